#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <cstddef>

namespace glint::python {

/// Queries that one thread answers at least: their cost is well above that of starting a task.
inline constexpr std::size_t kRunOfQueries = 1024;

/// Calls work(first, count) for runs of queries, on several threads. What work throws is thrown here.
/// @param threads  0: as many as the processor has
template <class Work>
void inRuns(std::size_t count, int threads, Work&& work) {
  if (threads == 1 || count <= kRunOfQueries) return work(std::size_t{0}, count);
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  arena.execute([&] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, kRunOfQueries),
                      [&](const tbb::blocked_range<std::size_t>& run) { work(run.begin(), run.size()); });
  });
}

}  // namespace glint::python
