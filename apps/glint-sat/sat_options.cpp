#include "glint-sat/sat_options.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/numbers.h"

namespace glint::apps {

SatOptions::SatOptions(Tool& tool) {
  tool.option("--bins", bins_, "rings of elevation x sectors of azimuth: 1 to 64 x 1 to 256, at most 2048 together");
  tool.option("--stride", values_.stride,
              "texels between the points of the table: bytes go down with its square, the time of a query goes up with it")
      .range(1, HistogramSat::kMaxStride);
  tool.addCheck([this] { readBins(); });
}

void SatOptions::readBins() {
  const bool two = parseProduct(bins_, values_.theta_bins, values_.phi_bins);
  if (two && values_.theta_bins >= 1 && values_.theta_bins <= HistogramSat::kMaxThetaBins && values_.phi_bins >= 1 &&
      values_.phi_bins <= HistogramSat::kMaxPhiBins && values_.theta_bins * values_.phi_bins <= HistogramSat::kMaxBins) {
    return;
  }
  throw Error(ErrorCode::usage, "option.range", {}, "--bins",
              two ? "'" + bins_ + "' is out of range" : "'" + bins_ + "' is not two numbers joined by x",
              "give 1 to 64 rings x 1 to 256 sectors, at most 2048 together, for example 9x32");
}

nlohmann::json satJson(const bake::HistogramSatData& sat) {
  const HistogramSat view = sat.view();
  return {{"bins", view.bin_count},
          {"directions", view.theta_bins * view.phi_bins},
          {"stride_texels", view.stride},
          {"coarse_stride_texels", view.coarse_stride},
          {"line_stride_texels", view.line_stride},
          {"size_bytes", sat.sizeBytes()},
          {"tables",
           {{"texels", view.texels.size_bytes()},
            {"sums", view.sums.size_bytes()},
            {"coarse_sums", view.coarse_sums.size_bytes()},
            {"row_sums", view.row_sums.size_bytes()},
            {"column_sums", view.column_sums.size_bytes()}}}};
}

std::string satText(const bake::HistogramSatData& sat) {
  const nlohmann::json json = satJson(sat);
  std::string text = fmt::format("{} of {} directions occur\n", json["bins"].get<int>(), json["directions"].get<int>());
  for (const auto& [name, bytes] : json["tables"].items())
    text += fmt::format("{:<12} {:>9.2f} MB\n", name, 1e-6 * bytes.get<double>());
  return text + fmt::format("{:<12} {:>9.2f} MB\n", "total", 1e-6 * json["size_bytes"].get<double>());
}

}  // namespace glint::apps
