#pragma once

#include <cmath>

#include "glint/math/bits.h"
#include "glint/model/ndf_cp.h"
#include "glint/query/detail/common/sampling.h"
#include "glint/query/detail/compressed/avx2_reader.h"
#include "glint/query/detail/compressed/cluster_reader.h"
#include "glint/query/detail/compressed/slice_places.h"
#include "glint/query/detail/compressed/spots.h"
#include "glint/query/detail/pyramid/block_mass.h"
#include "glint/query/detail/pyramid/block_rows.h"
#include "glint/query/detail/pyramid/pixel_spline.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"
#include "glint/query/detail/pyramid/texel_blend.h"
#include "glint/query/interpolation.h"
#include "glint/query/ndf_model.h"

namespace glint {

/// The NDF from a compressed pyramid: tensor rank (CP), Tucker-2 or PCA (Deng 2022, sections 4.2 to 4.4).
///
/// Chooses images as PyramidNdf does. A pixel is a sum of products of few factors. The sum over a box of pixels has the same
/// form, with factors from prefix sums (Eq. 6 and 7). Slices of few facets are stored as spots and an even rest instead.
///
/// Approximated pixels can be negative. `density` takes floors off the pixels (NdfCp::floors), takes negative pixels as 0, and
/// scales the image so that it then integrates to 1; between the half vectors of a pixel see Pixels. `mean` is a difference of
/// prefix sums, which include negative pixels and take no floors off: over whole pixels it is the exact average of
/// `signedDensity`, clamped at the end, and that of `density` where no floor is above 0 and no pixel is negative.
/// Thread-safe, allocates nothing; the arrays must outlive it.
class CpNdf {
  static constexpr int kMostBlocks = 64 * 64;  // blocks of the largest image, 1024^2 pixels

 public:
  GLINT_HD explicit CpNdf(const NdfCp& ndf, Interpolation interpolation = Interpolation::footprint,
                          Pixels pixels = Pixels::smooth)
      : ndf_(ndf), chooser_(ndf.shape, interpolation), pixels_(pixels), below_(ndf.shape, ndf.near_normals) {}
  /// @param normals  a NormalMap or NearNormals; instead of those that the asset keeps
  GLINT_HD CpNdf(const NdfCp& ndf, const NearNormals& normals, Interpolation interpolation = Interpolation::footprint,
                 Pixels pixels = Pixels::smooth)
      : ndf_(ndf), chooser_(ndf.shape, interpolation), pixels_(pixels), below_(ndf.shape, normals) {}

  GLINT_HD const NdfCp& ndfCp() const { return ndf_; }
  /// Whether footprints below level 0 are answered from the texels.
  GLINT_HD bool hasNormals() const { return below_.hasNormals(); }
  GLINT_HD const PyramidShape& shape() const { return ndf_.shape; }
  /// Whether the texels have a share in the answer of this footprint.
  GLINT_HD bool fromTexels(const Footprint& p) const { return below_.share(p) > 0; }
  /// As PyramidNdf::smallestSigma.
  GLINT_HD float smallestSigma() const { return hasNormals() ? 0 : std::sqrt(smallestSeenVariance(shape())); }

  GLINT_HD Pixels pixels() const { return pixels_; }

  /// Density towards h, >= 0; O(columns) for nine pixels, or one (Pixels), in each of 16 or 32 images, or of 8 (Interpolation).
  GLINT_HD float density(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return 0;
    return below_.density(p, h, [&] { return imageDensity(p, h); });
  }

  /// Average of the density over the pixel of the images that holds h, >= 0; O(columns) in each image.
  GLINT_HD float pixelMean(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return 0;
    const PixelPlace place = pixelPlace(shape(), h);
    return below_.mean(p, boxOfPixel(shape(), place), [&] { return imageMean(chooser_.choose(p), place); });
  }

  /// Draws an image by its weight, a block by its mass (Deng 2022, section 5.2), a pixel by its value, and a point in the pixel
  /// by its density. The result is exactly in proportion to the density, which is the pdf.
  ///
  /// Stored masses are rounded up, by at most a sixteenth. Where `xi` falls into the excess, another block is drawn with the
  /// digits of `xi` that are left: one time in forty on average. O(16 columns). O(256 columns) where `xi` falls into the excess
  /// or into mass that pixels of the same row hide which are negative or below their floors.
  GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    return below_.sample(
        p, xi, [&](Vec2 x) { return imageSample(p, x); }, [&](Vec2 h) { return insideSquare(h) ? imageDensity(p, h) : 0.0f; });
  }

