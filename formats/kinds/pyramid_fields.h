#pragma once

// Private to formats/: what kinds of uncompressed NDF images share.

#include "glint/formats/kinds/shared_fields.h"

namespace glint::formats {

/// Attributes of pixels: their type and scale.
void describePixels(Fields auto& fields, auto& pyramid) {
  fields.choice("precision", pyramid.precision, "f16|f32", "type of the stored pixels");
  fields.real("value_scale", pyramid.value_scale, kPositive, "1", "density = value_scale * stored pixel");
}

/// Attributes: shape, and those of pixels.
void describePyramidAttributes(Fields auto& fields, auto& pyramid) {
  describeShape(fields, pyramid.shape);
  describePixels(fields, pyramid);
}

/// Expressions of the sizes of the arrays of a level.
struct LevelDims {
  std::string_view rows = "level_rows[l]";                                       ///< rows of images
  std::string_view ranks = "level_rows[l] * level_columns[l] * mask_words + 1";  ///< elements of mask_ranks
};

/// Arrays of all levels: blocks and pixels, and what describe_more(l, blocks) adds, `blocks` being the number of stored blocks.
void describePyramidLevels(Fields auto& fields, auto& pyramid, auto describe_more, LevelDims dims = {}) {
  fields.derived("mask_words", "ceil_div(resolution * resolution, 16384)", "64-bit words of occupancy bits of an image");
  fields.levels("level_count", pyramid.shape.level_count, [&](int l) {
    auto& level = pyramid.levels[l];
    fields.array("level_{l}/masks", level.masks, {dims.rows, "level_columns[l]", "mask_words"}, "1",
                 "bit b of word w: block 64 w + b of the image is stored");
    fields.array("level_{l}/mask_ranks", level.mask_ranks, {dims.ranks}, "1",
                 "stored blocks of the level before those of this word; the last value is their total");
    fields.array("level_{l}/block_means", level.block_means, {"stored_blocks"}, "1", "mean density of each stored block");
    // The pixels are a bare pointer: the running count is the only witness of how many there are.
    const std::uint64_t blocks = level.mask_ranks.empty() ? 0 : level.mask_ranks.back();
    fields.data("level_{l}/pixels", level.pixels, blocks * kBlockPixels,
                {{"precision=f16", ElementType::f16}, {"precision=f32", ElementType::f32}}, {"stored_blocks", "16", "16"}, "1",
                "mean density of each pixel of each stored block, divided by value_scale");
    describe_more(l, blocks);
  });
}

/// Density of a stored pixel, divided by value_scale.
float storedPixel(const void* pixels, BlockPrecision precision, std::size_t index);

/// "in the image at column 3, row 7 from the top": place of a stored block of a level.
std::string imageOf(const NdfPyramid& pyramid, int l, std::size_t block);

/// Rules pyramid.masks and pyramid.mask_ranks, and those of shapes.
void checkPyramidIndex(const NdfPyramid& pyramid, Findings& findings);
/// Rules pyramid.masks and pyramid.mask_ranks.
void checkPyramidMasks(const NdfPyramid& pyramid, Findings& findings);
/// Rules pyramid.pixels, pyramid.block_means and pyramid.integral.
/// @param loses_light  whether images may integrate to less than 1, because light may leave the square of half vectors
void checkPyramidValues(const NdfPyramid& pyramid, Findings& findings, bool loses_light = false);

}  // namespace glint::formats
