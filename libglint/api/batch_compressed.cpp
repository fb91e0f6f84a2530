#include "glint/api/batch_compressed.h"

#include <algorithm>
#include <type_traits>

#include "glint/api/batch_kernels.h"
#include "glint/api/batch_slices.h"
#include "glint/model/packed_ndf.h"
#include "glint/query/bits.h"

namespace glint::api {
namespace {

constexpr int kSlices = PyramidSlices::kMost;

/// What is asked of blocks: each item is one block, and a pixel of it or a box, for one query of a chunk.
struct BlockItems {
  int count = 0;
  int lanes[kChunk];  ///< of the query in its SliceChunk
  int blocks[kChunk];
};

/// Where the slices of the items are stored. Nothing branches on what is stored: that cannot be predicted.
class SliceRows {
 public:
  explicit SliceRows(const CompressedNdf& ndf)
      : ndf_(ndf), coefficient_bytes_(static_cast<std::uint64_t>(coefficientBytes(ndf.coefficient_type))) {}

  /// Where the images of a chunk's queries are in the index.
  /// @param scales  of images
  void findImages(const SliceChunk& chunk, int lanes, const float* scales) {
    // Copies in registers: what is stored below might change the model, for all that the compiler knows.
    const std::uint16_t *regions = ndf_.image_regions.data(), *slots = ndf_.image_slots.data();
    const auto places = static_cast<std::uint32_t>(ndf_.places);
    for (int k = 0; k < lanes; ++k) {
      for (int step = 0; step < kSlices; step += 4) {
        const std::uint32_t first_image = ndf_.first_image[chunk.levels[step / 4][k]];
        for (int j = step; j < step + 4; ++j) {
          const std::uint32_t image = first_image + chunk.images[j][k];
          slots_[k][j] = slots[image];
          first_clusters_[k][j] = regions[image] * places;
          image_weights_[k][j] = chunk.weights[j][k] * scales[image];
        }
        const std::uint32_t* first = first_clusters_[k] + step;
        one_region_[k][step / 4] = first[0] == first[1] && first[0] == first[2] && first[0] == first[3];
      }
    }
  }

  /// Finds the rows of all items and asks the memory for them. After findImages of their chunk.
  void findRows(const BlockItems& items) {
    for (int i = 0; i < items.count; ++i) {
      const int lane = items.lanes[i];
      const std::uint16_t given = ndf_.block_places.data()[items.blocks[i]];
      const std::uint32_t place = given == kNoBlockPlace ? 0u : given;
      const float exists = given == kNoBlockPlace ? 0.0f : 1.0f;
      for (int step = 0; step < kSlices; step += 4) {
        const std::uint32_t* slot = slots_[lane] + step;
        std::uint32_t cluster[4];
        for (int c = 0; c < 4; ++c) {
          clusters[i][step + c] = cluster[c] = first_clusters_[lane][step + c] + place;
          weights[i][step + c] = exists * image_weights_[lane][step + c];
        }
        same_cluster[i][step / 4] = one_region_[lane][step / 4];
        if (same_cluster[i][step / 4]) {
          const Place at(ndf_, cluster[0], coefficient_bytes_);
          for (int c = 0; c < 4; ++c) findSlice(at, slot[c], i, step + c);
        } else {
          for (int c = 0; c < 4; ++c) findSlice(Place(ndf_, cluster[c], coefficient_bytes_), slot[c], i, step + c);
        }
      }
    }
  }

  // Of each slice of each item.
  std::uint32_t clusters[kChunk][kSlices];
  std::uint32_t slices[kChunk][kSlices];  ///< in their clusters
  const char* rows[kChunk][kSlices];      ///< of coefficients; none in clusters of spots
  float weights[kChunk][kSlices];         ///< 0: does not count
  bool same_cluster[kChunk][2];           ///< whether the slices of a level are in one

 private:
  /// A cluster's index and rows.
  struct Place {
    Place(const CompressedNdf& ndf, std::uint32_t at, std::uint64_t element_bytes) {
      const NdfCluster& cluster = ndf.clusters.data()[at];
      masks = ndf.masks.data() + cluster.first_word;
      ranks = ndf.mask_ranks.data() + cluster.first_word;
      rows = static_cast<const char*>(ndf.coefficients) + cluster.first_coefficient * element_bytes;
      row_bytes = static_cast<std::uint64_t>(rowElements(cluster)) * element_bytes;
    }
    const std::uint64_t* masks;
    const std::uint32_t* ranks;
    const char* rows;
    std::uint64_t row_bytes;
  };

