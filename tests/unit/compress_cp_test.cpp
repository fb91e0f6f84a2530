#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "glint/bake/compressed/cp.h"
#include "unit/compress_fixture.h"
#include "unit/compress_reference.h"

namespace glint::bake::compress_cp_test {
namespace {

struct Tensor {
  int count = 0;
  std::vector<float> slices;  // [count][kSliceStride]

  explicit Tensor(int slice_count) : count(slice_count), slices(static_cast<std::size_t>(slice_count) * kSliceStride, 0.0f) {}

  double energy() const {
    double sum = 0;
    for (const float v : slices) sum += static_cast<double>(v) * v;
    return sum;
  }
};

Tensor randomTensor(int count, unsigned seed) {
  Tensor t(count);
  std::mt19937 random(seed);
  std::normal_distribution<float> gaussian;
  for (int s = 0; s < count; ++s)
    for (int p = 0; p < kBlockPixels; ++p) t.slices[s * kSliceStride + p] = gaussian(random);
  return t;
}

Tensor lowRankTensor(int count, int rank, unsigned seed) {
  Tensor t(count);
  std::mt19937 random(seed);
  std::normal_distribution<float> gaussian;
  for (int r = 0; r < rank; ++r) {
    float x[16], y[16];
    for (float& v : x) v = gaussian(random);
    for (float& v : y) v = gaussian(random);
    for (int s = 0; s < count; ++s) {
      const float z = gaussian(random);
      for (int p = 0; p < kBlockPixels; ++p) t.slices[s * kSliceStride + p] += z * y[p / 16] * x[p % 16];
    }
  }
  return t;
}

/// Lobes of a few pixels that come and go from slice to slice.
Tensor lobeTensor(int count, unsigned seed) {
  Tensor t(count);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::vector<Vec2> lobes(60);
  for (Vec2& l : lobes) l = {-1 + 2 * uniform(random), -1 + 2 * uniform(random)};
  for (int s = 0; s < count; ++s) {
    std::vector<float> image(kBlockPixels, 0.0f);
    for (std::size_t i = 0; i < lobes.size(); ++i) {
      const float phase = static_cast<float>(s) / static_cast<float>(count) - static_cast<float>(i) / 60;
      test::addLobe(image, kBlockSize, lobes[i], 0.1f, std::exp(-30 * phase * phase));
    }
    std::copy(image.begin(), image.end(), t.slices.begin() + s * kSliceStride);
  }
  return t;
}

CpFactors decompose(const Tensor& t, int rank, double min_improvement = 1e-4, bool through_gram = false) {
  TuckerAnalysis analysis;
  for (int first = 0; first < t.count; first += kPanelSlices)
    analysis.addMoments(t.slices.data() + first * kSliceStride, std::min(kPanelSlices, t.count - first));
  analysis.solveAxes();
  for (int first = 0; first < t.count; first += kPanelSlices)
    analysis.addEnergies(t.slices.data() + first * kSliceStride, std::min(kPanelSlices, t.count - first));
  CpTensor tensor{t.slices.data(), t.count, nullptr, t.energy()};
  std::vector<float> gram(through_gram ? kBlockPixels * kBlockPixels : 0);
  if (through_gram) {
    for (int s = 0; s < t.count; ++s)
      for (int p = 0; p < kBlockPixels; ++p)
        for (int q = 0; q < kBlockPixels; ++q)
          gram[p * kBlockPixels + q] += t.slices[s * kSliceStride + p] * t.slices[s * kSliceStride + q];
    tensor.slices = nullptr;
    tensor.gram = gram.data();
  }
  return decomposeCp(tensor, analysis.axes(), {rank, min_improvement, 500});
}

/// Squared error of the best third factor, in double.
double residual(const Tensor& t, const CpFactors& f) {
  std::vector<double> basis, slices;
  for (int r = 0; r < f.rank; ++r)
    for (int p = 0; p < kBlockPixels; ++p)
      basis.push_back(static_cast<double>(f.x[p % 16 * f.rank + r]) * f.y[p / 16 * f.rank + r]);
  for (int s = 0; s < t.count; ++s)
    for (int p = 0; p < kBlockPixels; ++p) slices.push_back(t.slices[s * kSliceStride + p]);
  return test::squaredResidual(basis, slices, kBlockPixels);
}

TEST(CompressCp, IsAsAccurateAsTextbookLeastSquares) {
  // Local minima differ by a little; the reference starts at random.
  constexpr double kMargin = 1.02;
  int checked = 0;
  for (const int rank : {4, 16, 32}) {
    for (const Tensor& t : {randomTensor(24, 1), lobeTensor(24, 2)}) {
      const double reference = test::referenceCp(t.slices.data(), t.count, kSliceStride, rank, 1e-4, 60, 7);
      const CpFactors f = decompose(t, rank);
      EXPECT_LE(std::sqrt(residual(t, f)), kMargin * std::sqrt(reference)) << rank << " case " << checked;
      ++checked;
    }
  }
}

TEST(CompressCp, FindsLowRankTensors) {
  for (const int rank : {1, 2, 4, 8}) {
    const Tensor t = lowRankTensor(40, rank, static_cast<unsigned>(rank));
    const CpFactors f = decompose(t, rank, 1e-7);
    EXPECT_LT(std::sqrt(residual(t, f) / t.energy()), 1e-3) << rank;
  }
}

TEST(CompressCp, ReportsTheErrorOfItsFactorsWithinTheRidge) {
  const Tensor t = lobeTensor(64, 3);
  const CpFactors f = decompose(t, 16);
  const double exact = residual(t, f);
  EXPECT_GE(f.error, exact * 0.999);
  EXPECT_LE(std::sqrt(f.error), 1.02 * std::sqrt(exact));
}

TEST(CompressCp, GivesTheSameErrorThroughTheGramMatrix) {
  const Tensor t = lobeTensor(100, 4);
  for (const int rank : {3, 16, 32}) {
    const CpFactors direct = decompose(t, rank);
    const CpFactors gram = decompose(t, rank, 1e-4, true);
    EXPECT_NEAR(std::sqrt(gram.error / direct.error), 1, 0.02) << rank;
  }
}

TEST(CompressCp, NeverGetsWorseWithMoreSweeps) {
  const Tensor t = randomTensor(30, 5);
  TuckerAnalysis analysis;
  analysis.addMoments(t.slices.data(), t.count);
  analysis.solveAxes();
  analysis.addEnergies(t.slices.data(), t.count);
  const CpTensor tensor{t.slices.data(), t.count, nullptr, t.energy()};
  for (const int rank : {32, 48, 96}) {
    double previous = t.energy();
    for (const int sweeps : {1, 2, 5, 10, 20, 40}) {
      const CpFactors f = decomposeCp(tensor, analysis.axes(), {rank, 0, sweeps});
      EXPECT_LE(f.error, previous * (1 + 1e-6)) << rank;
      EXPECT_TRUE(std::all_of(f.x.begin(), f.x.end(), [](float v) { return std::isfinite(v); }));
      previous = f.error;
    }
  }
}

TEST(CompressCp, CutsTheRankToWhatTheTensorHolds) {
  EXPECT_EQ(decompose(Tensor(5), 16).rank, 0);
  EXPECT_EQ(decompose(lowRankTensor(30, 1, 9), 16).rank, 1);
  const Tensor single = randomTensor(1, 6);
  const CpFactors f = decompose(single, 48);
  EXPECT_EQ(f.rank, 16);
  EXPECT_LT(std::sqrt(residual(single, f) / single.energy()), 2e-3);
}

TEST(TuckerAnalysis, GivesOrthonormalAxesThatHoldAllEnergy) {
  const Tensor t = lobeTensor(300, 8);
  TuckerAnalysis analysis;
  analysis.addMoments(t.slices.data(), kPanelSlices);
  analysis.addMoments(t.slices.data() + kPanelSlices * kSliceStride, t.count - kPanelSlices);
  analysis.solveAxes();
  analysis.addEnergies(t.slices.data(), kPanelSlices);
  analysis.addEnergies(t.slices.data() + kPanelSlices * kSliceStride, t.count - kPanelSlices);
  const TuckerAxes& axes = analysis.axes();
  for (const float* m : {axes.u, axes.v}) {
    for (int a = 0; a < 16; ++a) {
      for (int b = 0; b < 16; ++b) {
        double sum = 0;
        for (int i = 0; i < 16; ++i) sum += static_cast<double>(m[i * 16 + a]) * m[i * 16 + b];
        EXPECT_NEAR(sum, a == b, 1e-5);
      }
    }
  }
  double energy = 0;
  for (const auto& row : axes.energy)
    for (const double e : row) energy += e;
  EXPECT_NEAR(energy / t.energy(), 1, 1e-5);
}

}  // namespace
}  // namespace glint::bake::compress_cp_test
