#include "glint/bake/compressed/compress.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <type_traits>

#include "glint/bake/compressed/encode.h"
#include "glint/bake/compressed/error_weights.h"
#include "glint/bake/compressed/model.h"
#include "glint/bake/compressed/ranks.h"
#include "glint/bake/compressed/slices.h"
#include "glint/model/error.h"
#include "glint/query/detail/pyramid/block_mass.h"

namespace glint::bake {
namespace {

// An image that decodes to this share of its mass or less is mostly error, and is not scaled up.
constexpr double kLeastEnergy = 0.5;
// Images of less mass hardly count in any answer, and are not reported when they are not scaled.
constexpr double kLeastMass = 0.01;
// Limits of the measured error of columns over the predicted one. Floors and positive parts leave less of it; weights that differ
// from pixel to pixel, more.
constexpr double kLeastCorrection = 0.05, kMostCorrection = 16;
// Largest error of an angular block over the tolerance. Without it, blocks in which errors are cheap have small errors, and pay
// for large ones in the block of sparse flakes that most lights show.
constexpr double kWorstBlock = 2;
// Shares by which scales of images may move before the errors of cells are measured again: for a report, and to bound blocks.
constexpr float kSameScale = 1e-3f, kNearlySameScale = 1e-2f;
// Searches for sizes with which all blocks keep their bounds.
constexpr int kMostRounds = 4;

void checkOptions(const CompressionOptions& options) {
  const auto require = [](bool valid, const char* rule, const std::string& what) {
    if (!valid) throw Error(ErrorCode::usage, rule, "", "", what);
  };
  require(options.rank >= 1 && options.rank <= kBlockPixels, "compress.rank",
          "the rank is " + std::to_string(options.rank) + "; it must be 1 to 256");
  require(options.tolerance >= 0 && options.tolerance < 1, "compress.tolerance",
          "the tolerance is " + fmt::format("{}", options.tolerance) + "; it must be at least 0 and below 1");
  require(options.regions >= 0 && options.regions <= 255, "compress.regions",
          "the regions are " + std::to_string(options.regions) + " per axis; they must be 0 to 255");
  require(options.min_improvement >= 0 && options.min_improvement < 1, "compress.min_improvement",
          "the least improvement is " + fmt::format("{}", options.min_improvement) + "; it must be at least 0 and below 1");
  require(options.max_iterations >= 1, "compress.max_iterations", "the iterations must be at least 1");
}

/// Most regions along each axis that are of use. More regions than the finest level has images stay empty. Clusters without
/// slices take memory too, so their number is bounded by a few times the number of slices.
int mostRegions(const NdfPyramid& pyramid) {
  constexpr int kSureRegions = 8;  // allowed for every pyramid: the default of cp
  constexpr double kSureClusters = 1 << 20, kClustersPerBlock = 4;
  const PyramidShape& shape = pyramid.shape;
  double stored = 0;
  for (int l = 0; l < shape.level_count; ++l) stored += static_cast<double>(pyramid.levels[l].block_means.size());
  const double clusters = std::max(kSureClusters, kClustersPerBlock * stored) / shape.blocksPerImage();
  const int images = shape.level_count > 0 ? std::max(shape.levels[0].columns, shape.levels[0].rows) : 0;
  return std::max(kSureRegions, std::min(images, static_cast<int>(std::sqrt(clusters))));
}

void checkRegions(const NdfPyramid& pyramid, int regions) {
  if (const int most = mostRegions(pyramid); regions > most)
    throw Error(ErrorCode::usage, "compress.regions", "", "",
                fmt::format("{} regions per axis are more than the pyramid has images to fill", regions),
                fmt::format("give --regions of at most {}", most));
}

/// How an attempt to meet a tolerance decomposes blocks, stores coefficients and scales blocks (ErrorWeights).
struct Attempt {
  CompressionMethod method;
  CoefficientType type;
  double scale_range;
};

/// Adds attempts with one method, from few bytes to many: of i8, or the type that the options ask for, or of more bits. A wide
/// range is best for most maps; narrow ranges lose less to rounding. Blocks are scaled for the seen error alone.
void addAttempts(const CompressionOptions& options, CompressionMethod method, bool more_bits, std::vector<Attempt>& attempts) {
  constexpr double kWide = 1e6, kNarrow = 1e3, kNarrowest = 100;
  const bool scales = options.metric == ErrorMetric::seen;
  const auto add = [&](CoefficientType type, double scale_range) { attempts.push_back({method, type, scale_range}); };
  if (!more_bits) {
    const CoefficientType first = options.coefficient_type.value_or(CoefficientType::i8);
    add(first, kWide);
    if (scales && options.tolerance > 0) add(first, kNarrow);
    return;
  }
  add(CoefficientType::f16, kNarrow);
  if (scales) add(CoefficientType::f16, kNarrowest);
  add(CoefficientType::f32, kNarrowest);
  if (scales) add(CoefficientType::f32, 1);
}

/// Attempts in turn. With one type of coefficients, images of pca take more bytes than products of tucker, and lose less to
/// rounding. More bits come last.
std::vector<Attempt> attemptsOf(const CompressionOptions& options) {
  std::vector<CompressionMethod> methods = {options.method.value_or(CompressionMethod::tucker)};
  if (!options.method && options.tolerance > 0) methods.push_back(CompressionMethod::pca);
  std::vector<Attempt> attempts;
  for (const CompressionMethod method : methods) addAttempts(options, method, false, attempts);
  if (!(options.tolerance > 0) || options.coefficient_type) return attempts;
  for (const CompressionMethod method : methods) addAttempts(options, method, true, attempts);
  return attempts;
}

/// The options of an attempt: its method is known.
CompressionOptions optionsOf(const CompressionOptions& options, const Attempt& attempt) {
  CompressionOptions result = options;
  result.method = attempt.method;
  return result;
}

/// @param least  smallest error of all attempts
[[noreturn]] void rejectTolerance(const CompressionOptions& options, double least) {
  // A search for a larger error ends a little above the smallest one, and the error is printed with few digits.
  constexpr double kMore = 1.01;
  std::vector<std::string> fixed, others;
  if (options.method) fixed.push_back("method"), others.push_back("--method auto");
  if (options.coefficient_type) fixed.push_back("type of coefficients"), others.push_back("--quantize auto");
  const std::string with = fixed.empty() ? "" : fmt::format(" with this {}", fmt::join(fixed, " and "));
  const std::string what = fmt::format("the tolerance {} cannot be reached{}", options.tolerance, with);
  const std::string reach = others.empty() ? "" : fmt::format("; {} may reach less", fmt::join(others, " and "));
  const std::string remedy = fmt::format("ask for at least {:.3g}{}", kMore * least, reach);
  throw Error(ErrorCode::failed, "compress.tolerance", "", "", what, remedy);
}

/// One run of compressPyramid(): its steps, and the data that they pass on.
class Compressor {
 public:
  Compressor(const NdfPyramid& pyramid, const CompressionOptions& options, const Attempt& attempt, ProgressCounter& progress)
      : pyramid_(pyramid),
        options_(optionsOf(options, attempt)),
        type_(attempt.type),
        index_(pyramid, regions(options_, pyramid.shape), levelGroups(options_), options.image_masses),
        weights_(index_, options.metric, attempt.scale_range),
        groups_(index_.levelGroupCount()),
        progress_(progress),
        statistics_(index_.clusterCount()),
        bases_(index_.clusterCount()),
        encoded_(index_.clusterCount()),
        selection_(index_.clusterCount(), -1),
        bounds_(index_.clusterCount(), std::numeric_limits<double>::infinity()),
        image_scales_(index_.imageCount(), 1.0f),
        density_scales_(index_.imageCount(), 1.0f) {
    progress_.grow(2 * index_.clusterCount());
  }

