#pragma once

#include <memory>

#include "glint/model/near_normals.h"

namespace glint::bake {

/// Normals that an asset keeps, and the arrays that they point to.
class NearNormalsData {
 public:
  /// Valid while this object lives; moving it keeps the arrays.
  const NearNormals& view() const { return view_; }

 private:
  friend NearNormalsData keepNormals(const NearNormals& normals, NearType type);
  struct Arrays;

  NearNormals view_;
  std::shared_ptr<const Arrays> arrays_;  // empty where the view points to the arrays of another
};

/// The normals of a map as an asset keeps them for footprints below level 0, with their min-max pyramid.
///
/// In 16 bits the step is the smallest power of two that covers the largest component, at most 2^-15. So a component errs by at most
/// half a step, 1.5e-5; by a step where rounding would leave the disk.
/// @param normals  a NormalMap, or normals that an asset keeps; finite, inside the disk. Must outlive the result, which points to its
///                 arrays where these are of the type already
/// @param type     of the result. f32 of normals in 16 bits has the same values in twice the bytes
/// @note O(texels), in memory of the default resource. The result does not depend on the number of threads
NearNormalsData keepNormals(const NearNormals& normals, NearType type);

/// Memory that keepNormals takes at its peak, bytes, without the arrays of its input.
double keepNormalsBytes(int width, int height, NearType type);

/// Bytes of kept normals and of their min-max pyramid.
std::uint64_t nearBytes(const NearNormals& normals);

}  // namespace glint::bake