  void findSlice(const Place& at, std::uint32_t slot, int i, int j) {
    const std::uint64_t mask = at.masks[slot / 64], stored = mask >> slot % 64 & 1;
    const std::uint64_t before = mask & ((std::uint64_t{1} << slot % 64) - 1);
    // Slices that are not stored read the first one of their cluster.
    const std::uint64_t slice = (at.ranks[slot / 64] + static_cast<std::uint64_t>(setBits(before))) & (0 - stored);
    const char* row = at.rows + slice * at.row_bytes;
    prefetch(row);
    rows[i][j] = row;
    slices[i][j] = static_cast<std::uint32_t>(slice);
    weights[i][j] *= static_cast<float>(static_cast<int>(stored));
  }

  const CompressedNdf& ndf_;
  const std::uint64_t coefficient_bytes_;
  // Of each image of each query.
  std::uint32_t slots_[kChunk][kSlices], first_clusters_[kChunk][kSlices];
  float image_weights_[kChunk][kSlices];
  bool one_region_[kChunk][2];
};

/// The end of an array, and after it what kernels may read beyond.
template <class T, int kCount>
class PaddedEnd {
 public:
  PaddedEnd(const T* data, std::size_t size) : data_(data), first_(size - std::min(size, std::size_t{kCount})) {
    std::fill(std::copy(data + first_, data + size, end_), end_ + kCount + kKernelMargin, T(0));
  }
  /// Where elements [first, first + count) can be read with a margin; nullptr: nowhere.
  const T* at(std::size_t first, std::size_t count, std::size_t size) const {
    if (first + count + kKernelMargin <= size) return data_ + first;
    return first >= first_ ? end_ + (first - first_) : nullptr;
  }

 private:
  const T* data_;
  std::size_t first_;
  T end_[kCount + kKernelMargin];
};

/// Values of slices at a pixel or over a box, by the kernels that the processor has.
template <class Basis, class Coefficient>
class SliceValues {
 public:
  explicit SliceValues(const CompressedNdf& ndf)
      : ndf_(ndf),
        reader_(ndf),
        basis_(static_cast<const Basis*>(ndf.basis), ndf.basis_count),
        scales_(ndf.scales.data(), ndf.scales.size()),
        core_(ndf.core.data(), ndf.core.size()) {}

  using Reader = ClusterReader<Basis, Coefficient>;
  const Reader& reader() const { return reader_; }

  struct Pixel {
    int x, y;
  };

  /// Values of the slices of item i; anything where the weight is 0.
  template <class Ask>
  void evaluate(const SliceRows& places, int i, const Ask& ask, float* values) const {
    if (wide_ && ndf_.method == CompressionMethod::cp && multiplyColumns(places, i, ask, values)) return;
    alignas(64) float projection[ColumnLayout::kMost + kKernelMargin];
    std::uint32_t projected = ~std::uint32_t{0};
    for (int step = 0; step < kSlices; step += 4) {
      const std::uint32_t* at = places.clusters[i] + step;
      const NdfCluster& cluster = ndf_.clusters.data()[*at];
      if (!hasColumns(cluster) || !places.same_cluster[i][step / 4]) {
        for (int j = step; j < step + 4; ++j) values[j] = one(places, i, j, ask);
        continue;
      }
      if (*at != projected) project(cluster, ask, projection);
      projected = *at;
      dotFour(projection, ColumnLayout(cluster), places.rows[i] + step, values + step);
    }
  }

 private:
  /// Nobody checks what else an empty cluster of a file says.
  static bool hasColumns(const NdfCluster& cluster) { return cluster.columns > 0 && cluster.slice_count > 0; }

  /// What a projection reads, as kernels may read it. The cluster has columns.
  struct Factors {
    const Basis* basis;
    const float* scales;
    const std::uint8_t* core;
    bool readable;
  };
  Factors factorsOf(const NdfCluster& cluster) const {
    const std::size_t elements = static_cast<std::size_t>(basisElements(ndf_.method, cluster)), columns = cluster.columns;
    const Basis* basis = basis_.at(cluster.first_basis, elements, ndf_.basis_count);
    const float* scales = scales_.at(cluster.first_scale, columns, ndf_.scales.size());
    const std::uint8_t* core = nullptr;
    if (ndf_.method == CompressionMethod::tucker) core = core_.at(cluster.first_scale, columns, ndf_.core.size());
    return {basis, scales, core,
            wide_ && basis != nullptr && scales != nullptr && (core != nullptr || ndf_.method != CompressionMethod::tucker)};
  }