  /// Chooses the sizes of all clusters and encodes them.
  /// @return whether the tolerance is met
  bool compress() {
    // Measure the clusters, and how much energy and how many slices each group of levels has.
    forEachCluster([&](std::size_t c) { statistics_[c] = measureCluster(index_, weights_, c); });
    for (std::size_t c = 0; c < index_.clusterCount(); ++c) {
      groupOf(c).energy += statistics_[c].energy;
      groupOf(c).slices += static_cast<std::uint64_t>(index_.sliceCount(c));
    }
    // Decompose all clusters, choose their sizes, and encode them.
    decompose();
    if (options_.tolerance > 0) return meetTolerance();
    // The first pass finds the scales of images, and the second measures errors with them.
    const std::vector<char> all(groups_.size(), 1);
    for (int pass = 0; pass < 2; ++pass) encode(std::vector<int>(index_.clusterCount(), 0), all, kSameScale);
    return true;
  }

  /// @return the largest error that a tolerance bounds
  double error() const {
    double most = 0;
    for (std::size_t g = 0; g < groups_.size(); ++g) most = std::max(most, groupError(g));
    return most;
  }

  NdfCpData result(CompressionReport* report) {
    NdfCpData data = pack();
    if (report) *report = makeReport(data);
    return data;
  }

