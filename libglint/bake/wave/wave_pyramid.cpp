#include "glint/bake/wave/wave_pyramid.h"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "glint/bake/common/slopes.h"
#include "glint/bake/pyramid/agreement.h"
#include "glint/bake/pyramid/image_bytes.h"
#include "glint/bake/wave/coherent_images.h"
#include "glint/bake/wave/colour_weights.h"
#include "glint/bake/wave/wave_images.h"
#include "glint/model/error.h"
#include "glint/model/texel_name.h"

namespace glint::bake {
namespace {

/// Slopes above this are refused: psi would be far outside its square, and samples many in each texel.
constexpr double kMostPsi = 4;
/// Light of a facet reaches so many deviations of its spot.
constexpr double kSpots = 6;

void require(bool ok, const char* option, const std::string& what, const std::string& remedy) {
  if (!ok) throw Error(ErrorCode::usage, "option.range", {}, option, what, remedy);
}

void checkWavelengths(const WaveOptions& o) {
  const std::vector<float>& waves = o.wavelengths_um;
  require(!waves.empty() && waves.size() <= kMostWaveChannels, "--wavelengths", fmt::format("{} wavelengths", waves.size()),
          fmt::format("give 1 to {}", kMostWaveChannels));
  for (std::size_t k = 0; k < waves.size(); ++k) {
    require(waves[k] >= kLeastWavelengthUm && waves[k] <= kMostWavelengthUm, "--wavelengths",
            fmt::format("{:g} um is no wavelength of light", waves[k]),
            fmt::format("give micrometres from {:g} to {:g}, such as 0.45,0.55,0.65", kLeastWavelengthUm, kMostWavelengthUm));
    require(k == 0 || waves[k - 1] < waves[k], "--wavelengths", "wavelengths do not rise",
            "list each once, the shortest first");
  }
  const bool visible = std::any_of(waves.begin(), waves.end(),
                                   [](float wave) { return wave >= kShortestVisibleUm && wave <= kLongestVisibleUm; });
  require(o.spectral || waves.size() == 1 || visible, "--wavelengths", "no wavelength is visible, so there is no colour",
          "add --spectral, or wavelengths from 0.36 to 0.83");
}

/// Mean and covariance of the slopes of the texels, by central differences. In one thread: O(texels).
MapSlopes slopesOf(const HeightMap& map) {
  std::vector<Vec2> row(static_cast<std::size_t>(map.width));
  double sums[5] = {};
  for (int j = 0; j < map.height; ++j) {
    rowSlopes(map.width, map.height, map.heights, j, Boundary::wrap, Gradient::central, row);
    for (const Vec2 s : row) {
      const double x = s.x, y = s.y;
      sums[0] += x, sums[1] += y, sums[2] += x * x, sums[3] += x * y, sums[4] += y * y;
    }
  }
  for (double& sum : sums) sum /= static_cast<double>(map.width) * map.height;
  const auto rounded = [](double value) { return static_cast<float>(value); };
  return {{rounded(sums[0]), rounded(sums[1])},
          {rounded(std::max(sums[2] - sums[0] * sums[0], 0.0)), rounded(sums[3] - sums[0] * sums[1]),
           rounded(std::max(sums[4] - sums[1] * sums[1], 0.0))}};
}

/// Largest share of light where aliasing begins, of a few places all over the map.
double borderShare(const HeightSpline& spline, double texel_um, const WaveGrid& grid) {
  constexpr int kPlaces = 4;  // along each axis
  const CoherentImager imager(grid);
  CoherentImager::Scratch scratch(grid);
  double most = 0;
  for (int j = 0; j < kPlaces; ++j)
    for (int i = 0; i < kPlaces; ++i) {
      const double x = (i + 0.37) / kPlaces * spline.width() * texel_um, y = (j + 0.37) / kPlaces * spline.height() * texel_um;
      PhaseRows rows(spline, texel_um, grid, x - 0.5 * grid.window_um() - grid.step_um, grid.size + 4);
      rows.compute(std::llround(y / grid.step_um) - grid.size / 2, grid.size);
      most = std::max(most, imager.borderShare(rows, x, y, scratch));
    }
  return most;
}

/// The grid for directions up to psi, unless it is too large to compute with.
WaveGrid gridFor(double wavelength, const WaveOptions& o, double psi) {
  constexpr int kMostSamples = 4096;  // along an axis: 200 MB for each thread
  const WaveGrid grid = waveGrid(wavelength, double{o.coherence_um}, o.resolution, psi);
  require(grid.size <= kMostSamples, "--coherence-um",
          fmt::format("{:g} um takes {} x {} samples of the surface for each image", o.coherence_um, grid.size, grid.size),
          fmt::format("give at most about {:.3g}", double{o.coherence_um} * kMostSamples / grid.size));
  return grid;
}

/// Grids that see all light of all wavelengths but for kMostAliased: from the steepest slope on, larger where the surface
/// diffracts light beyond it.
std::vector<WaveGrid> chooseGrids(const HeightSpline& spline, const HeightMap& map, const WaveOptions& o, double steepest) {
  constexpr double kGrowth = 1.2;
  std::vector<WaveGrid> grids;
  for (const double wavelength : o.wavelengths_um) {
    double psi = steepest + kSpots * spotDeviation(wavelength, double{o.coherence_um});
    WaveGrid grid = gridFor(wavelength, o, psi);
    while (borderShare(spline, double{map.texel_size_um}, grid) > kMostAliased) {
      psi = std::max(psi, grid.largestPsi()) * kGrowth;
      if (psi > kMostPsi)
        throw Error(ErrorCode::unsupported, "heights.rough", {}, {},
                    fmt::format("the surface scatters light of {:g} um over the horizon and far beyond", wavelength),
                    "smooth the heights, or check --texel-size-um");
      grid = gridFor(wavelength, o, psi);
    }
    grids.push_back(grid);
  }
  return grids;
}

/// Positions of `count` places along a periodic axis.
std::vector<double> evenPlaces(int count, double length) {
  std::vector<double> places;
  for (int k = 0; k < count; ++k) places.push_back((k + 0.5) * length / count);
  return places;
}

/// Makes level 0 and the mean of the map: coherent images row by row, each added to the footprints that see it. Footprints are
/// packed as soon as all rows that they see are done, so that only some rows of them are in memory.
class FinestLevel {
 public:
  FinestLevel(const HeightSpline& spline, const WaveOptions& options, std::vector<WaveGrid> grids,
              const std::vector<std::vector<float>>& weights, WavePyramidData& pyramid)
      : spline_(spline),
        grids_(std::move(grids)),
        weights_(weights),
        pyramid_(pyramid),
        shape_(pyramid.grey.shape),
        texel_um_(double{pyramid.shape.texel_size_um}),
        sigma_(double{kFootprintPerStride} * shape_.levels[0].stride),
        rows_v_(centresAlong(shape_, 0, 1)),
        most_pixels_(mostPixels(grids_)),
        mean_(emptyImage()) {
    const double gap = std::min(double{options.coherence_um} / texel_um_, sigma_) / double{options.kernels};
    kernel_columns_ = std::max(1, static_cast<int>(std::ceil(shape_.width / gap)));
    kernel_rows_ = std::max(1, static_cast<int>(std::ceil(shape_.height / gap)));
    kernels_u_ = evenPlaces(kernel_columns_, shape_.width);
    shares_u_ = gaussianShares(centresAlong(shape_, 0, 0), kernels_u_, shape_.width, sigma_);
    // One more target: the mean of the map.
    shares_u_.emplace_back(kernels_u_.size(), 1 / static_cast<float>(kernel_columns_));
    // Rows of kernels from the first that row 0 of the footprints sees to the last that the last row sees, counted beyond the map.
    const double per_texel = kernel_rows_ / static_cast<double>(shape_.height), reach = kFootprintReach * sigma_;
    first_row_ = std::min<std::ptrdiff_t>(0, static_cast<std::ptrdiff_t>(std::floor((rows_v_.front() - reach) * per_texel)));
    end_row_ =
        std::max<std::ptrdiff_t>(kernel_rows_, static_cast<std::ptrdiff_t>(std::ceil((rows_v_.back() + reach) * per_texel)));
    for (const WaveGrid& grid : grids_) imagers_.emplace_back(std::make_unique<CoherentImager>(grid));
  }