  static KernelLayout kernelLayout(const ColumnLayout& layout) {
    return {layout.columns, layout.wide, layout.half, layout.low(), layout.high()};
  }
  void project(const NdfCluster& cluster, const Pixel& pixel, float* projection) const {
    const Factors factors = factorsOf(cluster);
    if (!factors.readable) return reader_.pixel(cluster, ColumnLayout(cluster), pixel.x, pixel.y, projection);
    if (ndf_.method != CompressionMethod::pca)
      return projectProducts(factors, cluster, alongX(pixel), alongY(pixel), projection);
    if constexpr (!std::is_same_v<Basis, std::int16_t>)
      projectImages(factors.basis, kernelLayout(ColumnLayout(cluster)), pixel.x, pixel.y, factors.scales, projection);
  }
  void project(const NdfCluster& cluster, const BlockBox& box, float* projection) const {
    const Factors factors = factorsOf(cluster);
    if (!factors.readable) return reader_.box(cluster, ColumnLayout(cluster), box, projection);
    if (ndf_.method != CompressionMethod::pca) return projectProducts(factors, cluster, alongX(box), alongY(box), projection);
    if constexpr (!std::is_same_v<Basis, std::int16_t>) {
      const Basis* rows[16];
      float weights[16];
      int count = 0;
      Reader::forEachPrefix(factors.basis, cluster.columns, box, [&](const Basis* row, float weight) {
        rows[count] = row;
        weights[count++] = weight;
      });
      projectRows(rows, weights, count, kernelLayout(ColumnLayout(cluster)), factors.scales, projection);
    }
  }

  /// cp and tucker.
  /// @tparam Part  a pixel, or a part of an axis
  template <class Part>
  void projectProducts(const Factors& factors, const NdfCluster& cluster, const Part& x, const Part& y,
                       float* projection) const {
    if constexpr (!std::is_same_v<Basis, std::int32_t>) {
      const KernelLayout layout = kernelLayout(ColumnLayout(cluster));
      const CoreAxes axes = {cluster.rank_x, cluster.rank_y, factors.core};
      ndf_.method == CompressionMethod::tucker ? projectCore(factors.basis, axes, layout, x, y, factors.scales, projection)
                                               : projectColumns(factors.basis, layout, x, y, factors.scales, projection);
    }
  }

  static int alongX(const Pixel& pixel) { return pixel.x; }
  static int alongY(const Pixel& pixel) { return pixel.y; }
  static AxisPart alongX(const BlockBox& box) { return partOf(box.x0, box.x1); }
  static AxisPart alongY(const BlockBox& box) { return partOf(box.y0, box.y1); }
  static AxisPart partOf(float low, float high) {
    const int l = std::min(static_cast<int>(low), kBlockSize - 1), h = std::min(static_cast<int>(high), kBlockSize - 1);
    return {l, h, low - static_cast<float>(l), high - static_cast<float>(h)};
  }

  void dotFour(const float* projection, const ColumnLayout& layout, const char* const* rows, float* values) const {
    const Coefficient* each[4];
    for (int j = 0; j < 4; ++j) each[j] = reinterpret_cast<const Coefficient*>(rows[j]);
    if (wide_) return dotFourRows(projection, kernelLayout(layout), each, values);
    for (int j = 0; j < 4; ++j) values[j] = reader_.dot(projection, layout, each[j]);
  }

  /// cp, whose slices mostly are of different clusters: each has a projection of its own.
  /// @return whether kernels can do it
  template <class Ask>
  bool multiplyColumns(const SliceRows& places, int i, const Ask& ask, float* values) const {
    if constexpr (!std::is_same_v<Basis, std::int32_t>) {
      ProductSlice<Basis, Coefficient> slices[kSlices];
      bool possible = true;
      for (int j = 0; j < kSlices; ++j) {
        const NdfCluster& cluster = ndf_.clusters.data()[places.clusters[i][j]];
        if (!hasColumns(cluster) || cluster.narrow_columns > 0) return false;
        const Factors factors = factorsOf(cluster);
        possible = possible && factors.readable;
        slices[j] = {factors.basis, factors.scales, reinterpret_cast<const Coefficient*>(places.rows[i][j]), cluster.columns};
      }
      if (possible) dotEightSlices(slices, alongX(ask), alongY(ask), values);
      return possible;
    }
    return false;
  }