 private:
  /// Neighbouring levels that share clusters. Each group meets a tolerance by itself.
  struct LevelGroup {
    double energy = 0;
    std::uint64_t slices = 0;
  };

  std::size_t clustersPerGroup() const { return index_.clusterCount() / groups_.size(); }
  LevelGroup& groupOf(std::size_t cluster) { return groups_[cluster / clustersPerGroup()]; }
  int firstLevel(std::size_t group) const { return static_cast<int>(group); }
  int endLevel(std::size_t group) const {
    return group + 1 < groups_.size() ? static_cast<int>(group) + 1 : index_.levelCount();
  }

  /// Weighted squared error that a group may have.
  double budget(std::size_t group) const {
    const double whole = options_.metric == ErrorMetric::seen ? endLevel(group) - firstLevel(group) : groups_[group].energy;
    return options_.tolerance * options_.tolerance * whole;
  }

  /// Regions along each axis: as the options say, or as the method has them, and more where one would hold too many images.
  static int regions(const CompressionOptions& options, const PyramidShape& shape) {
    if (options.regions > 0) return options.regions;
    int count = options.method == CompressionMethod::cp ? 8 : 1;
    const PyramidGrid& finest = shape.levels[0];
    const double all_levels =
        levelGroups(options) > 1 ? 1 : 4.0 / 3;  // of a region, if the finest level has no group of its own
    const auto held = [&](int pieces) {
      const auto share = [&](int images) { return std::ceil(static_cast<double>(images) / pieces) + (pieces > 1 ? 1 : 0); };
      return all_levels * share(finest.columns) * share(finest.rows);
    };
    while (count < 255 && held(count) > SliceIndex::kMostImages) ++count;
    return count;
  }

  // The finest levels differ most from other levels and have most of the slices. Bases of tucker are small, so level groups can
  // have bases of their own. A tolerance for the seen error holds in every level, and coarse levels need finer coefficients.
  static int levelGroups(const CompressionOptions& options) {
    if (options.tolerance > 0 && options.metric == ErrorMetric::seen) return 4;
    return options.method == CompressionMethod::tucker ? 3 : 1;
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
    forEachCluster([&](std::size_t c) {
      // With this error in every cluster, the sum is 1/400 of the budget: more columns are not worth their memory.
      const double share =
          static_cast<double>(index_.sliceCount(c)) / static_cast<double>(std::max<std::uint64_t>(1, groupOf(c).slices));
      models[c].emplace(index_, weights_, c, statistics_[c], options_, type_,
                        0.0025 * budget(c / clustersPerGroup()) * share * weights_.evenness(c));
    });
    models_.reserve(models.size());
    for (auto& model : models) models_.push_back(std::move(*model));
    if (hasBounds()) correctModels();
  }

  /// Measures one choice of columns of each cluster as a reader sees it, and corrects the errors of all its choices by it. The
  /// choice is one that the bound of its block would ask for.
  void correctModels() {
    progress_.grow(index_.clusterCount());
    for (std::size_t g = 0; g < groups_.size(); ++g) boundBlocks(g);
    forEachCluster([&](std::size_t c) {
      if (!models_[c].hasColumns() || !std::isfinite(bounds_[c])) return;
      double predicted = 0;
      const ClusterBasis basis = models_[c].columnsNear(bounds_[c], predicted);
      const EncodedCluster encoded =
          encodeCluster(index_, weights_, c, statistics_[c], basis, *options_.method, type_, 0, density_scales_);
      double measured = 0;
      for (const SliceError& slice : encoded.errors.slices) measured += slice.seen.error;
      measured *= static_cast<double>(statistics_[c].peak) * statistics_[c].peak;
      models_[c].correctColumns(std::clamp(measured / predicted, kLeastCorrection, kMostCorrection));
    });
  }

  /// Encodes the clusters of some groups, but for those that are so encoded, and scales the images. Groups have images of their own,
  /// so that others stay as they are.
  /// @param same_scale  clusters are measured again where a scale of their images has moved by more than this share
  void encode(const std::vector<int>& selection, const std::vector<char>& groups, float same_scale) {
    progress_.grow(index_.clusterCount());
    forEachCluster([&](std::size_t c) {
      if (groups[c / clustersPerGroup()] && (selection[c] != selection_[c] || isRescaled(c, same_scale)))
        encodeOne(c, selection[c]);
    });
    scaleImages();
    measureLevels();
  }

