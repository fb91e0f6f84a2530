#include "glint/api/batch.h"

#include <algorithm>

#include "glint/api/batch_slices.h"
#include "glint/api/multiversion.h"
#include "glint/math/bits.h"
#include "glint/query/detail/pyramid/pyramid_reader.h"

namespace glint::api {
namespace {

constexpr int kSlices = PyramidSlices::kMost;

/// Places where the slices of a chunk are stored. No branch depends on a stored value, because processors cannot predict one.
class PyramidChunk {
 public:
  explicit PyramidChunk(const NdfPyramid& pyramid)
      : pyramid_(pyramid),
        words_(static_cast<unsigned>(pyramid.shape.maskWords())),
        pixel_shift_(pyramid.precision == BlockPrecision::f16 ? 1 : 2) {
    for (int l = 0; l < pyramid.shape.level_count; ++l) {
      const PyramidLevel& level = pyramid.levels[l];
      levels_[l] = {level.masks.data(), level.mask_ranks.data(), static_cast<const char*>(level.pixels)};
      // A slice without a pixel reads the first pixel of its level. A level without pixels has one of 0.
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

  /// Finds the pixel of every slice. A slice without a pixel gets weight 0.
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

  /// Adds up in the order of PyramidNdf: the corners of a level first.
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
    for (int k = 0; k < kChunk; ++k) products[k] = weights[k] * positiveHalfToFloat(halves[k]);
  }

  static void weighFloats(const float* weights, const char* const* places, float* products) {
    for (int k = 0; k < kChunk; ++k) {
      // Values of a file are not checked: a slice of weight 0 must not add an infinity.
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

/// The steps of a chunk of densities. `begin` prefetches the index, `find` reads the index and prefetches the pixels, `finish`
/// adds the pixels up.
struct PyramidSteps {
  explicit PyramidSteps(const PyramidNdf& model) : places(model.pyramid()), scale(model.pyramid().value_scale) {}
  void begin(SliceChunk& chunk) { places.prefetchMasks(chunk); }
  void find(SliceChunk& chunk) { findPixels(places, chunk); }
  void finish(const SliceChunk& chunk, float* sums) const {
    addUpPixels(places, chunk, sums);
    for (int k = 0; k < kChunk; ++k) sums[k] = finitePositive(scale * sums[k]);
  }
  PyramidChunk places;
  float scale;
};

/// Three chunks are in flight, one step apart. While the memory fetches what one chunk needs next, the other two are computed.
void modelDensities(const PyramidNdf& model, std::size_t count, const FootprintArrays& footprints,
                    const HalfVectorArrays& halves, float* out) {
  const SliceChooser chooser(model.shape());
  struct Stage {
    explicit Stage(const PyramidNdf& m) : steps(m) {}
    SliceChunk chunk;  // not cleared: every step fills the members that the next step reads
    PyramidSteps steps;
  };
  Stage stages[3] = {Stage(model), Stage(model), Stage(model)};
  const std::size_t chunks = (count + kChunk - 1) / kChunk;
  const auto lanesOf = [&](std::size_t k) { return static_cast<int>(std::min(count - k * kChunk, std::size_t{kChunk})); };
  for (std::size_t step = 0; step < chunks + 2; ++step) {
    if (step < chunks) {
      Stage& stage = stages[step % 3];
      selectChunk(model.shape(), chooser, footprints, halves, step * kChunk, lanesOf(step), stage.chunk);
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
    stage.steps.finish(stage.chunk, sums);
    for (int k = 0; k < lanes; ++k) {
      const std::size_t at = (step - 2) * kChunk + static_cast<std::size_t>(k);
      const bool from_texels = model.hasNormals() && stage.chunk.below[k] != 0;
      out[at] = from_texels ? model.density(footprints[at], halves[at]) : stage.chunk.inside[k] != 0 ? sums[k] : 0.0f;
    }
  }
}

/// Models without an overload above are asked one query at a time.
template <class Model>
void modelDensities(const Model& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& halves,
                    float* out) {
  for (std::size_t k = 0; k < count; ++k) out[k] = model.density(footprints[k], halves[k]);
}

void modelMeans(const PyramidNdf& model, std::size_t count, const FootprintArrays& footprints, const RangeArrays& ranges,
                float* out) {
  const SliceChooser chooser(model.shape());
  const PyramidReader reader(model.pyramid());
  SliceChunk chunk;
  PyramidReader::PendingMean pending[2];
  for (std::size_t first = 0; first < count; first += kChunk) {
    const int lanes = static_cast<int>(std::min(count - first, std::size_t{kChunk}));
    selectChunk(model.shape(), chooser, footprints, {ranges.x0, ranges.y0}, first, lanes, chunk);
    for (int k = 0; k < lanes; ++k) reader.prefetchIndex(chunk.slices(k));
    const auto fromTexels = [&](int k) { return model.hasNormals() && chunk.below[k] != 0; };
    // A mean takes long beside its cache misses, and reads many lines: only the next mean is prefetched.
    const auto begin = [&](int k) {
      if (fromTexels(k)) return;
      reader.beginMean(chunk.slices(k), ranges[first + static_cast<std::size_t>(k)], pending[k % 2]);
    };
    begin(0);
    for (int k = 0; k < lanes; ++k) {
      const std::size_t at = first + static_cast<std::size_t>(k);
      if (k + 1 < lanes) begin(k + 1);
      out[at] = fromTexels(k) ? model.mean(footprints[at], ranges[at]) : reader.finishMean(ranges[at], pending[k % 2]);
    }
  }
}

void modelSamples(const PyramidNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& xi,
                  const SampleArrays& out) {
  const SliceChooser chooser(model.shape());
  const PyramidReader reader(model.pyramid());
  SliceChunk chunk;
  PyramidSteps steps(model);
  PyramidReader::Draw draws[kChunk];
  for (std::size_t first = 0; first < count; first += kChunk) {
    const int lanes = static_cast<int>(std::min(count - first, std::size_t{kChunk}));
    selectChunk(model.shape(), chooser, footprints, xi, first, lanes, chunk);
    steps.begin(chunk);
    for (int k = 0; k < lanes; ++k) draws[k] = reader.chooseImage(chunk.slices(k), xi[first + static_cast<std::size_t>(k)]);
    for (int k = 0; k < lanes; ++k) reader.findBlocks(draws[k]);
    for (int k = 0; k < lanes; ++k) reader.chooseBlock(draws[k]);
    for (int k = 0; k < lanes; ++k) {
      reader.choosePixel(draws[k]);
      const PixelPlace place = draws[k].place;
      chunk.blocks[k] = std::max(place.block, 0);
      chunk.pixels[k] = std::max(place.y * kBlockSize + place.x, 0);
    }
    steps.find(chunk);
    alignas(64) float pdfs[kChunk] = {};
    steps.finish(chunk, pdfs);
    for (int k = 0; k < lanes; ++k) {
      const std::size_t at = first + static_cast<std::size_t>(k);
      if (model.fromTexels(footprints[at]))
        out.set(at, model.sample(footprints[at], xi[at]));
      else if (draws[k].place.x < 0)
        out.set(at, {});
      else
        out.set(at, drawnAt(pointInPixel(model.shape(), draws[k].place, draws[k].xi), pdfs[k]));
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

/// Whether every footprint of a batch is asked as it is, not as several parts.
bool allWhole(const AnisotropicNdf<PyramidNdf>& model, std::size_t count, const FootprintArrays& footprints) {
  if (footprints.sigma.data != nullptr) return true;
  for (std::size_t k = 0; k < count; ++k)
    if (!model.isWhole(footprints[k])) return false;
  return true;
}

/// Calls ask(model) with the model that answers a batch. A pyramid answers a batch of round footprints by its own model of round
/// footprints, which answers many queries at once. Every other batch goes to the model as it is.
template <class Ask>
void askModel(const AnyNdf& any, std::size_t count, const FootprintArrays& footprints, Ask&& ask) {
  const auto* pyramid = std::get_if<AnisotropicNdf<PyramidNdf>>(&any);
  if (pyramid != nullptr && allWhole(*pyramid, count, footprints)) return ask(pyramid->round());
  std::visit(ask, any);
}

}  // namespace

void densities(const AnyNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& halves,
               float* out) {
  askModel(model, count, footprints, [&](const auto& m) { modelDensities(m, count, footprints, halves, out); });
}

void means(const AnyNdf& model, std::size_t count, const FootprintArrays& footprints, const RangeArrays& ranges, float* out) {
  askModel(model, count, footprints, [&](const auto& m) { modelMeans(m, count, footprints, ranges, out); });
}

void samples(const AnyNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& xi,
             const SampleArrays& out) {
  askModel(model, count, footprints, [&](const auto& m) { modelSamples(m, count, footprints, xi, out); });
}

}  // namespace glint::api
