#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace glint::bake {

/// Memory that the sums of chunks take before they are added, bytes.
inline constexpr std::size_t kOrderedSumBytes = std::size_t{1} << 28;

/// Computes the sums of chunks in parallel, and adds them in the order of the chunks, so that results do not depend on
/// threads. As many sums as fit into kOrderedSumBytes are held at a time, and at least four.
/// @param bytes  size of one sum
/// @param make   make(chunk) returns the sum of a chunk
/// @param add    add(chunk, sum)
template <class Make, class Add>
void addInOrder(std::size_t chunks, std::size_t bytes, const Make& make, const Add& add) {
  const std::size_t batch = std::max<std::size_t>(4, kOrderedSumBytes / std::max<std::size_t>(bytes, 1));
  for (std::size_t first = 0; first < chunks; first += batch) {
    const std::size_t count = std::min(batch, chunks - first);
    std::vector<decltype(make(std::size_t{0}))> sums(count);
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t k) { sums[k] = make(first + k); });
    for (std::size_t k = 0; k < count; ++k) add(first + k, sums[k]);
  }
}

}  // namespace glint::bake