  void encodeOne(std::size_t c, int choice) {
    const bool keeps_bases = options_.method == CompressionMethod::cp;  // another decomposition would cost most of the time
    std::optional<ClusterBasis>& kept = bases_[c];
    if (choice != selection_[c] || !kept) kept = models_[c].basis(choice);
    encoded_[c] = encodeCluster(index_, weights_, c, statistics_[c], *kept, *options_.method, type_, gainPerByte(c, choice),
                                density_scales_);
    if (!keeps_bases) kept.reset();
    selection_[c] = choice;
  }

  /// Whether the scales of images have moved since the errors of a cluster were measured. Errors of slices follow the scales, but
  /// sums over cells do not.
  bool isRescaled(std::size_t c, float share) const {
    for (int s = 0; s < index_.sliceCount(c); ++s) {
      const float then = encoded_[c].errors.slices[s].seen_scale;
      const float now = measuredScale(density_scales_[index_.sliceImage(c, s)]);
      if (std::abs(now - then) > share * then) return true;
    }
    return false;
  }

  /// Weighted squared error that a byte of a cluster must remove to be worth storing: what a byte of its next step would remove. So
  /// the coefficients of a cluster depend on its choice alone.
  double gainPerByte(std::size_t c, int choice) const {
    const auto& choices = models_[c].choices();
    const auto next = static_cast<std::size_t>(choice) + 1;
    if (next >= choices.size() || options_.method == CompressionMethod::cp) return 0;
    return (choices[next - 1].error - choices[next].error) / static_cast<double>(choices[next].bytes - choices[next - 1].bytes);
  }

  /// Finds the scale with which each image integrates to its mass.
  void scaleImages() {
    std::vector<double> sums(index_.imageCount(), 0.0);
    std::vector<double> positive(index_.imageCount(), 0.0);
    for (std::size_t c = 0; c < index_.clusterCount(); ++c) {
      for (int s = 0; s < index_.sliceCount(c); ++s) {
        const std::uint32_t image = index_.sliceImage(c, s);
        sums[image] += static_cast<double>(encoded_[c].errors.slices[s].sum) * statistics_[c].peak;
        positive[image] += static_cast<double>(encoded_[c].errors.slices[s].positive) * statistics_[c].peak;
      }
    }
    const double pixel = 2.0 / pyramid_.shape.resolution;
    unscaled_images_ = 0;
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const double integral = sums[i] * pyramid_.value_scale * pixel * pixel;
      const double mass = index_.imageMass(i);
      const bool scaled = integral > kLeastEnergy * mass;
      image_scales_[i] = scaled ? static_cast<float>(mass / integral) : 1.0f;
      unscaled_images_ += !scaled && mass > kLeastMass;
      const auto density_scale = static_cast<float>(mass / (positive[i] * pyramid_.value_scale * pixel * pixel));
      density_scales_[i] = std::isfinite(density_scale) ? density_scale : 0.0f;
    }
  }

  /// Errors of one level.
  struct LevelErrors {
    double error = 0;   ///< sum over pixels of (D' - D)^2, stored units
    double energy = 0;  ///< sum over pixels of D^2, stored units
    SeenSummary seen;   ///< of densities
  };

  /// Measures the errors of all levels, with the scales of images.
  void measureLevels() {
    level_errors_.assign(index_.levelCount(), {});
    std::vector<double> seen2(index_.levelCount(), 0.0);
    for (std::size_t c = 0; c < index_.clusterCount(); ++c) {
      const double peak2 = static_cast<double>(statistics_[c].peak) * statistics_[c].peak;
      for (int s = 0; s < index_.sliceCount(c); ++s) {
        const SliceError& e = encoded_[c].errors.slices[s];
        const std::uint32_t image = index_.sliceImage(c, s);
        const int level = index_.level(image);
        level_errors_[level].error += e.plain.at(image_scales_[image]) * peak2;
        level_errors_[level].energy += e.plain.at(0) * peak2;
        seen2[level] += e.seen.at(density_scales_[image] / e.seen_scale) * peak2;
      }
    }
    for (int level = 0; level < index_.levelCount(); ++level) {
      measureCells(level);
      if (options_.metric == ErrorMetric::seen) level_errors_[level].seen.seen = std::sqrt(seen2[level]);
    }
  }

  /// Calls visit(truth, mean of the decoded density, mean of its squared error) for the lit cells of a block of a level.
  template <class Visit>
  void forEachLitCell(int level, std::size_t block, Visit visit) const {
    const auto blocks = static_cast<std::size_t>(index_.blockCount());
    const int cells = weights_.cellCount();
    const double pixels = static_cast<double>(index_.levelImages(level)) * weights_.cellPixels() * weights_.cellPixels();
    for (int k = 0; k < cells; ++k) {
      const CellDensity& truth = weights_.cells(level, block)[k];
      if (!truth.lit) continue;
      double sum = 0, error = 0;
      for (std::size_t c = block; c < index_.clusterCount(); c += blocks) {
        sum += encoded_[c].errors.cell_sums[static_cast<std::size_t>(level) * cells + k];
        error += encoded_[c].errors.cell_errors[static_cast<std::size_t>(level) * cells + k];
      }
      visit(truth, sum / pixels, error / pixels);
    }
  }

