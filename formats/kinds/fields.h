#pragma once

// Private to formats/: what is done with each attribute and array of a kind. A description (description.h) names them once, to
// one of the classes below, which satisfy the concept Fields.

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "glint/formats/packed_asset.h"
#include "glint/formats/schema.h"
#include "glint/formats/size_expression.h"
#include "glint/formats/structure.h"
#include "glint/model/displacement.h"
#include "glint/model/ndf_cp.h"
#include "glint/model/normal_map.h"
#include "glint/model/wave_pyramid.h"

namespace glint::formats {

/// The valid values of a number, both ends included.
struct Range {
  double minimum;
  double maximum;
};

/// The elements in a file of an array of T: their type, and how many make one T.
template <class T>
struct ElementOf;
template <ElementType kElement, std::uint64_t kElements = 1>
struct ElementIs {
  static constexpr ElementType kType = kElement;
  static constexpr std::uint64_t kCount = kElements;
};
template <>
struct ElementOf<std::uint8_t> : ElementIs<ElementType::u8> {};
template <>
struct ElementOf<std::uint16_t> : ElementIs<ElementType::u16> {};
template <>
struct ElementOf<std::uint32_t> : ElementIs<ElementType::u32> {};
template <>
struct ElementOf<std::uint64_t> : ElementIs<ElementType::u64> {};
template <>
struct ElementOf<std::int32_t> : ElementIs<ElementType::i32> {};
template <>
struct ElementOf<float> : ElementIs<ElementType::f32> {};
template <>
struct ElementOf<Vec2> : ElementIs<ElementType::f32, 2> {};
template <>
struct ElementOf<NormalBounds> : ElementIs<ElementType::f32, 4> {};
template <>
struct ElementOf<VmfLobe> : ElementIs<ElementType::f32, 4> {};
template <>
struct ElementOf<MapSlopes> : ElementIs<ElementType::f32, 5> {};
template <>
struct ElementOf<Rgb> : ElementIs<ElementType::f32, 3> {};
template <>
struct ElementOf<NdfCluster> : ElementIs<ElementType::ndf_cluster> {};

/// Types and sizes of an array. Sizes are expressions, slowest first. A name that nothing gives takes the size that is found.
using Types = std::initializer_list<TypeChoice>;
using Dims = std::initializer_list<std::string_view>;

/// Writes down what a kind holds.
class SchemaFields {
 public:
  explicit SchemaFields(KindSchema& schema) : schema_(schema) {}

  void integer(std::string_view name, int, Range range, std::string_view units, std::string_view long_name, int since = 0) {
    add({name, ElementType::i32, "", units, long_name, range.minimum, range.maximum, {}, since});
  }
  void real(std::string_view name, float, Range range, std::string_view units, std::string_view long_name, int since = 0) {
    add({name, ElementType::f32, "", units, long_name, range.minimum, range.maximum, {}, since});
  }
  /// A number that a file need not have. Files without it have `absent`, and `absent` is not written.
  void realUnless(float, std::string_view name, float, Range range, std::string_view units, std::string_view long_name) {
    AttributeSchema attribute = {name, ElementType::f32, "", units, long_name, range.minimum, range.maximum};
    attribute.required = false;
    schema_.attributes.push_back(attribute);
  }
  template <class Enum>
  void choice(std::string_view name, Enum, std::string_view values, std::string_view long_name, int since = 0) {
    add({name, ElementType::text, "", "1", long_name, 0, 0, values, since});
  }
  void reals(std::string_view name, std::string_view count, std::initializer_list<const float*>, Range range,
             std::string_view units, std::string_view long_name, int since = 0) {
    add({name, ElementType::f32, count, units, long_name, range.minimum, range.maximum, {}, since});
  }
  template <class Get>
  void levelIntegers(std::string_view name, int, Get, Range range, std::string_view units, std::string_view long_name) {
    add({name, ElementType::i32, "level_count", units, long_name, range.minimum, range.maximum});
  }
  template <class Get>
  void levelReals(std::string_view name, int, Get, Range range, std::string_view units, std::string_view long_name) {
    add({name, ElementType::f32, "level_count", units, long_name, range.minimum, range.maximum});
  }
  template <class T, class U>
  void set(const T&, const U&) {}
  template <class T, class Body>
  void optional(const std::optional<T>&, Body body) {
    required_ = false;
    body(T());
    required_ = true;
  }

  /// Attributes and arrays that a file has only with the attribute `key`, the first of them.
  template <class T, class Body>
  void together(std::string_view key, const std::optional<T>&, Body body) {
    key_ = key;
    body(T());
    key_ = {};
  }

  void derived(std::string_view name, std::string_view expression, std::string_view long_name) {
    schema_.derived.push_back({name, expression, long_name});
  }
  template <class Body>
  void levels(std::string_view count, int, Body body) {
    repeat_ = count;
    body(0);
    repeat_ = {};
  }