  std::size_t unitsOfWork() const { return static_cast<std::size_t>(end_row_ - first_row_) * grids_.size(); }
  int halfPixels() const { return most_pixels_ / 2; }
  int kernelColumns() const { return kernel_columns_; }
  int kernelRows() const { return kernel_rows_; }

  /// Makes the images of level 0, and packs them.
  void build(ProgressCounter& counter) {
    constexpr std::ptrdiff_t kBand = 16;  // rows of kernels that share rows of samples
    for (std::ptrdiff_t first = first_row_; first < end_row_; first += kBand) {
      const std::ptrdiff_t end = std::min(first + kBand, end_row_);
      for (std::size_t k = 0; k < grids_.size(); ++k) addBand(first, end, k, counter);
      const double done = placeOf(end) - 0.5 * rowGap() - kFootprintReach * sigma_;
      while (!sums_.empty() && (end == end_row_ || rows_v_[static_cast<std::size_t>(sums_.begin()->first)] < done)) {
        pack(sums_.begin()->second);
        sums_.erase(sums_.begin());
      }
    }
    finishLevel(pyramid_, 0);
  }

  /// Appends the image that is the mean of the map, as a level.
  void appendMean(std::size_t level) {
    std::vector<StoredWaveImage> image;
    image.push_back(storeImage(mean_, pyramid_.grey.precision, pyramid_.grey.value_scale));
    appendImages(image, pyramid_, level);
    finishLevel(pyramid_, level);
  }

