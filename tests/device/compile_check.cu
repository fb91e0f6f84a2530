// Compiled to PTX by clang, with or without a GPU: an error says which host function the query headers call from device code.
#include "device/kernels.h"
#include "glint/query/anisotropic_ndf.h"
#include "glint/query/brdf/displaced_brdf.h"
#include "glint/query/brdf/wave_brdf.h"
#include "glint/query/histogram_ndf.h"
#include "glint/query/light/environment.h"
#include "glint/query/light/sh_light_query.h"
#include "glint/query/light/sh_transfer.h"
#include "glint/query/moments_ndf.h"
#include "glint/query/ray_footprint.h"
#include "glint/query/tiny_example_ndf.h"
#include "glint/query/wang_reference.h"
#include "glint/query/wave_cp_ndf.h"
#include "glint/query/wave_ndf.h"

namespace glint::device {

template __global__ void answer<HistogramNdf>(HistogramNdf, const Footprint*, const Vec2*, float, int, float*, float*);
template __global__ void draw<HistogramNdf>(HistogramNdf, const Footprint*, const Vec2*, int, HalfVectorSample*);
template __global__ void answer<MomentsNdf>(MomentsNdf, const Footprint*, const Vec2*, float, int, float*, float*);
template __global__ void answer<WangReference>(WangReference, const Footprint*, const Vec2*, float, int, float*, float*);
template __global__ void draw<WangReference>(WangReference, const Footprint*, const Vec2*, int, HalfVectorSample*);
template __global__ void draw<MomentsNdf>(MomentsNdf, const Footprint*, const Vec2*, int, HalfVectorSample*);
template __global__ void answer<TinyExampleNdf>(TinyExampleNdf, const Footprint*, const Vec2*, float, int, float*, float*);
template __global__ void draw<TinyExampleNdf>(TinyExampleNdf, const Footprint*, const Vec2*, int, HalfVectorSample*);
template __global__ void answer<WaveNdf>(WaveNdf, const Footprint*, const Vec2*, float, int, float*, float*);
template __global__ void draw<WaveNdf>(WaveNdf, const Footprint*, const Vec2*, int, HalfVectorSample*);
template __global__ void answer<WaveCpNdf>(WaveCpNdf, const Footprint*, const Vec2*, float, int, float*, float*);
template __global__ void draw<WaveCpNdf>(WaveCpNdf, const Footprint*, const Vec2*, int, HalfVectorSample*);

/// A shading point under wave optics.
__global__ void diffract(const WaveNdf ndf, const SmithMasking masking, const Vec2* uv, const Vec3* wo, const Vec2* xi,
                         float* spectrum, Rgb* radiances) {
  const std::size_t k = threadIdx.x;
  const AnisotropicNdf<WaveNdf> stretched(ndf);
  const Footprint footprint = footprintFromDifferentials(uv[k], xi[k], {xi[k].y, xi[k].x}, 64, 64);
  const WaveBrdf brdf(stretched, footprint, masking, Fresnel::mirror());
  const BrdfSample drawn = brdf.sample(wo[k], xi[k]);
  stretched.densitySpectrum(footprint, xi[k], spectrum + k * static_cast<std::size_t>(ndf.channels()));
  radiances[k] = brdf.evaluateWithPdf(drawn.wi, wo[k]).f;
}

/// A shading point of a distribution: its footprint from ray differentials, its BRDF, and lights.
__global__ void shade(const PyramidNdf ndf, const SmithMasking masking, const SphericalGaussians lights, const Vec2* uv,
                      const Vec3* wo, const Vec2* xi, float* shares, Rgb* radiances) {
  const std::size_t k = threadIdx.x;
  const Footprint footprint = footprintFromDifferentials(uv[k], xi[k], {xi[k].y, xi[k].x}, 64, 64);
  const AnisotropicNdf<PyramidNdf> stretched(ndf);
  const Fresnel gold = Fresnel::conductor({0.18f, 0.42f, 1.37f}, {3.42f, 2.35f, 1.77f});
  const MicrofacetBrdf brdf(stretched, footprint, masking, gold);
  const BrdfSample drawn = brdf.sample(wo[k], xi[k]);
  const BrdfValue value = brdf.evaluateWithPdf(drawn.wi, wo[k]);
  const LightSampler sampler(brdf, wo[k], lights, shares + k * lights.count);
  radiances[k] = value.f + prefilteredRadiance(brdf, wo[k], lights) + sampler.sample(xi[k]).radiance +
                 transferFactor(gold, masking, wo[k]);
}

/// A point of a prefiltered displacement map.
__global__ void reflect(const Displacement asset, const Vec2* uv, const Vec3* wo, const Vec2* xi, Rgb* radiances) {
  const std::size_t k = threadIdx.x;
  const DisplacedBrdf brdf(asset);
  const LevelBlend levels = brdf.levelsFor(xi[k].x);
  const DirectionSample drawn = brdf.sample(levels, uv[k], wo[k], xi[k]);
  for (const DisplacedVariant variant : {DisplacedVariant::full, DisplacedVariant::lobes, DisplacedVariant::single})
    radiances[k] = radiances[k] + brdf.reflected(levels, uv[k], drawn.direction, wo[k], variant);
}

/// Light of a whole environment on a histogram of normals.
__global__ void light(const ShLight table, std::span<const float> zonal, const ShRecurrence<float>* recurrence,
                      const HistogramNdf histogram, const Footprint* footprints, const Vec3* wo, std::span<float> scratch,
                      ShLightIntegral* integrals) {
  const std::size_t k = threadIdx.x;
  const ShLightQuery<float> query(table, zonal, *recurrence, 0.05f);
  integrals[k] = query.integral(histogram, footprints[k], {}, wo[k], {}, scratch);
}

}  // namespace glint::device