  /// Average over a box of half vectors, >= 0, 0 if the box is empty; O(columns) for each block that the box covers.
  GLINT_HD float mean(const Footprint& p, const Box2& range) const { return finitePositive(signedMean(p, range)); }

  /// Density that keeps negative pixels and is constant over a pixel. Infinite or NaN where numbers of the file are.
  GLINT_HD float signedDensity(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return 0;
    return below_.density(p, h, [&] {
      const PixelPlace place = pixelPlace(shape(), h);
      return withReader(ndf_, [&]<class Reader>(const Reader& reader) {
        return sumSlices(chooser_.choose(p), place.block, ndf_.image_scales.data(), PixelOf<Reader>{reader, place}, Signed{});
      });
    });
  }

  /// Average of signedDensity over a box of half vectors, 0 if the box is empty: exact over whole pixels. Edges that cut pixels
  /// see BoxEdge.
  GLINT_HD float signedMean(const Footprint& p, const Box2& range) const {
    if (!(range.width() > 0 && range.height() > 0)) return 0;
    return below_.mean(p, range, [&] { return signedImageMean(chooser_.choose(p), range, pixels_); });
  }

 private:
  friend class CompressedTiles;  // asks images that it has chosen itself
  friend class WaveCpNdf;        // likewise, of several channels

  /// signedMean of chosen images. The range has an area.
  GLINT_HD float signedImageMean(const PyramidSlices& chosen, const Box2& range, Pixels pixels) const {
    return withReader(ndf_, [&]<class Reader>(const Reader& reader) {
      double sum = 0;
      forEachBlock(shape(), range, pixels, [&](int block, const BlockBox& box) {
        sum += double{sumSlices(chosen, block, ndf_.image_scales.data(), BoxOf<Reader>{reader, box}, Signed{})};
      });
      return static_cast<float>(sum / double{areaInPixels(shape(), range)});
    });
  }

  GLINT_HD float imageDensity(const Footprint& p, Vec2 h) const {
    const PyramidSlices chosen = chooser_.choose(p);
    const PixelPlace place = pixelPlace(shape(), h);
    if (pixels_ == Pixels::constant) return imageMean(chosen, place);
    return withReader(ndf_, [&](const auto& reader) { return splineDensity(shape(), window(reader, chosen, place), h); });
  }
  /// Mean density of a pixel, >= 0.
  GLINT_HD float imageMean(const PyramidSlices& chosen, const PixelPlace& place) const {
    return withReader(ndf_, [&]<class Reader>(const Reader& reader) {
      return finitePositive(
          sumSlices(chosen, place.block, ndf_.density_scales.data(), PixelOf<Reader>{reader, place}, AboveFloors{ndf_, place}));
    });
  }
  GLINT_HD HalfVectorSample imageSample(const Footprint& p, Vec2 xi) const;

  GLINT_HD std::size_t imageOf(const PyramidSlice& slice) const {
    return std::size_t{ndf_.first_image[slice.level]} + slice.image;
  }

  /// Keeps the values of slices as they are, negative ones too.
  struct Signed {
    GLINT_HD Signed in(const NdfCluster&) const { return {}; }
    GLINT_HD float operator()(float value) const { return value; }
    GLINT_HD Float4 operator()(Float4 values) const { return values; }
  };
  /// Takes the floor of the cluster off the values of slices, and takes negative values as 0.
  struct AboveFloor {
    float floor;
    GLINT_HD float operator()(float value) const { return std::max(0.0f, value - floor); }
    GLINT_HD Float4 operator()(Float4 values) const { return (values - Float4::all(floor)).positive(); }
  };
  /// AboveFloor, for one pixel of any cluster.
  struct AboveFloors {
    const NdfCp& ndf;
    PixelPlace place;
    GLINT_HD AboveFloor in(const NdfCluster& cluster) const { return {PixelFloors(ndf, cluster).at(place.x, place.y)}; }
  };

