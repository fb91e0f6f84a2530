#include "glint/formats/rules.h"

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

#include "glint/formats/kinds/kind.h"

namespace glint::formats {
namespace {

using enum Severity;
using enum ErrorCode;

constexpr std::string_view kDamaged = "the file is damaged: make it again or restore a copy";
constexpr std::string_view kAppended = "remove what was appended to the file, or make it again";
constexpr std::string_view kForeign = "write assets with the glint tools, or follow formats/SPEC.md";
constexpr std::string_view kRewrite =
    "make the file again with the glint tools: copies by other programs may have chunks, filters or heaps (SPEC.md, section 2)";
constexpr std::string_view kHostile = "do not trust this file";
constexpr std::string_view kUpdate = "read it with a newer version of glint";

/// Rules of all kinds, checked when a file is opened.
constexpr std::array kIndexRules = {
    Rule{"file.readable", error, io, "the file can be opened, read and mapped", "check the path and its permissions"},
    Rule{"file.signature", error, invalid_input, "the file starts with the HDF5 signature", kForeign},
    Rule{"file.superblock", error, invalid_input, "the superblock is version 2 or 3 with base address 0 and no extension",
         kForeign},
    Rule{"file.truncated", error, invalid_input, "the file is as long as its superblock says", kDamaged},
    Rule{"file.trailing", error, invalid_input, "the file is not longer than its superblock says", kAppended},
    Rule{"file.hdf5", error, invalid_input, "the metadata is whole, of forms that section 2 allows, and its checksums hold",
         kDamaged},
    Rule{"file.objects", error, invalid_input, "a file has at most 4096 groups and datasets", kHostile},
    Rule{"group.depth", error, invalid_input, "groups are nested at most 4 deep", kHostile},
    Rule{"group.size", error, invalid_input, "a group has at most 1024 links with names of at most 255 bytes", kHostile},
    Rule{"text.utf8", error, invalid_input, "names and texts are UTF-8 without control characters and marks of direction",
         kHostile},
    Rule{"text.padding", error, invalid_input, "only NUL follows the NUL that ends a text", kHostile},
    Rule{"link.hard", error, invalid_input, "every link is a hard link", kHostile},
    Rule{"link.single", error, invalid_input, "every object has exactly one link", kHostile},
    Rule{"object.type", error, invalid_input, "every object is a group or a dataset", kHostile},
    Rule{"object.attributes", error, invalid_input, "an object has at most 64 attributes", kHostile},
    Rule{"object.heap", error, invalid_input, "links and attributes are in object headers, not in heaps", kRewrite},
    Rule{"attribute.fixed", error, invalid_input, "no attribute has variable length or a committed type", kForeign},
    Rule{"attribute.size", error, invalid_input, "an attribute holds at most 65536 bytes", kHostile},
    Rule{"attribute.missing", error, invalid_input, "every required attribute exists", kForeign},
    Rule{"attribute.type", error, invalid_input, "an attribute has the type and number of elements of the schema", kForeign},
    Rule{"attribute.value", error, invalid_input, "an attribute's value is in the range of the schema", kForeign},
    Rule{"attribute.unknown", warning, invalid_input, "every attribute is in the schema",
         "ignore it, or read with a newer version"},
    Rule{"format.name", error, invalid_input, "root attribute glint_format is \"glint\"", kForeign},
    Rule{"format.major", error, unsupported, "the major version is the reader's", kUpdate},
    Rule{"format.minor", warning, unsupported, "the minor version is not newer than the reader's", kUpdate},
    Rule{"format.feature", error, unsupported, "the reader knows every required feature", kUpdate},
    Rule{"format.kind", error, unsupported, "the reader knows the kind", kUpdate},
    Rule{"dataset.vlen", error, invalid_input, "no dataset has variable-length elements", kForeign},
    Rule{"dataset.virtual", error, invalid_input, "no dataset is virtual", kHostile},
    Rule{"dataset.external", error, invalid_input, "no dataset is stored in another file", kHostile},
    Rule{"dataset.layout", error, invalid_input, "every dataset is contiguous without filters", kRewrite},
    Rule{"dataset.storage", error, invalid_input, "a dataset's bytes all lie inside the file", kDamaged},
    Rule{"dataset.alignment", error, invalid_input, "a dataset's offset is a multiple of 8", kForeign},
    Rule{"dataset.alignment_64", warning, invalid_input, "a dataset's offset is a multiple of 64",
         "write with H5Pset_alignment"},
    Rule{"group.unknown", warning, invalid_input, "every group is one of a dataset in the schema",
         "ignore it, or read with a newer version"},
    Rule{"dataset.unknown", warning, invalid_input, "every dataset is in the schema",
         "ignore it, or read with a newer version"},
    Rule{"dataset.missing", error, invalid_input, "every required dataset exists", kForeign},
    Rule{"dataset.type", error, invalid_input, "a dataset has the element type of the schema", kForeign},
    Rule{"dataset.dims", error, invalid_input, "a dataset has the sizes of the schema", kForeign},
    Rule{"shape.resolution", error, invalid_input, "the image resolution is a multiple of 16", kMakeAgain},
    Rule{"shape.strides", error, invalid_input, "each level's stride is twice the one before", kMakeAgain},
    Rule{"shape.slopes", error, invalid_input, "slope_covariance is a covariance", kMakeAgain},
    Rule{"shape.grid", error, invalid_input, "a level's grid is that of its stride, or 1 x 1 of the last level", kMakeAgain},
    Rule{"near.step", error, invalid_input, "near_step is 1 for f32, and a power of two up to 2^-15 for i16", kMakeAgain},
    Rule{"near.bounds_levels", error, invalid_input, "the coarsest level of the bounds of kept normals is one node",
         kMakeAgain},
    Rule{"sh.grid", error, invalid_input, "a grid is 0 x 0 (lobes only) or has at least 2 rows and 3 columns", kMakeAgain},
};

/// Rules of all kinds on values.
constexpr std::array kValueRules = {
    Rule{"attribute.json", error, invalid_input, "command is a JSON object, at most 100 levels deep", kForeign},
    Rule{"file.padding", error, invalid_input, "bytes between objects are 0", kDamaged},
    Rule{"file.digest", error, invalid_input, "attributes, sizes and hashes have the digest of root attribute digest",
         kDamaged},
    Rule{"dataset.hash", error, invalid_input, "a dataset's bytes have the hash of its attribute xxh3_128", kDamaged},
    Rule{"near.disk", error, invalid_input, "kept normals lie inside the unit disk", kMakeAgain},
    Rule{"near.bounds", error, invalid_input, "bounds of kept normals hold the normals that they cover", kMakeAgain},
    Rule{"sh.finite", error, invalid_input, "coefficients, scales and norms are finite, the latter two not negative",
         kMakeAgain},
};

}  // namespace

std::string_view name(Severity severity) {
  switch (severity) {
    case error:
      return "error";
    case warning:
      return "warning";
    case info:
      return "info";
  }
  return "error";
}

std::span<const Rule> rules() {
  static const std::vector<Rule> all = [] {
    std::vector<Rule> list(kIndexRules.begin(), kIndexRules.end());
    const auto append = [&](const auto& rules) { list.insert(list.end(), rules.begin(), rules.end()); };
    for (const Kind* kind : kinds()) append(kind->index_rules);
    append(kValueRules);
    for (const Kind* kind : kinds()) append(kind->value_rules);
    return list;
  }();
  return all;
}

const Rule& findRule(std::string_view id) {
  for (const Rule& rule : rules()) {
    if (rule.id == id) return rule;
  }
  throw std::logic_error("no rule " + std::string(id));
}

}  // namespace glint::formats
