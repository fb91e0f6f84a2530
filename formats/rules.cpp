#include "glint/formats/rules.h"

#include <array>
#include <stdexcept>
#include <string>

namespace glint::formats {
namespace {

using enum Severity;
using enum ErrorCode;

constexpr std::string_view kMakeAgain = "make the file again from its inputs";
constexpr std::string_view kDamaged = "the file is damaged: make it again or restore a copy";
constexpr std::string_view kAppended = "remove what was appended to the file, or make it again";
constexpr std::string_view kForeign = "write assets with the glint tools, or follow formats/SPEC.md";
constexpr std::string_view kHostile = "do not trust this file";
constexpr std::string_view kUpdate = "read it with a newer version of glint";

constexpr std::array kRules = {
    Rule{"file.readable", error, io, "the file can be opened, read and mapped", "check the path and its permissions"},
    Rule{"file.signature", error, invalid_input, "the file starts with the HDF5 signature", kForeign},
    Rule{"file.superblock", error, invalid_input, "the superblock is version 2 or 3 with base address 0 and no extension",
         kForeign},
    Rule{"file.truncated", error, invalid_input, "the file is as long as its superblock says", kDamaged},
    Rule{"file.trailing", error, invalid_input, "the file is not longer than its superblock says", kAppended},
    Rule{"file.hdf5", error, invalid_input, "HDF5 can read the file's metadata and its checksums hold", kDamaged},
    Rule{"group.depth", error, invalid_input, "groups are nested at most 4 deep", kHostile},
    Rule{"group.size", error, invalid_input, "a group has at most 1024 links with names of at most 255 bytes", kHostile},
    Rule{"text.utf8", error, invalid_input, "names and texts are UTF-8 without control characters", kHostile},
    Rule{"link.hard", error, invalid_input, "every link is a hard link", kHostile},
    Rule{"link.single", error, invalid_input, "every object has exactly one link", kHostile},
    Rule{"object.type", error, invalid_input, "every object is a group or a dataset", kHostile},
    Rule{"object.attributes", error, invalid_input, "an object has at most 64 attributes", kHostile},
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
    Rule{"dataset.layout", error, invalid_input, "every dataset is contiguous without filters", kForeign},
    Rule{"dataset.storage", error, invalid_input, "a dataset's bytes all lie inside the file", kDamaged},
    Rule{"dataset.alignment", error, invalid_input, "a dataset's offset is a multiple of 8", kForeign},
    Rule{"dataset.alignment_64", warning, invalid_input, "a dataset's offset is a multiple of 64",
         "write with H5Pset_alignment"},
    Rule{"dataset.unknown", warning, invalid_input, "every dataset is in the schema",
         "ignore it, or read with a newer version"},
    Rule{"dataset.missing", error, invalid_input, "every required dataset exists", kForeign},
    Rule{"dataset.type", error, invalid_input, "a dataset has the element type of the schema", kForeign},
    Rule{"dataset.dims", error, invalid_input, "a dataset has the sizes of the schema", kForeign},
    Rule{"shape.resolution", error, invalid_input, "the image resolution is a multiple of 16", kMakeAgain},
    Rule{"shape.strides", error, invalid_input, "each level's stride is twice the one before", kMakeAgain},
    Rule{"shape.slopes", error, invalid_input, "slope_covariance is a covariance", kMakeAgain},
    Rule{"shape.grid", error, invalid_input, "a level's grid is ceil(size / stride), or 1 x 1 of the last level", kMakeAgain},
    Rule{"normals.bounds_levels", error, invalid_input, "the coarsest level of bounds is one node", kMakeAgain},
    Rule{"pyramid.masks", error, invalid_input, "no occupancy bit lies beyond the image's blocks", kMakeAgain},
    Rule{"pyramid.mask_ranks", error, invalid_input, "mask_ranks is the running count of occupancy bits", kMakeAgain},
    Rule{"compressed.images", error, invalid_input, "there is one record for each image of each level", kMakeAgain},
    Rule{"compressed.slots", error, invalid_input, "images have valid regions, and slots 0..n-1 in each region", kMakeAgain},
    Rule{"compressed.places", error, invalid_input, "block_places number the blocks of place_blocks in turn", kMakeAgain},
    Rule{"compressed.masks", error, invalid_input, "mask bits are slots of the region and their number is slice_count",
         kMakeAgain},
    Rule{"compressed.mask_ranks", error, invalid_input, "mask_ranks is the running count of mask bits", kMakeAgain},
    Rule{"compressed.first_block", error, invalid_input, "first_block is the running count of the bits of block_masks",
         kMakeAgain},
    Rule{"compressed.ranks", error, invalid_input, "cluster ranks are valid for the method", kMakeAgain},
    Rule{"compressed.ranges", error, invalid_input, "every cluster's factors lie inside their arrays", kMakeAgain},
    Rule{"compressed.spots", error, invalid_input, "spots are near their block, and their counts agree", kMakeAgain},
    Rule{"bin_map.size", error, unsupported, "columns and rows of the map need at most 28 bits together", kMakeAgain},
    Rule{"bin_map.alpha", error, invalid_input, "alpha is between alpha_min and alpha_max", kMakeAgain},
    Rule{"bin_map.cells", error, invalid_input, "cell_starts rise from 0 to the number of texels", kMakeAgain},
    Rule{"bin_map.nodes", error, invalid_input, "nodes divide the bins in blocks of texels, numbered in order", kMakeAgain},
    Rule{"bin_map.classes", error, invalid_input, "classes divide the keys of bins, and every texel has one", kMakeAgain},
    Rule{"histogram.bins", error, invalid_input, "bin_ids increase, below theta_bins * phi_bins, which is at most 2048",
         kMakeAgain},
    Rule{"histogram.strides", error, invalid_input, "coarse_stride is a multiple of stride", kMakeAgain},
    Rule{"histogram.texels", error, invalid_input, "every texel's bin is below bin_count", kMakeAgain},
    Rule{"sh.grid", error, invalid_input, "a grid is 0 x 0 (lobes only) or has at least 2 rows and 3 columns", kMakeAgain},
    Rule{"displacement.levels", error, invalid_input, "factors ascend, and each divides the map into the level's cells",
         kMakeAgain},
    Rule{"file.padding", error, invalid_input, "bytes between objects are 0", kDamaged},
    Rule{"dataset.hash", error, invalid_input, "a dataset's bytes have the hash of its attribute xxh3_128", kDamaged},
    Rule{"normals.finite", error, invalid_input, "normals are finite", "make it again with glint-ingest --fix-invalid"},
    Rule{"normals.disk", error, invalid_input, "normals lie inside the unit disk",
         "make it again with glint-ingest, which moves normals on the rim inside"},
    Rule{"normals.bounds", error, invalid_input, "bounds hold the normals that they cover", kMakeAgain},
    Rule{"heights.finite", error, invalid_input, "heights are finite", "make it again with glint-ingest --fix-invalid"},
    Rule{"pyramid.pixels", error, invalid_input, "pixels are finite and not negative", kMakeAgain},
    Rule{"pyramid.block_means", error, invalid_input, "block_means are the means of the pixels", kMakeAgain},
    Rule{"pyramid.integral", warning, invalid_input, "every image integrates to 1 within 1e-3", kMakeAgain},
    Rule{"displacement.heights", error, invalid_input, "downsampled heights are finite", kMakeAgain},
    Rule{"displacement.lobes", error, invalid_input,
         "lobes have centres in the disk, bandwidths up to 1e6 and amplitudes of 0 or more", kMakeAgain},
    Rule{"displacement.bases", error, invalid_input, "colours of lobes are 0 to 1, and their alphas above 0 and at most 1",
         kMakeAgain},
    Rule{"displacement.scales", error, invalid_input, "scaling functions are finite and not negative", kMakeAgain},
    Rule{"displacement.moments", error, invalid_input, "slope moments and fit errors are finite", kMakeAgain},
    Rule{"compressed.image_scales", error, invalid_input, "image_scales are finite and positive", kMakeAgain},
    Rule{"compressed.density_scales", error, invalid_input, "density_scales make the positive parts of images integrate to 1",
         kMakeAgain},
    Rule{"compressed.block_masks", error, invalid_input, "block_masks name the slices of the clusters", kMakeAgain},
    Rule{"compressed.block_masses", error, invalid_input, "block_masses are the shares of the slices, rounded up", kMakeAgain},
    Rule{"compressed.scales", error, invalid_input, "scales are finite", kMakeAgain},
    Rule{"compressed.factors", error, invalid_input, "bases and coefficients are finite", kMakeAgain},
    Rule{"compressed.integral", warning, invalid_input, "every image integrates to 1 within 1e-3", kMakeAgain},
    Rule{"bin_map.texels", error, invalid_input,
         "every texel of the map is listed once, in its class and in a bin of the square", kMakeAgain},
    Rule{"bin_map.moments", error, invalid_input, "block_moments are those of a distribution inside the block", kMakeAgain},
    Rule{"histogram.bin_normals", error, invalid_input, "the mean normals of bins lie inside the unit disk", kMakeAgain},
    Rule{"histogram.totals", error, invalid_input, "bin_totals are the numbers of texels of each bin, above 0", kMakeAgain},
    Rule{"histogram.sums", error, invalid_input, "the tables of sums count the texels of each bin", kMakeAgain},
    Rule{"sh.finite", error, invalid_input, "coefficients, scales and norms are finite, the latter two not negative",
         kMakeAgain},
    Rule{"sh.zonal", warning, invalid_input, "lobes have the norm of the lobe along +z within 1e-2", kMakeAgain},
    Rule{"sh.band_norms", error, invalid_input, "band_norms are the norms of the coefficients", kMakeAgain},
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

std::span<const Rule> rules() { return kRules; }

const Rule& findRule(std::string_view id) {
  for (const Rule& rule : kRules) {
    if (rule.id == id) return rule;
  }
  throw std::logic_error("no rule " + std::string(id));
}

}  // namespace glint::formats
