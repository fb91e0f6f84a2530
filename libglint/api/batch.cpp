#include "glint/api/batch.h"

#include <algorithm>
#include <type_traits>

#include "glint/api/batch_columns.h"
#include "glint/api/batch_slices.h"
#include "glint/api/multiversion.h"
#include "glint/model/packed_ndf.h"
#include "glint/query/bits.h"

namespace glint::api {
namespace {

constexpr int kSlices = PyramidSlices::kMost;

/// Where the slices of a chunk are stored. Nothing branches on what is stored: that cannot be predicted.
class PyramidChunk {
 public:
  explicit PyramidChunk(const NdfPyramid& pyramid)
      : pyramid_(pyramid),
        words_(static_cast<unsigned>(pyramid.shape.maskWords())),
        pixel_shift_(pyramid.precision == BlockPrecision::f16 ? 1 : 2) {
    for (int l = 0; l < pyramid.shape.level_count; ++l) {
      const PyramidLevel& level = pyramid.levels[l];
      levels_[l] = {level.masks.data(), level.mask_ranks.data(), static_cast<const char*>(level.pixels)};
      // Slices without a pixel read the first one of their level; a level may have none.
      if (level.block_means.empty()) levels_[l].pixels = reinterpret_cast<const char*>(&kZero);
    }
  }

  void prefetchMasks(const SliceChunk& chunk) const {
    for (int k = 0; k < kChunk; ++k) {
      for (int j = 0; j < kSlices; ++j) {
        const Level& level = levels_[chunk.levels[j / 4][k]];
        const std::size_t word = static_cast<std::size_t>(chunk.images[j][k]) * words_ + chunk.blocks[k] / 64;
        prefetch(level.masks + word);
        if (j % 2 == 0) prefetch(level.mask_ranks + word);
      }
    }
  }

  /// Finds every pixel, and gives slices that have none weight 0.
  void findPixels(SliceChunk& chunk) {
    for (int k = 0; k < kChunk; ++k) {
      const unsigned word = static_cast<unsigned>(chunk.blocks[k]) / 64, bit = static_cast<unsigned>(chunk.blocks[k]) % 64;
      for (int step = 0; step < 2; ++step) {
        const Level level = levels_[chunk.levels[step][k]];
        for (int j = 4 * step; j < 4 * step + 4; ++j) {
          const std::size_t at = static_cast<std::size_t>(chunk.images[j][k]) * words_ + word;
          const BitRank rank(level.masks[at], bit);
          const std::uint64_t stored = level.mask_ranks[at] + rank.below;
          const std::uint64_t pixel = (stored * kBlockPixels + static_cast<std::uint64_t>(chunk.pixels[k])) & rank.kept;
          chunk.weights[j][k] = keepIf(rank.kept, chunk.weights[j][k]);
          places_[j][k] = level.pixels + (pixel << pixel_shift_);
          prefetch(places_[j][k]);
        }
      }
    }
  }

  /// As PyramidNdf adds up: the corners of a level first.
  void addUp(const SliceChunk& chunk, float* sums) const {
    for (int step = 0; step < 2; ++step) {
      alignas(64) float products[4][kChunk];
      for (int corner = 0; corner < 4; ++corner) {
        const int j = 4 * step + corner;
        pyramid_.precision == BlockPrecision::f16 ? weighHalves(chunk.weights[j], places_[j], products[corner])
                                                  : weighFloats(chunk.weights[j], places_[j], products[corner]);
      }
      for (int k = 0; k < kChunk; ++k) sums[k] += (products[0][k] + products[2][k]) + (products[1][k] + products[3][k]);
    }
  }

 private:
  static constexpr float kZero = 0;

  struct Level {
    const std::uint64_t* masks;
    const std::uint32_t* mask_ranks;
    const char* pixels;
  };

  static void weighHalves(const float* weights, const char* const* places, float* products) {
    alignas(64) std::uint16_t halves[kChunk];
    for (int k = 0; k < kChunk; ++k) halves[k] = *reinterpret_cast<const std::uint16_t*>(places[k]);
    for (int k = 0; k < kChunk; ++k) products[k] = weights[k] * halfToFloat(halves[k]);
  }