  /// Asks a block for one pixel.
  template <class Reader>
  struct PixelOf {
    Reader reader;
    PixelPlace place;
#ifdef GLINT_AVX2
    PixelOf<typename Reader::Avx2> avx2() const { return {typename Reader::Avx2(reader), place}; }
#endif
    GLINT_HD void project(const NdfCluster& cluster, const ColumnLayout& layout, float* projection) const {
      reader.pixel(cluster, layout, place.x, place.y, projection);
    }
    GLINT_HD void prefetch(const NdfCluster& cluster, std::uint64_t slice) const {
      reader.asksAlone(cluster) ? reader.prefetchAlone(cluster, slice, place.x, place.y)
                                : glint::prefetch(reader.row(cluster, slice));
    }
    GLINT_HD bool alone(const NdfCluster& cluster) const { return reader.asksAlone(cluster); }
    GLINT_HD float valueAlone(const NdfCluster& cluster, std::uint64_t slice) const {
      return reader.valueAlone(cluster, reader.row(cluster, slice), place.x, place.y);
    }
    GLINT_HD float spots(const SpotProfile& profile, const SpotList& list) const {
      return spotsAt(profile, list, place.x, place.y);
    }
  };
  /// Asks a block for the sum over a box of pixels.
  template <class Reader>
  struct BoxOf {
    Reader reader;
    BlockBox box;
#ifdef GLINT_AVX2
    BoxOf<typename Reader::Avx2> avx2() const { return {typename Reader::Avx2(reader), box}; }
#endif
    GLINT_HD void project(const NdfCluster& cluster, const ColumnLayout& layout, float* projection) const {
      reader.box(cluster, layout, box, projection);
    }
    GLINT_HD void prefetch(const NdfCluster& cluster, std::uint64_t slice) const {
      glint::prefetch(reader.row(cluster, slice));
    }
    GLINT_HD bool alone(const NdfCluster&) const { return false; }
    GLINT_HD float valueAlone(const NdfCluster&, std::uint64_t) const { return 0; }
    GLINT_HD float spots(const SpotProfile& profile, const SpotList& list) const { return spotsIn(profile, list, box); }
  };

  /// Weighted sum over the chosen images. Prefetches all slices first, so that their cache misses overlap.
  /// @param scales  factors of images, [images]
  /// @param ask     PixelOf or BoxOf
  /// @param part    Signed or AboveFloors
  template <class Ask, class Part>
  GLINT_HD float sumSlices(const PyramidSlices& chosen, int block, const float* scales, const Ask& ask, Part part) const {
    const SlicePlaces places = findSlices(ndf_, chosen, block, scales);
    for (int k = 0; k < places.count; ++k)
      if (places.weights[k] > 0) ask.prefetch(ndf_.clusters.data()[places.clusters[k]], places.slices[k]);
    return sumSlices(places, ask, part);
  }

  /// Weighted sum over slices. Slices of the same cluster share one projection; neighbouring images mostly are in one cluster.
  template <class Ask, class Part>
  GLINT_HD float sumSlices(const SlicePlaces& places, const Ask& ask, Part part) const {
#ifdef GLINT_AVX2
    if (hasAvx2()) return sumSlicesAvx2(places, ask, part);
#endif
    return sumSlicesBy(places, ask, part);
  }
#ifdef GLINT_AVX2
  template <class Ask, class Part>
  GLINT_AVX2 GLINT_FLATTEN float sumSlicesAvx2(const SlicePlaces& places, const Ask& ask, Part part) const {
    return sumSlicesBy(places, ask.avx2(), part);
  }
#endif

