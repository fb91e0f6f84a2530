#pragma once

#include "glint/query/brdf/bin_map_brdf.h"
#include "glint/query/manifold_ndf.h"
#include "glint/query/packed_ndf_view.h"

namespace glint::device {

/// Answers of a model: densities[k] towards halves[k], and means[k] over a box of half width `reach` around it.
template <class Model>
__global__ void answer(const Model model, const Footprint* footprints, const Vec2* halves, float reach, int count,
                       float* densities, float* means) {
  const int k = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (k >= count) return;
  densities[k] = model.density(footprints[k], halves[k]);
  means[k] = model.mean(footprints[k], {halves[k] - Vec2{reach, reach}, halves[k] + Vec2{reach, reach}});
}

/// A half vector for each point of the unit square.
template <class Model>
__global__ void draw(const Model model, const Footprint* footprints, const Vec2* points, int count, HalfVectorSample* samples) {
  const int k = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (k < count) samples[k] = model.sample(footprints[k], points[k]);
}

/// Weights of bins around half vectors.
__global__ void weigh(const BinMapNdf ndf, const Footprint* footprints, const Vec2* halves, int count, BinWeights* weights) {
  const int k = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (k < count) weights[k] = ndf.weights(footprints[k], halves[k]);
}

/// Directions drawn from the micro-BRDF of a bin map, and its value there.
__global__ void drawBrdf(const BinMapNdf ndf, const Footprint* footprints, const Vec3* views, const Vec2* points, int count,
                         BrdfSample* samples, Rgb* values) {
  const int k = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (k >= count) return;
  const BinMapBrdf brdf(ndf, footprints[k], Fresnel::mirror());
  samples[k] = brdf.sample(views[k], points[k]);
  values[k] = brdf.evaluate(samples[k].wi, views[k]);
}

/// Densities from a packed buffer, whose model every thread makes for itself.
__global__ void answerPacked(const void* buffer, const Footprint* footprints, const Vec2* halves, int count, float* densities) {
  const int k = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (k >= count) return;
  const PackedNdfView view(buffer);
  const auto density = [&](const auto& model) { return model.density(footprints[k], halves[k]); };
  densities[k] = view.kind() == PackedKind::compressed ? density(view.cpNdf())
                 : view.kind() == PackedKind::pyramid  ? density(view.pyramidNdf())
                                                       : density(view.reference());
}

template __global__ void answer<Reference>(Reference, const Footprint*, const Vec2*, float, int, float*, float*);
template __global__ void answer<ManifoldNdf>(ManifoldNdf, const Footprint*, const Vec2*, float, int, float*, float*);
template __global__ void answer<PyramidNdf>(PyramidNdf, const Footprint*, const Vec2*, float, int, float*, float*);
template __global__ void answer<CpNdf>(CpNdf, const Footprint*, const Vec2*, float, int, float*, float*);

template __global__ void answer<BinMapNdf>(BinMapNdf, const Footprint*, const Vec2*, float, int, float*, float*);

template __global__ void draw<BinMapNdf>(BinMapNdf, const Footprint*, const Vec2*, int, HalfVectorSample*);
template __global__ void draw<Reference>(Reference, const Footprint*, const Vec2*, int, HalfVectorSample*);
template __global__ void draw<ManifoldNdf>(ManifoldNdf, const Footprint*, const Vec2*, int, HalfVectorSample*);
template __global__ void draw<PyramidNdf>(PyramidNdf, const Footprint*, const Vec2*, int, HalfVectorSample*);
template __global__ void draw<CpNdf>(CpNdf, const Footprint*, const Vec2*, int, HalfVectorSample*);

// Models are passed by value, in the 4 KB that all GPUs have for a kernel's arguments.
static_assert(sizeof(Reference) < 4000 && sizeof(PyramidNdf) < 4000 && sizeof(CpNdf) < 4000 && sizeof(BinMapNdf) < 4000);

}  // namespace glint::device
