#include "glint/bake/common/half_array.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "glint/bake/common/half_array.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace glint::bake::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void HalvesToFloats(const std::uint16_t* in, std::size_t count, float* out) {
  const hn::CappedTag<float, 8> floats;
  const hn::Rebind<hwy::float16_t, decltype(floats)> halves;
  const auto* values = reinterpret_cast<const hwy::float16_t*>(in);
  for (std::size_t i = 0; i < count; i += hn::Lanes(floats))
    hn::StoreU(hn::PromoteTo(floats, hn::LoadU(halves, values + i)), floats, out + i);
}

}  // namespace glint::bake::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace glint::bake {

HWY_EXPORT(HalvesToFloats);

void halvesToFloats(const std::uint16_t* in, std::size_t count, float* out) {
  HWY_DYNAMIC_DISPATCH(HalvesToFloats)(in, count, out);
}

}  // namespace glint::bake
#endif
