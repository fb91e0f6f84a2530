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

/// Where the slices of a chunk are stored. Every step reads what the step before has asked the memory for, so that the misses of a
/// whole chunk are under way together. Nothing branches on what is stored: that cannot be predicted.
class PyramidChunk {
 public:
  explicit PyramidChunk(const NdfPyramid& pyramid)
      : pyramid_(pyramid), words_(pyramid.shape.maskWords()), pixel_shift_(pyramid.precision == BlockPrecision::f16 ? 1 : 2) {
    for (int l = 0; l < pyramid.shape.level_count; ++l) {
      const PyramidLevel& level = pyramid.levels[l];
      levels_[l] = {level.masks.data(), level.first_block.data(), static_cast<const char*>(level.pixels)};
      // Slices without a pixel read the first one of their level; a level may have none.
      if (level.block_means.empty()) levels_[l].pixels = reinterpret_cast<const char*>(&kZero);
    }
  }

  void prefetchMasks(const SliceChunk& chunk) const {
    for (int k = 0; k < kChunk; ++k) {
      for (int j = 0; j < kSlices; ++j) {
        const Level& level = levels_[chunk.levels[j / 4][k]];
        prefetch(level.masks + static_cast<std::size_t>(chunk.images[j][k]) * words_);
        if (j % 2 == 0) prefetch(level.first_block + chunk.images[j][k]);
      }
    }
  }

  void findPixels(SliceChunk& chunk) {
    if (words_ == 4)  // images of 256^2, as most are
      findPixels<4>(chunk, 4);
    else
      findPixels<kMostWords>(chunk, words_);
  }

  /// Finds every pixel, and gives slices that have none weight 0.
  template <int kWords>
  void findPixels(SliceChunk& chunk, int given_words) {
    const int words = kWords < kMostWords ? kWords : given_words;
    for (int k = 0; k < kChunk; ++k) {
      const int block = chunk.blocks[k];
      std::uint64_t before[kWords];  // bits of the blocks before this one
      for (int w = 0; w < words; ++w) {
        const int bits = std::clamp(block - 64 * w, 0, 64);
        before[w] = bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
      }
      for (int step = 0; step < 2; ++step) {
        const Level level = levels_[chunk.levels[step][k]];
        for (int j = 4 * step; j < 4 * step + 4; ++j) {
          const std::uint32_t image = chunk.images[j][k];
          const std::uint64_t* mask = level.masks + static_cast<std::size_t>(image) * words;
          std::uint64_t rank = level.first_block[image];
          for (int w = 0; w < words; ++w) rank += setBits(mask[w] & before[w]);
          const std::uint64_t stored = mask[block / 64] >> (block % 64) & 1;
          chunk.weights[j][k] *= static_cast<float>(static_cast<int>(stored));
          const std::uint64_t pixel = (rank * kBlockPixels + static_cast<std::uint64_t>(chunk.pixels[k])) & (0 - stored);
          places_[j][k] = level.pixels + (pixel << pixel_shift_);
          prefetch(places_[j][k]);
        }
      }
    }
  }

  void addUp(const SliceChunk& chunk, float* sums) const {
    if (pyramid_.precision == BlockPrecision::f16)
      addUpHalves(chunk, sums);
    else
      addUpFloats(chunk, sums);
  }

 private:
  static constexpr float kZero = 0;
  static constexpr int kMostWords = 64;

  struct Level {
    const std::uint64_t* masks;
    const std::uint64_t* first_block;
    const char* pixels;
  };

  void addUpHalves(const SliceChunk& chunk, float* sums) const {
    for (int j = 0; j < kSlices; ++j) {
      alignas(64) std::uint16_t halves[kChunk];
      for (int k = 0; k < kChunk; ++k) halves[k] = *reinterpret_cast<const std::uint16_t*>(places_[j][k]);
      for (int k = 0; k < kChunk; ++k) sums[k] += chunk.weights[j][k] * halfToFloat(halves[k]);
    }
  }

  void addUpFloats(const SliceChunk& chunk, float* sums) const {
    for (int j = 0; j < kSlices; ++j)
      for (int k = 0; k < kChunk; ++k) {
        // Values of a file are not checked: a slice that does not count must not bring an infinity.
        const float value = chunk.weights[j][k] * *reinterpret_cast<const float*>(places_[j][k]);
        sums[k] += chunk.weights[j][k] > 0 ? value : 0.0f;
      }
  }