  template <class Ask>
  float one(const SliceRows& places, int i, int j, const Ask& ask) const {
    if (!(places.weights[i][j] > 0)) return 0;
    const NdfCluster& cluster = ndf_.clusters.data()[places.clusters[i][j]];
    if (cluster.columns == 0) return ofSpots(spotsOf(ndf_, cluster, places.slices[i][j]), ask);
    alignas(64) float projection[ColumnLayout::kMost + kKernelMargin];
    project(cluster, ask, projection);
    return reader_.dot(projection, ColumnLayout(cluster), reinterpret_cast<const Coefficient*>(places.rows[i][j]));
  }
  float ofSpots(const SpotList& list, const Pixel& pixel) const { return spotsAt(SpotProfile(ndf_), list, pixel.x, pixel.y); }
  float ofSpots(const SpotList& list, const BlockBox& box) const { return spotsIn(SpotProfile(ndf_), list, box); }

  const CompressedNdf& ndf_;
  const Reader reader_;
  const PaddedEnd<Basis, 1024> basis_;
  const PaddedEnd<float, 64> scales_;
  const PaddedEnd<std::uint8_t, 64> core_;
  const bool wide_ = hasWideKernels();
};

/// Sum of the slices of an item. Values that do not count may be anything.
/// @tparam kPositive  whether negative values are taken as 0
template <bool kPositive>
float weighedSum(const float* weights, const float* values) {
  const auto four = [&](int j) {
    const Float4 w = Float4::load(weights + j), v = Float4::load(values + j);
    return whereLess(Float4::zero(), w, w * (kPositive ? v.positive() : v), Float4::zero());
  };
  return (four(0) + four(4)).sum();
}

/// Calls visitor(SliceValues) for the types that a compressed NDF stores.
template <class Visitor>
void withValues(const CompressedNdf& ndf, Visitor&& visitor) {
  withReader(ndf, [&]<class Basis, class Coefficient>(const ClusterReader<Basis, Coefficient>&) {
    visitor(SliceValues<Basis, Coefficient>(ndf));
  });
}

/// The blocks that the ranges of a chunk's queries cover, in the order of queries. Full lists are handed to `finish`.
template <class Finish>
class RangeItems {
 public:
  explicit RangeItems(Finish finish) : finish_(finish) {}

  void add(const PyramidShape& shape, int lane, const Box2& range) {
    if (!(range.width() > 0 && range.height() > 0)) return;
    forEachBlock(shape, range, [&](int block, const BlockBox& box) {
      items_.lanes[items_.count] = lane;
      items_.blocks[items_.count] = block;
      boxes_[items_.count++] = box;
      if (items_.count == kChunk) flush();
    });
  }
  void flush() {
    finish_(items_, boxes_);
    items_.count = 0;
  }

