#include <nanobind/stl/array.h>

#include <array>
#include <vector>

#include "failure.h"
#include "footprints.h"
#include "ndf.h"
#include "ndf_handle.h"
#include "parallel.h"

namespace glint::python {
namespace {

Brdf make(const Ndf& ndf, int fresnel, const std::array<float, 3>& eta, const std::array<float, 3>& k, int facets) {
  glint_brdf_options o = GLINT_BRDF_OPTIONS_INIT;
  o.fresnel = fresnel;
  o.facets = facets;
  for (std::size_t c = 0; c < 3; ++c) o.eta[c] = eta[c], o.k[c] = k[c];
  glint_brdf* brdf = nullptr;
  const nb::gil_scoped_release others_may_run;
  check(glint_brdf_create(ndf.get(), &o, &brdf));
  return Brdf(brdf);
}

void evaluate(const Brdf& brdf, const Footprints& footprints, const Rows& wi, const Rows& wo, const Answers& f,
              const Answers& pdf, int threads) {
  const nb::gil_scoped_release others_may_run;
  inRuns(pdf.shape(0), threads, [&](std::size_t first, std::size_t count) {
    const glint_footprints p = footprints.from(first);
    const glint_directions in = directions(wi, first), out = directions(wo, first);
    check(glint_brdf_evaluate_batch(brdf.get(), count, &p, &in, &out, from(f, first), from(pdf, first)));
  });
}

void sample(const Brdf& brdf, const Footprints& footprints, const Rows& wo, const Rows& xi, const Answers& wi,
            const Answers& weight, const Answers& pdf, int threads) {
  const nb::gil_scoped_release others_may_run;
  inRuns(pdf.shape(0), threads, [&](std::size_t first, std::size_t count) {
    const glint_footprints p = footprints.from(first);
    const glint_directions out = directions(wo, first);
    check(glint_brdf_sample_batch(brdf.get(), count, &p, &out, member(xi, 0, first), member(xi, 1, first), from(wi, first),
                                  from(weight, first), from(pdf, first)));
  });
}

using Lobes = nb::ndarray<const float, nb::ndim<3>, nb::device::cpu>;  // [queries][lobes][members]

/// Lobes of one query: axes, sharpness and amplitudes.
void gather(const Lobes& lobes, std::size_t query, std::vector<glint_spherical_gaussian>& out) {
  for (std::size_t l = 0; l < out.size(); ++l) {
    for (std::size_t c = 0; c < 3; ++c) out[l].axis[c] = lobes(query, l, c), out[l].amplitude[c] = lobes(query, l, 4 + c);
    out[l].sharpness = lobes(query, l, 3);
  }
}

void reflectLobes(const Brdf& brdf, const Footprints& footprints, const Rows& wo, const Lobes& lobes, int cells,
                  const Answers& radiance, int threads) {
  const nb::gil_scoped_release others_may_run;
  inRuns(radiance.shape(0), threads, [&](std::size_t first, std::size_t count) {
    std::vector<glint_spherical_gaussian> of_query(lobes.shape(1));
    for (std::size_t k = first; k < first + count; ++k) {
      gather(lobes, k, of_query);
      const glint_footprint p = footprints.at(k);
      const float out[3] = {wo(k, 0), wo(k, 1), wo(k, 2)};
      check(glint_lobes_reflected(brdf.get(), &p, out, of_query.data(), of_query.size(), cells, from(radiance, k)));
    }
  });
}

}  // namespace

void bindBrdf(nb::module_& m) {
  nb::class_<Brdf>(m, "Brdf").def("evaluate", &evaluate).def("sample", &sample).def("reflect_lobes", &reflectLobes);
  m.def("make_brdf", &make);
}

}  // namespace glint::python