  template <class Ask, class Part>
  GLINT_HD float sumSlicesBy(const SlicePlaces& places, const Ask& ask, Part part) const {
    unsigned left = counted(places);
    float sum = 0;
    while (left != 0) {
      const int lowest = lowestBit(left);
      const std::uint32_t at = places.clusters[lowest];
      const NdfCluster& cluster = ndf_.clusters.data()[at];
      if (ask.alone(cluster)) {
        left &= left - 1;
        sum += places.weights[lowest] * part.in(cluster)(ask.valueAlone(cluster, places.slices[lowest]));
        continue;
      }
      const auto shares = [&](int step) { return whereEqual(places.clusters + step, at, Float4::load(places.weights + step)); };
      const unsigned here = countedIn(places, at);
      left &= ~here;
      if (cluster.columns == 0) {
        sum += addSpots(cluster, places, here, ask);
        continue;
      }
      const ColumnLayout layout(cluster);
      float projection[ColumnLayout::kMost];
      ask.project(cluster, layout, projection);
      const auto rows = ask.reader.rows(cluster, layout);
      const auto kept = part.in(cluster);
      for (int step = 0; step < places.count; step += 4) {
        const unsigned lanes = here >> step & 15;
        if (lanes == 0) continue;
        const int first = step + lowestBit(lanes);
        if ((lanes & (lanes - 1)) == 0) {
          sum += places.weights[first] * kept(ask.reader.dot(projection, layout, rows(places.slices[first])));
          continue;
        }
        // Four slices are read at once. Lanes of other clusters repeat a slice of this cluster, with weight 0.
        const auto lane = [&](int k) { return rows(places.slices[lanes >> k & 1 ? step + k : first]); };
        sum += (shares(step) * kept(ask.reader.dots(projection, layout, {lane(0), lane(1), lane(2), lane(3)}))).sum();
      }
    }
    return sum;
  }

  /// Mean densities of a pixel and of its neighbours, >= 0.
  template <class Reader>
  GLINT_HD PixelWindow window(const Reader& reader, const PyramidSlices& chosen, const PixelPlace& place) const {
    WindowRows window;
    forEachBlockOfWindow(shape(), place, [&](int block, int x, int y) {
      const SlicePlaces places = findSlices(ndf_, chosen, block, ndf_.density_scales.data());
      prefetchRows(reader, places);
      addWindows(reader, &places, 1, x, y, &window);
    });
    return window.pixels();
  }
  template <class Reader>
  GLINT_HD void prefetchRows(const Reader& reader, const SlicePlaces& places) const {
    for (int k = 0; k < places.count; ++k)
      if (places.weights[k] > 0) prefetch(reader.row(ndf_.clusters.data()[places.clusters[k]], places.slices[k]));
  }

  /// Adds the parts of windows that lie in a block. Pixels of a slice are less their floors, and negative ones count as 0.
  /// @param places   [count]: slices of each window
  /// @param count    of windows, 1 to kMostWindows
  /// @param x, y     column and row of a window's first pixel in the block, -2 to 15
  /// @param windows  [count]
  template <class Reader>
  GLINT_HD void addWindows(const Reader& reader, const SlicePlaces* places, int count, int x, int y,
                           WindowRows* windows) const {
#ifdef GLINT_AVX2
    if (hasAvx2()) return addWindowsAvx2(reader, places, count, x, y, windows);
#endif
    addWindowsBy(reader, places, count, x, y, windows);
  }
#ifdef GLINT_AVX2
  template <class Reader>
  GLINT_AVX2 GLINT_FLATTEN void addWindowsAvx2(const Reader& reader, const SlicePlaces* places, int count, int x, int y,
                                               WindowRows* windows) const {
    addWindowsBy(typename Reader::Avx2(reader), places, count, x, y, windows);
  }
#endif

  /// Windows that are summed at once: they share the values of columns.
  static constexpr int kMostWindows = 4;

  template <class Reader>
  GLINT_HD void addWindowsBy(const Reader& reader, const SlicePlaces* places, int count, int x, int y,
                             WindowRows* windows) const {
    unsigned left[kMostWindows];  // bit k: slice k of the window's places is yet to be added
    for (int w = 0; w < count; ++w) left[w] = counted(places[w]);
    for (int w = 0; w < count; ++w) {
      while (left[w] != 0) {
        const std::uint32_t at = places[w].clusters[lowestBit(left[w])];
        unsigned here[kMostWindows] = {};
        for (int other = w; other < count; ++other) {
          here[other] = countedIn(places[other], at);
          left[other] &= ~here[other];
        }
        const NdfCluster& cluster = ndf_.clusters.data()[at];
        if (cluster.columns == 0) {
          for (int other = w; other < count; ++other)
            addWindowOfSpots(cluster, places[other], here[other], x, y, windows[other]);
        } else {
          const ClusterWindow<Reader> columns(ndf_, reader, cluster, x, y);
          for (int other = w; other < count; ++other) columns.add(places[other], here[other], windows[other]);
        }
      }
    }
  }