  /// Measures the bias and the worst error of the cells of a level; with ErrorMetric::l2 the seen error, too.
  void measureCells(int level) {
    const auto blocks = static_cast<std::size_t>(index_.blockCount());
    SeenSummary& seen = level_errors_[level].seen;
    double squares = 0, lit = 0;
    for (std::size_t block = 0; block < blocks; ++block) {
      forEachLitCell(level, block, [&](const CellDensity& truth, double mean, double error2) {
        const double e2 = error2 / truth.seenSquare();
        ++lit;
        squares += e2;
        seen.worst = std::max(seen.worst, std::sqrt(e2));
        seen.bias = std::max(seen.bias, std::abs(mean - truth.mean) / truth.seenMean());
      });
    }
    seen.seen = lit > 0 ? std::sqrt(squares / lit) : 0;
  }

  /// Error of a group that its budget bounds.
  double measuredError(std::size_t group) const {
    double sum = 0, most = 0;
    for (int level = firstLevel(group); level < endLevel(group); ++level) {
      sum += level_errors_[level].error;
      most = std::max(most, level_errors_[level].seen.seen);
    }
    return options_.metric == ErrorMetric::seen ? (endLevel(group) - firstLevel(group)) * most * most : sum;
  }

  /// Sets the weighted squared errors that the clusters of a group may have, so that a light towards the half vectors of a block
  /// shows no more than kWorstBlock times the tolerance. Regions of a block share its bound by their energy.
  void boundBlocks(std::size_t group) {
    const auto blocks = static_cast<std::size_t>(index_.blockCount());
    const std::size_t first = group * clustersPerGroup(), end = first + clustersPerGroup();
    std::vector<double> energies(blocks, 0.0);
    for (std::size_t c = first; c < end; ++c) energies[c % blocks] += statistics_[c].energy;
    for (std::size_t c = first; c < end; ++c) {
      double lit = 0;
      for (int level = firstLevel(group); level < endLevel(group); ++level) lit += weights_.litShare(level, c % blocks);
      const double energy = energies[c % blocks], share = energy > 0 ? statistics_[c].energy / energy : 1;
      if (lit * share > 0) bounds_[c] = worstBlock2() * lit * share;
    }
  }

  /// Largest squared error of an angular block.
  double worstBlock2() const { return kWorstBlock * kWorstBlock * options_.tolerance * options_.tolerance; }

  /// Squared error of a block of a level, over its lit cells.
  double blockError2(int level, std::size_t block) const {
    double sum = 0, lit = 0;
    forEachLitCell(level, block, [&](const CellDensity& truth, double /*sum*/, double error2) {
      sum += error2 / truth.seenSquare();
      ++lit;
    });
    return lit > 0 ? sum / lit : 0;
  }

  /// Lowers the bounds of clusters whose blocks err by more than they may, by how much they do.
  /// @return whether a bound of the group was lowered that a larger choice can meet
  bool tightenBounds(std::size_t group) {
    constexpr double kSlack = 1.02, kSafety = 0.9;
    if (!hasBounds()) return false;
    const auto blocks = static_cast<std::size_t>(index_.blockCount());
    bool tightened = false;
    for (std::size_t k = 0; k < clustersPerGroup(); ++k) {
      const std::size_t c = group * clustersPerGroup() + k;
      const auto choice = static_cast<std::size_t>(selection_[c]);
      if (choice + 1 >= models_[c].choices().size()) continue;
      double excess = 0;
      for (int level = firstLevel(group); level < endLevel(group); ++level)
        excess = std::max(excess, blockError2(level, k % blocks) / worstBlock2());
      if (excess <= kSlack) continue;
      bounds_[c] = kSafety * std::min(bounds_[c], models_[c].choices()[choice].error) / excess;
      tightened = true;
    }
    return tightened;
  }

