#pragma once
#pragma GCC system_header  // include_next is an extension

// Found before oneTBB's own header by builds for ThreadSanitizer alone.
#include_next <tbb/parallel_for.h>

#include <concepts>

#include "annotations.h"

namespace tbb {

template <std::integral Index, class Body, class... Partitioner>
void annotatedParallelFor(Index first, Index last, const Body& body, const Partitioner&... partitioner) {
  glint::tsan::runAnnotated(body, [&](const auto& annotated) { parallel_for(first, last, annotated, partitioner...); });
}

template <class Range, class Body, class... Partitioner>
void annotatedParallelFor(const Range& range, const Body& body, const Partitioner&... partitioner) {
  glint::tsan::runAnnotated(body, [&](const auto& annotated) { parallel_for(range, annotated, partitioner...); });
}

}  // namespace tbb

#define parallel_for annotatedParallelFor