  /// The columns of a cluster at the pixels of a window.
  template <class Reader>
  class ClusterWindow {
    static constexpr int kRows = ColumnWindows::kRows;

   public:
    /// @param x, y  column and row of the window's first pixel in the block, -2 to 15
    GLINT_HD ClusterWindow(const NdfCp& ndf, const Reader& reader, const NdfCluster& cluster, int x, int y)
        : reader_(reader), cluster_(cluster) {
      reader.window(cluster, x, y, columns_);
      PixelFloors(ndf, cluster).window(x, y, floors_);
    }

    /// Adds slices of the cluster.
    /// @param here  bit k: slice k of `places` is in the cluster
    GLINT_HD void add(const SlicePlaces& places, unsigned here, WindowRows& window) const {
      for (; here != 0; here &= here - 1) {
        const int slice = lowestBit(here);
        float scaled[kMaxColumns];
        reader_.scaledCoefficients(cluster_, reader_.row(cluster_, places.slices[slice]), scaled);
        // Two sums of each row, so that an addition need not wait for the previous one.
        Float4 even[kRows], odd[kRows];
        for (int row = 0; row < kRows; ++row) even[row] = odd[row] = Float4::zero();
        int k = 0;
        for (; k + 2 <= cluster_.columns; k += 2) {
          for (int row = 0; row < kRows; ++row) {
            even[row] = even[row] + Float4::all(scaled[k]) * columns_.row(k, row);
            odd[row] = odd[row] + Float4::all(scaled[k + 1]) * columns_.row(k + 1, row);
          }
        }
        if (k < cluster_.columns)
          for (int row = 0; row < kRows; ++row) even[row] = even[row] + Float4::all(scaled[k]) * columns_.row(k, row);
        for (int row = 0; row < kRows; ++row)
          window.rows[row] =
              window.rows[row] + Float4::all(places.weights[slice]) * (even[row] + odd[row] - floors_[row]).positive();
      }
    }

   private:
    const Reader& reader_;
    const NdfCluster& cluster_;
    ColumnWindows columns_;
    Float4 floors_[kRows];
  };

  GLINT_HD void addWindowOfSpots(const NdfCluster& cluster, const SlicePlaces& places, unsigned here, int x, int y,
                                 WindowRows& window) const {
    const SpotProfile profile(ndf_);
    for (; here != 0; here &= here - 1) {
      const int slice = lowestBit(here);
      addSpotWindow(profile, spotsOf(ndf_, cluster, places.slices[slice]), x, y, places.weights[slice], window);
    }
  }

  /// Bit k: slice k has a weight.
  static GLINT_HD unsigned counted(const SlicePlaces& places) {
    unsigned bits = 0;
    for (int k = 0; k < places.count; k += 4) bits |= lanesAbove0(Float4::load(places.weights + k)) << k;
    return bits;
  }
  /// Bit k: slice k has a weight and is in a cluster.
  static GLINT_HD unsigned countedIn(const SlicePlaces& places, std::uint32_t cluster) {
    unsigned bits = 0;
    for (int k = 0; k < places.count; k += 4)
      bits |= lanesAbove0(whereEqual(places.clusters + k, cluster, Float4::load(places.weights + k))) << k;
    return bits;
  }
  static GLINT_HD unsigned lanesAbove0(Float4 weights) { return ~weights.notAbove(0) & 15u; }

  /// Weighted sum over slices of a cluster of spots.
  /// @param here  bit k: slice k of `places` is in the cluster
  template <class Ask>
  GLINT_HD float addSpots(const NdfCluster& cluster, const SlicePlaces& places, unsigned here, const Ask& ask) const {
    const SpotProfile profile(ndf_);
    float sum = 0;
    for (; here != 0; here &= here - 1) {
      const int k = lowestBit(here);
      sum += places.weights[k] * ask.spots(profile, spotsOf(ndf_, cluster, places.slices[k]));
    }
    return sum;
  }

