#include "glint/formats/kinds/kind.h"

#include <array>
#include <utility>

namespace glint::formats {
namespace {

template <class... Models>
std::array<const Kind*, sizeof...(Models)> kindsOf(const std::variant<Models...>*) {
  return {&kindOf<Models>()...};
}

}  // namespace

std::span<const Kind* const> kinds() {
  static const auto all = kindsOf(static_cast<const AnyAsset*>(nullptr));
  return all;
}

const Kind* findKind(std::string_view name) {
  for (const Kind* kind : kinds()) {
    if (kind->schema.name == name) return kind;
  }
  return nullptr;
}

}  // namespace glint::formats
