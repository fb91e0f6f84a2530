#include "glint-compress/compress_options.h"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/input_asset.h"
#include "glint/api/any_ndf.h"
#include "glint/formats/udim.h"

namespace glint::apps {
namespace {

template <class... Values>
std::string format(const char* pattern, Values... values) {
  char line[200];
  std::snprintf(line, sizeof line, pattern, values...);
  return line;
}

const char* typeName(CoefficientType type) {
  return type == CoefficientType::i8 ? "i8" : type == CoefficientType::f16 ? "f16" : "f32";
}

const char* methodName(CompressionMethod method) {
  return method == CompressionMethod::tucker ? "tucker" : method == CompressionMethod::pca ? "pca" : "cp";
}

}  // namespace

CompressOptions::CompressOptions(Tool& tool) : tool_(tool) {
  tool.choice("--method", values_.method,
              {{"auto", std::nullopt},
               {"cp", CompressionMethod::cp},
               {"tucker", CompressionMethod::tucker},
               {"pca", CompressionMethod::pca}},
              "decomposition of the blocks: canonical polyadic, Tucker-2 or principal components; auto: tucker, and pca where "
              "tucker cannot meet a tolerance");
  const Option& rank = tool.option("--rank", values_.rank, "columns of every cluster").range(1, 256);
  tool.option(
          "--tolerance", values_.tolerance,
          "instead of --rank: largest error, in the metric below; columns and bits of every cluster are chosen to meet it in "
          "few bytes; tucker and pca with --metric seen also aim at twice it at most for every block")
      .range(1e-6, 0.99)
      .excludes(rank)
      .defaultText("none");
  tool.choice("--metric", values_.metric, {{"seen", bake::ErrorMetric::seen}, {"l2", bake::ErrorMetric::l2}},
              "error to make small: what a person sees towards each half vector, in every level; or the relative error of all "
              "images together, in which peaks hide dim light");
  tool.choice(
      "--quantize", values_.coefficient_type,
      {{"auto", std::nullopt}, {"f32", CoefficientType::f32}, {"f16", CoefficientType::f16}, {"i8", CoefficientType::i8}},
      "type of the coefficients; auto: i8, and more bits where a tolerance needs them");
  tool.choice("--spots", values_.spots, {{"auto", true}, {"off", false}},
              "with --tolerance, tucker or pca, and i8: store slices of few facets as spots where that costs less");
  tool.option("--regions", values_.regions, "regions of the map along each axis")
      .range(1, 255)
      .defaultText("8 for cp, otherwise 1, or more for more than 65536 images");
  tool.option("--min-improvement", values_.min_improvement, "cp: end when a sweep improves the relative error by less")
      .range(0, 0.99);
  tool.option("--max-iterations", values_.max_iterations, "cp: sweeps at most").range(1, 1e6);
  tool.choice(
          "--keep-normals", keep_,
          {{"auto", KeepNormals::as_input}, {"none", KeepNormals::none}, {"i16", KeepNormals::i16}, {"f32", KeepNormals::f32}},
          "normals of the map in the asset, for footprints below the finest level; auto: those that the pyramid keeps, or "
          "those of --normals in 16 bits")
      .recordedIfGiven();
  tool.option("--normals", normals_,
              "asset of kind normals that the pyramid was made from, to keep its normals where the pyramid keeps none")
      .unrecorded();
  tool.addCheck([this] {
    if (normals_.empty()) return;
    if (keep_ == KeepNormals::none)
      throw Error(ErrorCode::usage, "cli.usage", "", "--normals", "gives normals, and --keep-normals none keeps none",
                  "leave one of them out");
    addInputs(tool_, normals_, UdimSets::taken);
  });
}

std::string CompressOptions::normalsOf(int tile) const {
  if (normals_.empty() || tile == 0) return normals_;
  if (!formats::isUdimPattern(normals_))
    throw Error(ErrorCode::usage, "udim.normals", normals_, "", "is one map, and a set has one for each tile",
                "name the maps by a pattern, too, such as name.<UDIM>.map.glint");
  return formats::udimFile(normals_, tile).string();
}

std::optional<formats::Asset> CompressOptions::openNormals(int tile) const {
  if (normals_.empty()) return {};
  return openInput(tool_, normalsOf(tile), UdimSets::taken);
}

std::optional<bake::NearNormalsData> CompressOptions::kept(const formats::Asset& asset, const std::string& path, int tile,
                                                           const std::optional<formats::Asset>& normals) const {
  if (asset.kind() != "ndf-pyramid") {
    if (keep_ == KeepNormals::i16 || keep_ == KeepNormals::f32 || normals)
      throw Error(ErrorCode::usage, "cli.usage", path, "",
                  "is of kind " + std::string(asset.kind()) + ", which keeps no normals",
                  "leave --keep-normals and --normals out");
    return {};
  }
  const auto& pyramid = asset.get<NdfPyramid>();
  if (normals) {
    const auto& map = normals->get<NormalMap>();
    api::requireSameMap(asset, path, pyramid.shape.width, pyramid.shape.height, map, normalsOf(tile));
    const bool floats = pyramid.near_normals && !pyramid.near_normals->coded();
    return keptNormals(tool_, map, keep_ != KeepNormals::as_input ? keep_ : floats ? KeepNormals::f32 : KeepNormals::i16);
  }
  if (pyramid.near_normals) {
    if (keep_ == KeepNormals::f32 && pyramid.near_normals->coded())
      throw Error(ErrorCode::usage, "cli.usage", path, "", "keeps normals in 16 bits, and --keep-normals f32 asks for more",
                  "add --normals with the asset that the pyramid was made from");
    return keptNormals(tool_, *pyramid.near_normals, keep_);
  }
  if (keep_ == KeepNormals::i16 || keep_ == KeepNormals::f32)
    throw Error(ErrorCode::usage, "cli.usage", path, "", "keeps no normals",
                "add --normals with the asset that the pyramid was made from");
  return {};
}

bake::NdfCpData compress(const NdfPyramid& pyramid, const std::vector<float>& masses, const CompressOptions& options,
                         bake::CompressionReport& report, Tool& tool) {
  bake::CompressionOptions values = options.values();
  values.image_masses = masses;
  return bake::compressPyramid(pyramid, values, &report, tool.progress("compress"));
}

nlohmann::json compressionJson(const bake::CompressionReport& report) {
  const auto level = [](const bake::CompressionLevelReport& l) {
    return nlohmann::json{
        {"slices", l.slices}, {"rel_l2", l.rel_l2}, {"seen", l.seen.seen}, {"seen_worst", l.seen.worst}, {"bias", l.seen.bias}};
  };
  nlohmann::json levels = nlohmann::json::array();
  for (const auto& l : report.levels) levels.push_back(level(l));
  return {{"total", level(report.total)},
          {"levels", levels},
          {"method", methodName(report.method)},
          {"coefficient_type", typeName(report.coefficient_type)},
          {"basis_bytes", report.basis_bytes},
          {"coefficient_bytes", report.coefficient_bytes},
          {"index_bytes", report.index_bytes},
          {"total_bytes", report.total_bytes},
          {"ratio_to_dense", report.ratio_to_dense},
          {"ratio_to_stored", report.ratio_to_stored},
          {"rank_histogram", report.rank_histogram},
          {"spot_slices", report.spot_slices},
          {"spots", report.spots},
          {"unscaled_images", report.unscaled_images}};
}

std::string compressionText(const bake::CompressionReport& report) {
  std::string text =
      format("%.2f MB, 1 : %.1f of the pyramid as stored, 1 : %.1f of dense images; %s, coefficients of type %s\n",
             static_cast<double>(report.total_bytes) / 1e6, report.ratio_to_stored, report.ratio_to_dense,
             methodName(report.method), typeName(report.coefficient_type));
  const auto errors = [](const bake::CompressionLevelReport& l) {
    return format("%llu slices, seen error %.4f (worst direction %.3f, bias %.4f), relative error %.4f\n",
                  static_cast<unsigned long long>(l.slices), l.seen.seen, l.seen.worst, l.seen.bias, l.rel_l2);
  };
  text += "all levels: " + errors(report.total);
  for (std::size_t l = 0; l < report.levels.size(); ++l) text += format("level %zu: ", l) + errors(report.levels[l]);
  return text;
}

}  // namespace glint::apps
