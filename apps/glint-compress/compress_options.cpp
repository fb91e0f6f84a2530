#include "glint-compress/compress_options.h"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace glint::apps {
namespace {

template <class... Values>
std::string format(const char* pattern, Values... values) {
  char line[200];
  std::snprintf(line, sizeof line, pattern, values...);
  return line;
}

}  // namespace

CompressOptions::CompressOptions(Tool& tool) {
  tool.choice("--method", values_.method,
              {{"cp", CompressionMethod::cp}, {"tucker", CompressionMethod::tucker}, {"pca", CompressionMethod::pca}},
              "decomposition of the blocks: canonical polyadic, Tucker-2 or principal components");
  const Option& rank = tool.option("--rank", values_.rank, "columns of every cluster").range(1, 256);
  tool.option("--tolerance", values_.tolerance,
              "instead of --rank: relative error of all images together (tucker: also of level 0, of level 1 and of the "
              "coarser ones); columns and bits of every cluster are chosen to meet it in the fewest bytes")
      .range(1e-6, 0.99)
      .excludes(rank)
      .defaultText("none");
  tool.choice("--quantize", values_.coefficient_type,
              {{"f32", CoefficientType::f32}, {"f16", CoefficientType::f16}, {"i8", CoefficientType::i8}},
              "type of the coefficients");
  tool.choice("--spots", values_.spots, {{"auto", true}, {"off", false}},
              "with --tolerance, tucker or pca, and i8: store slices of few facets as spots where that costs less");
  tool.option("--regions", values_.regions, "regions of the map along each axis")
      .range(1, 255)
      .defaultText("8 for cp, otherwise 1");
  tool.option("--min-improvement", values_.min_improvement, "cp: end when a sweep improves the relative error by less")
      .range(0, 0.99);
  tool.option("--max-iterations", values_.max_iterations, "cp: sweeps at most").range(1, 1e6);
}

nlohmann::json compressionJson(const bake::CompressionReport& report) {
  const auto level = [](const bake::CompressionLevelReport& l) {
    return nlohmann::json{{"slices", l.slices}, {"rel_l2", l.rel_l2}};
  };
  nlohmann::json levels = nlohmann::json::array();
  for (const auto& l : report.levels) levels.push_back(level(l));
  return {{"total", level(report.total)},
          {"levels", levels},
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
      format("%.2f MB, 1 : %.1f of the pyramid as stored, 1 : %.1f of dense images; relative error %.4f\n",
             static_cast<double>(report.total_bytes) / 1e6, report.ratio_to_stored, report.ratio_to_dense, report.total.rel_l2);
  for (std::size_t l = 0; l < report.levels.size(); ++l)
    text += format("level %zu: %llu slices, relative error %.4f\n", l, static_cast<unsigned long long>(report.levels[l].slices),
                   report.levels[l].rel_l2);
  return text;
}

}  // namespace glint::apps
