#include "glint-plan/plan_candidates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "glint/bake/pyramid/asked_levels.h"
#include "glint/model/ndf_pyramid.h"
#include "measure/light_blur.h"

namespace glint::apps {
namespace {

/// First level of moments that answers a footprint as it is: level 1 does from 1.2 texels on, and each level from twice as many.
int finestMoments(double smallest, int width, int height) {
  constexpr double kSmallestOfLevel1 = 1.2;
  const int last = static_cast<int>(std::log2(std::min(width, height)));
  const double level = std::floor(std::log2(std::max(smallest, kSmallestOfLevel1 / 2) / kSmallestOfLevel1)) + 1;
  return std::clamp(static_cast<int>(level), 0, last);
}

/// Whole texels between images such that level 0 answers the smallest footprint.
int strideOf(double smallest, int width, int height) {
  return std::min(bake::strideFor(smallest), std::max(2, std::min(width, height) / 4));
}

/// Levels whose images are as large as the largest footprint needs.
int levelsOf(double largest, int stride, int width, int height) {
  const int most = std::max(1, 1 + static_cast<int>(std::log2(std::min(width, height) / static_cast<double>(stride))));
  return std::min(bake::levelsFor(largest, stride), most);
}

/// Pixels of images along each axis: 256, and fewer where the facets or the light are so wide that fewer may do.
std::vector<int> resolutionsOf(const MapQuestion& question) {
  constexpr int kUsual = 256, kFewest = 32, kBlock = 16;
  constexpr double kPixelsOfSigma = 1.5, kPixelsOfLight = 2;
  const double pixels = std::min(2 * kPixelsOfSigma / double{question.sigma_r},
                                 2 * kPixelsOfLight / std::max(halfVectorsOfLight(question.light_deg), 1e-9));
  const int fewest = static_cast<int>(std::clamp(kBlock * std::ceil(pixels / kBlock), double{kFewest}, double{kUsual}));
  std::vector<int> resolutions;
  for (int resolution = fewest; resolution < kUsual; resolution *= 2) resolutions.push_back(resolution);
  resolutions.push_back(kUsual);
  return resolutions;
}

void addPyramids(const MapQuestion& question, int width, int height, std::vector<Candidate>& all) {
  const int stride = strideOf(question.footprints.smallest, width, height);
  const bool needs_texels = question.footprints.smallest < double{kFootprintPerStride} * stride;
  const std::string levels = std::to_string(levelsOf(question.footprints.largest, stride, width, height));
  for (const int pixels : resolutionsOf(question)) {
    const std::string resolution = std::to_string(pixels);
    const std::string images = fmt::format("stride {}, {} pixels", stride, resolution);
    const Candidate pyramid = {"pyramid",
                               images,
                               "glint-pyramid",
                               {"--stride", std::to_string(stride), "--levels", levels, "--resolution", resolution, "--sigma-r",
                                fmt::format("{:.9g}", question.sigma_r)},
                               "",
                               needs_texels};
    all.push_back(pyramid);
    const auto compressed = [&](const char* method, const char* option, const char* value) {
      all.push_back({method,
                     fmt::format("{} {} of {}", option + 2, value, images),
                     "glint-compress",
                     {"--method", method, option, value},
                     pyramid.name(),
                     needs_texels});
    };
    // Steps of a square root of 2, so that the next finer one takes little more.
    for (const char* method : {"tucker", "pca"})
      for (const char* tolerance : {"0.56", "0.4", "0.28", "0.2", "0.14", "0.1", "0.07", "0.05"})
        compressed(method, "--tolerance", tolerance);
    for (const char* rank : {"16", "32"}) compressed("cp", "--rank", rank);
  }
}

}  // namespace

std::vector<Candidate> planCandidates(const MapQuestion& question, int width, int height) {
  std::vector<Candidate> all = {{"brute force", "", "", {}, "", false}};
  const int finest = finestMoments(question.footprints.smallest, width, height);
  all.push_back(
      {"moments", fmt::format("finest level {}", finest), "glint-moments", {"--finest", std::to_string(finest)}, "", false});
  all.push_back({"bin map",
                 "",
                 "glint-binmap",
                 {"--alpha", fmt::format("{:.9g}", std::numbers::sqrt2_v<float> * question.sigma_r)},
                 "",
                 false});
  for (const auto& [bins, text] : {std::pair{"9x32", "9 x 32 bins"}, std::pair{"18x64", "18 x 64 bins"}}) {
    for (const char* stride : {"8", "32"})
      all.push_back({"histograms",
                     fmt::format("{}, stride {}", text, stride),
                     "glint-sat",
                     {"--bins", bins, "--stride", stride},
                     "",
                     false});
  }
  addPyramids(question, width, height, all);
  return all;
}

std::vector<Candidate> paperCandidates(const MapQuestion& question) {
  constexpr int kStride = 32;
  const bool needs_texels = question.footprints.smallest < double{kFootprintPerStride} * kStride;
  const Candidate pyramid = {"pyramid",
                             "as in the paper",
                             "glint-pyramid",
                             {"--stride", std::to_string(kStride), "--overlap", "1", "--resolution", "256", "--sigma-r",
                              fmt::format("{:.9g}", question.sigma_r)},
                             "",
                             needs_texels};
  return {
      pyramid,
      {"cp", "rank 16, as in the paper", "glint-compress", {"--method", "cp", "--rank", "16"}, pyramid.name(), needs_texels}};
}

const Candidate* sourceOf(const std::vector<Candidate>& all, const Candidate& candidate) {
  if (candidate.source.empty()) return nullptr;
  const auto found = std::find_if(all.begin(), all.end(), [&](const Candidate& c) { return c.name() == candidate.source; });
  return found == all.end() ? nullptr : &*found;
}

std::string flagOf(const Candidate& candidate, const std::string& name) {
  const auto found = std::find(candidate.flags.begin(), candidate.flags.end(), name);
  return found == candidate.flags.end() ? "" : *(found + 1);
}

double toleranceOf(const Candidate& candidate) {
  const std::string text = flagOf(candidate, "--tolerance");
  return text.empty() ? 0 : std::stod(text);
}

}  // namespace glint::apps