  /// A sample that is being drawn: chooseImage, chooseBlock, findBlockSlice and choosePixel fill it in this order.
  struct Draw;
  GLINT_HD Draw chooseImage(const PyramidSlices& chosen, Vec2 xi) const;
  GLINT_HD void chooseBlock(Draw& draw) const;
  GLINT_HD void findBlockSlice(Draw& draw) const;
  template <class Reader>
  GLINT_HD void choosePixel(const Reader& reader, Draw& draw) const;

  /// Sums of the rows of a slice and single rows of its pixels, for clusters of columns and for clusters of spots.
  template <class Reader>
  class SliceRows {
   public:
    GLINT_HD SliceRows(const NdfCp& ndf, const Reader& reader, const SlicePlace& at)
        : reader_(reader), cluster_(ndf.clusters.data()[at.cluster]), profile_(ndf) {
      if (cluster_.columns == 0)
        spots_ = spotsOf(ndf, cluster_, at.slice);
      else
        reader.sliceWeights(cluster_, reader.row(cluster_, at.slice), weights_);
    }

    /// A lower bound of the mass of each row: its sum with floors taken off and negative pixels included.
    GLINT_HD Float16 leastSums() const {
      return cluster_.columns == 0 ? spotRowSums(profile_, spots_) : reader_.leastSums(cluster_, weights_);
    }
    /// The mass of each row beyond `least`. Decodes all pixels.
    GLINT_HD Float16 addedSums(const Float16& least) const {
      float pixels[kBlockPixels];
      if (cluster_.columns == 0)  // no pixel of spots is negative
        std::fill(pixels, pixels + kBlockPixels, 0.0f);
      else
        reader_.block(cluster_, weights_, pixels);
      return (sumRows(pixels) - least).positive();
    }
    /// Pixels of a row, >= 0.
    GLINT_HD Float16 row(int y) const {
      return cluster_.columns == 0 ? spotRow(profile_, spots_, y) : reader_.rowPixels(cluster_, weights_, y);
    }

   private:
    const Reader& reader_;
    const NdfCluster& cluster_;
    SpotProfile profile_;
    SpotList spots_ = {};
    float weights_[kBlockPixels];
  };

  /// Chooses a pixel of the chosen block in proportion to its value: its row with xi.y, its column with xi.x.
  ///
  /// The stored mass of the block has three parts, and xi.y falls into one of them:
  ///  1. Lower bounds of the rows (leastSums). They are cheap, and choose the row.
  ///  2. The rest of the rows' mass, which pixels below their floors hide (addedSums). Chooses the row after decoding all pixels.
  ///  3. The excess from rounding the stored mass up. No pixel is chosen.
  /// @param last_try  whether this is the last block that is tried (one in a million); then lower bounds alone choose the row
  /// @return false in case 3: the caller draws another block with the digits of xi that are left
  template <class Reader>
  GLINT_DEVICE_CALL GLINT_HD bool choosePixelOfBlock(const Reader& reader, bool last_try, Draw& draw) const;
  template <class Reader>
  GLINT_HD void choosePixelBy(const Reader& reader, Draw& draw) const;

  NdfCp ndf_;
  SliceChooser chooser_;
  Pixels pixels_;
  TexelBlend below_;
};

struct CpNdf::Draw {
  Vec2 xi;
  float total = 0;  ///< sum of the weights of images that have any density
  bool possible = false;
  std::size_t image = 0;
  int block = 0, block_place = 0;
  float mass = 0;  ///< stored mass of the block: at least its share of the image
  SlicePlace slice;
  PixelPlace place = {0, -1, -1};  ///< x = -1: nothing can be drawn
};

inline GLINT_HD CpNdf::Draw CpNdf::chooseImage(const PyramidSlices& chosen, Vec2 xi) const {
  Draw draw;
  draw.xi = clampUnit(xi);
  float weights[PyramidSlices::kMost];
  for (int k = 0; k < chosen.count; ++k) {  // images without a pixel above its floor have no density
    weights[k] = ndf_.density_scales.data()[imageOf(chosen[k])] > 0 ? chosen.weights[k] : 0.0f;
    draw.total += weights[k];
  }
  const int k = chooseIndex(
      chosen.count, draw.total, [&](int i) { return weights[i]; }, draw.xi.x);
  if (k < 0) return draw;
  draw.possible = true;
  draw.image = imageOf(chosen[k]);
  prefetch(ndf_.block_masks.data() + draw.image * static_cast<std::size_t>(ndf_.placeWords()));
  return draw;
}

