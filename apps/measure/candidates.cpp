#include "measure/candidates.h"

#include <algorithm>

namespace glint::apps {
namespace {

constexpr const char* kPyramid = "pyramid, stride 32";

Candidate compressed(const std::string& method, const std::string& setting, const std::vector<std::string>& flags) {
  std::vector<std::string> all = {"--method", method};
  all.insert(all.end(), flags.begin(), flags.end());
  return {method, setting, "glint-compress", all, kPyramid, true};
}

}  // namespace

std::vector<Candidate> benchCandidates(bool quick) {
  const std::vector<Candidate> defaults = {
      {"brute force", "", "", {}, "", false},
      {"moments", "finest level 1", "glint-moments", {}, "", false},
      {"bin map", "", "glint-binmap", {}, "", false},
      {"histograms", "9 x 32 bins, stride 8", "glint-sat", {}, "", false},
      {"pyramid", "stride 32", "glint-pyramid", {"--stride", "32"}, "", true},
      compressed("tucker", "tolerance 0.1", {"--tolerance", "0.1"}),
  };
  if (quick) return defaults;
  const std::vector<Candidate> sweep = {
      {"moments", "finest level 3", "glint-moments", {"--finest", "3"}, "", false},
      {"histograms", "18 x 64 bins, stride 16", "glint-sat", {"--bins", "18x64", "--stride", "16"}, "", false},
      {"histograms", "9 x 32 bins, stride 32", "glint-sat", {"--stride", "32"}, "", false},
      {"pyramid", "stride 16", "glint-pyramid", {"--stride", "16"}, "", true},
      {"pyramid", "stride 64", "glint-pyramid", {"--stride", "64"}, "", true},
      {"pyramid", "stride 32, overlap 1", "glint-pyramid", {"--stride", "32", "--overlap", "1"}, "", true},
      compressed("tucker", "tolerance 0.05", {"--tolerance", "0.05"}),
      compressed("tucker", "tolerance 0.2", {"--tolerance", "0.2"}),
      compressed("pca", "tolerance 0.1", {"--tolerance", "0.1"}),
      compressed("cp", "rank 16", {"--rank", "16"}),
      compressed("cp", "rank 32", {"--rank", "32"}),
  };
  std::vector<Candidate> all = defaults;
  all.insert(all.end(), sweep.begin(), sweep.end());
  return all;
}

std::vector<std::string> benchMethods() {
  std::vector<std::string> methods;
  for (const Candidate& c : benchCandidates(false))
    if (std::find(methods.begin(), methods.end(), c.method) == methods.end()) methods.push_back(c.method);
  return methods;
}

}  // namespace glint::apps
