#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "glint/math/device.h"  // asks for C++20

namespace glint::formats {

/// Version of the file format that this library writes. SPEC.md says what a reader does with other versions.
inline constexpr int kFormatMajor = 1;
inline constexpr int kFormatMinor = 0;

/// Element of a dataset or attribute. All are little-endian; `ndf_cluster` is a compound of 32 bytes.
enum class ElementType : std::uint8_t { i8, i16, i32, u8, u16, u32, u64, f16, f32, text, ndf_cluster };

/// Name of the type as SPEC.md and schema.json write it, e.g. "f32".
std::string_view name(ElementType type);
/// Bytes of one element; 0 for text.
std::size_t sizeBytes(ElementType type);

/// One root attribute.
struct AttributeSchema {
  std::string_view name;
  ElementType type = ElementType::i32;
  std::string_view count;        ///< expression of the number of elements; empty for a scalar, "*" for any number
  std::string_view units;        ///< "1" when dimensionless
  std::string_view long_name;    ///< what it means
  double minimum = 0;            ///< smallest valid number
  double maximum = 0;            ///< largest valid number
  std::string_view values = {};  ///< valid texts, separated by '|'; empty for any
  int since = 0;                 ///< minor version of the format that added it: files of older ones need not have it
  bool required = true;
  std::string_view needs = {};  ///< attribute without which there is none, and with which it must be there; empty: none
};

/// The type of a dataset when all of `when` hold: "a=x|y & b=z" of text attributes; empty always holds.
struct TypeChoice {
  std::string_view when;
  ElementType type = ElementType::f32;
};

/// One dataset, or one for each level.
struct DatasetSchema {
  std::string_view path;    ///< from the root without a leading '/'; "{l}" stands for the level with two digits
  std::string_view repeat;  ///< expression of the number of levels; empty for a single dataset
  std::vector<TypeChoice> types;
  std::vector<std::string_view> dims;  ///< expressions, slowest first; a name bound nowhere takes the size that is found first
  std::string_view units;
  std::string_view long_name;
  bool required = true;
  int since = 0;                ///< minor version of the format that added it: files of older ones need not have it
  std::string_view needs = {};  ///< attribute without which there is none, and with which it must be there; empty: none
};

/// A size that follows from attributes.
struct DerivedValue {
  std::string_view name;
  std::string_view expression;
  std::string_view long_name;
};

/// What one kind of asset holds: what its description in formats/kinds/ says. Reader, writer, validator and schema.json use it.
struct KindSchema {
  std::string_view name;   ///< value of root attribute `kind`
  std::string_view title;  ///< one line for people
  std::vector<AttributeSchema> attributes;
  std::vector<DerivedValue> derived;
  std::vector<DatasetSchema> datasets;
};

/// Schemas of all kinds of this format version, by name.
std::vector<const KindSchema*> kindSchemas();
/// The schema of a kind, or nullptr.
const KindSchema* findKindSchema(std::string_view kind);
/// Root attributes that every kind has.
std::span<const AttributeSchema> commonAttributes();
/// Attributes that every dataset has.
std::span<const AttributeSchema> datasetAttributes();

/// `path` with "{l}" replaced by the level.
std::string levelPath(std::string_view path, int level);

}  // namespace glint::formats