 private:
  static int mostPixels(const std::vector<WaveGrid>& grids) {
    int most = 2;
    for (const WaveGrid& grid : grids) most = std::max(most, grid.pixels());
    return most;
  }
  DenseImage emptyImage() const { return {shape_.resolution, most_pixels_ / 2, pyramid_.shape.channels}; }
  double rowGap() const { return static_cast<double>(shape_.height) / kernel_rows_; }
  /// Position of a row of kernels, texels, counted beyond the map.
  double placeOf(std::ptrdiff_t row) const { return (static_cast<double>(row) + 0.5) * rowGap(); }

  /// Adds the rows [first, end) of kernels, at one wavelength.
  void addBand(std::ptrdiff_t first, std::ptrdiff_t end, std::size_t wave, ProgressCounter& counter) {
    const WaveGrid& grid = grids_[wave];
    const double left = -0.5 * grid.window_um() - 2 * grid.step_um;
    const auto columns = static_cast<int>(std::ceil((shape_.width * texel_um_ - 2 * left) / grid.step_um)) + 2;
    PhaseRows samples(spline_, texel_um_, grid, left, columns);
    const auto sampleOf = [&](std::ptrdiff_t row) { return std::llround(placeOf(row) * texel_um_ / grid.step_um); };
    const std::ptrdiff_t low = sampleOf(first) - grid.size / 2, high = sampleOf(end - 1) + grid.size / 2;
    samples.compute(low, static_cast<int>(high - low));
    tbb::enumerable_thread_specific<CoherentImager::Scratch> scratch([&] { return CoherentImager::Scratch(grid); });
    const auto pixels = static_cast<std::size_t>(grid.pixels()) * static_cast<std::size_t>(grid.pixels());
    std::vector<float> images(pixels * static_cast<std::size_t>(kernel_columns_));
    for (std::ptrdiff_t row = first; row < end; ++row) {
      tbb::parallel_for(0, kernel_columns_, [&](int i) {
        imagers_[wave]->image(samples, kernels_u_[static_cast<std::size_t>(i)] * texel_um_, placeOf(row) * texel_um_,
                              scratch.local(), images.data() + pixels * static_cast<std::size_t>(i));
      });
      addRow(row, wave, images);
      counter.advance();
    }
  }

