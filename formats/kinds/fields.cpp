#include "glint/formats/kinds/fields.h"

#include <algorithm>

#include "glint/formats/choices.h"
#include "glint/formats/number_text.h"
#include "glint/model/error.h"

namespace glint::formats {
namespace {

/// Throws an Error for an attribute that would break the file.
[[noreturn]] void failAttribute(std::string_view name, const std::string& what) {
  throw Error(ErrorCode::failed, "attribute.value", {}, "/@" + std::string(name),
              "cannot be written as a valid asset: " + what);
}

void requireRange(std::string_view name, double value, Range range) {
  if (value >= range.minimum && value <= range.maximum) return;
  failAttribute(name,
                "is " + numberText(value) + ", outside " + numberText(range.minimum) + " to " + numberText(range.maximum));
}

}  // namespace

void PackFields::attribute(std::string_view name, AttributeValue value) {
  if (value.type == ElementType::i32) {
    std::vector<std::uint64_t>& sizes = scope_.values[std::string(name)];
    for (const double number : value.numbers) sizes.push_back(static_cast<std::uint64_t>(number));
  }
  packed_.attributes.emplace_back(name, std::move(value));
}

void PackFields::integer(std::string_view name, int value, Range range, std::string_view, std::string_view, int) {
  requireRange(name, value, range);
  attribute(name, {ElementType::i32, true, {static_cast<double>(value)}, {}});
}

void PackFields::real(std::string_view name, float value, Range range, std::string_view, std::string_view, int) {
  requireRange(name, double{value}, range);
  attribute(name, {ElementType::f32, true, {double{value}}, {}});
}

void PackFields::text(std::string_view name, int index, std::string_view values) {
  const std::string_view text = choiceAt(values, index);
  if (text.empty()) failAttribute(name, "is number " + std::to_string(index) + " of " + std::string(values));
  attribute(name, {ElementType::text, true, {}, {std::string(text)}});
}

void PackFields::reals(std::string_view name, std::string_view, std::initializer_list<const float*> values, Range range,
                       std::string_view, std::string_view, int) {
  std::vector<double> numbers;
  for (const float* value : values) numbers.push_back(double{*value});
  list(name, ElementType::f32, std::move(numbers), range);
}

void PackFields::list(std::string_view name, ElementType type, std::vector<double> values, Range range) {
  for (const double value : values) requireRange(name, value, range);
  attribute(name, {type, false, std::move(values), {}});
}

void PackFields::derived(std::string_view name, std::string_view expression, std::string_view) {
  scope_.values[std::string(name)] = {evaluateSize(expression, scope_).value_or(0)};
}

void PackFields::data(std::string_view path, const void* values, std::uint64_t count, Types types, Dims dims,
                      std::string_view units, std::string_view long_name, int) {
  const Attributes attributes(packed_.attributes.begin(), packed_.attributes.end());
  const auto type =
      std::find_if(types.begin(), types.end(), [&](const TypeChoice& c) { return conditionHolds(c.when, attributes); });
  if (type == types.end())
    throw Error(ErrorCode::failed, "dataset.type", {}, "/" + std::string(path), "has no type for its attributes");
  add(path, type->type, values, count, dims, units, long_name);
}

void PackFields::add(std::string_view path, ElementType type, const void* values, std::uint64_t count, Dims dims,
                     std::string_view units, std::string_view long_name) {
  PackedArray array{
      levelPath(path, static_cast<int>(scope_.level)), type, {}, values, count * sizeBytes(type), units, long_name};
  // A size that no name gives follows from the number of elements.
  std::uint64_t known = 1;
  for (const std::string_view dim : dims) known *= evaluateSize(dim, scope_).value_or(1);
  for (const std::string_view dim : dims) {
    auto size = evaluateSize(dim, scope_);
    if (!size) {
      size = known == 0 ? 0 : count / known;
      scope_.values[std::string(dim)] = {*size};
    }
    array.dims.push_back(*size);
  }
  std::uint64_t expected = 1;
  for (const std::uint64_t size : array.dims) expected *= size;
  if (expected != count || (count != 0 && values == nullptr)) {
    throw Error(ErrorCode::usage, "dataset.dims", {}, "/" + array.path,
                "holds " + std::to_string(values == nullptr ? 0 : count) + " elements where its sizes need " +
                    std::to_string(expected));
  }
  packed_.arrays.push_back(std::move(array));
}

int ReadFields::indexIn(std::string_view values, std::string_view value) { return indexOf(value, values); }

const AttributeValue* ReadFields::find(std::string_view name) {
  const auto found = file_.attributes.find(name);
  if (found != file_.attributes.end()) return &found->second;
  missing_ = true;
  return nullptr;
}

const DatasetRecord* ReadFields::findArray(std::string_view path) const {
  const auto found = file_.datasets.find(levelPath(path, level_));
  return found == file_.datasets.end() ? nullptr : &found->second;
}

}  // namespace glint::formats
