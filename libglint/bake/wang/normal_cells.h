#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "glint/math/vec.h"

namespace glint::bake {

/// How many normals lie in each of 64 x 64 cells of [-1, 1]^2: cells of the width by which the seen error pools (four pixels of an
/// NDF image of 256^2).
class NormalCells {
 public:
  static constexpr int kPerAxis = 64;

  void add(Vec2 n) {
    ++counts_[cellOf(n)];
    ++total_;
  }
  void add(const NormalCells& other) {
    for (std::size_t k = 0; k < counts_.size(); ++k) counts_[k] += other.counts_[k];
    total_ += other.total_;
  }

  /// Total variation between the distributions of this and another; 1 if one of them is empty. `more` is added to this.
  double totalVariation(const NormalCells& other, const NormalCells* more = nullptr) const {
    const std::uint64_t total = total_ + (more ? more->total_ : 0);
    if (total == 0 || other.total_ == 0) return 1;
    double sum = 0;
    for (std::size_t k = 0; k < counts_.size(); ++k) {
      const std::uint64_t count = counts_[k] + (more ? more->counts_[k] : 0);
      sum += std::abs(static_cast<double>(count) / static_cast<double>(total) -
                      static_cast<double>(other.counts_[k]) / static_cast<double>(other.total_));
    }
    return 0.5 * sum;
  }

 private:
  static std::size_t cellOf(Vec2 n) {
    const auto along = [](float x) { return std::clamp(static_cast<int>((x + 1) * (0.5f * kPerAxis)), 0, kPerAxis - 1); };
    return rowMajorIndex(along(n.x), along(n.y), kPerAxis);
  }

  std::array<std::uint64_t, std::size_t{kPerAxis}* kPerAxis> counts_ = {};
  std::uint64_t total_ = 0;
};

}  // namespace glint::bake