  /// Adds a row of kernels to the footprints that see it.
  void addRow(std::ptrdiff_t row, std::size_t wave, const std::vector<float>& images) {
    struct Seen {
      std::vector<DenseImage>* images;
      float share;
    };
    std::vector<Seen> seen;
    for (std::size_t b = 0; b < rows_v_.size(); ++b) {
      const double x = (placeOf(row) - rows_v_[b]) / sigma_;
      if (std::abs(x) > kFootprintReach) continue;
      auto& sums = sums_[static_cast<int>(b)];
      if (sums.empty()) sums.assign(static_cast<std::size_t>(shape_.levels[0].columns), emptyImage());
      seen.push_back({&sums, static_cast<float>(std::exp(-0.5 * x * x) / rowShares(b))});
    }
    const bool inside = row >= 0 && row < kernel_rows_;
    const int pixels = grids_[wave].pixels();
    const auto size = static_cast<std::size_t>(pixels) * static_cast<std::size_t>(pixels);
    tbb::parallel_for(std::size_t{0}, shares_u_.size(), [&](std::size_t a) {
      const bool is_mean = a + 1 == shares_u_.size();
      if (is_mean && !inside) return;
      std::vector<float> sum(size, 0.0f), weights(weights_[wave].size());
      for (std::size_t i = 0; i < shares_u_[a].size(); ++i)
        if (const float share = shares_u_[a][i]; share > 0)
          for (std::size_t k = 0; k < size; ++k) sum[k] += share * images[i * size + k];
      const auto addTo = [&](DenseImage& image, float share) {
        for (std::size_t c = 0; c < weights.size(); ++c) weights[c] = share * weights_[wave][c];
        image.add(sum.data(), pixels, weights.data());
      };
      if (is_mean) return addTo(mean_, 1 / static_cast<float>(kernel_rows_));
      for (const Seen& footprints : seen) addTo((*footprints.images)[a], footprints.share);
    });
  }

  /// Sum of the weights of all rows of kernels that a row of footprints sees.
  double rowShares(std::size_t b) const {
    double sum = 0;
    for (std::ptrdiff_t row = first_row_; row < end_row_; ++row) {
      const double x = (placeOf(row) - rows_v_[b]) / sigma_;
      if (std::abs(x) <= kFootprintReach) sum += std::exp(-0.5 * x * x);
    }
    return sum;
  }

  void pack(const std::vector<DenseImage>& sums) {
    std::vector<StoredWaveImage> images(sums.size());
    tbb::parallel_for(std::size_t{0}, sums.size(), [&](std::size_t k) {
      images[k] = storeImage(sums[k], pyramid_.grey.precision, pyramid_.grey.value_scale);
    });
    appendImages(images, pyramid_, 0);
  }

