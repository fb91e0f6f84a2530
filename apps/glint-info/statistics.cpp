#include "glint-info/statistics.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "glint/bake/ingest/ingest.h"

namespace glint::apps {
namespace {

using nlohmann::ordered_json;

std::uint64_t datasetBytes(const formats::AssetInfo& info) {
  std::uint64_t bytes = 0;
  for (const formats::DatasetInfo& dataset : info.datasets) bytes += dataset.size_bytes;
  return bytes;
}

ordered_json statisticsOf(const NormalMap& map, const formats::AssetInfo&) {
  Vec2 low{1, 1};
  Vec2 high{-1, -1};
  for (const Vec2 n : map.normals) {
    low = {std::min(low.x, n.x), std::min(low.y, n.y)};
    high = {std::max(high.x, n.x), std::max(high.y, n.y)};
  }
  const bake::IngestReport report = bake::describeNormals(map.width, map.height, map.normals);
  ordered_json statistics = {{"mean_tilt_deg", report.mean_tilt_deg},
                             {"max_tilt_deg", report.steepest_tilt_deg},
                             {"normal_range_x", {low.x, high.x}},
                             {"normal_range_y", {low.y, high.y}}};
  return statistics;
}

ordered_json statisticsOf(const HeightMap& map, const formats::AssetInfo&) {
  double sum = 0;
  double squares = 0;
  const auto [low, high] = std::minmax_element(map.heights.begin(), map.heights.end());
  for (const float h : map.heights) sum += h, squares += static_cast<double>(h) * h;
  const auto count = static_cast<double>(map.heights.size());
  const double mean = sum / count;
  return {{"min_texels", *low},
          {"max_texels", *high},
          {"mean_texels", mean},
          {"deviation_texels", std::sqrt(std::max(0.0, squares / count - mean * mean))}};
}

/// 0 of nothing: a shard may have no images of a level.
double shareOf(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

ordered_json statisticsOf(const NdfPyramid& pyramid, const formats::AssetInfo&) {
  ordered_json levels = ordered_json::array();
  std::uint64_t blocks = 0;
  std::uint64_t places = 0;
  for (int l = 0; l < pyramid.shape.level_count; ++l) {
    const PyramidGrid& grid = pyramid.shape.levels[l];
    const std::uint64_t level_blocks = pyramid.levels[l].block_means.size();
    const std::uint64_t level_places = grid.imageCount() * static_cast<std::uint64_t>(pyramid.shape.blocksPerImage());
    levels.push_back({{"blocks", level_blocks}, {"occupied_share", shareOf(level_blocks, level_places)}});
    blocks += level_blocks;
    places += level_places;
  }
  return {{"blocks", blocks}, {"occupied_share", shareOf(blocks, places)}, {"levels", std::move(levels)}};
}

ordered_json statisticsOf(const NdfPyramidShard& shard, const formats::AssetInfo& info) {
  NdfPyramid held = shard.images;  // whose levels are as large as their arrays
  for (int l = 0; l < held.shape.level_count; ++l) held.shape.levels[l].rows = shard.rows[l];
  return statisticsOf(held, info);
}

ordered_json statisticsOf(const WavePyramid& wave, const formats::AssetInfo& info) { return statisticsOf(wave.grey, info); }

ordered_json statisticsOf(const NdfCp& ndf, const formats::AssetInfo& info) {
  std::map<int, std::uint64_t> ranks;
  std::uint64_t slices = 0, spot_slices = 0;
  std::uint64_t empty = 0;
  for (const NdfCluster& cluster : ndf.clusters) {
    slices += cluster.slice_count;
    if (cluster.slice_count == 0) {
      ++empty;
    } else if (cluster.columns == 0) {
      spot_slices += cluster.slice_count;
    } else {
      ++ranks[cluster.columns];
    }
  }
  ordered_json histogram = ordered_json::array();
  for (const auto& [columns, clusters] : ranks) histogram.push_back({{"columns", columns}, {"clusters", clusters}});
  const std::uint64_t bytes = datasetBytes(info);
  return {{"clusters", ndf.clusters.size()},
          {"empty_clusters", empty},
          {"slices", slices},
          {"spot_slices", spot_slices},
          {"bytes_per_slice", slices == 0 ? 0.0 : static_cast<double>(bytes) / static_cast<double>(slices)},
          {"ranks", std::move(histogram)}};
}

ordered_json statisticsOf(const WaveCp& wave, const formats::AssetInfo& info) { return statisticsOf(wave.images, info); }

ordered_json statisticsOf(const BinMap& map, const formats::AssetInfo&) {
  return {{"bins", static_cast<std::uint64_t>(map.bins_per_axis) * static_cast<std::uint64_t>(map.bins_per_axis)},
          {"bins_of_a_tile", std::uint64_t{1} << 2 * map.tile_bits},
          {"blocks", map.blockCount()},
          {"texels_of_a_block", static_cast<double>(map.texels.size()) / static_cast<double>(map.blockCount())},
          {"cells", map.cell_starts.size() - 1},
          {"classes", map.classCount()}};
}

ordered_json statisticsOf(const HistogramSat& sat, const formats::AssetInfo& info) {
  const std::uint64_t bytes = datasetBytes(info);
  const auto fullest = std::max_element(sat.bin_totals.begin(), sat.bin_totals.end());
  const double texels = static_cast<double>(sat.width) * sat.height;
  return {{"bins", sat.bin_count},
          {"fullest_bin", sat.bin_ids[static_cast<std::size_t>(fullest - sat.bin_totals.begin())]},
          {"fullest_share", static_cast<double>(*fullest) / texels},
          {"bytes_per_texel", static_cast<double>(bytes) / texels}};
}

/// Roughness of a lobe at each level: root mean square of the deviations of slopes under a texel.
ordered_json statisticsOf(const SlopeMoments& moments, const formats::AssetInfo& info) {
  ordered_json spreads = ordered_json::array();
  for (int l = 0; l < moments.level_count; ++l) {
    double sum = 0;
    for (const MapSlopes& s : moments.levels[l].texels) sum += 0.5 * (double{s.covariance.xx} + double{s.covariance.yy});
    spreads.push_back(std::sqrt(sum / static_cast<double>(moments.levels[l].texels.size())));
  }
  const double texels = static_cast<double>(moments.width) * moments.height;
  return {{"slope_deviations", std::move(spreads)}, {"bytes_per_texel", static_cast<double>(datasetBytes(info)) / texels}};
}

ordered_json statisticsOf(const TinyExample& tiny, const formats::AssetInfo& info) {
  std::uint64_t images = 0, blocks = 0;
  for (int l = 0; l < tiny.images.shape.level_count; ++l) {
    images += tiny.images.shape.levels[l].imageCount();
    blocks += tiny.images.levels[l].block_means.size();
  }
  const double places = static_cast<double>(images) * tiny.images.shape.blocksPerImage();
  return {{"images", images},
          {"blocks", blocks},
          {"occupied_share", static_cast<double>(blocks) / places},
          {"size_bytes", datasetBytes(info)}};
}

ordered_json statisticsOf(const ShLobes& lobes, const formats::AssetInfo&) {
  return {{"coefficients", shCount(lobes.order)}, {"mean", lobes.zonal[0]}, {"last_band", lobes.zonal.back()}};
}

/// How much of the light the bands hold, over all outgoing directions: shares of the sum of squares.
ordered_json statisticsOf(const ShLight& light, const formats::AssetInfo&) {
  const std::size_t bands = static_cast<std::size_t>(light.order) + 1;
  double total = 0, first = 0, upper = 0;
  for (std::size_t k = 0; k < light.band_norms.size(); ++k) {
    const double square = double{light.band_norms[k]} * light.band_norms[k];
    total += square;
    if (k % bands == 0) first += square;
    if (k % bands > bands / 2) upper += square;
  }
  return {{"coefficients", shCount(light.order)},
          {"share_of_band_0", total > 0 ? first / total : 0.0},
          {"share_of_upper_half", total > 0 ? upper / total : 0.0}};
}

ordered_json statisticsOf(const Displacement& d, const formats::AssetInfo&) {
  ordered_json levels = ordered_json::array();
  for (int l = 0; l < d.level_count; ++l) {
    const DisplacementLevel& level = d.levels[l];
    double error = 0;
    for (const float e : level.fit_errors) error += e;
    const auto [low, high] = std::minmax_element(level.spatial_scale.begin(), level.spatial_scale.end());
    levels.push_back({{"mean_fit_error", error / static_cast<double>(level.fit_errors.size())},
                      {"min_T", *low},
                      {"max_T", *high},
                      {"singular_shares", std::vector<float>(level.singular_shares.begin(), level.singular_shares.end())},
                      {"scale_terms", d.more_terms + 1},
                      {"scale_residual", level.scale_residual},
                      {"scale_bytes", level.spatial_scale.size_bytes() + level.angular_scale.size_bytes() +
                                          level.spatial_terms.size_bytes() + level.angular_terms.size_bytes()}});
  }
  return {{"reliable_within_deg", 75}, {"levels", std::move(levels)}};
}

/// A kind without statistics of its own.
template <class Model>
ordered_json statisticsOf(const Model&, const formats::AssetInfo&) {
  return ordered_json::object();
}

}  // namespace

ordered_json statisticsOf(const formats::Asset& asset) {
  return std::visit([&](const auto& model) { return statisticsOf(model, asset.info()); }, asset.any());
}

}  // namespace glint::apps
