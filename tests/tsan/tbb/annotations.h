#pragma once

#include <sanitizer/tsan_interface.h>

/// What oneTBB orders, told to ThreadSanitizer: the library itself is not instrumented, so neither the start of a loop's bodies
/// nor their end would be seen. Bodies are not ordered among each other: their own races are still found.
namespace glint::tsan {

/// The start and the end of one loop: addresses that stand for them.
struct Order {
  char begin, end;
};

/// Release and acquire at the end of a scope, also where an exception leaves it.
struct ReleaseAtEnd {
  char* address;
  ~ReleaseAtEnd() { __tsan_release(address); }
};
struct AcquireAtEnd {
  char* address;
  ~AcquireAtEnd() { __tsan_acquire(address); }
};

/// A body of a loop. Its members, and the range that it gets, lie in memory that the library hands from thread to thread.
template <class Body>
struct AnnotatedBody {
  Order* order;
  const Body* body;

  template <class Range>
  __attribute__((no_sanitize("thread"))) void operator()(const Range& range) const {
    const Range own = range;
    __tsan_acquire(&order->begin);
    const ReleaseAtEnd release{&order->end};
    (*body)(own);
  }
};

/// Calls loop(annotated body).
template <class Body, class Loop>
void runAnnotated(const Body& body, const Loop& loop) {
  Order order;
  __tsan_release(&order.begin);
  const AcquireAtEnd acquire{&order.end};
  loop(AnnotatedBody<Body>{&order, &body});
}

}  // namespace glint::tsan