  const NdfPyramid& pyramid_;
  const int words_;
  const int pixel_shift_;
  Level levels_[kMaxPyramidLevels];
  const char* places_[kSlices][kChunk];
};

GLINT_API_MULTIVERSION void answerChunk(const PyramidNdf& model, SliceChunk& chunk, float* sums) {
  PyramidChunk places(model.pyramid());
  places.prefetchMasks(chunk);
  places.findPixels(chunk);
  places.addUp(chunk, sums);
  for (int k = 0; k < kChunk; ++k) sums[k] *= model.pyramid().value_scale;
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
        if (cluster.columns > 0) project<Basis>(reader, cluster, x, y, projection);
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
  void project(const Reader& reader, const NdfCluster& cluster, int x, int y, float* projection) const {
    if constexpr (!std::is_same_v<Basis, std::int32_t>) {
      if (wide_ && ndf_.method == CompressionMethod::cp && cluster.narrow_columns == 0) {
        const Basis* basis = static_cast<const Basis*>(ndf_.basis) + cluster.first_basis;
        return projectColumns(basis, cluster.columns, x, y, ndf_.scales.data() + cluster.first_scale, projection);
      }
    }
    reader.pixel(cluster, x, y, projection);
  }

  template <class Coefficient, class Reader>
  float dot(const Reader& reader, const float* projection, const ColumnLayout& layout, const Coefficient* row) const {
    return wide_ && layout.half == 0 ? dotColumns(projection, row, layout.low) : reader.dot(projection, layout, row);
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

void answerChunk(const CpNdf& model, SliceChunk& chunk, int count, float* sums) {
  const CompressedNdf& ndf = model.compressed();
  CompressedChunk places(ndf);
  places.findClusters(chunk);
  places.findRows(chunk);
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

void answer(const PyramidNdf& model, SliceChunk& chunk, int, float* sums) { answerChunk(model, chunk, sums); }
void answer(const CpNdf& model, SliceChunk& chunk, int count, float* sums) { answerChunk(model, chunk, count, sums); }

template <class Model>
void pyramidDensities(const Model& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& halves,
                      float* out) {
  for (std::size_t first = 0; first < count; first += kChunk) {
    const int lanes = static_cast<int>(std::min(count - first, static_cast<std::size_t>(kChunk)));
    SliceChunk chunk;
    alignas(64) float sums[kChunk] = {};
    selectChunk(model.shape(), footprints, halves, first, lanes, chunk);
    answer(model, chunk, lanes, sums);
    for (int k = 0; k < lanes; ++k) {
      const std::size_t at = first + static_cast<std::size_t>(k);
      const bool from_texels = model.hasNormals() && chunk.below[k] != 0;
      out[at] = from_texels ? model.density(footprints[at], halves[at]) : chunk.inside[k] != 0 ? sums[k] : 0.0f;
    }
  }
}

void modelDensities(const PyramidNdf& model, std::size_t count, const FootprintArrays& footprints,
                    const HalfVectorArrays& halves, float* out) {
  pyramidDensities(model, count, footprints, halves, out);
}

void modelDensities(const CpNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& halves,
                    float* out) {
  pyramidDensities(model, count, footprints, halves, out);
}

/// Models that have no way of their own are asked one by one.
template <class Model>
void modelDensities(const Model& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& halves,
                    float* out) {
  for (std::size_t k = 0; k < count; ++k) out[k] = model.density(footprints[k], halves[k]);
}

}  // namespace

void densities(const AnyNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& halves,
               float* out) {
  std::visit([&](const auto& m) { modelDensities(m, count, footprints, halves, out); }, model);
}

void means(const AnyNdf& model, std::size_t count, const FootprintArrays& footprints, const RangeArrays& ranges, float* out) {
  std::visit(
      [&](const auto& m) {
        for (std::size_t k = 0; k < count; ++k) out[k] = m.mean(footprints[k], ranges[k]);
      },
      model);
}

void samples(const AnyNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& xi,
             const SampleArrays& out) {
  std::visit(
      [&](const auto& m) {
        for (std::size_t k = 0; k < count; ++k) {
          const HalfVectorSample drawn = m.sample(footprints[k], xi[k]);
          out.x[k] = drawn.h.x;
          out.y[k] = drawn.h.y;
          out.pdf[k] = drawn.pdf;
        }
      },
      model);
}

}  // namespace glint::api
