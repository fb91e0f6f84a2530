#include "glint/api/batch.h"

#include <algorithm>

#include "glint/api/plane_position.h"
#include "glint/query/curved_ndf.h"
#include "glint/query/detail/pyramid/pyramid_reader.h"

namespace glint::api {
namespace {

/// Queries that a batch works on at once: enough to keep many cache misses in flight, few enough to stay in the nearest cache.
constexpr int kChunk = 32;

/// Queries of a chunk, and the images that answer them. Each step prefetches what the next step reads.
class PyramidChunk {
 public:
  /// Chooses the images of a query.
  void choose(int k, const PyramidNdf& model, const Footprint& p, Vec2 h) {
    inside_[k] = insideSquare(h);
    from_texels_[k] = model.fromTexels(p);
    slices_[k] = model.chooser().choose(p);
    places_[k] = inside_[k] ? pixelPlace(model.shape(), h) : PixelPlace{0, 0, 0};
    model.reader().prefetchBlock(slices_[k], places_[k].block);
  }
  void findPixels(int k, const PyramidNdf& model) { pixels_[k] = model.reader().findPixels(slices_[k], places_[k]); }
  float density(int k, const PyramidNdf& model) const { return inside_[k] ? model.reader().addPixels(pixels_[k]) : 0.0f; }
  /// Whether the texels have a share in the answer: then the model is asked for the query alone.
  bool fromTexels(int k) const { return from_texels_[k]; }

