#pragma once

#include <cstddef>
#include <limits>
#include <string>

namespace glint {

/// "column 3, row 7 from the top" of a texel index. Arrays hold the bottom row first; messages count as image viewers do:
/// columns from the left and rows from the top, both from 0.
inline std::string texelName(int width, int height, std::size_t texel) {
  const auto columns = static_cast<std::size_t>(width);
  const std::size_t row = static_cast<std::size_t>(height) - 1 - texel / columns;
  return "column " + std::to_string(texel % columns) + ", row " + std::to_string(row) + " from the top";
}

/// Counts texels and remembers the first, in the order of texelName: row by row from the top.
class TexelTally {
 public:
  TexelTally(int width, int height) : width_(width), height_(height) {}

  void add(std::size_t texel) {
    const auto columns = static_cast<std::size_t>(width_);
    const std::size_t place = (static_cast<std::size_t>(height_) - 1 - texel / columns) * columns + texel % columns;
    if (place < first_place_) first_place_ = place, first_ = texel;
    ++count_;
  }
  std::size_t count() const { return count_; }
  std::size_t first() const { return first_; }
  std::string firstName() const { return texelName(width_, height_, first_); }

 private:
  int width_, height_;
  std::size_t count_ = 0;
  std::size_t first_ = 0;
  std::size_t first_place_ = std::numeric_limits<std::size_t>::max();
};

}  // namespace glint