  static void weighFloats(const float* weights, const char* const* places, float* products) {
    for (int k = 0; k < kChunk; ++k) {
      // Values of a file are not checked: a slice that does not count must not bring an infinity.
      const float value = weights[k] * *reinterpret_cast<const float*>(places[k]);
      products[k] = weights[k] > 0 ? value : 0.0f;
    }
  }

  const NdfPyramid& pyramid_;
  const unsigned words_;
  const int pixel_shift_;
  Level levels_[kMaxPyramidLevels];
  const char* places_[kSlices][kChunk];
};

GLINT_API_MULTIVERSION void findPixels(PyramidChunk& places, SliceChunk& chunk) { places.findPixels(chunk); }

GLINT_API_MULTIVERSION void addUpPixels(const PyramidChunk& places, const SliceChunk& chunk, float* sums) {
  places.addUp(chunk, sums);
}

bool hasWideKernels() {
#if defined(GLINT_WIDE_KERNELS)
  static const bool supported = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("f16c");
  return supported;
#else
  return false;
#endif
}

/// The same for compressed images: clusters and rows of coefficients.
class CompressedChunk {
 public:
  explicit CompressedChunk(const CompressedNdf& ndf) : ndf_(ndf) {}

  void findClusters(SliceChunk& chunk) {
    for (int k = 0; k < kChunk; ++k) {
      for (int j = 0; j < kSlices; ++j) {
        const std::uint32_t image = ndf_.first_image[chunk.levels[j / 4][k]] + chunk.images[j][k];
        const std::uint16_t place = ndf_.block_places.data()[chunk.blocks[k]];
        if (place == kNoBlockPlace) {
          chunk.weights[j][k] = 0;
          continue;
        }
        const std::size_t cluster =
            std::size_t{ndf_.image_regions.data()[image]} * static_cast<std::size_t>(ndf_.places) + place;
        slots_[j][k] = ndf_.image_slots.data()[image];
        clusters_[j][k] = static_cast<std::uint32_t>(cluster);
        const std::size_t word = ndf_.clusters.data()[cluster].first_word + slots_[j][k] / 64u;
        prefetch(ndf_.masks.data() + word);
        prefetch(ndf_.mask_ranks.data() + word);
        chunk.weights[j][k] *= ndf_.density_scales.data()[image];
      }
    }
  }

  void findRows(SliceChunk& chunk) {
    const std::size_t bytes = static_cast<std::size_t>(coefficientBytes(ndf_.coefficient_type));
    for (int k = 0; k < kChunk; ++k) {
      std::uint32_t previous = ~std::uint32_t{0};
      for (int j = 0; j < kSlices; ++j) {
        if (!(chunk.weights[j][k] > 0)) continue;
        const std::uint32_t at = clusters_[j][k];
        const NdfCluster& cluster = ndf_.clusters.data()[at];
        const std::size_t word = cluster.first_word + slots_[j][k] / 64u;
        const std::uint64_t mask = ndf_.masks.data()[word], bit = std::uint64_t{1} << (slots_[j][k] % 64u);
        if ((mask & bit) == 0) {
          chunk.weights[j][k] = 0;
          continue;
        }
        slices_[j][k] = ndf_.mask_ranks.data()[word] + static_cast<std::uint32_t>(setBits(mask & (bit - 1)));
        const std::uint64_t row = cluster.columns > 0 ? slices_[j][k] * static_cast<std::uint64_t>(rowElements(cluster))
                                                      : spotCountsOffset(cluster.slice_count) + slices_[j][k];
        prefetch(static_cast<const char*>(ndf_.coefficients) + (cluster.first_coefficient + row) * bytes);
        if (at == previous) continue;
        previous = at;
        if (cluster.columns == 0) continue;
        prefetch(ndf_.scales.data() + cluster.first_scale);
        prefetch(ndf_.scales.data() + cluster.first_scale + cluster.columns - 1);
        prefetchBasis(cluster, chunk.pixels[k]);
      }
    }
  }

