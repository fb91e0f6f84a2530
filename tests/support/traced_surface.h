#pragma once

#include <embree3/rtcore.h>

#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "glint/bake/displace/height_surface.h"
#include "glint/bake/displace/height_tracer.h"

namespace glint::test {

/// A periodic height surface as triangles that Embree traces: the ground truth of visibility. One copy of the map; rays that
/// leave it enter again on the other side.
class TracedSurface {
 public:
  explicit TracedSurface(const bake::HeightSurface& surface) : surface_(surface) {
    device_ = rtcNewDevice("threads=1");
    scene_ = rtcNewScene(device_);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    const int w = surface.width(), h = surface.height();
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12,
                                                                 static_cast<std::size_t>(w + 1) * (h + 1)));
    for (int j = 0; j <= h; ++j) {
      for (int i = 0; i <= w; ++i) {
        *vertices++ = static_cast<float>(i), *vertices++ = static_cast<float>(j), *vertices++ = surface.at(i % w, j % h);
        high_ = std::max(high_, surface.at(i % w, j % h));
      }
    }
    auto* triangles = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, surface.facetCount()));
    const auto vertex = [&](int i, int j) { return static_cast<unsigned>(j * (w + 1) + i); };
    for (int j = 0; j < h; ++j) {
      for (int i = 0; i < w; ++i) {
        *triangles++ = vertex(i, j), *triangles++ = vertex(i + 1, j), *triangles++ = vertex(i, j + 1);
        *triangles++ = vertex(i + 1, j + 1), *triangles++ = vertex(i, j + 1), *triangles++ = vertex(i + 1, j);
      }
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }
  ~TracedSurface() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  TracedSurface(const TracedSurface&) = delete;
  TracedSurface& operator=(const TracedSurface&) = delete;

  /// First hit of a ray that starts on a facet, on its upper side.
  std::optional<bake::SurfaceHit> trace(Vec3 origin, Vec3 direction) const {
    const auto w = static_cast<float>(surface_.width()), h = static_cast<float>(surface_.height());
    const float horizontal = std::sqrt(direction.x * direction.x + direction.y * direction.y);
    float near = 1e-4f, travelled = 0;
    for (int copy = 0; copy < 1000; ++copy) {
      const auto border = [](float o, float d, float size) { return d > 0 ? (size - o) / d : d < 0 ? -o / d : INFINITY; };
      const float tx = border(origin.x, direction.x, w), ty = border(origin.y, direction.y, h);
      const float far = std::min(tx, ty);
      RTCRayHit ray{};
      ray.ray.org_x = origin.x, ray.ray.org_y = origin.y, ray.ray.org_z = origin.z;
      ray.ray.dir_x = direction.x, ray.ray.dir_y = direction.y, ray.ray.dir_z = direction.z;
      ray.ray.tnear = near, ray.ray.tfar = far, ray.ray.mask = ~0u;
      ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      rtcIntersect1(scene_, &context, &ray);
      if (ray.hit.geomID != RTC_INVALID_GEOMETRY_ID)
        return bake::SurfaceHit{ray.hit.primID, origin + ray.ray.tfar * direction, travelled + ray.ray.tfar * horizontal};
      if (!(far < 1e6f)) return std::nullopt;
      origin = origin + far * direction;
      travelled += far * horizontal;
      if (direction.z >= 0 && origin.z > high_) return std::nullopt;
      if (tx <= ty) origin.x = direction.x > 0 ? 0 : w;
      if (ty <= tx) origin.y = direction.y > 0 ? 0 : h;
      near = 0;
    }
    return std::nullopt;
  }

  bool visible(Vec3 origin, Vec3 direction) const { return !trace(origin, direction); }

 private:
  bake::HeightSurface surface_;
  float high_ = -INFINITY;
  RTCDevice device_;
  RTCScene scene_;
};

}  // namespace glint::test