/// Chooses a block in proportion to its stored mass, with xi.y.
inline GLINT_HD void CpNdf::chooseBlock(Draw& draw) const {
  if (!draw.possible) return;
  const std::uint32_t* first = ndf_.first_block.data() + draw.image;
  const BlockMasses masses(ndf_.block_masses.data() + first[0], static_cast<int>(first[1] - first[0]),
                           ndf_.block_masses.size() - first[0]);
  const int rank = chooseOfMany<kMostBlocks>(masses, draw.xi.y);
  draw.possible = rank >= 0;
  if (!draw.possible) return;
  draw.block_place = placeOfRank(ndf_.block_masks.data() + draw.image * static_cast<std::size_t>(ndf_.placeWords()), rank);
  draw.block = ndf_.place_blocks.data()[draw.block_place];
  draw.mass = masses[rank];
}

inline GLINT_HD void CpNdf::findBlockSlice(Draw& draw) const {
  if (!draw.possible) return;
  draw.slice = findSlice(ndf_, draw.image, draw.block_place);
  draw.possible = draw.slice.found();
}

template <class Reader>
GLINT_HD bool CpNdf::choosePixelOfBlock(const Reader& reader, bool last_try, Draw& draw) const {
  const auto resolution = static_cast<float>(shape().resolution);
  float mass = draw.mass * 0.25f * resolution * resolution / ndf_.density_scales.data()[draw.image];  // sum of pixels
  const SliceRows<Reader> rows(ndf_, reader, draw.slice);
  Float16 sums = rows.leastSums();
  float total = sums.sum(), reached = draw.xi.y * (last_try ? total : mass);
  if (!(reached < total) && !last_try) {
    reached -= total;
    mass -= total;
    sums = rows.addedSums(sums);
    total = sums.sum();
    if (!(reached < total)) {
      draw.xi.y = clampUnit((reached - total) / (mass - total));
      return false;
    }
  }
  const int y = std::max(chooseAt(sums, reached, draw.xi.y), 0);
  draw.place = {draw.block, chooseOf16(rows.row(y), draw.xi.x), y};
  return true;
}

template <class Reader>
GLINT_HD void CpNdf::choosePixel(const Reader& reader, Draw& draw) const {
#ifdef GLINT_AVX2
  if (hasAvx2()) return choosePixelBy(typename Reader::Avx2(reader), draw);
#endif
  choosePixelBy(reader, draw);
}

template <class Reader>
GLINT_HD void CpNdf::choosePixelBy(const Reader& reader, Draw& draw) const {
  constexpr int kTries = 4;
  for (int tries = 1; draw.possible && !choosePixelOfBlock(reader, tries == kTries, draw); ++tries) {
    chooseBlock(draw);
    findBlockSlice(draw);
  }
}

// Defined after the templates that it calls, because clang instantiates only templates that it has read.
inline GLINT_HD HalfVectorSample CpNdf::imageSample(const Footprint& p, Vec2 xi) const {
  const PyramidSlices chosen = chooser_.choose(p);
  Draw draw = chooseImage(chosen, xi);
  chooseBlock(draw);
  findBlockSlice(draw);
  if (!draw.possible) return {};
  return withReader(ndf_, [&]<class Reader>(const Reader& reader) -> HalfVectorSample {
    // Prefetches the slices that the pdf needs; they arrive while the pixel is chosen.
    prefetchRows(reader, findSlices(ndf_, chosen, draw.block, ndf_.density_scales.data()));
    choosePixel(reader, draw);
    if (draw.place.x < 0) return {};
    if (pixels_ == Pixels::constant)
      return drawnAt(pointInPixel(shape(), draw.place, draw.xi), finitePositive(imageMean(chosen, draw.place) / draw.total));
    PixelWindow pixels = window(reader, chosen, draw.place);
    pixels *= 1 / draw.total;
    return splineSample(shape(), draw.place, pixels, draw.xi);
  });
}

static_assert(NdfModel<CpNdf>);

}  // namespace glint