  /// Searches the smallest choices of all clusters with which every group meets the tolerance and blocks keep their bounds, and
  /// encodes them. Where measured errors of blocks are above their bounds, the bounds are lowered, and the search goes on.
  /// @return whether every group meets the tolerance
  bool meetTolerance() {
    std::vector<ToleranceSearch> searches;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      std::vector<std::span<const SizeChoice>> clusters;
      for (const ClusterModel& model : std::span(models_).subspan(g * clustersPerGroup(), clustersPerGroup()))
        clusters.emplace_back(model.choices());
      searches.emplace_back(std::move(clusters), budget(g));
      if (hasBounds()) searches[g].setBounds(boundsOf(g));
    }
    std::vector<char> searched(groups_.size(), 1);
    for (int round = 1; std::any_of(searched.begin(), searched.end(), [](char s) { return s; }); ++round) {
      search(searches, searched);
      for (std::size_t g = 0; g < groups_.size(); ++g) {
        searched[g] = searched[g] && round < kMostRounds && tightenBounds(g);
        if (searched[g]) searches[g].setBounds(boundsOf(g));
      }
    }
    encode(selection_, std::vector<char>(groups_.size(), 1), kSameScale);
    bool met = true;
    for (std::size_t g = 0; g < groups_.size(); ++g) met &= measuredError(g) <= budget(g);
    return met;
  }

  /// Runs the searches of some groups to their ends, and encodes what they found.
  void search(std::vector<ToleranceSearch>& searches, const std::vector<char>& groups) {
    const auto encodeChosen = [&](const std::vector<char>& which, float same_scale) {
      std::vector<int> selection;
      for (const ToleranceSearch& search : searches)
        selection.insert(selection.end(), search.selection().begin(), search.selection().end());
      encode(selection, which, same_scale);
    };
    for (std::vector<char> active = groups; std::any_of(active.begin(), active.end(), [](char a) { return a; });) {
      encodeChosen(active, std::numeric_limits<float>::infinity());
      for (std::size_t g = 0; g < groups_.size(); ++g) active[g] = active[g] && searches[g].next(measuredError(g));
    }
    encodeChosen(groups, kNearlySameScale);
  }

  /// Whether the errors of blocks are bounded. Other ranks of cp are other decompositions, which cost most of the time.
  bool hasBounds() const {
    return options_.metric == ErrorMetric::seen && options_.tolerance > 0 && options_.method != CompressionMethod::cp;
  }
  std::span<const double> boundsOf(std::size_t group) const {
    return std::span(bounds_).subspan(group * clustersPerGroup(), clustersPerGroup());
  }

  /// Error of a group that the tolerance bounds.
  double groupError(std::size_t group) const {
    const double bound = budget(group);
    return bound > 0 ? options_.tolerance * std::sqrt(measuredError(group) / bound) : 0;
  }

  /// Puts the encoded clusters into the arrays of NdfCp.
  NdfCpData pack() {
    NdfCpData data;
    index_.describe(data);
    data.header.method = *options_.method;
    data.header.coefficient_type = type_;
    for (std::size_t i = 0; i < index_.imageCount(); ++i) {
      data.image_scales.push_back(image_scales_[i] / index_.imageMass(i));
      data.density_scales.push_back(density_scales_[i] / index_.imageMass(i));
    }
    numberBlocks(data);
    const std::size_t blocks = pyramid_.shape.blocksPerImage();
    for (int region = 0; region < index_.regionCount(); ++region)
      for (const std::uint16_t block : data.place_blocks) packCluster(region, region * blocks + block, data);
    data.coefficients.resize(data.coefficients.size() + static_cast<std::size_t>(kRowPadding) * coefficientElementBytes(type_));
    packBlockMasses(data);
    if (std::any_of(encoded_.begin(), encoded_.end(), [](const EncodedCluster& e) { return e.spots > 0; }))
      data.spot_sums = spotSums(index_.sigmaPixels());
    return data;
  }

  /// Numbers the places: the blocks that occur in any image.
  void numberBlocks(NdfCpData& data) const {
    const std::size_t blocks = pyramid_.shape.blocksPerImage();
    data.block_places.assign(blocks, kNoBlockPlace);
    for (std::size_t block = 0; block < blocks; ++block) {
      bool occurs = false;
      for (int region = 0; region < index_.regionCount(); ++region) occurs |= !encoded_[region * blocks + block].kept.empty();
      if (!occurs) continue;
      data.block_places[block] = static_cast<std::uint16_t>(data.place_blocks.size());
      data.place_blocks.push_back(static_cast<std::uint16_t>(block));
    }
    data.header.places = static_cast<int>(data.place_blocks.size());
  }

