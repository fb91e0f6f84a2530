#pragma once

#include <cstddef>
#include <memory>
#include <memory_resource>
#include <type_traits>

namespace glint::bake {

/// Gives an array back to the resource that it came from.
struct LargeArrayDelete {
  std::pmr::memory_resource* resource = nullptr;
  std::size_t size_bytes = 0;
  static constexpr std::size_t kAlignment = 64;

  void operator()(void* array) const { resource->deallocate(array, size_bytes, kAlignment); }
};

/// An array that grows with the map, in memory of the default resource, which may be a temporary file.
template <class T>
using LargeArray = std::unique_ptr<T[], LargeArrayDelete>;

/// Makes an array whose values are not set, since builders write all of them.
/// @throws std::bad_alloc, and what the resource throws
template <class T>
LargeArray<T> makeLargeArray(std::size_t count) {
  static_assert(std::is_trivial_v<T>);
  std::pmr::memory_resource* resource = std::pmr::get_default_resource();
  const std::size_t bytes = count * sizeof(T);
  return {static_cast<T*>(resource->allocate(bytes, LargeArrayDelete::kAlignment)), LargeArrayDelete{resource, bytes}};
}

}  // namespace glint::bake
