#include "glint/formats/schema.h"

#include "glint/formats/kinds/kind.h"
#include "glint/formats/udim.h"
#include "glint/model/ndf_cp.h"

namespace glint::formats {

using enum ElementType;

std::string_view name(ElementType type) {
  switch (type) {
    case i8:
      return "i8";
    case i16:
      return "i16";
    case i32:
      return "i32";
    case u8:
      return "u8";
    case u16:
      return "u16";
    case u32:
      return "u32";
    case u64:
      return "u64";
    case f16:
      return "f16";
    case f32:
      return "f32";
    case text:
      return "text";
    case ndf_cluster:
      return "ndf_cluster";
  }
  return "unknown";
}

std::size_t sizeBytes(ElementType type) {
  switch (type) {
    case i8:
    case u8:
      return 1;
    case i16:
    case u16:
    case f16:
      return 2;
    case i32:
    case u32:
    case f32:
      return 4;
    case u64:
      return 8;
    case ndf_cluster:
      return sizeof(NdfCluster);
    case text:
      return 0;
  }
  return 0;
}

std::vector<const KindSchema*> kindSchemas() {
  std::vector<const KindSchema*> schemas;
  for (const Kind* kind : kinds()) schemas.push_back(&kind->schema);
  return schemas;
}

const KindSchema* findKindSchema(std::string_view kind) {
  const Kind* found = findKind(kind);
  return found == nullptr ? nullptr : &found->schema;
}

std::span<const AttributeSchema> commonAttributes() {
  static const std::vector<AttributeSchema> table = {
      {"glint_format", text, "", "1", "name of the format", 0, 0, "glint"},
      {"format_major", i32, "", "1", "major version of the format", 0, 1e9},
      {"format_minor", i32, "", "1", "minor version of the format", 0, 1e9},
      {"required_features", text, "*", "1", "features that a reader has to know to read the file", 0, 0},
      {"kind", text, "", "1", "kind of asset", 0, 0},
      {"generator", text, "", "1", "tool and version that made the file", 0, 0},
      {"command", text, "", "1", "JSON of every parameter that changed the result", 0, 0},
      {.name = "digest",
       .type = text,
       .count = "",
       .units = "1",
       .long_name = "digest of all attributes and sizes, 32 hexadecimal digits",
       .required = false},
      {"inputs", text, "*", "1", "hash, two spaces and name of every input", 0, 0},
      {.name = "udim",
       .type = i32,
       .units = "1",
       .long_name = "tile of a UDIM set that the asset covers: 1001 + column + 10 row",
       .minimum = kFirstUdim,
       .maximum = kLastUdim,
       .required = false},
      {.name = "udim_margins",
       .type = i32,
       .count = "4",
       .units = "texels",
       .long_name = "texels of the neighbouring tiles beyond the left, lower, right and upper border of the tile",
       .minimum = 0,
       .maximum = 65536,
       .required = false},
  };
  return table;
}

std::span<const AttributeSchema> datasetAttributes() {
  static const std::vector<AttributeSchema> table = {
      {"long_name", text, "", "1", "what the dataset holds", 0, 0},
      {"units", text, "", "1", "units of its elements", 0, 0},
      {"xxh3_128", text, "", "1", "XXH3 128-bit hash of its bytes, 32 lower-case hexadecimal digits", 0, 0},
  };
  return table;
}

std::string levelPath(std::string_view path, int level) {
  std::string result(path);
  const std::size_t place = result.find("{l}");
  if (place == std::string::npos) return result;
  const std::string digits = std::to_string(level);
  return result.replace(place, 3, digits.size() < 2 ? "0" + digits : digits);
}

}  // namespace glint::formats
