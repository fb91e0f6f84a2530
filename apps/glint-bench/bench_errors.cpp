#include "glint-bench/bench_errors.h"

#include <tbb/parallel_for.h>

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "glint/bake/common/reference_image.h"
#include "glint/bake/common/seen_error.h"

namespace glint::apps {
namespace {

constexpr int kResolution = SetTruth::kResolution;

/// Means of a model over the pixels of an image. Rows are shared by all threads.
std::vector<float> imageOf(const api::AnyNdf& any, const Footprint& footprint) {
  constexpr float kPixel = 2.0f / kResolution;
  std::vector<float> image(rowMajorIndex(0, kResolution, kResolution));
  std::visit(
      [&](const auto& model) {
        tbb::parallel_for(0, kResolution, [&](int j) {
          for (int i = 0; i < kResolution; ++i) {
            const Vec2 low = {kPixel * static_cast<float>(i) - 1, kPixel * static_cast<float>(j) - 1};
            image[rowMajorIndex(i, j, kResolution)] = model.mean(footprint, {low, low + Vec2{kPixel, kPixel}});
          }
        });
      },
      any);
  return image;
}

/// Sums over the images of a set: relative L2 distance, total variation, and energy.
struct ImageSums {
  double rel_l2 = 0, tv = 0, energy = 0;

  void add(const std::vector<float>& image, const std::vector<float>& truth) {
    double difference2 = 0, truth2 = 0, absolute = 0, sum = 0;
    for (std::size_t k = 0; k < image.size(); ++k) {
      const double d = double{image[k]} - double{truth[k]};
      difference2 += d * d;
      truth2 += double{truth[k]} * double{truth[k]};
      absolute += std::abs(d);
      sum += double{image[k]};
    }
    constexpr double kPixelArea = 4.0 / (kResolution * kResolution);
    rel_l2 += std::sqrt(difference2 / truth2);
    tv += 0.5 * kPixelArea * absolute;
    energy += kPixelArea * sum - 1;
  }
};

bool answersAsAsked(const api::FootprintShapes& shapes, FootprintShape shape) {
  return shape == FootprintShape::box ? shapes.boxes : shapes.gaussians;
}

}  // namespace

SetTruth::SetTruth(const NormalMap& map, const FootprintSet& set) : set_(&set), images_(set.footprints.size()) {
  tbb::parallel_for(std::size_t{0}, images_.size(), [&](std::size_t k) {
    images_[k] = bake::referenceImage(map, kBenchSigmaR, Surface::flat, Boundary::wrap, set.footprints[k], kResolution);
  });
}

nlohmann::json SetTruth::errorsOf(const api::OpenedNdf& ndf, double budget_s, std::vector<float>& first) const {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  bake::SeenError seen(kResolution);
  ImageSums sums;
  std::size_t places = 0;
  while (places < set_->places) {
    std::vector<float> image = imageOf(ndf.model(), set_->footprints[places]);
    seen.add(image.data(), images_[places].data());
    sums.add(image, images_[places]);
    if (places == 0) first = std::move(image);
    ++places;
    if (std::chrono::duration<double>(Clock::now() - start).count() > budget_s) break;
  }
  for (std::size_t k = places; k < images_.size(); ++k) seen.addTruth(images_[k].data());
  const bake::SeenSummary summary = seen.summary();
  const auto count = static_cast<double>(places);
  return {{"shape", shapeName(set_->shape)},
          {"sigma_texels", set_->sigma_texels},
          {"places", places},
          {"as_asked", answersAsAsked(ndf.info().shapes, set_->shape)},
          {"seen", summary.seen},
          {"seen_worst", summary.worst},
          {"bias", summary.bias},
          {"rel_l2", sums.rel_l2 / count},
          {"tv", sums.tv / count},
          {"energy", sums.energy / count}};
}

}  // namespace glint::apps
