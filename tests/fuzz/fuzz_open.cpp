// Opens arbitrary bytes as an asset, follows every index of what opens, and asks it. Anything but a clean refusal, or a valid
// asset with finite answers, is a defect: a crash, a hang, a sanitizer report or an exception that is no glint::Error.

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <variant>

#include "fuzz/opens_asset.h"
#include "glint/api/any_ndf.h"
#include "glint/formats/validate.h"
#include "glint/query/brdf/displaced_brdf.h"

namespace {

using namespace glint;

bool isDensity(float value) { return value >= 0 && value < std::numeric_limits<float>::infinity(); }
bool isDensity(Rgb value) { return isDensity(value.r) && isDensity(value.g) && isDensity(value.b); }

void require(bool finite) {
  if (finite) return;
  std::fprintf(stderr, "an answer is negative or not finite\n");
  std::abort();
}

/// Asks an NDF a few queries.
void ask(const api::AnyNdf& ndf) {
  for (const float sigma : {0.7f, 3.0f, 40.0f}) {
    const Footprint p = Footprint::isotropic({0.3f, 0.6f}, sigma);
    require(isDensity(ndf.density(p, {0.1f, -0.05f})));
    require(isDensity(ndf.mean(p, {{-0.2f, -0.3f}, {0.3f, 0.1f}})));
    require(isDensity(ndf.sample(p, {0.4f, 0.7f}).pdf));
  }
}

/// Asks a displacement for light and normals.
void ask(const Displacement& displacement) {
  const DisplacedBrdf brdf(displacement);
  const Vec3 wi = {0.6f, 0, 0.8f}, wo = {-0.48f, 0.6f, 0.64f};
  for (const float diameter : {1.0f, 20.0f, 500.0f}) {
    const LevelBlend levels = brdf.levelsFor(diameter);
    const Vec2 uv = {0.3f, 0.6f};
    for (const auto variant : {DisplacedVariant::full, DisplacedVariant::lobes, DisplacedVariant::single})
      require(isDensity(brdf.reflected(levels, uv, wi, wo, variant)));
    require(isDensity(brdf.normalDensity(levels.first, uv, {0.1f, -0.05f})));
    require(isDensity(brdf.sample(levels, uv, wo, {0.4f, 0.7f}).pdf));
  }
}

}  // namespace

bool opensAsset(const std::uint8_t* data, std::size_t size) {
  // At a multiple of 64, so that the bytes are used in place and the sanitizer sees their end.
  struct Free {
    void operator()(void* memory) const { std::free(memory); }
  };
  void* memory = nullptr;
  if (::posix_memalign(&memory, 64, size == 0 ? 1 : size) != 0) std::abort();
  const std::unique_ptr<void, Free> owner(memory);
  if (size > 0) std::memcpy(memory, data, size);
  const std::span bytes(static_cast<const std::byte*>(memory), size);
  // Data checks evaluate every block and cluster, through the same indices as queries.
  formats::validateMemory(bytes, "fuzz");
  try {
    formats::Asset asset = formats::Asset::openMemory(bytes, "fuzz");
    if (asset.kind() == "displacement") {
      ask(asset.get<Displacement>());
    } else if (api::answersNdf(asset.kind())) {
      ask(api::OpenedNdf::open(std::move(asset), "fuzz").model());
    }
    return true;
  } catch (const Error&) {
    return false;
  }
}
