#include "glint/bake/common/seen_error.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "glint/model/ndf_pyramid.h"

namespace glint::bake {

int seenCellPixels(int resolution) {
  const int pixels = std::clamp(resolution / kSeenCells, 1, kBlockSize);
  return static_cast<int>(std::bit_floor(static_cast<unsigned>(pixels)));
}

SeenError::SeenError(int resolution)
    : resolution_(resolution),
      cell_pixels_(seenCellPixels(resolution)),
      cells_(resolution / cell_pixels_),
      sums_(static_cast<std::size_t>(cells_) * cells_) {}

void SeenError::add(const float* image, const float* truth) {
  ++places_;
  ++truth_places_;
  for (int y = 0; y < resolution_; ++y) {
    for (int x = 0; x < resolution_; ++x) {
      const std::size_t at = static_cast<std::size_t>(y) * resolution_ + x;
      const double t = truth[at], d = image[at] - t;
      Cell& cell = sums_[static_cast<std::size_t>(y / cell_pixels_) * cells_ + x / cell_pixels_];
      cell.error2 += d * d;
      cell.truth2 += t * t;
      cell.difference += d;
      cell.truth += t;
      cell.lit |= std::max(image[at], truth[at]) > kDarkestSeen;
    }
  }
}

void SeenError::addTruth(const float* truth) {
  ++truth_places_;
  for (int y = 0; y < resolution_; ++y) {
    for (int x = 0; x < resolution_; ++x) {
      const double t = truth[static_cast<std::size_t>(y) * resolution_ + x];
      Cell& cell = sums_[static_cast<std::size_t>(y / cell_pixels_) * cells_ + x / cell_pixels_];
      cell.truth2 += t * t;
      cell.truth += t;
      cell.lit |= t > kDarkestSeen;
    }
  }
}

double SeenError::errorOf(const Cell& cell) const {
  if (!cell.lit || places_ == 0) return 0;
  const double area = cell_pixels_ * cell_pixels_;
  return std::sqrt(cell.error2 / (places_ * area)) / std::max(std::sqrt(cell.truth2 / (truth_places_ * area)), kDarkestSeen);
}

SeenSummary SeenError::summary() const {
  SeenSummary result;
  double squares = 0, lit = 0;
  for (const Cell& cell : sums_) {
    if (!cell.lit) continue;
    const double area = cell_pixels_ * cell_pixels_, e = errorOf(cell);
    ++lit;
    squares += e * e;
    result.worst = std::max(result.worst, e);
    if (places_ == 0) continue;
    const double truth = std::max(cell.truth / (truth_places_ * area), kDarkestSeen);
    result.bias = std::max(result.bias, std::abs(cell.difference / (places_ * area)) / truth);
  }
  if (lit > 0) result.seen = std::sqrt(squares / lit);
  return result;
}

std::vector<double> SeenError::errors() const {
  std::vector<double> result;
  result.reserve(sums_.size());
  for (const Cell& cell : sums_) result.push_back(errorOf(cell));
  return result;
}

}  // namespace glint::bake
