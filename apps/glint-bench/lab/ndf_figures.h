#pragma once

#include <span>
#include <vector>

#include "glint-bench/lab/bench_lab.h"
#include "glint/bake/common/seen_error.h"

namespace glint::apps {

/// The footprint that a method is asked for: the Gaussian, or the box of the same second moments where it knows boxes only. So
/// errors are those of the method, and not of the shape.
Footprint askedShape(const Footprint& gaussian, const api::NdfInfo& info);

/// Round footprints at places that cover a map evenly, from a random one on. Where random places leave gaps, half vectors of the
/// facets there count as dark, and a faint light towards one of them as a large seen error.
std::vector<Footprint> roundFootprints(std::uint64_t seed, std::size_t count, float sigma_texels);

/// Exact NDF images of some footprints, as Gaussians and as boxes.
class ImageTruth {
 public:
  /// @param resolution  pixels of an image along each axis
  ImageTruth(const LabMap& map, std::vector<Footprint> footprints, const LabQuestion& question = {}, int resolution = 128);

  /// Mean total variation between a method's images and the exact ones.
  double variation(const api::OpenedNdf& ndf) const;
  /// Mean total variation between the exact images of another map, of Gaussians, and these.
  double variation(const LabMap& other) const;
  /// Seen error over all half vectors.
  double seen(const api::OpenedNdf& ndf) const;
  /// Largest bias of a half vector.
  double bias(const api::OpenedNdf& ndf) const;
  /// Seen error over half vectors of lengths between two radii; 0 where nothing is lit.
  double seenInRing(const api::OpenedNdf& ndf, double inner, double outer) const;

 private:
  /// The exact images of the shape that a method is asked for.
  const std::vector<std::vector<float>>& images(const api::NdfInfo& info) const;
  std::vector<std::vector<float>> imagesOf(const LabMap& map, const api::NdfInfo& info) const;
  bake::SeenError seenErrors(const api::OpenedNdf& ndf) const;
  std::vector<float> imageOf(const api::OpenedNdf& ndf, std::size_t place) const;

  const LabMap& map_;
  LabQuestion question_;
  std::vector<Footprint> footprints_;
  int resolution_;
  mutable std::vector<std::vector<float>> gaussian_images_, box_images_;  // on demand
};

/// Questions that follow one another along a path: a footprint and a half vector each.
struct PathStep {
  Footprint footprint;
  Vec2 half;
};
using Path = std::vector<PathStep>;

/// RMS of the second difference of the densities along paths over the RMS of these densities.
double flicker(const api::OpenedNdf& ndf, std::span<const Path> paths);

}  // namespace glint::apps
