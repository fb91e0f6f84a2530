#include "glint/bake/compress.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <optional>
#include <string>
#include <type_traits>

#include "glint/bake/compress_encode.h"
#include "glint/bake/compress_model.h"
#include "glint/bake/compress_ranks.h"
#include "glint/bake/compress_slices.h"
#include "glint/model/error.h"
#include "glint/query/block_mass.h"

namespace glint::bake {
namespace {

// An image that decodes to this much of its energy or less is not scaled up: what is left of it is mostly error.
constexpr double kLeastEnergy = 0.5;

// The measured error of a tolerance lies between this part of it and all of it, unless single steps are larger.
constexpr double kTightness = 0.985;
constexpr int kMostCorrections = 12;

void checkOptions(const CompressionOptions& options) {
  const auto require = [](bool valid, const char* rule, const std::string& what) {
    if (!valid) throw Error(ErrorCode::usage, rule, "", "", what);
  };
  require(options.rank >= 1 && options.rank <= kBlockPixels, "compress.rank",
          "the rank is " + std::to_string(options.rank) + "; it must be 1 to 256");
  require(options.tolerance >= 0 && options.tolerance < 1, "compress.tolerance",
          "the tolerance is " + std::to_string(options.tolerance) + "; it must be at least 0 and below 1");
  require(options.regions >= 0 && options.regions <= 255, "compress.regions",
          "the regions are " + std::to_string(options.regions) + " per axis; they must be 0 to 255");
  require(options.min_improvement >= 0 && options.min_improvement < 1, "compress.min_improvement",
          "the least improvement is " + std::to_string(options.min_improvement) + "; it must be at least 0 and below 1");
  require(options.max_iterations >= 1, "compress.max_iterations", "the iterations must be at least 1");
}

/// Counts units of work of all threads.
class Progress {
 public:
  Progress(const ProgressFn& report, std::size_t total) : report_(report), total_(total) {}

  /// More work than was known at first.
  void grow(std::size_t units) { total_ += units; }

  void advance() {
    if (!report_) return;
    const std::lock_guard lock(mutex_);
    report_(++done_, total_);
  }

 private:
  const ProgressFn& report_;
  std::mutex mutex_;
  std::size_t done_ = 0;
  std::size_t total_;
};

/// One run: the steps of compressPyramid() and what they pass on.
class Compressor {
 public:
  Compressor(const NdfPyramid& pyramid, const CompressionOptions& options, const ProgressFn& progress)
      : pyramid_(pyramid),
        options_(options),
        index_(pyramid, regions(options)),
        progress_(progress, 3 * index_.clusterCount()),
        statistics_(index_.clusterCount()),
        encoded_(index_.clusterCount()),
        selection_(index_.clusterCount(), -1),
        image_scales_(index_.imageCount(), 1.0f),
        density_scales_(index_.imageCount(), 0.0f) {}

  CompressedNdfData run(CompressionReport* report) {
    forEachCluster([&](std::size_t c) { statistics_[c] = measureCluster(index_, c); });
    for (const ClusterStatistics& s : statistics_) energy_ += s.energy;
    decompose();
    if (options_.tolerance > 0) {
      meetTolerance();
    } else {
      encode(std::vector<int>(index_.clusterCount(), 0));
    }
    CompressedNdfData data = pack();
    if (report) *report = makeReport(data);
    return data;
  }

 private:
  static int regions(const CompressionOptions& options) {
    if (options.regions > 0) return options.regions;
    return options.method == CompressionMethod::cp ? 8 : 1;
  }