  /// As CpNdf::density: slices of the same cluster, as those of neighbours mostly are, share its projection.
  template <class Basis, class Coefficient>
  void addUp(const SliceChunk& chunk, int count, float* sums) const {
    const ClusterReader<Basis, Coefficient> reader(ndf_);
    alignas(64) float projection[ColumnLayout::kMost];
    for (int k = 0; k < count; ++k) {
      float sum = 0;
      unsigned left = 0;  // slices that are still to be added
      for (int j = 0; j < kSlices; ++j) left |= chunk.weights[j][k] > 0 ? 1u << j : 0u;
      while (left != 0) {
        const std::uint32_t at = clusters_[lowestBit(left)][k];
        const NdfCluster& cluster = ndf_.clusters.data()[at];
        const ColumnLayout layout(cluster);
        const int x = chunk.pixels[k] % kBlockSize, y = chunk.pixels[k] / kBlockSize;
        if (cluster.columns > 0) project<Basis>(reader, cluster, layout, x, y, projection);
        for (int j = lowestBit(left); j < kSlices; ++j) {
          if (!(left >> j & 1) || clusters_[j][k] != at) continue;
          left &= ~(1u << j);
          const float value = cluster.columns > 0
                                  ? dot<Coefficient>(reader, projection, layout, reader.row(cluster, slices_[j][k]))
                                  : spotsAt(SpotProfile(ndf_), spotsOf(ndf_, cluster, slices_[j][k]), x, y);
          sum += chunk.weights[j][k] * std::max(0.0f, value);
        }
      }
      sums[k] = sum;
    }
  }

 private:
  template <class Basis, class Reader>
  void project(const Reader& reader, const NdfCluster& cluster, const ColumnLayout& layout, int x, int y,
               float* projection) const {
    if constexpr (!std::is_same_v<Basis, std::int32_t>) {
      if (wide_ && ndf_.method == CompressionMethod::cp && cluster.narrow_columns == 0) {
        const Basis* basis = static_cast<const Basis*>(ndf_.basis) + cluster.first_basis;
        return projectColumns(basis, cluster.columns, x, y, ndf_.scales.data() + cluster.first_scale, projection);
      }
    }
    reader.pixel(cluster, layout, x, y, projection);
  }

  template <class Coefficient, class Reader>
  float dot(const Reader& reader, const float* projection, const ColumnLayout& layout, const Coefficient* row) const {
    return wide_ && layout.half == 0 ? dotColumns(projection, row, layout.low()) : reader.dot(projection, layout, row);
  }

  void prefetchBasis(const NdfCluster& cluster, int pixel) const {
    const std::size_t bytes = static_cast<std::size_t>(basisBytes(ndf_.method, ndf_.coefficient_type));
    const char* basis = static_cast<const char*>(ndf_.basis) + cluster.first_basis * bytes;
    const std::size_t x = static_cast<std::size_t>(pixel % kBlockSize), y = static_cast<std::size_t>(pixel / kBlockSize);
    if (ndf_.method == CompressionMethod::pca) {
      prefetch(basis + static_cast<std::size_t>(pixel) * cluster.columns * bytes);
      return;
    }
    const bool cp = ndf_.method == CompressionMethod::cp;
    const std::size_t rank_x = cp ? cluster.columns : cluster.rank_x, rank_y = cp ? cluster.columns : cluster.rank_y;
    // A value is the difference of two rows of prefix sums.
    const char* along_x = basis + x * rank_x * bytes;
    const char* along_y = basis + (kBlockSize * rank_x + y * rank_y) * bytes;
    prefetch(along_x - (x > 0 ? rank_x * bytes : 0));
    prefetch(along_x + rank_x * bytes - 1);
    prefetch(along_y - (y > 0 ? rank_y * bytes : 0));
    prefetch(along_y + rank_y * bytes - 1);
  }

