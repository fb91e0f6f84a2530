#include "glint/formats/schema.h"

#include <cctype>
#include <cfloat>
#include <charconv>

#include "glint/model/bin_map.h"
#include "glint/model/displacement.h"
#include "glint/model/histogram_sat.h"
#include "glint/model/ndf_cp.h"
#include "glint/model/sh.h"

namespace glint::formats {
namespace {

using enum ElementType;

constexpr double kMaxMapSize = 1 << 20;  // texels along an axis; keeps every product of sizes far below 2^63
constexpr double kMaxSlope = 1e6;        // float normals inside the unit disk have slopes up to 4096
constexpr double kMaxText = 0;           // texts have no numeric range

AttributeSchema integer(std::string_view name, double low, double high, std::string_view units, std::string_view long_name) {
  return {name, i32, "", units, long_name, low, high};
}

AttributeSchema real(std::string_view name, double low, double high, std::string_view units, std::string_view long_name) {
  return {name, f32, "", units, long_name, low, high};
}

AttributeSchema choice(std::string_view name, std::string_view values, std::string_view long_name) {
  return {name, text, "", "1", long_name, 0, kMaxText, values};
}

std::vector<AttributeSchema> mapSize() {
  return {integer("width", 1, kMaxMapSize, "texel", "width of the map"),
          integer("height", 1, kMaxMapSize, "texel", "height of the map"),
          real("texel_size_um", 0, FLT_MAX, "um", "width of a texel; 0 when unknown")};
}

/// Attributes of glint::MapSlopes.
AttributeSchema slopeMean() {
  return {"slope_mean", f32, "2", "1", "mean slope of the map's texels along u and v", -kMaxSlope, kMaxSlope};
}
AttributeSchema slopeCovariance() {
  constexpr double kMost = kMaxSlope * kMaxSlope;
  return {"slope_covariance", f32, "3", "1", "uu, uv, vv of the slopes of the map's texels", -kMost, kMost};
}

/// Attributes of glint::PyramidShape.
std::vector<AttributeSchema> pyramidShape() {
  return {
      integer("width", 1, kMaxMapSize, "texel", "width of the normal map"),
      integer("height", 1, kMaxMapSize, "texel", "height of the normal map"),
      integer("resolution", kBlockSize, 1024, "pixel", "pixels of an NDF image along each axis; a multiple of 16"),
      real("sigma_r", FLT_MIN, 1, "1", "intrinsic roughness: standard deviation in disk units"),
      choice("surface", "flat|smooth", "normals between texel centres"),
      choice("boundary", "wrap|clamp", "what lies beyond the border of the map"),
      integer("level_count", 1, kMaxPyramidLevels, "1", "number of levels"),
      {"level_strides", f32, "level_count", "texel", "distance between footprint centres of each level", FLT_MIN, kMaxMapSize},
      {"level_columns", i32, "level_count", "1", "footprints along u of each level", 1, kMaxMapSize},
      {"level_rows", i32, "level_count", "1", "footprints along v of each level", 1, kMaxMapSize},
      slopeMean(),
      slopeCovariance()};
}

std::vector<AttributeSchema> joined(std::vector<AttributeSchema> a, const std::vector<AttributeSchema>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

KindSchema heightsSchema() {
  return {"heights",
          "Height field",
          mapSize(),
          {},
          {{"heights", "", {{"", f32}}, {"height", "width"}, "texel", "height over the base plane, bottom row first"}}};
}

KindSchema histogramSatSchema() {
  constexpr double kStride = HistogramSat::kMaxStride;
  return {
      "histogram-sat",
      "Accumulated histograms of normals",
      {integer("width", 1, kMaxMapSize, "texel", "width of the normal map"),
       integer("height", 1, kMaxMapSize, "texel", "height of the normal map"),
       integer("theta_bins", 1, HistogramSat::kMaxThetaBins, "1", "rings of elevation"),
       integer("phi_bins", 1, HistogramSat::kMaxPhiBins, "1", "sectors of azimuth"),
       integer("bin_count", 1, HistogramSat::kMaxBins, "1", "bins that occur"),
       integer("stride", 1, kStride, "texel", "distance between the points of sums"),
       integer("coarse_stride", 1, kStride, "texel", "distance between the points of coarse_sums; a multiple of stride"),
       integer("line_stride", 1, HistogramSat::kMaxLineStride, "texel", "distance between the points of row_sums, column_sums"),
       slopeMean(), slopeCovariance()},
      {{"row_length", "ceil_div(bin_count, 16) * 16", "counters of a point"}},
      {{"bin_ids", "", {{"", u16}}, {"bin_count"}, "1", "ring * phi_bins + sector of each bin that occurs, increasing"},
       {"bin_normals", "", {{"", f32}}, {"bin_count", "2"}, "1", "mean (nx, ny) of the texels of each bin"},
       {"bin_totals", "", {{"", u64}}, {"bin_count"}, "1", "texels of each bin"},
       {"texels", "", {{"", u16}}, {"ceil_div(height, 8)", "ceil_div(width, 8)", "8", "8"}, "1", "bin of each texel, in tiles"},
       {"sums",
        "",
        {{"", u16}},
        {"ceil_div(height, stride) + 1", "ceil_div(width, stride) + 1", "row_length"},
        "1",
        "texels of each bin below and left of each point, modulo 2^16"},
       {"coarse_sums",
        "",
        {{"", u32}},
        {"ceil_div(height, coarse_stride) + 1", "ceil_div(width, coarse_stride) + 1", "row_length"},
        "1",
        "texels of each bin below and left of each point, modulo 2^32"},
       {"row_sums",
        "",
        {{"", u16}},
        {"height", "ceil_div(width, line_stride) + 1", "row_length"},
        "1",
        "texels of each bin in a row left of each point, modulo 2^16"},
       {"column_sums",
        "",
        {{"", u16}},
        {"width", "ceil_div(height, line_stride) + 1", "row_length"},
        "1",
        "texels of each bin in a column below each point, modulo 2^16"}}};
}

KindSchema normalsSchema() {
  return {"normals",
          "Normal map",
          joined(mapSize(), {integer("bounds_level_count", 0, 20, "1", "levels of the min-max pyramid; 0 when there is none")}),
          {},
          {{"normals", "", {{"", f32}}, {"height", "width", "2"}, "1", "(nx, ny) on the unit disk, bottom row first"},
           {"bounds/level_{l}",
            "bounds_level_count",
            {{"", f32}},
            {"ceil_div(height, pow2(l + 1))", "ceil_div(width, pow2(l + 1))", "4"},
            "1",
            "low nx, low ny, high nx, high ny of the texels of each node and one more row and column, wrapped"}}};
}

KindSchema ndfPyramidSchema() {
  return {"ndf-pyramid",
          "Pyramid of NDF images",
          joined(pyramidShape(), {choice("precision", "f16|f32", "type of the stored pixels"),
                                  real("value_scale", FLT_MIN, FLT_MAX, "1", "density = value_scale * stored pixel")}),
          {{"mask_words", "ceil_div(resolution * resolution, 16384)", "64-bit words of occupancy bits of an image"}},
          {{"level_{l}/masks",
            "level_count",
            {{"", u64}},
            {"level_rows[l]", "level_columns[l]", "mask_words"},
            "1",
            "bit b of word w: block 64 w + b of the image is stored"},
           {"level_{l}/mask_ranks",
            "level_count",
            {{"", u32}},
            {"level_rows[l] * level_columns[l] * mask_words + 1"},
            "1",
            "stored blocks of the level before those of this word; the last value is their total"},
           {"level_{l}/block_means", "level_count", {{"", f32}}, {"stored_blocks"}, "1", "mean density of each stored block"},
           {"level_{l}/pixels",
            "level_count",
            {{"precision=f16", f16}, {"precision=f32", f32}},
            {"stored_blocks", "16", "16"},
            "1",
            "mean density of each pixel of each stored block, divided by value_scale"}}};
}

KindSchema ndfCpSchema() {
  return {"ndf-cp",
          "Compressed pyramid of NDF images",
          joined(pyramidShape(), {choice("method", "cp|tucker|pca", "how the basis images of a cluster are made"),
                                  choice("coefficient_type", "i8|f16|f32", "type of the stored coefficients"),
                                  integer("regions", 1, 65535, "1", "regions of images, by place on the map or by level"),
                                  integer("places", 0, 4096, "1", "angular blocks that occur in any image")}),
          {{"blocks_per_image", "ceil_div(resolution * resolution, 256)", "angular blocks of an image"},
           {"place_words", "ceil_div(places, 64)", "64-bit words of occupancy bits of an image"}},
          {{"image_regions", "", {{"", u16}}, {"images"}, "1", "region that an image belongs to"},
           {"image_slots", "", {{"", u16}}, {"images"}, "1", "slot of an image in its region"},
           {"image_scales", "", {{"", f32}}, {"images"}, "1", "factor that makes an image integrate to 1"},
           {"density_scales",
            "",
            {{"", f32}},
            {"images"},
            "1",
            "factor that makes an image without its negative parts integrate to 1"},
           {"block_places", "", {{"", u16}}, {"blocks_per_image"}, "1", "place of a block; 65535: it occurs in no image"},
           {"place_blocks", "", {{"", u16}}, {"places"}, "1", "block of a place"},
           {"block_masks",
            "",
            {{"", u64}},
            {"images", "place_words"},
            "1",
            "bit b of word w: the block of place 64 w + b of the image has a slice"},
           {"first_block",
            "",
            {{"", u32}},
            {"images + 1"},
            "1",
            "slices of all images before this one; the last value is their total"},
           {"block_masses",
            "",
            {{"", u8}},
            {"slice_total"},
            "1",
            "share of each slice in its image, rounded up: bits 6 to 13 of a half-precision number"},
           {"clusters", "", {{"", ndf_cluster}}, {"regions", "places"}, "1", "place and size of each cluster's factors"},
           {"masks", "", {{"", u64}}, {"word_count"}, "1", "bit b of word w of a cluster: slot 64 w + b has a slice in it"},
           {"mask_ranks", "", {{"", u32}}, {"word_count"}, "1", "set bits of the cluster before this word"},
           {"basis",
            "",
            {{"coefficient_type=f32", f32}, {"method=cp|tucker", i16}, {"method=pca", i32}},
            {"basis_count"},
            "1",
            "inclusive prefix sums of each cluster's basis, columns fastest"},
           {"coefficients",
            "",
            {{"coefficient_type=i8", i8}, {"coefficient_type=f16", f16}, {"coefficient_type=f32", f32}},
            {"coefficient_count"},
            "1",
            "coefficients of each cluster, a row for each slice; or its spots"},
           {"scales", "", {{"", f32}}, {"scale_count"}, "1", "scale of each column of each cluster"},
           {"core", "", {{"", u8}}, {"core_count"}, "1", "tucker: a + 16 b of each column of each cluster"},
           {"spot_sums", "", {{"", f32}}, {"spot_sum_count"}, "1", "share of a spot up to edges of pixels, or nothing"}}};
}

KindSchema binMapSchema() {
  return {
      "bin-map",
      "Inverse bin map",
      {integer("width", 1, kMaxMapSize, "texel", "width of the normal map"),
       integer("height", 1, kMaxMapSize, "texel", "height of the normal map"),
       real("alpha", FLT_MIN, 1, "1", "Beckmann roughness that the bins are made for"),
       real("alpha_min", FLT_MIN, 1, "1", "smallest Beckmann roughness of a facet"),
       real("alpha_max", FLT_MIN, 1, "1", "largest Beckmann roughness of a facet"), slopeMean(), slopeCovariance(),
       integer("bins_per_axis", 1, 4096, "1", "bins of directions along each axis of [-1, 1]^2"),
       integer("leaf_size", 1, 1024, "texel", "texels of a cell, on average at least, where a block is not sparse"),
       integer("tile_bits", 0, BinMap::kMaxTileBits, "1", "bins along each axis of a tile, logarithm to base 2"),
       integer("cell_starts_shift", 0, CompactCounts::kMaxShift, "1",
               "values of cell_starts that share a base, logarithm to base 2")},
      {},
      {{"nodes", "", {{"", u32}}, {"node_count", "2"}, "1", "kind and block number, and first child or cell, of each node"},
       {"block_moments",
        "",
        {{"", f16}},
        {"block_count", "5"},
        "1",
        "mean x, y and covariance xx, xy, yy of the block's normals, in its sides from its lower left corner"},
       {"cell_starts/offsets",
        "",
        {{"", u16}},
        {"cell_bounds"},
        "1",
        "first texel of each cell, and their number, less its base"},
       {"cell_starts/bases", "", {{"", u64}}, {"ceil_div(cell_bounds, pow2(cell_starts_shift))"}, "1", "bases of cell_starts"},
       {"texels",
        "",
        {{"", u32}},
        {"height * width"},
        "1",
        "column and row in its cell and place in its block of each texel, listed by block and cell"},
       {"class_keys", "", {{"", u32}}, {"class_bounds"}, "1", "first key of each class of bins, and the number of keys"},
       {"texel_classes",
        "",
        {{"", u16}},
        {"ceil_div(height * width * 12, 16)"},
        "1",
        "class of each texel of the map, 12 bits each"}}};
}

/// Attributes of glint::ShGrid and the order.
std::vector<AttributeSchema> shShape(double smallest_grid) {
  return {integer("order", 0, kMaxShOrder, "1", "highest band of the spherical harmonics"),
          integer("grid_rows", smallest_grid, 4096, "1", "polar angles of the grid of directions, both poles included"),
          integer("grid_columns", smallest_grid, 8192, "1", "azimuths of the grid of directions"),
          choice("precision", "f16|f32", "type of the stored coefficients")};
}

KindSchema shLobesSchema() {
  return {"sh-lobes",
          "Turned roughness lobes in spherical harmonics",
          joined(shShape(0), {real("sigma_r", FLT_MIN, 1, "1", "intrinsic roughness: standard deviation in disk units")}),
          {},
          {{"zonal", "", {{"", f32}}, {"order + 1"}, "1", "coefficients f_l of the lobe along +z"},
           {"lobes",
            "",
            {{"precision=f16", f16}, {"precision=f32", f32}},
            {"grid_rows", "grid_columns", "(order + 1) * (order + 1)"},
            "1",
            "coefficients of the lobe towards each direction of the grid"}}};
}

KindSchema shLightSchema() {
  return {"sh-light",
          "Light for half vectors in spherical harmonics",
          shShape(2),
          {},
          {{"scales", "", {{"", f32}}, {"grid_rows", "grid_columns"}, "1", "coefficient = scale * stored number"},
           {"band_norms",
            "",
            {{"", f32}},
            {"grid_rows", "grid_columns", "order + 1"},
            "1",
            "norm of each band's coefficients, the largest of red, green and blue"},
           {"light",
            "",
            {{"precision=f16", f16}, {"precision=f32", f32}},
            {"grid_rows", "grid_columns", "3", "(order + 1) * (order + 1)"},
            "1",
            "coefficients of red, green and blue for each outgoing direction of the grid, divided by its scale"}}};
}

AttributeSchema levelIntegers(std::string_view name, double low, double high, std::string_view units,
                              std::string_view long_name) {
  return {name, i32, "level_count", units, long_name, low, high};
}

AttributeSchema levelReals(std::string_view name, double low, double high, std::string_view long_name) {
  return {name, f32, "level_count", "1", long_name, low, high};
}

std::vector<AttributeSchema> displacementAttributes() {
  return joined(mapSize(),
                {choice("base", "diffuse|ggx", "reflectance of a facet of the original surface"),
                 real("albedo", 0, 1, "1", "diffuse: albedo; ggx: 1"),
                 real("alpha", 0, 1, "1", "ggx: roughness; diffuse: 0"),
                 real("eta", FLT_MIN, 100, "1", "ggx: refractive index of the conductor"),
                 real("k", 0, 100, "1", "ggx: extinction of the conductor; with eta 1 and k 0 it reflects all light"),
                 integer("rgb", 0, 1, "1", "1 if colours, T and S are linear red, green and blue, not grey"),
                 integer("lobe_count", 1, kMaxLobes, "1", "lobes of a cell"),
                 integer("has_lobe_colors", 0, 1, "1", "1 if lobes have colours of their own"),
                 integer("has_lobe_alphas", 0, 1, "1", "1 if lobes have a roughness of their own"),
                 integer("angular", 3, 25, "1", "cells of the concentric map along each axis, for either direction"),
                 integer("level_count", 1, kMaxDisplacementLevels, "1", "levels of detail"),
                 levelIntegers("level_factors", 2, kMaxMapSize, "texel", "side of a cell of each level"),
                 levelIntegers("level_columns", 1, kMaxMapSize, "1", "cells along u of each level"),
                 levelIntegers("level_rows", 1, kMaxMapSize, "1", "cells along v of each level"),
                 levelIntegers("level_spatial_columns", 1, 16, "1", "patches of the spatial scale along u"),
                 levelIntegers("level_spatial_rows", 1, 16, "1", "patches of the spatial scale along v"),
                 levelReals("level_rank1_residuals", 0, FLT_MAX, "norm of R - T S over that of R"),
                 levelReals("level_rank1_energies", 0, 1, "share of the largest singular value's square of R"),
                 levelReals("level_interreflected", 0, 1, "share of the reflected light that was scattered more than once"),
                 levelReals("level_distant", 0, 1, "share of the reflected light that hopped farther than a cell")});
}

std::vector<DatasetSchema> displacementDatasets() {
  return {{"level_{l}/heights",
           "level_count",
           {{"", f32}},
           {"level_rows[l]", "level_columns[l]"},
           "texel",
           "height of each vertex"},
          {"level_{l}/lobes",
           "level_count",
           {{"", f32}},
           {"level_rows[l]", "level_columns[l]", "lobe_count", "4"},
           "1",
           "centre (x, y) on the disk, bandwidth and amplitude of each lobe of each cell"},
          {"level_{l}/slopes",
           "level_count",
           {{"", f32}},
           {"level_rows[l]", "level_columns[l]", "5"},
           "1",
           "mean slope along u and v, variances uu, uv, vv of each cell"},
          {"level_{l}/fit_errors",
           "level_count",
           {{"", f32}},
           {"level_rows[l]", "level_columns[l]"},
           "1",
           "relative error of each cell's lobes, blurred by 8 degrees"},
          {"level_{l}/spatial_scale",
           "level_count",
           {{"", f32}},
           {"level_spatial_rows[l]", "level_spatial_columns[l]", "channels"},
           "1",
           "T: factors of each patch"},
          {"level_{l}/angular_scale",
           "level_count",
           {{"", f16}},
           {"angular_pairs", "channels"},
           "1",
           "S: factors of each pair of directions i <= o at o (o + 1) / 2 + i"},
          {"level_{l}/lobe_colors",
           "level_count * has_lobe_colors",
           {{"", f32}},
           {"level_rows[l]", "level_columns[l]", "lobe_count", "channels"},
           "1",
           "factors of the base's reflectance of each lobe"},
          {"level_{l}/lobe_alphas",
           "level_count * has_lobe_alphas",
           {{"", f32}},
           {"level_rows[l]", "level_columns[l]", "lobe_count"},
           "1",
           "ggx: roughness of the base of each lobe"}};
}

KindSchema displacementSchema() {
  return {"displacement",
          "Downsampled displacement map that keeps its appearance",
          displacementAttributes(),
          {{"angular_pairs", "ceil_div(angular * angular * (angular * angular + 1), 2)", "pairs of directions"},
           {"channels", "2 * rgb + 1", "numbers of a colour, of T and of S"}},
          displacementDatasets()};
}

/// Recursive descent over one size expression.
class SizeParser {
 public:
  SizeParser(std::string_view source, const SizeScope& scope) : rest_(source), scope_(scope) {}

  std::optional<std::uint64_t> parse() {
    const auto value = sum();
    skipSpace();
    return rest_.empty() ? value : std::nullopt;
  }

 private:
  using Value = std::optional<std::uint64_t>;

  void skipSpace() {
    while (!rest_.empty() && rest_.front() == ' ') rest_.remove_prefix(1);
  }
  bool take(char c) {
    skipSpace();
    if (rest_.empty() || rest_.front() != c) return false;
    rest_.remove_prefix(1);
    return true;
  }

  Value sum() {
    Value left = product();
    while (left && take('+')) {
      const Value right = product();
      std::uint64_t total = 0;
      if (!right || __builtin_add_overflow(*left, *right, &total)) return std::nullopt;
      left = total;
    }
    return left;
  }

  Value product() {
    Value left = factor();
    while (left && take('*')) {
      const Value right = factor();
      std::uint64_t total = 0;
      if (!right || __builtin_mul_overflow(*left, *right, &total)) return std::nullopt;
      left = total;
    }
    return left;
  }

  Value factor() {
    if (take('(')) {
      const Value value = sum();
      return take(')') ? value : std::nullopt;
    }
    std::size_t length = 0;
    while (length < rest_.size() && (std::isalnum(static_cast<unsigned char>(rest_[length])) || rest_[length] == '_')) ++length;
    const std::string_view word = rest_.substr(0, length);
    rest_.remove_prefix(length);
    if (word.empty()) return std::nullopt;
    if (std::isdigit(static_cast<unsigned char>(word.front()))) {
      std::uint64_t number = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
      return error == std::errc() && end == word.data() + word.size() ? Value(number) : std::nullopt;
    }
    if (word == "ceil_div" || word == "pow2") return call(word);
    return lookUp(word);
  }

  Value call(std::string_view function) {
    if (!take('(')) return std::nullopt;
    const Value a = sum();
    if (function == "pow2") return a && *a < 63 && take(')') ? Value(std::uint64_t{1} << *a) : std::nullopt;
    if (!a || !take(',')) return std::nullopt;
    const Value b = sum();
    if (!b || *b == 0 || !take(')')) return std::nullopt;
    return *a / *b + (*a % *b != 0);
  }

  Value lookUp(std::string_view word) {
    if (word == "l") return scope_.level;
    const auto found = scope_.values.find(word);
    std::uint64_t index = 0;
    if (take('[')) {
      const Value at = sum();
      if (!at || !take(']')) return std::nullopt;
      index = *at;
    }
    if (found == scope_.values.end() || index >= found->second.size()) return std::nullopt;
    return found->second[index];
  }

  std::string_view rest_;
  const SizeScope& scope_;
};

}  // namespace

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

std::span<const KindSchema> kindSchemas() {
  static const std::vector<KindSchema> table = {binMapSchema(),       displacementSchema(), heightsSchema(),
                                                histogramSatSchema(), ndfCpSchema(),        ndfPyramidSchema(),
                                                normalsSchema(),      shLightSchema(),      shLobesSchema()};
  return table;
}

const KindSchema* findKindSchema(std::string_view kind) {
  for (const KindSchema& schema : kindSchemas()) {
    if (schema.name == kind) return &schema;
  }
  return nullptr;
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
      {"inputs", text, "*", "1", "hash, two spaces and name of every input", 0, 0},
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

std::optional<std::uint64_t> evaluateSize(std::string_view expression, const SizeScope& scope) {
  return SizeParser(expression, scope).parse();
}

}  // namespace glint::formats