  /// Appends one cluster: its record, factors and mask.
  void packCluster(int region, std::size_t c, NdfCpData& data) {
    const EncodedCluster& e = encoded_[c];
    const int coefficient_bytes = coefficientElementBytes(type_);
    // A reader loads 32-bit numbers of spots, so they begin at a multiple of four bytes.
    if (e.spots > 0) data.coefficients.resize((data.coefficients.size() + 3) / 4 * 4);
    NdfCluster cluster;
    cluster.first_basis = static_cast<std::uint32_t>(data.basis.size());
    cluster.first_coefficient = data.coefficients.size() / coefficient_bytes;
    cluster.first_scale = static_cast<std::uint32_t>(data.scales.size());
    cluster.first_word = static_cast<std::uint32_t>(data.masks.size());
    cluster.slice_count = static_cast<std::uint32_t>(e.kept.size());
    cluster.columns = static_cast<std::uint16_t>(e.columns);
    cluster.narrow_columns = static_cast<std::uint16_t>(e.narrow_columns);
    cluster.rank_x = static_cast<std::uint8_t>(e.rank_x);
    cluster.rank_y = static_cast<std::uint8_t>(e.rank_y);
    cluster.floor_unit = e.floors.unit;
    data.clusters.push_back(cluster);
    const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    append(data.basis, e.basis);
    append(data.coefficients, e.coefficients);
    append(data.scales, e.scales);
    append(data.core, e.core);
    append(data.floors, e.floors.codes);
    // Mark the images of the region that have a slice in this cluster, and count them word by word.
    data.masks.resize(data.masks.size() + (index_.slotCount(region) + 63) / 64, 0);
    for (const std::uint32_t s : e.kept) {
      const std::uint16_t slot = index_.slot(index_.sliceImage(c, s));
      data.masks[cluster.first_word + slot / 64] |= std::uint64_t{1} << (slot % 64);
    }
    std::uint32_t count = 0;
    for (std::size_t w = cluster.first_word; w < data.masks.size(); ++w) {
      data.mask_ranks.push_back(count);
      count += static_cast<std::uint32_t>(std::popcount(data.masks[w]));
    }
  }

  /// Notes for every image which places it has, and the share of its mass in each.
  void packBlockMasses(NdfCpData& data) const {
    // A reader sums the pixels of a block in another order. The stored mass must not be below the reader's.
    constexpr float kRounding = 1 + 1e-5f;
    const std::size_t images = index_.imageCount(), blocks = pyramid_.shape.blocksPerImage();
    const auto places = static_cast<std::size_t>(data.header.places),
               words = static_cast<std::size_t>(data.header.placeWords());
    const double pixel = 2.0 / pyramid_.shape.resolution;
    std::vector<float> masses(images * places, -1);
    for (std::size_t c = 0; c < index_.clusterCount(); ++c) {
      const double unit = pixel * pixel * pyramid_.value_scale * statistics_[c].peak;
      for (const std::uint32_t s : encoded_[c].kept) {
        const std::size_t image = index_.sliceImage(c, s);
        masses[image * places + data.block_places[c % blocks]] =
            static_cast<float>(unit * encoded_[c].errors.slices[s].positive * data.density_scales[image]) * kRounding;
      }
    }
    data.block_masks.assign(images * words, 0);
    data.first_block.assign(1, 0);
    for (std::size_t image = 0; image < images; ++image) {
      for (std::size_t k = 0; k < places; ++k) {
        if (masses[image * places + k] < 0) continue;
        data.block_masks[image * words + k / 64] |= std::uint64_t{1} << (k % 64);
        data.block_masses.push_back(blockMassCode(masses[image * places + k]));
      }
      data.first_block.push_back(static_cast<std::uint32_t>(data.block_masses.size()));
    }
  }

  CompressionReport makeReport(const NdfCpData& data) const {
    CompressionReport report;
    report.method = *options_.method;
    report.coefficient_type = type_;
    reportLevels(report);
    measureBytes(data, report);
    report.unscaled_images = unscaled_images_;
    for (const EncodedCluster& e : encoded_) {
      report.spots += e.spots;
      if (e.spots > 0) report.spot_slices += e.kept.size();
    }
    for (std::size_t c = 0; c < index_.clusterCount(); ++c) {
      if (index_.sliceCount(c) == 0) continue;
      const auto columns = static_cast<std::size_t>(encoded_[c].columns);
      if (report.rank_histogram.size() <= columns) report.rank_histogram.resize(columns + 1, 0);
      ++report.rank_histogram[columns];
    }
    return report;
  }