  template <class Work>
  void forEachCluster(Work work) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, index_.clusterCount(), 1),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        for (std::size_t c = range.begin(); c != range.end(); ++c) {
                          work(c);
                          progress_.advance();
                        }
                      });
  }

  void decompose() {
    std::vector<std::optional<ClusterModel>> models(index_.clusterCount());
    const double budget = options_.tolerance * options_.tolerance * energy_;
    forEachCluster([&](std::size_t c) {
      // Finishing all clusters to this error leaves 1 part in 400 of the budget: further columns are not worth their memory.
      const double share =
          static_cast<double>(index_.sliceCount(c)) / static_cast<double>(std::max<std::uint64_t>(1, index_.totalSlices()));
      models[c].emplace(index_, c, statistics_[c], options_, 0.0025 * budget * share);
    });
    models_.reserve(models.size());
    for (auto& model : models) models_.push_back(std::move(*model));
  }

  /// Encodes the clusters whose choice changed, and scales the images.
  void encode(const std::vector<int>& selection) {
    forEachCluster([&](std::size_t c) {
      if (selection[c] == selection_[c]) return;
      encoded_[c] = encodeCluster(index_, c, statistics_[c], models_[c].basis(selection[c]), options_.method,
                                  options_.coefficient_type, pyramid_.value_scale);
    });
    selection_ = selection;
    scaleImages();
  }

  void scaleImages() {
    std::vector<double> sums(index_.imageCount(), 0.0);
    std::vector<double> positive(index_.imageCount(), 0.0);
    for (std::size_t c = 0; c < index_.clusterCount(); ++c) {
      for (int s = 0; s < index_.sliceCount(c); ++s) {
        const std::uint32_t image = index_.image(index_.firstSlice(c) + s);
        sums[image] += static_cast<double>(encoded_[c].slices[s].sum) * statistics_[c].peak;
        positive[image] += static_cast<double>(encoded_[c].slices[s].positive) * statistics_[c].peak;
      }
    }
    const double pixel = 2.0 / pyramid_.shape.resolution;
    unscaled_images_ = 0;
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const double integral = sums[i] * pyramid_.value_scale * pixel * pixel;
      const bool scaled = integral > kLeastEnergy;
      image_scales_[i] = scaled ? static_cast<float>(1 / integral) : 1.0f;
      unscaled_images_ += !scaled;
      const auto density_scale = static_cast<float>(1 / (positive[i] * pyramid_.value_scale * pixel * pixel));
      density_scales_[i] = std::isfinite(density_scale) ? density_scale : 0.0f;
    }
  }

  /// Squared error of a slice as a reader decodes it, with the scale of its image.
  double sliceError(std::size_t cluster, int slice) const {
    // slice - scale decoded = (slice - decoded) + (1 - scale) decoded
    const SliceError& e = encoded_[cluster].slices[slice];
    const double rest = 1.0 - image_scales_[index_.image(index_.firstSlice(cluster) + slice)];
    const double peak = statistics_[cluster].peak;
    return std::max(0.0, e.error + 2 * rest * e.cross + rest * rest * e.power) * peak * peak;
  }

  double totalError() const {
    double sum = 0;
    for (std::size_t c = 0; c < index_.clusterCount(); ++c)
      for (int s = 0; s < index_.sliceCount(c); ++s) sum += sliceError(c, s);
    return sum;
  }

  /// Searches the error before quantisation that gives the tolerance after it. The difference of the two changes slowly, so a
  /// few corrections by it suffice.
  void meetTolerance() {
    const RankAllocator allocator(models_);
    const double budget = options_.tolerance * options_.tolerance * energy_;
    double target = budget;
    double least = 0;
    std::optional<double> met;  // the largest target known to meet the budget
    for (int i = 0; i < kMostCorrections; ++i) {
      std::vector<int> selection = allocator.allocate(target);
      const bool everything = target <= allocator.smallestError();
      if (i > 0 && selection == selection_) break;
      progress_.grow(index_.clusterCount());
      encode(selection);
      const double measured = totalError();
      least = measured;
      if (measured <= budget) {
        met = target;
        if (measured >= kTightness * kTightness * budget) return;
      } else if (everything) {
        break;
      }
      const double aim = budget * (1 + kTightness * kTightness) / 2;
      target = std::max(0.0, allocator.error(selection) + aim - measured);
    }
    if (totalError() <= budget) return;
    if (met) {
      encode(allocator.allocate(*met));
      return;
    }
    encode(allocator.allocate(0));
    least = totalError();
    if (least > budget)
      throw Error(ErrorCode::failed, "compress.tolerance", "", "",
                  "the tolerance " + std::to_string(options_.tolerance) +
                      " cannot be reached with this method and type of coefficient; the least error is " +
                      std::to_string(std::sqrt(least / energy_)),
                  "ask for a larger tolerance, or for coefficients of more bits");
  }

  CompressedNdfData pack() {
    CompressedNdfData data;
    index_.describe(data);
    data.header.method = options_.method;
    data.header.coefficient_type = options_.coefficient_type;
    data.image_scales = image_scales_;
    data.density_scales = density_scales_;
    const int basis_bytes = basisElementBytes(options_.method, options_.coefficient_type);
    const int coefficient_bytes = coefficientElementBytes(options_.coefficient_type);
    for (std::size_t c = 0; c < index_.clusterCount(); ++c) {
      EncodedCluster& e = encoded_[c];
      NdfCluster cluster;
      cluster.first_basis = data.basis.size() / basis_bytes;
      cluster.first_coefficient = data.coefficients.size() / coefficient_bytes;
      cluster.first_scale = data.scales.size();
      cluster.rank_x = static_cast<std::uint16_t>(e.rank_x);
      cluster.rank_y = static_cast<std::uint16_t>(e.rank_y);
      cluster.slice_count = static_cast<std::uint32_t>(index_.sliceCount(c));
      data.clusters.push_back(cluster);
      data.basis.insert(data.basis.end(), e.basis.begin(), e.basis.end());
      data.coefficients.insert(data.coefficients.end(), e.coefficients.begin(), e.coefficients.end());
      data.scales.insert(data.scales.end(), e.scales.begin(), e.scales.end());
      if (e.rank_x == 0) makeEmpty(data, c);
    }
    packBlockMasses(data);
    return data;
  }

  /// The blocks of every image and their shares of it, from the slices of all clusters.
  void packBlockMasses(CompressedNdfData& data) const {
    // A reader adds up the pixels in another order: its share must not exceed the stored one.
    constexpr float kRounding = 1 + 1e-5f;
    const std::size_t images = index_.imageCount(), words = pyramid_.shape.maskWords(),
                      blocks = pyramid_.shape.blocksPerImage();
    const double pixel = 2.0 / pyramid_.shape.resolution;
    std::vector<float> masses(images * blocks, -1);
    for (std::size_t c = 0; c < index_.clusterCount(); ++c) {
      if (data.clusters[c].slice_count == 0) continue;
      const double unit = pixel * pixel * pyramid_.value_scale * statistics_[c].peak;
      for (int s = 0; s < index_.sliceCount(c); ++s) {
        const std::size_t image = index_.image(index_.firstSlice(c) + s);
        masses[image * blocks + c % blocks] =
            static_cast<float>(unit * encoded_[c].slices[s].positive * density_scales_[image]) * kRounding;
      }
    }
    data.block_masks.assign(images * words, 0);
    data.first_block.assign(1, 0);
    for (std::size_t image = 0; image < images; ++image) {
      for (std::size_t b = 0; b < blocks; ++b) {
        if (masses[image * blocks + b] < 0) continue;
        data.block_masks[image * words + b / 64] |= std::uint64_t{1} << (b % 64);
        data.block_masses.push_back(blockMassCode(masses[image * blocks + b]));
      }
      data.first_block.push_back(static_cast<std::uint32_t>(data.block_masses.size()));
    }
  }

  /// A cluster that a tolerance leaves without columns decodes to 0: for readers, it is empty.
  static void makeEmpty(CompressedNdfData& data, std::size_t cluster) {
    const auto words = static_cast<std::ptrdiff_t>(data.header.words_per_cluster);
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(cluster) * words;
    std::fill_n(data.masks.begin() + first, words, 0);
    std::fill_n(data.mask_ranks.begin() + first, words, 0);
    data.clusters[cluster].slice_count = 0;
  }

  CompressionReport makeReport(const CompressedNdfData& data) const {
    CompressionReport report;
    measureLevels(data, report);
    measureBytes(data, report);
    report.unscaled_images = unscaled_images_;
    for (std::size_t c = 0; c < index_.clusterCount(); ++c) {
      if (index_.sliceCount(c) == 0) continue;
      const std::size_t columns = encoded_[c].scales.size();
      if (report.rank_histogram.size() <= columns) report.rank_histogram.resize(columns + 1, 0);
      ++report.rank_histogram[columns];
    }
    return report;
  }

  void measureLevels(const CompressedNdfData& data, CompressionReport& report) const {
    const int levels = pyramid_.shape.level_count;
    const std::uint32_t* first = data.header.first_image;
    std::vector<double> errors(levels, 0.0);
    std::vector<double> energies(levels, 0.0);
    report.levels.resize(levels);
    for (std::size_t c = 0; c < index_.clusterCount(); ++c) {
      const double peak = statistics_[c].peak;
      for (int s = 0; s < index_.sliceCount(c); ++s) {
        const std::uint32_t image = index_.image(index_.firstSlice(c) + s);
        const auto level = std::upper_bound(first, first + levels, image) - first - 1;
        const SliceError& e = encoded_[c].slices[s];
        ++report.levels[level].slices;
        errors[level] += sliceError(c, s);
        energies[level] += (static_cast<double>(e.error) + 2.0 * e.cross + e.power) * peak * peak;
      }
    }
    double error = 0;
    for (int l = 0; l < levels; ++l) {
      report.levels[l].rel_l2 = energies[l] > 0 ? std::sqrt(errors[l] / energies[l]) : 0;
      error += errors[l];
    }
    report.total = {index_.totalSlices(), energy_ > 0 ? std::sqrt(error / energy_) : 0};
  }

  void measureBytes(const CompressedNdfData& data, CompressionReport& report) const {
    const auto bytes = [](const auto& array) {
      return array.size() * sizeof(typename std::remove_cvref_t<decltype(array)>::value_type);
    };
    report.basis_bytes = bytes(data.basis);
    report.coefficient_bytes = bytes(data.coefficients) + bytes(data.scales);
    report.index_bytes = bytes(data.image_regions) + bytes(data.image_slots) + bytes(data.image_scales) + bytes(data.clusters) +
                         bytes(data.masks) + bytes(data.mask_ranks) + bytes(data.density_scales) + bytes(data.block_masks) +
                         bytes(data.first_block) + bytes(data.block_masses);
    report.total_bytes = report.basis_bytes + report.coefficient_bytes + report.index_bytes;
    const double pixels = static_cast<double>(pyramid_.shape.resolution) * pyramid_.shape.resolution;
    const double dense = static_cast<double>(index_.imageCount()) * pixels * sizeof(float);
    double stored =
        static_cast<double>(index_.totalSlices()) * kBlockPixels * (pyramid_.precision == BlockPrecision::f16 ? 2 : 4);
    for (int l = 0; l < pyramid_.shape.level_count; ++l) {
      const PyramidLevel& level = pyramid_.levels[l];
      stored += static_cast<double>(level.masks.size_bytes() + level.first_block.size_bytes() + level.block_means.size_bytes());
    }
    report.ratio_to_dense = dense / static_cast<double>(report.total_bytes);
    report.ratio_to_stored = stored / static_cast<double>(report.total_bytes);
  }

  const NdfPyramid& pyramid_;
  const CompressionOptions& options_;
  SliceIndex index_;
  Progress progress_;
  std::vector<ClusterStatistics> statistics_;
  double energy_ = 0;
  std::vector<ClusterModel> models_;
  std::vector<EncodedCluster> encoded_;
  std::vector<int> selection_;
  std::vector<float> image_scales_;
  std::vector<float> density_scales_;
  std::uint64_t unscaled_images_ = 0;
};

}  // namespace