  template <class T>
  void array(std::string_view path, std::span<const T>, Dims dims, std::string_view units, std::string_view long_name,
             int since = 0) {
    add(path, {{"", ElementOf<T>::kType}}, dims, units, long_name, since);
  }
  void halves(std::string_view path, std::span<const std::uint16_t>, Dims dims, std::string_view units,
              std::string_view long_name, int since = 0) {
    add(path, {{"", ElementType::f16}}, dims, units, long_name, since);
  }
  void data(std::string_view path, const void*, std::uint64_t, Types types, Dims dims, std::string_view units,
            std::string_view long_name, int since = 0) {
    add(path, types, dims, units, long_name, since);
  }

 private:
  void add(AttributeSchema attribute) {
    attribute.required = required_ && key_.empty();
    if (attribute.name != key_) attribute.needs = key_;
    schema_.attributes.push_back(attribute);
  }
  void add(std::string_view path, Types types, Dims dims, std::string_view units, std::string_view long_name, int since) {
    schema_.datasets.push_back({path, repeat_, types, dims, units, long_name, key_.empty(), since, key_});
  }

  KindSchema& schema_;
  std::string_view repeat_, key_;
  bool required_ = true;
};

/// Packs a struct for writing.
class PackFields {
 public:
  explicit PackFields(std::string_view kind) { packed_.kind = kind; }
  PackedAsset& packed() { return packed_; }

  void integer(std::string_view name, int value, Range range, std::string_view, std::string_view, int = 0);
  void real(std::string_view name, float value, Range range, std::string_view, std::string_view, int = 0);
  void realUnless(float absent, std::string_view name, float value, Range range, std::string_view units,
                  std::string_view long_name) {
    if (value != absent) real(name, value, range, units, long_name);
  }
  template <class Enum>
  void choice(std::string_view name, Enum value, std::string_view values, std::string_view, int = 0) {
    text(name, static_cast<int>(value), values);
  }
  void reals(std::string_view name, std::string_view, std::initializer_list<const float*> values, Range range, std::string_view,
             std::string_view, int = 0);
  template <class Get>
  void levelIntegers(std::string_view name, int count, Get get, Range range, std::string_view, std::string_view) {
    std::vector<double> values;
    for (int l = 0; l < count; ++l) values.push_back(get(l));
    list(name, ElementType::i32, std::move(values), range);
  }
  template <class Get>
  void levelReals(std::string_view name, int count, Get get, Range range, std::string_view, std::string_view) {
    std::vector<double> values;
    for (int l = 0; l < count; ++l) values.push_back(double{get(l)});
    list(name, ElementType::f32, std::move(values), range);
  }
  template <class T, class U>
  void set(const T&, const U&) {}
  template <class T, class Body>
  void optional(const std::optional<T>& value, Body body) {
    if (value) body(*value);
  }
  template <class T, class Body>
  void together(std::string_view, const std::optional<T>& value, Body body) {
    if (value) body(*value);
  }

  void derived(std::string_view name, std::string_view expression, std::string_view);
  template <class Body>
  void levels(std::string_view, int count, Body body) {
    const SizeScope outside = scope_;
    for (int l = 0; l < count; ++l) {
      scope_.level = static_cast<std::uint64_t>(l);
      body(l);
      scope_ = outside;
    }
  }

  template <class T>
  void array(std::string_view path, std::span<const T> values, Dims dims, std::string_view units, std::string_view long_name,
             int = 0) {
    add(path, ElementOf<T>::kType, values.data(), ElementOf<T>::kCount * values.size(), dims, units, long_name);
  }
  void halves(std::string_view path, std::span<const std::uint16_t> values, Dims dims, std::string_view units,
              std::string_view long_name, int = 0) {
    add(path, ElementType::f16, values.data(), values.size(), dims, units, long_name);
  }
  void data(std::string_view path, const void* values, std::uint64_t count, Types types, Dims dims, std::string_view units,
            std::string_view long_name, int = 0);

 private:
  void text(std::string_view name, int index, std::string_view values);
  void list(std::string_view name, ElementType type, std::vector<double> values, Range range);
  void attribute(std::string_view name, AttributeValue value);
  /// @param count  elements of `type` that `values` has
  void add(std::string_view path, ElementType type, const void* values, std::uint64_t count, Dims dims, std::string_view units,
           std::string_view long_name);

  PackedAsset packed_;
  SizeScope scope_;
};

/// Fills a struct from a file that agrees with the schema. Spans and pointers of the struct then point into the file's mapping.
/// Attributes and arrays that the file's minor version does not have leave the struct as it is.
class ReadFields {
 public:
  explicit ReadFields(const FileStructure& file) : file_(file) {}

