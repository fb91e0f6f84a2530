#pragma once
#pragma GCC system_header  // include_next is an extension

// Found before oneTBB's own header by builds for ThreadSanitizer alone.
#include_next <tbb/parallel_pipeline.h>

#include "annotations.h"

namespace glint::tsan {

/// Tokens go from filter to filter: every call of one sees what all calls that have ended did.
inline Order& pipelineOrder() {
  static Order order;
  return order;
}

}  // namespace glint::tsan

namespace tbb {

template <class Input, class Output, class Body>
auto annotatedFilter(filter_mode mode, const Body& body) {
  return make_filter<Input, Output>(mode, [body](auto&&... input) -> Output {
    struct Scope {
      Scope() { __tsan_acquire(&glint::tsan::pipelineOrder().end); }
      ~Scope() { __tsan_release(&glint::tsan::pipelineOrder().end); }
    } scope;
    return body(std::forward<decltype(input)>(input)...);
  });
}

template <class Filter>
void annotatedParallelPipeline(std::size_t most_tokens, const Filter& filter) {
  __tsan_release(&glint::tsan::pipelineOrder().end);
  const glint::tsan::AcquireAtEnd acquire{&glint::tsan::pipelineOrder().end};
  parallel_pipeline(most_tokens, filter);
}

}  // namespace tbb

#define make_filter annotatedFilter
#define parallel_pipeline annotatedParallelPipeline