  void reportLevels(CompressionReport& report) const {
    double error = 0, energy = 0;
    for (const LevelErrors& e : level_errors_) {
      report.levels.push_back({0, e.energy > 0 ? std::sqrt(e.error / e.energy) : 0, e.seen});
      error += e.error;
      energy += e.energy;
      SeenSummary& most = report.total.seen;
      most = {std::max(most.seen, e.seen.seen), std::max(most.worst, e.seen.worst), std::max(most.bias, e.seen.bias)};
    }
    for (std::uint64_t slice = 0; slice < index_.totalSlices(); ++slice)
      ++report.levels[index_.level(index_.image(slice))].slices;
    report.total.slices = index_.totalSlices();
    report.total.rel_l2 = energy > 0 ? std::sqrt(error / energy) : 0;
  }

  void measureBytes(const NdfCpData& data, CompressionReport& report) const {
    const auto bytes = [](const auto& array) {
      return array.size() * sizeof(typename std::remove_cvref_t<decltype(array)>::value_type);
    };
    report.basis_bytes = bytes(data.basis);
    report.coefficient_bytes = bytes(data.coefficients) + bytes(data.scales) + bytes(data.spot_sums);
    report.index_bytes = bytes(data.image_regions) + bytes(data.image_slots) + bytes(data.image_scales) + bytes(data.clusters) +
                         bytes(data.masks) + bytes(data.mask_ranks) + bytes(data.density_scales) + bytes(data.block_masks) +
                         bytes(data.first_block) + bytes(data.block_masses) + bytes(data.block_places) +
                         bytes(data.place_blocks) + bytes(data.core) + bytes(data.floors);
    report.total_bytes = report.basis_bytes + report.coefficient_bytes + report.index_bytes;
    const double pixels = static_cast<double>(pyramid_.shape.resolution) * pyramid_.shape.resolution;
    const double dense = static_cast<double>(index_.imageCount()) * pixels * sizeof(float);
    double stored =
        static_cast<double>(index_.totalSlices()) * kBlockPixels * (pyramid_.precision == BlockPrecision::f16 ? 2 : 4);
    for (int l = 0; l < pyramid_.shape.level_count; ++l) {
      const PyramidLevel& level = pyramid_.levels[l];
      stored += static_cast<double>(level.masks.size_bytes() + level.mask_ranks.size_bytes() + level.block_means.size_bytes());
    }
    report.ratio_to_dense = dense / static_cast<double>(report.total_bytes);
    report.ratio_to_stored = stored / static_cast<double>(report.total_bytes);
  }

  const NdfPyramid& pyramid_;
  CompressionOptions options_;  // with a method
  CoefficientType type_;
  SliceIndex index_;
  ErrorWeights weights_;
  std::vector<LevelGroup> groups_;
  ProgressCounter& progress_;
  std::vector<ClusterStatistics> statistics_;
  std::vector<ClusterModel> models_;
  std::vector<std::optional<ClusterBasis>> bases_;  // [clusters], cp: the bases of selection_
  std::vector<EncodedCluster> encoded_;
  std::vector<LevelErrors> level_errors_;
  std::vector<int> selection_;
  std::vector<double> bounds_;  // [clusters]: weighted squared error that each may have
  std::vector<float> image_scales_;
  std::vector<float> density_scales_;
  std::uint64_t unscaled_images_ = 0;
};

}  // namespace

NdfCp NdfCpData::view() const {
  NdfCp v = header;
  v.image_regions = image_regions;
  v.image_slots = image_slots;
  v.image_scales = image_scales;
  v.density_scales = density_scales;
  v.block_masks = block_masks;
  v.first_block = first_block;
  v.block_masses = block_masses;
  v.block_places = block_places;
  v.place_blocks = place_blocks;
  v.clusters = clusters;
  v.masks = masks;
  v.mask_ranks = mask_ranks;
  v.basis = basis;
  v.coefficients = coefficients.data();
  v.coefficient_count = coefficients.size() / coefficientElementBytes(header.coefficient_type);
  v.scales = scales;
  v.core = core;
  v.spot_sums = spot_sums;
  v.floors = floors;
  return v;
}

int coefficientElementBytes(CoefficientType type) {
  return type == CoefficientType::i8 ? 1 : type == CoefficientType::f16 ? 2 : 4;
}

NdfCpData compressPyramid(const NdfPyramid& pyramid, const CompressionOptions& options, CompressionReport* report,
                          const ProgressFn& progress) {
  checkOptions(options);
  checkRegions(pyramid, options.regions);
  const std::vector<Attempt> attempts = attemptsOf(options);
  ProgressCounter counter(progress, 0);
  double least = std::numeric_limits<double>::infinity();
  for (const Attempt& attempt : attempts) {
    Compressor compressor(pyramid, options, attempt, counter);
    if (compressor.compress()) return compressor.result(report);
    least = std::min(least, compressor.error());
  }
  rejectTolerance(options, least);
}

}  // namespace glint::bake