CompressedNdf CompressedNdfData::view() const {
  CompressedNdf v = header;
  v.image_regions = image_regions;
  v.image_slots = image_slots;
  v.image_scales = image_scales;
  v.density_scales = density_scales;
  v.block_masks = block_masks;
  v.first_block = first_block;
  v.block_masses = block_masses;
  v.clusters = clusters;
  v.masks = masks;
  v.mask_ranks = mask_ranks;
  v.basis = basis.data();
  v.basis_count = basis.size() / basisElementBytes(header.method, header.coefficient_type);
  v.coefficients = coefficients.data();
  v.coefficient_count = coefficients.size() / coefficientElementBytes(header.coefficient_type);
  v.scales = scales;
  return v;
}

int basisElementBytes(CompressionMethod method, CoefficientType type) {
  if (type == CoefficientType::f32) return sizeof(float);
  return method == CompressionMethod::pca ? sizeof(std::int32_t) : sizeof(std::int16_t);
}

int coefficientElementBytes(CoefficientType type) {
  return type == CoefficientType::i8 ? 1 : type == CoefficientType::f16 ? 2 : 4;
}

CompressedNdfData compressPyramid(const NdfPyramid& pyramid, const CompressionOptions& options, CompressionReport* report,
                                  const ProgressFn& progress) {
  checkOptions(options);
  return Compressor(pyramid, options, progress).run(report);
}

}  // namespace glint::bake
