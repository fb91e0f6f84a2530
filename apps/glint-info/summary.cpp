#include "glint-info/summary.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "glint/bake/ingest/ingest.h"

namespace glint::apps {
namespace {

using nlohmann::ordered_json;

void addSlopes(const MapSlopes& slopes, ordered_json& properties) {
  properties["mean_slope"] = {slopes.mean.x, slopes.mean.y};
  properties["slope_covariance_xx"] = slopes.covariance.xx;
  properties["slope_covariance_xy"] = slopes.covariance.xy;
  properties["slope_covariance_yy"] = slopes.covariance.yy;
}

ordered_json summarizeNormals(const NormalMap& map) {
  Vec2 low{1, 1};
  Vec2 high{-1, -1};
  for (const Vec2 n : map.normals) {
    low = {std::min(low.x, n.x), std::min(low.y, n.y)};
    high = {std::max(high.x, n.x), std::max(high.y, n.y)};
  }
  const bake::IngestReport report = bake::describeNormals(map.width, map.height, map.normals);
  ordered_json properties = {{"mean_tilt_deg", report.mean_tilt_deg},
                             {"max_tilt_deg", report.steepest_tilt_deg},
                             {"normal_range_x", {low.x, high.x}},
                             {"normal_range_y", {low.y, high.y}}};
  addSlopes(report.slopes, properties);
  properties["bounds_levels"] = map.bounds_level_count;
  return properties;
}

ordered_json summarizeHeights(const HeightMap& map) {
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

ordered_json shapeProperties(const PyramidShape& shape) {
  ordered_json properties = {{"width", shape.width},
                             {"height", shape.height},
                             {"resolution", shape.resolution},
                             {"sigma_r", shape.sigma_r},
                             {"surface", shape.surface == Surface::flat ? "flat" : "smooth"},
                             {"boundary", shape.boundary == Boundary::wrap ? "wrap" : "clamp"},
                             {"levels", shape.level_count}};
  addSlopes(shape.slopes, properties);
  return properties;
}

ordered_json levelJson(const PyramidGrid& grid) {
  return {{"stride_texels", grid.stride}, {"columns", grid.columns}, {"rows", grid.rows}};
}

ordered_json summarizePyramid(const NdfPyramid& pyramid) {
  ordered_json levels = ordered_json::array();
  std::uint64_t blocks = 0;
  std::uint64_t places = 0;
  for (int l = 0; l < pyramid.shape.level_count; ++l) {
    const PyramidGrid& grid = pyramid.shape.levels[l];
    const std::uint64_t level_blocks = pyramid.levels[l].block_means.size();
    const std::uint64_t level_places = grid.imageCount() * static_cast<std::uint64_t>(pyramid.shape.blocksPerImage());
    levels.push_back(levelJson(grid));
    levels.back()["blocks"] = level_blocks;
    levels.back()["occupied_share"] = static_cast<double>(level_blocks) / static_cast<double>(level_places);
    blocks += level_blocks;
    places += level_places;
  }
  return {{"blocks", blocks},
          {"occupied_share", static_cast<double>(blocks) / static_cast<double>(places)},
          {"levels", std::move(levels)}};
}

ordered_json summarizeNdfCp(const NdfCp& ndf, const formats::AssetInfo& info) {
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
  std::uint64_t bytes = 0;
  for (const formats::DatasetInfo& dataset : info.datasets) bytes += dataset.size_bytes;
  ordered_json levels = ordered_json::array();
  for (int l = 0; l < ndf.shape.level_count; ++l) levels.push_back(levelJson(ndf.shape.levels[l]));
  return {{"clusters", ndf.clusters.size()},
          {"empty_clusters", empty},
          {"slices", slices},
          {"spot_slices", spot_slices},
          {"bytes_per_slice", slices == 0 ? 0.0 : static_cast<double>(bytes) / static_cast<double>(slices)},
          {"ranks", std::move(histogram)},
          {"levels", std::move(levels)}};
}

ordered_json summarizeBinMap(const BinMap& map) {
  return {{"bins", static_cast<std::uint64_t>(map.bins_per_axis) * static_cast<std::uint64_t>(map.bins_per_axis)},
          {"bins_of_a_tile", std::uint64_t{1} << 2 * map.tile_bits},
          {"blocks", map.blockCount()},
          {"texels_of_a_block", static_cast<double>(map.texels.size()) / static_cast<double>(map.blockCount())},
          {"cells", map.cell_starts.size() - 1},
          {"classes", map.classCount()}};
}

ordered_json summarizeHistograms(const HistogramSat& sat, const formats::AssetInfo& info) {
  std::uint64_t bytes = 0;
  for (const formats::DatasetInfo& dataset : info.datasets) bytes += dataset.size_bytes;
  const auto fullest = std::max_element(sat.bin_totals.begin(), sat.bin_totals.end());
  const double texels = static_cast<double>(sat.width) * sat.height;
  return {{"bins", sat.bin_count},
          {"fullest_bin", sat.bin_ids[static_cast<std::size_t>(fullest - sat.bin_totals.begin())]},
          {"fullest_share", static_cast<double>(*fullest) / texels},
          {"bytes_per_texel", static_cast<double>(bytes) / texels}};
}

ordered_json shProperties(int order, const ShGrid& grid, ShPrecision precision) {
  return {{"order", order},
          {"coefficients", shCount(order)},
          {"grid", std::to_string(grid.rows) + "x" + std::to_string(grid.columns)},
          {"precision", precision == ShPrecision::f16 ? "f16" : "f32"}};
}

/// How much of the light the bands hold, over all outgoing directions: shares of the sum of squares.
ordered_json summarizeLight(const ShLight& light) {
  const std::size_t bands = static_cast<std::size_t>(light.order) + 1;
  double total = 0, first = 0, upper = 0;
  for (std::size_t k = 0; k < light.band_norms.size(); ++k) {
    const double square = double{light.band_norms[k]} * light.band_norms[k];
    total += square;
    if (k % bands == 0) first += square;
    if (k % bands > bands / 2) upper += square;
  }
  return {{"share_of_band_0", total > 0 ? first / total : 0.0}, {"share_of_upper_half", total > 0 ? upper / total : 0.0}};
}

ordered_json displacementProperties(const Displacement& d) {
  ordered_json properties = {{"width", d.width}, {"height", d.height}, {"texel_size_um", d.texel_size_um}};
  if (d.base.kind == BaseBrdf::Kind::diffuse) {
    properties["base"] = "diffuse";
    properties["albedo"] = d.base.albedo;
  } else {
    properties["base"] = "ggx";
    properties["alpha"] = d.base.alpha;
    properties["eta"] = d.base.eta;
    properties["k"] = d.base.k;
  }
  properties["channels"] = d.channels;
  properties["lobes"] = d.lobe_count;
  properties["base_color"] = d.levels[0].lobe_colors.empty() ? "one"
                             : d.channels == 3               ? "rgb of each lobe"
                                                             : "grey of each lobe";
  if (d.base.kind == BaseBrdf::Kind::ggx)
    properties["base_roughness"] = d.levels[0].lobe_alphas.empty() ? "one" : "of each lobe";
  properties["angular"] = d.angular;
  properties["levels"] = d.level_count;
  return properties;
}

ordered_json summarizeDisplacement(const Displacement& d) {
  ordered_json levels = ordered_json::array();
  for (int l = 0; l < d.level_count; ++l) {
    const DisplacementLevel& level = d.levels[l];
    double error = 0;
    for (const float e : level.fit_errors) error += e;
    const auto [low, high] = std::minmax_element(level.spatial_scale.begin(), level.spatial_scale.end());
    levels.push_back({{"factor", level.factor},
                      {"columns", level.columns},
                      {"rows", level.rows},
                      {"mean_fit_error", error / static_cast<double>(level.fit_errors.size())},
                      {"min_T", *low},
                      {"max_T", *high},
                      {"rank1_residual", level.rank1_residual},
                      {"rank1_energy", level.rank1_energy},
                      {"interreflected_share", level.interreflected_share},
                      {"distant_share", level.distant_share},
                      {"scale_bytes", level.spatial_scale.size_bytes() + level.angular_scale.size_bytes()}});
  }
  return {{"reliable_within_deg", 75}, {"levels", std::move(levels)}};
}

const char* nameOf(CompressionMethod method) {
  switch (method) {
    case CompressionMethod::cp:
      return "cp";
    case CompressionMethod::tucker:
      return "tucker";
    case CompressionMethod::pca:
      return "pca";
  }
  return "unknown";
}

const char* nameOf(CoefficientType type) {
  switch (type) {
    case CoefficientType::i8:
      return "i8";
    case CoefficientType::f16:
      return "f16";
    case CoefficientType::f32:
      return "f32";
  }
  return "unknown";
}

void addKind(const formats::Asset& asset, ordered_json& properties, ordered_json& statistics) {
  if (asset.kind() == "normals") {
    const NormalMap& map = asset.get<NormalMap>();
    properties = {{"width", map.width}, {"height", map.height}, {"texel_size_um", map.texel_size_um}};
    statistics = summarizeNormals(map);
  } else if (asset.kind() == "heights") {
    const HeightMap& map = asset.get<HeightMap>();
    properties = {{"width", map.width}, {"height", map.height}, {"texel_size_um", map.texel_size_um}};
    statistics = summarizeHeights(map);
  } else if (asset.kind() == "ndf-pyramid") {
    const NdfPyramid& pyramid = asset.get<NdfPyramid>();
    properties = shapeProperties(pyramid.shape);
    properties["precision"] = pyramid.precision == BlockPrecision::f16 ? "f16" : "f32";
    properties["value_scale"] = pyramid.value_scale;
    statistics = summarizePyramid(pyramid);
  } else if (asset.kind() == "displacement") {
    properties = displacementProperties(asset.get<Displacement>());
    statistics = summarizeDisplacement(asset.get<Displacement>());
  } else if (asset.kind() == "ndf-cp") {
    const NdfCp& ndf = asset.get<NdfCp>();
    properties = shapeProperties(ndf.shape);
    properties["method"] = nameOf(ndf.method);
    properties["coefficient_type"] = nameOf(ndf.coefficient_type);
    properties["regions"] = ndf.regions;
    statistics = summarizeNdfCp(ndf, asset.info());
  } else if (asset.kind() == "bin-map") {
    const BinMap& map = asset.get<BinMap>();
    properties = {{"width", map.width},         {"height", map.height},       {"alpha", map.alpha},
                  {"alpha_min", map.alpha_min}, {"alpha_max", map.alpha_max}, {"bins_per_axis", map.bins_per_axis},
                  {"leaf_size", map.leaf_size}};
    addSlopes(map.slopes, properties);
    statistics = summarizeBinMap(map);
  } else if (asset.kind() == "histogram-sat") {
    const HistogramSat& sat = asset.get<HistogramSat>();
    properties = {{"width", sat.width},
                  {"height", sat.height},
                  {"directions", std::to_string(sat.theta_bins) + "x" + std::to_string(sat.phi_bins)},
                  {"stride_texels", sat.stride},
                  {"coarse_stride_texels", sat.coarse_stride},
                  {"line_stride_texels", sat.line_stride}};
    addSlopes(sat.slopes, properties);
    statistics = summarizeHistograms(sat, asset.info());
  } else if (asset.kind() == "sh-lobes") {
    const ShLobes& lobes = asset.get<ShLobes>();
    properties = shProperties(lobes.order, lobes.grid, lobes.precision);
    properties["sigma_r"] = lobes.sigma_r;
    statistics = {{"mean", lobes.zonal[0]}, {"last_band", lobes.zonal.back()}};
  } else if (asset.kind() == "sh-light") {
    const ShLight& light = asset.get<ShLight>();
    properties = shProperties(light.order, light.grid, light.precision);
    statistics = summarizeLight(light);
  }
}

std::string listed(const ordered_json& dims) {
  std::string text;
  for (const auto& n : dims) text += (text.empty() ? "" : " x ") + n.dump();
  return text;
}

/// A number with the digits that people read, a text without quotes, or a list of those.
std::string plain(const ordered_json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.5g", value.get<double>());
    return digits;
  }
  if (!value.is_array()) return value.dump();
  std::string text;
  for (const auto& element : value) text += (text.empty() ? "" : ", ") + plain(element);
  return text;
}

std::string row(const std::string& name, const std::string& value) {
  return "  " + name + std::string(name.size() < 22 ? 22 - name.size() : 1, ' ') + value + "\n";
}

/// Rows of objects with the same keys, in columns under their names.
std::string table(const ordered_json& rows) {
  std::vector<std::vector<std::string>> cells(1);
  for (const auto& [key, value] : rows.at(0).items()) cells[0].push_back(key);
  for (const auto& entry : rows) {
    cells.emplace_back();
    for (const auto& [key, value] : entry.items()) cells.back().push_back(key == "dims" ? listed(value) : plain(value));
  }
  std::vector<std::size_t> widths(cells[0].size());
  for (const auto& line : cells) {
    for (std::size_t c = 0; c < widths.size(); ++c) widths[c] = std::max(widths[c], line[c].size());
  }
  std::string text;
  for (const auto& line : cells) {
    text += " ";
    for (std::size_t c = 0; c < widths.size(); ++c)
      text += " " + line[c] + std::string(c + 1 < widths.size() ? widths[c] - line[c].size() + 1 : 0, ' ');
    text += "\n";
  }
  return text;
}

std::string section(const char* title, const ordered_json& values) {
  std::string text = std::string(title) + "\n";
  std::string tables;
  for (const auto& [key, value] : values.items()) {
    if (value.is_array() && !value.empty() && value[0].is_object()) {
      tables += key + "\n" + table(value);
    } else {
      text += row(key, plain(value));
    }
  }
  return text + tables;
}

}  // namespace

ordered_json summarize(const formats::Asset& asset) {
  const formats::AssetInfo& info = asset.info();
  ordered_json inputs = ordered_json::array();
  for (const formats::InputRecord& input : info.provenance.inputs)
    inputs.push_back({{"name", input.name}, {"hash", input.hash_hex}});
  ordered_json datasets = ordered_json::array();
  for (const formats::DatasetInfo& dataset : info.datasets) {
    datasets.push_back({{"path", dataset.path},
                        {"type", dataset.type},
                        {"dims", dataset.dims},
                        {"bytes", dataset.size_bytes},
                        {"offset", dataset.offset},
                        {"hash", dataset.hash_hex},
                        {"units", dataset.units},
                        {"long_name", dataset.long_name}});
  }
  // The command is JSON, but the file may hold anything: then it is shown as text.
  ordered_json command = ordered_json::parse(info.provenance.command_json, nullptr, false);
  if (command.is_discarded()) command = info.provenance.command_json;
  ordered_json properties = ordered_json::object();
  ordered_json statistics = ordered_json::object();
  addKind(asset, properties, statistics);
  return {{"schema_version", kSummarySchemaVersion},
          {"kind", asset.kind()},
          {"format_version", std::to_string(info.format_major) + "." + std::to_string(info.format_minor)},
          {"file_bytes", info.file_bytes},
          {"provenance",
           {{"generator", info.provenance.generator}, {"command", std::move(command)}, {"inputs", std::move(inputs)}}},
          {"properties", std::move(properties)},
          {"statistics", std::move(statistics)},
          {"datasets", std::move(datasets)}};
}

std::string summaryText(const std::string& path, const ordered_json& summary) {
  std::string text = path + "\n";
  text += row("kind", plain(summary["kind"])) + row("format_version", plain(summary["format_version"])) +
          row("file_bytes", plain(summary["file_bytes"]));
  text += section("properties", summary["properties"]) + section("statistics", summary["statistics"]);
  const ordered_json& provenance = summary["provenance"];
  text += "provenance\n" + row("generator", plain(provenance["generator"])) + row("command", provenance["command"].dump());
  for (const auto& input : provenance["inputs"]) text += row("input", plain(input["hash"]) + "  " + plain(input["name"]));
  ordered_json parts = ordered_json::array();
  for (const auto& dataset : summary["datasets"]) {
    parts.push_back({{"path", dataset["path"]},
                     {"type", dataset["type"]},
                     {"dims", dataset["dims"]},
                     {"bytes", dataset["bytes"]},
                     {"long_name", dataset["long_name"]}});
  }
  return parts.empty() ? text : text + "datasets\n" + table(parts);
}

}  // namespace glint::apps
