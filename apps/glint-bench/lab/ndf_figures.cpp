#include "glint-bench/lab/ndf_figures.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <variant>

#include "common/ndf_image.h"
#include "glint/bake/common/counter_random.h"
#include "glint/bake/common/image_errors.h"
#include "glint/bake/common/reference_image.h"
#include "glint/query/detail/common/footprint_weights.h"

namespace glint::apps {
Footprint askedShape(const Footprint& gaussian, const api::NdfInfo& info) {
  if (info.shapes.gaussians || gaussian.kind == Footprint::Kind::box) return gaussian;
  const AxisPair deviations = deviationsOf(positiveCovariance(gaussian.covariance));
  // A box of half side a has the variance a^2 / 3.
  const auto halfAxis = [](const double(&axis)[2]) {
    return Vec2{static_cast<float>(std::numbers::sqrt3 * axis[0]), static_cast<float>(std::numbers::sqrt3 * axis[1])};
  };
  return Footprint::box(gaussian.centre, halfAxis(deviations.a), halfAxis(deviations.b));
}

std::vector<Footprint> roundFootprints(std::uint64_t seed, std::size_t count, float sigma_texels) {
  constexpr std::uint64_t kStream = 2000;
  // Steps of the sequence R2 (Roberts 2018): 1/g and 1/g^2, where g^3 = g + 1.
  constexpr double kStepX = 0.7548776662466927, kStepY = 0.5698402909980532;
  const Vec2 start = bake::randomPair(seed, kStream, 0);
  const auto wrapped = [](double x) { return static_cast<float>(x - std::floor(x)); };
  std::vector<Footprint> footprints;
  for (std::size_t k = 0; k < count; ++k) {
    const auto n = static_cast<double>(k);
    footprints.push_back(Footprint::isotropic({wrapped(start.x + n * kStepX), wrapped(start.y + n * kStepY)}, sigma_texels));
  }
  return footprints;
}

ImageTruth::ImageTruth(const LabMap& map, std::vector<Footprint> footprints, const LabQuestion& question, int resolution)
    : map_(map), question_(question), footprints_(std::move(footprints)), resolution_(resolution) {}

std::vector<std::vector<float>> ImageTruth::imagesOf(const LabMap& map, const api::NdfInfo& info) const {
  std::vector<std::vector<float>> images(footprints_.size());
  tbb::parallel_for(std::size_t{0}, images.size(), [&](std::size_t k) {
    images[k] = bake::referenceImage(map.normals(), question_.sigma_r, question_.surface, Boundary::wrap,
                                     askedShape(footprints_[k], info), resolution_);
  });
  return images;
}

const std::vector<std::vector<float>>& ImageTruth::images(const api::NdfInfo& info) const {
  std::vector<std::vector<float>>& images = info.shapes.gaussians ? gaussian_images_ : box_images_;
  if (images.empty()) images = imagesOf(map_, info);
  return images;
}

std::vector<float> ImageTruth::imageOf(const api::OpenedNdf& ndf, std::size_t place) const {
  return ndfImage(ndf.model(), askedShape(footprints_[place], ndf.info()), resolution_);
}

double ImageTruth::variation(const api::OpenedNdf& ndf) const {
  const std::vector<std::vector<float>>& truth = images(ndf.info());
  double sum = 0;
  for (std::size_t k = 0; k < footprints_.size(); ++k) sum += bake::imageErrors(imageOf(ndf, k), truth[k], resolution_).tv;
  return sum / static_cast<double>(footprints_.size());
}

double ImageTruth::variation(const LabMap& other) const {
  api::NdfInfo info;
  info.shapes.gaussians = true;
  const std::vector<std::vector<float>>&truth = images(info), others = imagesOf(other, info);
  double sum = 0;
  for (std::size_t k = 0; k < truth.size(); ++k) sum += bake::imageErrors(others[k], truth[k], resolution_).tv;
  return sum / static_cast<double>(truth.size());
}

bake::SeenError ImageTruth::seenErrors(const api::OpenedNdf& ndf) const {
  const std::vector<std::vector<float>>& truth = images(ndf.info());
  bake::SeenError errors(resolution_);
  for (std::size_t k = 0; k < footprints_.size(); ++k) errors.add(imageOf(ndf, k).data(), truth[k].data());
  return errors;
}

double ImageTruth::seen(const api::OpenedNdf& ndf) const { return seenErrors(ndf).summary().seen; }

double ImageTruth::bias(const api::OpenedNdf& ndf) const { return seenErrors(ndf).summary().bias; }

double ImageTruth::seenInRing(const api::OpenedNdf& ndf, double inner, double outer) const {
  const std::vector<double> errors = seenErrors(ndf).errors();
  const auto cells = static_cast<int>(std::lround(std::sqrt(static_cast<double>(errors.size()))));
  double squares = 0;
  int lit = 0;
  for (int y = 0; y < cells; ++y) {
    for (int x = 0; x < cells; ++x) {
      const double radius = std::hypot(2 * (x + 0.5) / cells - 1, 2 * (y + 0.5) / cells - 1);
      const double error = errors[static_cast<std::size_t>(y) * cells + x];
      if (radius < inner || radius >= outer || error == 0) continue;
      squares += error * error;
      ++lit;
    }
  }
  return lit > 0 ? std::sqrt(squares / lit) : 0;
}

double flicker(const api::OpenedNdf& ndf, std::span<const Path> paths) {
  std::vector<double> changes(paths.size()), squares(paths.size());
  tbb::parallel_for(std::size_t{0}, paths.size(), [&](std::size_t k) {
    double before = 0, here = 0;
    for (std::size_t step = 0; step < paths[k].size(); ++step) {
      const PathStep& question = paths[k][step];
      const double next = ndf.model().density(askedShape(question.footprint, ndf.info()), question.half);
      const double change = step < 2 ? 0 : before - 2 * here + next;
      changes[k] += change * change, squares[k] += next * next;
      before = here, here = next;
    }
  });
  double change = 0, square = 0;
  for (std::size_t k = 0; k < paths.size(); ++k) change += changes[k], square += squares[k];
  return square > 0 ? std::sqrt(change / square) : 0;
}

}  // namespace glint::apps
