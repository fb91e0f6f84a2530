#include "measure/bench_errors.h"

#include <tbb/parallel_for.h>

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/ndf_image.h"
#include "glint/bake/common/image_errors.h"
#include "glint/bake/common/reference_image.h"
#include "glint/bake/common/seen_error.h"
#include "measure/light_blur.h"

namespace glint::apps {
namespace {

constexpr int kResolution = SetTruth::kResolution;

bool answersAsAsked(const api::FootprintShapes& shapes, FootprintShape shape) {
  return shape == FootprintShape::box ? shapes.boxes : shapes.gaussians;
}

}  // namespace

SetTruth::SetTruth(const NormalMap& map, const FootprintSet& set, float sigma_r, double light_deg)
    : set_(&set), light_deg_(light_deg), images_(set.footprints.size()) {
  tbb::parallel_for(std::size_t{0}, images_.size(), [&](std::size_t k) {
    images_[k] = bake::referenceImage(map, sigma_r, Surface::flat, Boundary::wrap, set.footprints[k], kResolution);
    blurByLight(images_[k], kResolution, light_deg);
  });
}

nlohmann::json SetTruth::errorsOf(const api::OpenedNdf& ndf, double budget_s, std::vector<float>& first) const {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  bake::SeenError seen(kResolution);
  bake::ImageErrors sums;
  std::size_t places = 0;
  while (places < set_->places) {
    std::vector<float> image = ndfImage(ndf.model(), set_->footprints[places], kResolution);
    blurByLight(image, kResolution, light_deg_);
    seen.add(image.data(), images_[places].data());
    const bake::ImageErrors errors = bake::imageErrors(image, images_[places], kResolution);
    sums.rel_l2 += errors.rel_l2, sums.tv += errors.tv, sums.energy += errors.energy;
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
