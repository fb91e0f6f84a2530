#pragma once

#include <cstddef>
#include <functional>

namespace glint::bake {

/// Called now and then while a builder works: `done` of `total` units, from any thread but never concurrently, `done` never
/// decreasing. An empty function is fine.
using ProgressFn = std::function<void(std::size_t done, std::size_t total)>;

}  // namespace glint::bake
