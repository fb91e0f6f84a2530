#include "glint/bake/moments/lobe_textures.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "glint/bake/common/slopes.h"

namespace glint::bake {
namespace {

/// Makes a texture: write(texel, its pixel) for every texel.
template <class Write>
LobeTexture texture(std::string_view name, int channels, std::span<const MapSlopes> texels, const Write& write) {
  LobeTexture made{name, channels, std::vector<float>(texels.size() * static_cast<std::size_t>(channels))};
  tbb::parallel_for(std::size_t{0}, texels.size(),
                    [&](std::size_t k) { write(texels[k], made.pixels.data() + k * static_cast<std::size_t>(channels)); });
  return made;
}

void writeNormal(const MapSlopes& slopes, float* pixel) {
  const Vec2 n = normalFromSlopes(slopes.mean.x, slopes.mean.y);
  pixel[0] = 0.5f + 0.5f * n.x;
  pixel[1] = 0.5f + 0.5f * n.y;
  pixel[2] = 0.5f + 0.5f * std::sqrt(std::max(0.0f, 1 - dot(n, n)));
}

float roughnessOf(float alpha) { return std::sqrt(alpha); }

}  // namespace

GgxLobe ggxLobe(const Covariance& slopes) {
  const double mean = 0.5 * (double{slopes.xx} + double{slopes.yy}), half = 0.5 * (double{slopes.xx} - double{slopes.yy});
  const double split = std::hypot(half, double{slopes.xy});
  const double angle = 0.5 * std::atan2(double{slopes.xy}, half);
  const auto alpha = [](double variance) { return static_cast<float>(std::min(1.0, std::sqrt(2 * std::max(0.0, variance)))); };
  GgxLobe lobe;
  lobe.alpha_along = alpha(mean + split);
  lobe.alpha_across = alpha(mean - split);
  lobe.along = {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle))};
  return lobe;
}

bool isLimited(const Covariance& slopes, LobeConvention convention) {
  const double mean = 0.5 * (double{slopes.xx} + double{slopes.yy}), half = 0.5 * (double{slopes.xx} - double{slopes.yy});
  const double split = convention == LobeConvention::isotropic ? 0 : std::hypot(half, double{slopes.xy});
  return 2 * (mean + split) > 1;
}

std::vector<LobeTexture> lobeTextures(std::span<const MapSlopes> texels, LobeConvention convention) {
  std::vector<LobeTexture> textures = {texture("normal", 3, texels, writeNormal)};
  switch (convention) {
    case LobeConvention::isotropic:
      textures.push_back(texture("roughness", 1, texels, [](const MapSlopes& s, float* pixel) {
        const float mean = 0.5f * (s.covariance.xx + s.covariance.yy);
        *pixel = roughnessOf(ggxLobe({mean, 0, mean}).alpha_along);
      }));
      break;
    case LobeConvention::gltf:
      textures.push_back(texture("roughness", 1, texels, [](const MapSlopes& s, float* pixel) {
        *pixel = roughnessOf(ggxLobe(s.covariance).alpha_across);
      }));
      textures.push_back(texture("anisotropy", 3, texels, [](const MapSlopes& s, float* pixel) {
        const GgxLobe lobe = ggxLobe(s.covariance);
        pixel[0] = 0.5f + 0.5f * lobe.along.x;
        pixel[1] = 0.5f + 0.5f * lobe.along.y;
        const float rest = 1 - lobe.alpha_across;
        pixel[2] = rest > 0 ? std::sqrt(std::clamp((lobe.alpha_along - lobe.alpha_across) / rest, 0.0f, 1.0f)) : 0.0f;
      }));
      break;
    case LobeConvention::materialx:
      textures.push_back(texture("roughness", 1, texels, [](const MapSlopes& s, float* pixel) {
        const GgxLobe lobe = ggxLobe(s.covariance);
        *pixel = roughnessOf(std::sqrt(lobe.alpha_along * lobe.alpha_across));
      }));
      textures.push_back(texture("anisotropy", 1, texels, [](const MapSlopes& s, float* pixel) {
        const GgxLobe lobe = ggxLobe(s.covariance);
        *pixel = lobe.alpha_along > 0 ? 1 - lobe.alpha_across / lobe.alpha_along : 0.0f;
      }));
      textures.push_back(texture("rotation", 1, texels, [](const MapSlopes& s, float* pixel) {
        const Vec2 along = ggxLobe(s.covariance).along;
        const float turns = std::atan2(along.y, along.x) / (2 * std::numbers::pi_v<float>);
        *pixel = turns < 0 ? turns + 0.5f : turns;
      }));
      break;
  }
  return textures;
}

std::vector<float> leanChannels(std::span<const MapSlopes> texels, std::span<const float> heights) {
  std::vector<float> pixels(6 * texels.size());
  tbb::parallel_for(std::size_t{0}, texels.size(), [&](std::size_t k) {
    const Vec2 m = texels[k].mean;
    const Covariance& c = texels[k].covariance;
    const float values[6] = {
        heights.empty() ? 0 : heights[k], m.x, -m.y, c.xx + m.x * m.x, c.yy + m.y * m.y, -(c.xy + m.x * m.y)};
    std::copy(std::begin(values), std::end(values), pixels.data() + 6 * k);
  });
  return pixels;
}

}  // namespace glint::bake
