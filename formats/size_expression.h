#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace glint::formats {

/// Values of the names in size expressions.
struct SizeScope {
  std::map<std::string, std::vector<std::uint64_t>, std::less<>> values;
  std::uint64_t level = 0;  ///< value of `l`
};

/// Evaluates a size expression: integers, names, `name[l]`, `l`, `+`, `*`, `ceil_div(a, b)`, `pow2(a)` and parentheses.
/// @return nothing if a name is not bound, the syntax is wrong, a divisor is 0 or the value needs more than 64 bits
std::optional<std::uint64_t> evaluateSize(std::string_view expression, const SizeScope& scope);

}  // namespace glint::formats
