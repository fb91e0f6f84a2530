#pragma once

// What tests of the C interface share: files of every kind, handles that close themselves, and random queries.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <type_traits>
#include <vector>

#include "glint.h"
#include "glint/api/ndf_models.h"
#include "glint/formats/asset_writer.h"
#include "glint/model/slope_sums.h"
#include "support/sample_assets.h"
#include "support/temp_folder.h"

namespace glint::test {

inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
inline constexpr int kSize = 64;

// Small assets of the kinds that models answer. A kind that has none does not compile.

inline void writeSample(std::type_identity<NormalMap>, const std::string& path) {
  formats::writeAsset(path, sampleNormals(kSize, kSize).map, sampleProvenance());
}
inline void writeSample(std::type_identity<NdfPyramid>, const std::string& path) {
  formats::writeAsset(path, samplePyramid(kSize, BlockPrecision::f16).pyramid, sampleProvenance());
}
inline void writeSample(std::type_identity<NdfCp>, const std::string& path) {
  formats::writeAsset(path, sampleNdfCp(kSize, CompressionMethod::cp, CoefficientType::i8).ndf, sampleProvenance());
}
inline void writeSample(std::type_identity<BinMap>, const std::string& path) {
  formats::writeAsset(path, sampleBinMap(kSize, kSize).map, sampleProvenance());
}
inline void writeSample(std::type_identity<HistogramSat>, const std::string& path) {
  formats::writeAsset(path, sampleHistograms(kSize, kSize).sat, sampleProvenance());
}
inline void writeSample(std::type_identity<WavePyramid>, const std::string& path) {
  formats::writeAsset(path, sampleWavePyramid(kSize, WaveChannels::xyz, BlockPrecision::f16).wave, sampleProvenance());
}
inline void writeSample(std::type_identity<WaveCp>, const std::string& path) {
  formats::writeAsset(path, sampleWaveCp(kSize, WaveChannels::xyz).wave, sampleProvenance());
}
inline void writeSample(std::type_identity<SlopeMoments>, const std::string& path) {
  formats::writeAsset(path, sampleSlopeMoments(kSize, kSize).moments, sampleProvenance());
}

inline void writeSample(std::type_identity<TinyExample>, const std::string& path) {
  formats::writeAsset(path, sampleTinyExample(kSize, TinyMode::tiled).example, sampleProvenance());
}

inline void writeSample(std::type_identity<WangTiles>, const std::string& path) {
  // Sixteen times one tile of many normals.
  SampleWangTiles sample = sampleWangTiles();
  const SampleNormals tile = sampleNormals(kSize, kSize, false);
  sample.normals.clear();
  for (int k = 0; k < sample.tiles.tile_count; ++k)
    sample.normals.insert(sample.normals.end(), tile.normals.begin(), tile.normals.end());
  sample.tiles.size = kSize;
  sample.tiles.normals = sample.normals;
  sample.tiles.slopes =
      slopeSums(sample.normals.data(), sample.normals.size()).moments(static_cast<double>(sample.normals.size()));
  formats::writeAsset(path, sample.tiles, sampleProvenance());
}
inline void writeSample(std::type_identity<WangPyramid>, const std::string& path) {
  formats::writeAsset(path, sampleWangPyramid().asset, sampleProvenance());
}
inline void writeSample(std::type_identity<WangCp>, const std::string& path) {
  formats::writeAsset(path, sampleWangCp().asset, sampleProvenance());
}

/// Files of every kind that a model answers, and of some others.
class Assets {
 public:
  Assets() {
    api::NdfModels::forEach([&]<class Model>(std::type_identity<Model>) {
      writeSample(std::type_identity<api::AssetOf<Model>>{}, path(std::string(api::NdfTraits<Model>::kKind)));
    });
    formats::writeAsset(path("heights"), sampleHeights(kSize, kSize).map, sampleProvenance());
    formats::writeAsset(path("displacement"), sampleDisplacement(kSize, true).displacement, sampleProvenance());
  }
  std::string path(const std::string& kind) const { return (folder_.path() / (kind + ".glint")).string(); }

 private:
  TempFolder folder_;
};

inline const Assets& assets() {
  static const Assets files;
  return files;
}

struct Closer {
  void operator()(glint_ndf* ndf) const { glint_ndf_close(ndf); }
};
using Handle = std::unique_ptr<glint_ndf, Closer>;

inline Handle openHandle(const std::string& kind, const glint_open_options* options = nullptr) {
  glint_ndf* ndf = nullptr;
  EXPECT_EQ(glint_ndf_open(assets().path(kind).c_str(), options, &ndf), GLINT_OK) << glint_error_message();
  return Handle(ndf);
}

template <class... Models>
constexpr std::array<const char*, sizeof...(Models)> kindsOf(api::NdfModelList<Models...>) {
  return {api::NdfTraits<Models>::kKind.data()...};
}
/// The kinds that models answer.
inline constexpr auto kKinds = kindsOf(api::NdfModels{});

/// Random queries of every size, with a few that are degenerate.
struct Queries {
  explicit Queries(std::size_t count, unsigned seed = 1) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(0, 1);
    for (std::size_t k = 0; k < count; ++k) {
      u.push_back(unit(random) * 3 - 1);
      v.push_back(unit(random));
      sigma.push_back(std::exp2(unit(random) * 7 - 2));
      hx.push_back(unit(random) - 0.5f);
      hy.push_back(unit(random) - 0.5f);
      if (k % 23 == 5) u.back() = kNan;
      if (k % 29 == 7) sigma.back() = k % 2 ? kNan : 0;
      if (k % 31 == 3) hx.back() = k % 2 ? kNan : 1.5f;
      if (k % 37 == 11) sigma.back() = k % 2 ? 1e18f : std::numeric_limits<float>::infinity();
      if (k % 41 == 13) u.back() = k % 2 ? -1e9f : 1e30f;
    }
  }
  std::vector<float> u, v, sigma, hx, hy;
};

inline glint_floats contiguous(const std::vector<float>& values) { return {values.data(), sizeof(float)}; }

inline glint_footprints isotropic(const Queries& q) {
  glint_footprints p = {};
  p.u = contiguous(q.u);
  p.v = contiguous(q.v);
  p.sigma = contiguous(q.sigma);
  return p;
}

}  // namespace glint::test