 private:
  Finish finish_;
  BlockItems items_;
  BlockBox boxes_[kChunk];
};

std::size_t lanesOf(std::size_t first, std::size_t count) { return std::min(count - first, std::size_t{kChunk}); }

}  // namespace

void compressedDensities(const CpNdf& model, std::size_t count, const FootprintArrays& footprints,
                         const HalfVectorArrays& halves, float* out) {
  const CompressedNdf& ndf = model.compressed();
  if (ndf.method == CompressionMethod::cp) {
    // The slices of a density are of as many clusters: wide kernels gain less than it takes to hand these over.
    for (std::size_t k = 0; k < count; ++k) out[k] = model.density(footprints[k], halves[k]);
    return;
  }
  withValues(ndf, [&](const auto& values) {
    using Pixel = typename std::decay_t<decltype(values)>::Pixel;
    SliceChunk chunk;
    SliceRows places(ndf);
    BlockItems items;
    for (std::size_t first = 0; first < count; first += kChunk) {
      items.count = static_cast<int>(lanesOf(first, count));
      selectChunk(model.shape(), model.chooser(), footprints, halves, first, items.count, chunk);
      for (int i = 0; i < items.count; ++i) {
        items.lanes[i] = i;
        items.blocks[i] = chunk.blocks[i];
      }
      places.findImages(chunk, items.count, ndf.density_scales.data());
      places.findRows(items);
      for (int i = 0; i < items.count; ++i) {
        const std::size_t at = first + static_cast<std::size_t>(i);
        float each[kSlices];
        values.evaluate(places, i, Pixel{chunk.pixels[i] % kBlockSize, chunk.pixels[i] / kBlockSize}, each);
        const float sum = weighedSum<true>(places.weights[i], each);
        out[at] = model.fromTexels(footprints[at]) ? model.density(footprints[at], halves[at])
                  : chunk.inside[i] != 0           ? sum
                                                   : 0.0f;
      }
    }
  });
}

void compressedMeans(const CpNdf& model, std::size_t count, const FootprintArrays& footprints, const RangeArrays& ranges,
                     float* out) {
  const CompressedNdf& ndf = model.compressed();
  const HalfVectorArrays corners = {ranges.x0, ranges.y0};
  withValues(ndf, [&](const auto& values) {
    SliceChunk chunk;
    SliceRows places(ndf);
    for (std::size_t first = 0; first < count; first += kChunk) {
      const int lanes = static_cast<int>(lanesOf(first, count));
      selectChunk(model.shape(), model.chooser(), footprints, corners, first, lanes, chunk);
      places.findImages(chunk, lanes, ndf.image_scales.data());
      double sums[kChunk] = {};
      RangeItems items([&](const BlockItems& some, const BlockBox* boxes) {
        places.findRows(some);
        for (int i = 0; i < some.count; ++i) {
          float each[kSlices];
          values.evaluate(places, i, boxes[i], each);
          sums[some.lanes[i]] += weighedSum<false>(places.weights[i], each);
        }
      });
      for (int k = 0; k < lanes; ++k) items.add(model.shape(), k, ranges[first + static_cast<std::size_t>(k)]);
      items.flush();
      for (int k = 0; k < lanes; ++k) {
        const std::size_t at = first + static_cast<std::size_t>(k);
        const Box2 range = ranges[at];
        const bool empty = !(range.width() > 0 && range.height() > 0);
        const auto mean = static_cast<float>(sums[k] / areaInPixels(model.shape(), range));
        out[at] = empty ? 0.0f : model.fromTexels(footprints[at]) ? model.mean(footprints[at], range) : std::max(0.0f, mean);
      }
    }
  });
}

/// Samples follow their cache misses together; what their pixels hold is then asked as densities are.
void compressedSamples(const CpNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& xi,
                       const SampleArrays& out) {
  const CompressedNdf& ndf = model.compressed();
  withValues(ndf, [&](const auto& values) {
    using Pixel = typename std::decay_t<decltype(values)>::Pixel;
    SliceChunk chunk;
    SliceRows places(ndf);
    BlockItems items;
    CpNdf::Draw draws[kChunk];
    for (std::size_t first = 0; first < count; first += kChunk) {
      items.count = static_cast<int>(lanesOf(first, count));
      selectChunk(model.shape(), model.chooser(), footprints, xi, first, items.count, chunk);
      for (int k = 0; k < items.count; ++k)
        draws[k] = model.chooseImage(chunk.slices(k), xi[first + static_cast<std::size_t>(k)]);
      for (int k = 0; k < items.count; ++k) model.findBlocks(draws[k]);
      for (int k = 0; k < items.count; ++k) model.chooseBlock(draws[k]);
      for (int k = 0; k < items.count; ++k) model.findBlockSlice(draws[k]);
      for (int k = 0; k < items.count; ++k) {
        model.choosePixel(values.reader(), draws[k]);
        items.lanes[k] = k;
        items.blocks[k] = draws[k].place.block;
      }
      places.findImages(chunk, items.count, ndf.density_scales.data());
      places.findRows(items);
      for (int k = 0; k < items.count; ++k) {
        const std::size_t at = first + static_cast<std::size_t>(k);
        const CpNdf::Draw& draw = draws[k];
        HalfVectorSample drawn;
        if (model.fromTexels(footprints[at])) {
          drawn = model.sample(footprints[at], xi[at]);
        } else if (draw.place.x >= 0) {
          float each[kSlices];
          values.evaluate(places, k, Pixel{draw.place.x, draw.place.y}, each);
          drawn = {pointInPixel(model.shape(), draw.place, draw.xi), weighedSum<true>(places.weights[k], each) / draw.total};
        }
        out.set(at, drawn);
      }
    }
  });
}

}  // namespace glint::api