  const HeightSpline& spline_;
  std::vector<WaveGrid> grids_;
  const std::vector<std::vector<float>>& weights_;  // [wavelengths][channels]
  WavePyramidData& pyramid_;
  const PyramidShape& shape_;
  double texel_um_, sigma_;  // sigma_: of footprints, texels
  std::vector<double> rows_v_, kernels_u_;
  int kernel_columns_ = 0, kernel_rows_ = 0, most_pixels_;
  std::ptrdiff_t first_row_ = 0, end_row_ = 0;
  std::vector<std::vector<float>> shares_u_;  // [columns + 1][kernel_columns]
  std::vector<std::unique_ptr<CoherentImager>> imagers_;
  std::map<int, std::vector<DenseImage>> sums_;  // [row of footprints][column]
  DenseImage mean_;
};

/// Sets what the channels are. @return [wavelengths][channels]: how much each wavelength counts in each channel
std::vector<std::vector<float>> setChannels(const WaveOptions& o, WavePyramidData& pyramid) {
  const std::size_t count = o.wavelengths_um.size();
  const auto weights = xyzWeights(o.wavelengths_um);
  const auto rgb = rgbOfXyz();
  const bool spectral = o.spectral || count == 1;
  pyramid.shape.meaning = spectral ? WaveChannels::spectral : WaveChannels::xyz;
  pyramid.shape.channels = spectral ? static_cast<int>(count) : 3;
  std::vector<std::vector<float>> shares(count);
  if (!spectral) pyramid.channel_rgb.assign(rgb.begin(), rgb.end());
  for (std::size_t k = 0; k < count; ++k) {
    if (!spectral) {
      shares[k].assign(weights[k].begin(), weights[k].end());
      continue;
    }
    shares[k].assign(count, 0);
    shares[k][k] = 1;
    pyramid.channel_rgb.push_back(weights[k][0] * rgb[0] + weights[k][1] * rgb[1] + weights[k][2] * rgb[2]);
  }
  return shares;
}

PyramidShape shapeOf(const HeightMap& map, const WaveOptions& o) {
  PyramidOptions options;
  options.stride = o.stride, options.overlap = o.overlap, options.resolution = o.resolution, options.levels = o.levels;
  options.surface = Surface::smooth;
  double mean = 0;
  for (const double wavelength : o.wavelengths_um) mean += wavelength / static_cast<double>(o.wavelengths_um.size());
  options.sigma_r = static_cast<float>(spotDeviation(mean, double{o.coherence_um}));
  PyramidShape shape = pyramidShape(map.width, map.height, options);
  shape.slopes = slopesOf(map);
  return shape;
}

/// Drops the coarsest level of footprints while the next finer level agrees with it, as buildPyramid does.
void dropAgreeingLevels(WavePyramidData& pyramid) {
  PyramidShape& shape = pyramid.grey.shape;
  const int levels = shape.footprintLevels();
  int kept = levels;
  while (kept > 1 && levelDisagreement(pyramid.grey.view(), kept - 2) < kAgreement) --kept;
  const PyramidGrid mean = {2 * shape.levels[kept - 1].stride, 1, 1};
  const auto drop = [&](auto& list) { list.erase(list.begin() + kept, list.begin() + levels); };
  drop(pyramid.grey.levels), drop(pyramid.half_pixels), drop(pyramid.float_pixels);
  for (int l = kept; l < shape.level_count; ++l) shape.levels[l] = {};
  shape.levels[kept] = mean;
  shape.level_count = kept + 1;
}

}  // namespace

WavePyramid WavePyramidData::view() const {
  WavePyramid v = shape;
  v.grey = grey.view();
  v.wavelengths_um = wavelengths_um;
  v.channel_rgb = channel_rgb;
  for (std::size_t l = 0; l < grey.levels.size(); ++l)
    v.pixels[l] =
        grey.precision == BlockPrecision::f16 ? static_cast<const void*>(half_pixels[l].data()) : float_pixels[l].data();
  return v;
}

void checkWaveOptions(const HeightMap& map, const WaveOptions& o) {
  if (!(map.texel_size_um > 0))
    throw Error(ErrorCode::invalid_input, "heights.texel_size", {}, "/@texel_size_um", "the size of a texel is not known",
                "make the heights again with glint-ingest --texel-size-um");
  checkWavelengths(o);
  require(o.stride >= 2 && o.stride <= 65536, "--stride", "out of range", "give 2 to 65536 texels");
  require(o.overlap >= 1 && o.overlap <= kMostOverlap, "--overlap", "out of range", "give 1 to 4 footprints in a stride");
  require(o.resolution >= kLeastResolution && o.resolution <= kMostResolution && o.resolution % kBlockSize == 0, "--resolution",
          "out of range", "give a multiple of 16 from 32 to 1024");
  require(o.levels >= 0 && o.levels < kMaxPyramidLevels, "--levels", "out of range", "give auto or 1 to 15");
  const float side_um = static_cast<float>(std::min(map.width, map.height)) * map.texel_size_um;
  const float longest = o.wavelengths_um.back();
  require(o.coherence_um >= longest && o.coherence_um <= side_um, "--coherence-um", fmt::format("{:g} um", o.coherence_um),
          side_um >= longest ? fmt::format("give the longest wavelength, {:g}, to the size of the map, {:g}", longest, side_um)
                             : fmt::format("the map is {:g} um wide: take a larger one", side_um));
  // Coherent images are a coherence area apart: texels that are far wider than the area would take as many images as it takes.
  constexpr double kMostImages = 1 << 24;
  const double gap_um = double{o.coherence_um} / double{o.kernels}, texel_um = double{map.texel_size_um};
  const double images = map.width * texel_um / gap_um * (map.height * texel_um / gap_um);
  require(images <= kMostImages, "--coherence-um",
          fmt::format("{:g} um on texels of {:g} um takes {:.3g} coherent images", o.coherence_um, texel_um, images),
          fmt::format("give at least {:.3g}, or heights of a smaller part of the surface",
                      double{o.coherence_um} * std::sqrt(images / kMostImages)));
}

double wavePyramidBytes(const HeightMap& map, const WaveOptions& o, double most_bytes) {
  checkWaveOptions(map, o);
  const std::size_t waves = o.wavelengths_um.size();
  const double images = 1 + static_cast<double>(o.spectral || waves == 1 ? waves : 3);  // grey, and one for each channel
  const PyramidShape shape = shapeOf(map, o);
  // Few images see the steepest slopes: most see those of a few deviations.
  constexpr double kDeviations = 3;
  const MapSlopes& slopes = shape.slopes;
  const double half_trace = 0.5 * (double{slopes.covariance.xx} + slopes.covariance.yy);
  const double half_gap = 0.5 * (double{slopes.covariance.xx} - slopes.covariance.yy);
  const double largest = half_trace + std::hypot(half_gap, double{slopes.covariance.xy});
  const double reach = std::hypot(slopes.mean.x, slopes.mean.y) + kDeviations * std::sqrt(largest) +
                       kSpots * spotDeviation(double{o.wavelengths_um.back()}, double{o.coherence_um});
  // Blocks that a disk meets, in the mean over its places.
  const double radius = std::min(1.0, reach) * 0.5 * shape.blocksPerAxis();
  const double blocks_of_disk =
      std::min(static_cast<double>(shape.blocksPerImage()), std::numbers::pi * radius * radius + 4 * radius + 1);
  const auto blocks = [&](int, std::size_t) { return static_cast<std::size_t>(blocks_of_disk); };
  return images * imageBytes(shape, o.precision, most_bytes / images, blocks);
}

WavePyramidData buildWavePyramid(const HeightMap& map, const WaveOptions& o, const ProgressFn& progress) {
  checkWaveOptions(map, o);
  const HeightSpline spline(map);
  const HeightSpline::Steepest steepest = spline.steepest();
  if (!(steepest.slope <= kMostPsi))
    throw Error(ErrorCode::invalid_input, "heights.steep", {}, {},
                fmt::format("a slope of {:.3g} {}; psi ends at 1", steepest.slope,
                            texelName(map.width, map.height, static_cast<std::size_t>(steepest.j) * map.width + steepest.i)),
                "check the scale of the heights (glint-ingest --height-scale-um)");
  WavePyramidData pyramid;
  pyramid.wavelengths_um = o.wavelengths_um;
  pyramid.shape.texel_size_um = map.texel_size_um;
  pyramid.shape.coherence_um = o.coherence_um;
  pyramid.grey.shape = shapeOf(map, o);
  pyramid.grey.precision = o.precision;
  if (o.resolution > 256) pyramid.grey.value_scale = static_cast<float>(o.resolution * o.resolution) / (256 * 256);
  const auto weights = setChannels(o, pyramid);

  const std::vector<WaveGrid> grids = chooseGrids(spline, map, o, steepest.slope);
  PyramidShape& shape = pyramid.grey.shape;
  const auto levels = static_cast<std::size_t>(shape.level_count);
  pyramid.grey.levels.resize(levels), pyramid.half_pixels.resize(levels), pyramid.float_pixels.resize(levels);
  FinestLevel finest(spline, o, grids, weights, pyramid);
  std::size_t units = finest.unitsOfWork();
  for (int l = 1; l < shape.footprintLevels(); ++l) units += shape.levels[l].imageCount();
  ProgressCounter counter(progress, units);
  finest.build(counter);
  for (int l = 1; l < shape.footprintLevels(); ++l) buildCoarserLevel(pyramid, l, finest.halfPixels(), counter);
  finest.appendMean(levels - 1);
  if (o.levels == 0) dropAgreeingLevels(pyramid);

  double step = grids[0].step_um;
  for (const WaveGrid& grid : grids) step = std::min(step, grid.step_um);
  pyramid.report = {steepest.slope, step, static_cast<int>(std::ceil(double{map.texel_size_um} / step)), finest.kernelColumns(),
                    finest.kernelRows()};
  return pyramid;
}

}  // namespace glint::bake