  void integer(std::string_view name, int& value, Range, std::string_view, std::string_view, int = 0) {
    if (const AttributeValue* found = find(name)) value = static_cast<int>(found->numbers[0]);
  }
  void real(std::string_view name, float& value, Range, std::string_view, std::string_view, int = 0) {
    if (const AttributeValue* found = find(name)) value = static_cast<float>(found->numbers[0]);
  }
  void realUnless(float absent, std::string_view name, float& value, Range, std::string_view, std::string_view) {
    const AttributeValue* found = find(name);
    value = found != nullptr ? static_cast<float>(found->numbers[0]) : absent;
  }
  template <class Enum>
  void choice(std::string_view name, Enum& value, std::string_view values, std::string_view, int = 0) {
    if (const AttributeValue* found = find(name)) value = static_cast<Enum>(indexIn(values, found->texts[0]));
  }
  void reals(std::string_view name, std::string_view, std::initializer_list<float*> values, Range, std::string_view,
             std::string_view, int = 0) {
    const AttributeValue* found = find(name);
    if (found == nullptr) return;
    auto number = found->numbers.begin();
    for (float* value : values) *value = static_cast<float>(*number++);
  }
  template <class Get>
  void levelIntegers(std::string_view name, int count, Get get, Range, std::string_view, std::string_view) {
    for (int l = 0; l < count; ++l) get(l) = static_cast<int>(find(name)->numbers[static_cast<std::size_t>(l)]);
  }
  template <class Get>
  void levelReals(std::string_view name, int count, Get get, Range, std::string_view, std::string_view) {
    for (int l = 0; l < count; ++l) get(l) = static_cast<float>(find(name)->numbers[static_cast<std::size_t>(l)]);
  }
  template <class T, class U>
  void set(T& target, const U& value) {
    target = value;
  }
  /// Takes the value only if the file has all that body() describes.
  template <class T, class Body>
  void optional(std::optional<T>& value, Body body) {
    T read;
    missing_ = false;
    body(read);
    if (!missing_) value = read;
  }

  template <class T, class Body>
  void together(std::string_view key, std::optional<T>& value, Body body) {
    if (!file_.attributes.contains(key)) return;
    if (!value) value.emplace();
    body(*value);
  }

  void derived(std::string_view, std::string_view, std::string_view) {}
  template <class Body>
  void levels(std::string_view, int count, Body body) {
    for (level_ = 0; level_ < count; ++level_) body(level_);
  }

  template <class T>
  void array(std::string_view path, std::span<const T>& values, Dims, std::string_view, std::string_view, int = 0) {
    if (const DatasetRecord* found = findArray(path))
      values = {reinterpret_cast<const T*>(found->data), static_cast<std::size_t>(found->size_bytes / sizeof(T))};
  }
  void halves(std::string_view path, std::span<const std::uint16_t>& values, Dims dims, std::string_view units,
              std::string_view long_name, int since = 0) {
    array(path, values, dims, units, long_name, since);
  }
  /// @param count  set to the number of elements if it is a variable
  template <class Count>
  void data(std::string_view path, const void*& values, Count&& count, Types, Dims, std::string_view, std::string_view,
            int = 0) {
    const DatasetRecord* found = findArray(path);
    if (found == nullptr) return;
    values = found->data;
    if constexpr (std::is_lvalue_reference_v<Count>) count = found->size_bytes / sizeBytes(found->type);
  }

 private:
  static int indexIn(std::string_view values, std::string_view value);
  /// Value of an attribute; nullptr, noted in missing_, if the file does not have it.
  const AttributeValue* find(std::string_view name);
  const DatasetRecord* findArray(std::string_view path) const;

  const FileStructure& file_;
  int level_ = 0;
  bool missing_ = false;
};

/// Functions that describe() calls for each attribute and array, whichever is done with them. A member of the struct is
/// constant for classes that only look at it.
///
/// Attributes: integer, real, choice, reals (several numbers), levelIntegers and levelReals (a number for each level; get(l) is
/// the member of level l). optional() describes attributes that a file may lack, all or none; together()
/// attributes and arrays that a file has only with the first of them. set() stores a value that follows
/// from others. Sizes: derived. Arrays: array, halves (half precision), data (a bare pointer to elements of one of several
/// types); levels() repeats them.
template <class F>
concept Fields = requires(F& fields, int& integer, float& real, BlockPrecision& choice, std::optional<MapSlopes>& slopes,
                          std::span<const float>& array, std::span<const std::uint16_t>& halves, const void*& data,
                          std::uint64_t& count, Range range, std::string_view text, Types types, Dims dims, int since,
                          int& (*integer_of)(int), float& (*real_of)(int), void (*visit_level)(int),
                          void (*describe_slopes)(const MapSlopes&)) {
  fields.integer(text, integer, range, text, text, since);
  fields.real(text, real, range, text, text, since);
  fields.choice(text, choice, text, text, since);
  fields.reals(text, text, {&real, &real}, range, text, text, since);
  fields.levelIntegers(text, integer, integer_of, range, text, text);
  fields.levelReals(text, integer, real_of, range, text, text);
  fields.optional(slopes, describe_slopes);
  fields.together(text, slopes, describe_slopes);
  fields.set(integer, integer);
  fields.derived(text, text, text);
  fields.array(text, array, dims, text, text, since);
  fields.halves(text, halves, dims, text, text, since);
  fields.data(text, data, count, types, dims, text, text, since);
  fields.levels(text, integer, visit_level);
};
static_assert(Fields<SchemaFields> && Fields<PackFields> && Fields<ReadFields>);

}  // namespace glint::formats
