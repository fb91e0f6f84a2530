#include "measure/place_errors.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "common/ndf_image.h"
#include "glint/bake/common/reference_image.h"
#include "glint/bake/common/seen_error.h"
#include "measure/light_blur.h"
#include "measure/place_light.h"

namespace glint::apps {
namespace {

constexpr int kPixels = PlaceTruth::kResolution;
constexpr double kDarkest = bake::kDarkestSeen;

std::size_t cellOf(int x, int y) {
  const int pixels = bake::seenCellPixels(kPixels);
  return static_cast<std::size_t>(y / pixels) * static_cast<std::size_t>(kPixels / pixels) +
         static_cast<std::size_t>(x / pixels);
}

double pixelShare() {
  const double pixels = bake::seenCellPixels(kPixels);
  return 1 / (pixels * pixels);
}

std::size_t pixelAt(int x, int y) { return static_cast<std::size_t>(y) * kPixels + static_cast<std::size_t>(x); }

/// Calls visit(cell, pixel) for every pixel.
template <class Visit>
void eachPixel(const Visit& visit) {
  for (int y = 0; y < kPixels; ++y)
    for (int x = 0; x < kPixels; ++x) visit(cellOf(x, y), pixelAt(x, y));
}

}  // namespace

PlaceTruth::PlaceTruth(const NormalMap& map, std::vector<Footprint> footprints, std::size_t asked, float sigma_r,
                       double light_deg)
    : map_(map), sigma_r_(sigma_r), footprints_(std::move(footprints)), light_deg_(light_deg) {
  PlaceLight light = placeLight(map, footprints_, sigma_r, light_deg, kPixels);
  light2_ = std::move(light.squares), lit_ = std::move(light.lit);
  const auto places = static_cast<double>(footprints_.size());
  const Covariance shape = footprints_.front().covariance;
  const float sigma = std::sqrt(std::sqrt(shape.xx * shape.yy - shape.xy * shape.xy));
  const std::vector<double> least = leastLight(map, sigma, sigma_r, light_deg, kPixels);
  for (std::size_t cell = 0; cell < least.size(); ++cell)
    light2_[cell] = std::max({light2_[cell] / places, least[cell], kDarkest * kDarkest});
  footprints_.resize(asked);
}

void PlaceTruth::makeImages(std::size_t places) {
  const std::size_t known = images_.size();
  if (places <= known) return;
  images_.resize(places);
  tbb::parallel_for(known, places, [&](std::size_t k) {
    images_[k] = bake::referenceImage(map_, sigma_r_, Surface::flat, Boundary::wrap, footprints_[k], kPixels);
    blurByLight(images_[k], kPixels, light_deg_);
  });
}

PlaceErrors PlaceSample::ask(int places, double longest_s) {
  // Time of the processors, so that a busy machine measures as much as an idle one.
  const auto used = [] { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; };
  const int wanted = std::min(places, truth_.places());
  truth_.makeImages(static_cast<std::size_t>(wanted));
  while (static_cast<int>(squares_.size()) < wanted) {
    if (seconds_ > longest_s && static_cast<int>(squares_.size()) >= kFewest) break;
    const double start = used();
    askNext();
    seconds_ += used() - start;
  }
  return errors();
}

void PlaceSample::askNext() {
  const std::size_t place = squares_.size();
  std::vector<float> image = ndfImage(ndf_.model(), truth_.footprints_[place], kPixels);
  blurByLight(image, kPixels, truth_.light_deg_);
  const std::vector<float>& exact = truth_.images_[place];
  std::vector<double> squares(lit_.size(), 0.0), differences(lit_.size(), 0.0);
  const double share = pixelShare();
  eachPixel([&](std::size_t cell, std::size_t pixel) {
    const double d = double{image[pixel]} - exact[pixel];
    squares[cell] += share * d * d;
    differences[cell] += share * d;
    if (image[pixel] > kDarkest) lit_[cell] = 1;
  });
  squares_.push_back(std::move(squares));
  differences_.push_back(std::move(differences));
}

PlaceErrors PlaceSample::errors() const {
  const auto count = static_cast<double>(squares_.size());
  double lit = 0;
  for (const unsigned char is_lit : lit_) lit += is_lit;
  PlaceErrors errors;
  errors.places = static_cast<int>(squares_.size());
  if (lit == 0) return errors;
  // The square of the seen error is a mean over places.
  std::vector<double> of_place(squares_.size(), 0.0);
  double bias2 = 0;
  for (std::size_t cell = 0; cell < lit_.size(); ++cell) {
    if (!lit_[cell]) continue;
    const double share = 1 / (lit * truth_.light2_[cell]);
    double sum = 0, sum2 = 0;
    for (std::size_t k = 0; k < squares_.size(); ++k) {
      of_place[k] += share * squares_[k][cell];
      sum += differences_[k][cell], sum2 += differences_[k][cell] * differences_[k][cell];
    }
    // Few places have a mean error by chance: its square is the variance over the number of places, which is taken away.
    const double mean = sum / count, variance = (sum2 - count * mean * mean) / (count - 1);
    bias2 += share * (mean * mean - variance / count);
  }
  double mean = 0, spread2 = 0;
  for (const double q : of_place) mean += q / count;
  for (const double q : of_place) spread2 += (q - mean) * (q - mean) / (count - 1);
  errors.seen = std::sqrt(mean);
  if (errors.seen > 0) errors.deviation = std::sqrt(spread2 / count) / (2 * errors.seen);
  errors.bias = std::sqrt(std::max(0.0, bias2));
  return errors;
}

}  // namespace glint::apps