 private:
  bool inside_[kChunk], from_texels_[kChunk];
  PyramidSlices slices_[kChunk];
  PixelPlace places_[kChunk];
  PyramidReader::FoundPixels pixels_[kChunk];
};

/// Three chunks are in flight, one step apart. While the memory fetches what one chunk needs next, the other two are computed.
void pyramidDensities(const PyramidNdf& model, std::size_t count, const FootprintArrays& footprints,
                      const HalfVectorArrays& halves, float* out) {
  PyramidChunk stages[3];
  const std::size_t chunks = (count + kChunk - 1) / kChunk;
  const auto lanesOf = [&](std::size_t k) { return static_cast<int>(std::min(count - k * kChunk, std::size_t{kChunk})); };
  const auto queryOf = [](std::size_t chunk, int k) { return chunk * kChunk + static_cast<std::size_t>(k); };
  for (std::size_t step = 0; step < chunks + 2; ++step) {
    if (step < chunks)
      for (int k = 0; k < lanesOf(step); ++k) {
        const std::size_t at = queryOf(step, k);
        stages[step % 3].choose(k, model, footprints[at], halves[at]);
      }
    if (step >= 1 && step - 1 < chunks)
      for (int k = 0; k < lanesOf(step - 1); ++k) stages[(step - 1) % 3].findPixels(k, model);
    if (step < 2) continue;
    const PyramidChunk& ready = stages[(step - 2) % 3];
    for (int k = 0; k < lanesOf(step - 2); ++k) {
      const std::size_t at = queryOf(step - 2, k);
      out[at] = ready.fromTexels(k) ? model.density(footprints[at], halves[at]) : ready.density(k, model);
    }
  }
}

void pyramidMeans(const PyramidNdf& model, std::size_t count, const FootprintArrays& footprints, const RangeArrays& ranges,
                  float* out) {
  const PyramidReader& reader = model.reader();
  PyramidSlices slices[kChunk];
  bool from_texels[kChunk];
  PyramidReader::PendingMean pending[2];
  for (std::size_t first = 0; first < count; first += kChunk) {
    const int lanes = static_cast<int>(std::min(count - first, std::size_t{kChunk}));
    for (int k = 0; k < lanes; ++k) {
      const Footprint p = footprints[first + static_cast<std::size_t>(k)];
      from_texels[k] = model.fromTexels(p);
      slices[k] = model.chooser().choose(p);
      reader.prefetchIndex(slices[k]);
    }
    // A mean takes long beside its cache misses, and reads many lines: only the next mean is prefetched.
    const auto begin = [&](int k) {
      if (!from_texels[k])
        reader.beginMean(slices[k], ranges[first + static_cast<std::size_t>(k)], model.pixels(), pending[k % 2]);
    };
    begin(0);
    for (int k = 0; k < lanes; ++k) {
      const std::size_t at = first + static_cast<std::size_t>(k);
      if (k + 1 < lanes) begin(k + 1);
      out[at] = from_texels[k] ? model.mean(footprints[at], ranges[at]) : reader.finishMean(ranges[at], pending[k % 2]);
    }
  }
}

/// Every loop is a step of all samples, and prefetches what the next loop reads.
void pyramidSamples(const PyramidNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& xi,
                    const SampleArrays& out) {
  const PyramidReader& reader = model.reader();
  PyramidReader::Draw draws[kChunk];
  PyramidReader::FoundPixels pixels[kChunk];
  for (std::size_t first = 0; first < count; first += kChunk) {
    const int lanes = static_cast<int>(std::min(count - first, std::size_t{kChunk}));
    for (int k = 0; k < lanes; ++k) {
      const std::size_t at = first + static_cast<std::size_t>(k);
      draws[k] = reader.chooseImage(model.chooser().choose(footprints[at]), xi[at]);
    }
    for (int k = 0; k < lanes; ++k) {
      reader.findBlocks(draws[k]);
      reader.prefetchIndex(draws[k].slices);
    }
    for (int k = 0; k < lanes; ++k) reader.chooseBlock(draws[k]);
    for (int k = 0; k < lanes; ++k) {
      reader.choosePixel(draws[k]);
      if (draws[k].place.x >= 0) pixels[k] = reader.findPixels(draws[k].slices, draws[k].place);
    }
    for (int k = 0; k < lanes; ++k) {
      const std::size_t at = first + static_cast<std::size_t>(k);
      if (model.fromTexels(footprints[at]))
        out.set(at, model.sample(footprints[at], xi[at]));
      else if (draws[k].place.x < 0)
        out.set(at, {});
      else
        out.set(at, drawnAt(pointInPixel(model.shape(), draws[k].place, draws[k].xi), reader.addPixels(pixels[k])));
    }
  }
}

/// Whether every footprint of a batch is asked as it is, not as several parts.
bool allWhole(const AnisotropicNdf<PyramidNdf>& model, std::size_t count, const FootprintArrays& footprints) {
  if (footprints.sigma.data != nullptr) return true;
  for (std::size_t k = 0; k < count; ++k)
    if (!model.isWhole(footprints[k])) return false;
  return true;
}

/// The pyramid whose queries are answered many at once; nullptr where they are asked one by one.
const PyramidNdf* batchedPyramid(const AnyNdf& any, std::size_t count, const FootprintArrays& footprints) {
  const auto* pyramid = std::get_if<AnisotropicNdf<PyramidNdf>>(&any);
  return pyramid != nullptr && !footprints.curved() && allWhole(*pyramid, count, footprints) ? &pyramid->round() : nullptr;
}

/// Calls ask(k, model) with the model at the position of each query, averaged over the half vectors of its pixel.
template <class Ask>
void askEach(const AnyNdf& any, std::size_t count, const FootprintArrays& footprints, Ask&& ask) {
  const bool moves = footprints.precise_u.data != nullptr && isEndless(any);
  for (std::size_t k = 0; k < count; ++k) {
    if (moves) {
      const AnyNdf moved = movedTo(any, footprints, k);
      ask(k, CurvedNdf(moved, footprints.spread(k)));
    } else {
      ask(k, CurvedNdf(any, footprints.spread(k)));
    }
  }
}

}  // namespace

void densities(const AnyNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& halves,
               float* out) {
  // Smooth pixels are asked one by one: each query reads so many pixels that its own misses overlap.
  const PyramidNdf* pyramid = batchedPyramid(model, count, footprints);
  if (pyramid != nullptr && pyramid->pixels() != Pixels::smooth)
    return pyramidDensities(*pyramid, count, footprints, halves, out);
  askEach(model, count, footprints, [&](std::size_t k, const auto& m) { out[k] = m.density(footprints[k], halves[k]); });
}

void means(const AnyNdf& model, std::size_t count, const FootprintArrays& footprints, const RangeArrays& ranges, float* out) {
  if (const PyramidNdf* pyramid = batchedPyramid(model, count, footprints))
    return pyramidMeans(*pyramid, count, footprints, ranges, out);
  askEach(model, count, footprints, [&](std::size_t k, const auto& m) { out[k] = m.mean(footprints[k], ranges[k]); });
}

void samples(const AnyNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& xi,
             const SampleArrays& out) {
  const PyramidNdf* pyramid = batchedPyramid(model, count, footprints);
  if (pyramid != nullptr && pyramid->pixels() != Pixels::smooth) return pyramidSamples(*pyramid, count, footprints, xi, out);
  askEach(model, count, footprints, [&](std::size_t k, const auto& m) { out.set(k, m.sample(footprints[k], xi[k])); });
}

}  // namespace glint::api