  const CompressedNdf& ndf_;
  const bool wide_ = hasWideKernels();
  std::uint32_t slices_[kSlices][kChunk];  ///< in their clusters
  std::uint32_t clusters_[kSlices][kChunk];
  std::uint16_t slots_[kSlices][kChunk];
};

void addUpRows(const CompressedNdf& ndf, const CompressedChunk& places, const SliceChunk& chunk, int count, float* sums) {
  const bool pca = ndf.method == CompressionMethod::pca;
  switch (ndf.coefficient_type) {
    case CoefficientType::i8:
      pca ? places.addUp<std::int32_t, std::int8_t>(chunk, count, sums)
          : places.addUp<std::int16_t, std::int8_t>(chunk, count, sums);
      break;
    case CoefficientType::f16:
      pca ? places.addUp<std::int32_t, std::uint16_t>(chunk, count, sums)
          : places.addUp<std::int16_t, std::uint16_t>(chunk, count, sums);
      break;
    case CoefficientType::f32:
      places.addUp<float, float>(chunk, count, sums);
      break;
  }
}

/// The steps of a chunk of densities: `begin` asks the memory for the index, `find` reads it and asks for the values, `finish` adds these
/// up.
struct PyramidSteps {
  explicit PyramidSteps(const PyramidNdf& model) : places(model.pyramid()), scale(model.pyramid().value_scale) {}
  void begin(SliceChunk& chunk) { places.prefetchMasks(chunk); }
  void find(SliceChunk& chunk) { findPixels(places, chunk); }
  void finish(const SliceChunk& chunk, int, float* sums) const {
    addUpPixels(places, chunk, sums);
    for (int k = 0; k < kChunk; ++k) sums[k] *= scale;
  }
  PyramidChunk places;
  float scale;
};

struct CompressedSteps {
  explicit CompressedSteps(const CpNdf& model) : ndf(model.compressed()), places(ndf) {}
  void begin(SliceChunk& chunk) { places.findClusters(chunk); }
  void find(SliceChunk& chunk) { places.findRows(chunk); }
  void finish(const SliceChunk& chunk, int count, float* sums) const { addUpRows(ndf, places, chunk, count, sums); }
  const CompressedNdf& ndf;
  CompressedChunk places;
};

/// Chunks go through their steps one behind the other, so that what a step asks the memory for has the time of another chunk's to come.
template <class Steps, class Model>
void pyramidDensities(const Model& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& halves,
                      float* out) {
  struct Stage {
    SliceChunk chunk;
    Steps steps;
  };
  Stage stages[3] = {{{}, Steps(model)}, {{}, Steps(model)}, {{}, Steps(model)}};
  const std::size_t chunks = (count + kChunk - 1) / kChunk;
  const auto lanesOf = [&](std::size_t k) { return static_cast<int>(std::min(count - k * kChunk, std::size_t{kChunk})); };
  for (std::size_t step = 0; step < chunks + 2; ++step) {
    if (step < chunks) {
      Stage& stage = stages[step % 3];
      selectChunk(model.shape(), model.chooser(), footprints, halves, step * kChunk, lanesOf(step), stage.chunk);
      stage.steps.begin(stage.chunk);
    }
    if (step >= 1 && step - 1 < chunks) {
      Stage& stage = stages[(step - 1) % 3];
      stage.steps.find(stage.chunk);
    }
    if (step < 2) continue;
    const Stage& stage = stages[(step - 2) % 3];
    const int lanes = lanesOf(step - 2);
    alignas(64) float sums[kChunk] = {};
    stage.steps.finish(stage.chunk, lanes, sums);
    for (int k = 0; k < lanes; ++k) {
      const std::size_t at = (step - 2) * kChunk + static_cast<std::size_t>(k);
      const bool from_texels = model.hasNormals() && stage.chunk.below[k] != 0;
      out[at] = from_texels ? model.density(footprints[at], halves[at]) : stage.chunk.inside[k] != 0 ? sums[k] : 0.0f;
    }
  }
}

void modelDensities(const PyramidNdf& model, std::size_t count, const FootprintArrays& footprints,
                    const HalfVectorArrays& halves, float* out) {
  pyramidDensities<PyramidSteps>(model, count, footprints, halves, out);
}

void modelDensities(const CpNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& halves,
                    float* out) {
  pyramidDensities<CompressedSteps>(model, count, footprints, halves, out);
}

/// Models that have no way of their own are asked one by one.
template <class Model>
void modelDensities(const Model& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& halves,
                    float* out) {
  for (std::size_t k = 0; k < count; ++k) out[k] = model.density(footprints[k], halves[k]);
}

/// A mean is long work next to its cache misses, and reads many lines: few are asked ahead.
constexpr int kMeansAhead = 4;
constexpr int kSamplesAhead = 16;

void modelMeans(const PyramidNdf& model, std::size_t count, const FootprintArrays& footprints, const RangeArrays& ranges,
                float* out) {
  for (std::size_t first = 0; first < count; first += kMeansAhead) {
    const int lanes = static_cast<int>(std::min(count - first, static_cast<std::size_t>(kMeansAhead)));
    PyramidSlices chosen[kMeansAhead];
    for (int k = 0; k < lanes; ++k) {
      chosen[k] = model.chooseSlices(footprints[first + static_cast<std::size_t>(k)]);
      model.prefetchIndex(chosen[k]);
    }
    for (int k = 0; k < lanes; ++k) model.prefetchMean(chosen[k], ranges[first + static_cast<std::size_t>(k)]);
    for (int k = 0; k < lanes; ++k) {
      const std::size_t at = first + static_cast<std::size_t>(k);
      out[at] = model.fromTexels(footprints[at]) ? model.mean(footprints[at], ranges[at]) : model.mean(chosen[k], ranges[at]);
    }
  }
}

void modelSamples(const PyramidNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& xi,
                  const SampleArrays& out) {
  for (std::size_t first = 0; first < count; first += kSamplesAhead) {
    const int lanes = static_cast<int>(std::min(count - first, static_cast<std::size_t>(kSamplesAhead)));
    PyramidNdf::Draw draws[kSamplesAhead];
    for (int k = 0; k < lanes; ++k) {
      const std::size_t at = first + static_cast<std::size_t>(k);
      draws[k] = model.chooseImage(footprints[at], xi[at]);
    }
    for (int k = 0; k < lanes; ++k) model.findBlocks(draws[k]);
    for (int k = 0; k < lanes; ++k) model.chooseBlock(draws[k]);
    for (int k = 0; k < lanes; ++k) model.choosePixel(draws[k]);
    for (int k = 0; k < lanes; ++k) {
      const std::size_t at = first + static_cast<std::size_t>(k);
      out.set(at, model.fromTexels(footprints[at]) ? model.sample(footprints[at], xi[at]) : model.finish(draws[k]));
    }
  }
}

template <class Model>
void modelMeans(const Model& model, std::size_t count, const FootprintArrays& footprints, const RangeArrays& ranges,
                float* out) {
  for (std::size_t k = 0; k < count; ++k) out[k] = model.mean(footprints[k], ranges[k]);
}

template <class Model>
void modelSamples(const Model& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& xi,
                  const SampleArrays& out) {
  for (std::size_t k = 0; k < count; ++k) out.set(k, model.sample(footprints[k], xi[k]));
}

}  // namespace

void densities(const AnyNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& halves,
               float* out) {
  std::visit([&](const auto& m) { modelDensities(m, count, footprints, halves, out); }, model);
}

void means(const AnyNdf& model, std::size_t count, const FootprintArrays& footprints, const RangeArrays& ranges, float* out) {
  std::visit([&](const auto& m) { modelMeans(m, count, footprints, ranges, out); }, model);
}

void samples(const AnyNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& xi,
             const SampleArrays& out) {
  std::visit([&](const auto& m) { modelSamples(m, count, footprints, xi, out); }, model);
}

}  // namespace glint::api
