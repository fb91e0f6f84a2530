#include "footprints.h"

#include <nanobind/stl/optional.h>

#include <array>

#include "glint/query/ray_footprint.h"
#include "parallel.h"

namespace glint::python {
namespace {

void set(const Answers& covariances, std::size_t k, const Covariance& c) {
  float* out = from(covariances, k);
  out[0] = c.xx, out[1] = c.xy, out[2] = c.yy;
}

}  // namespace

void bindFootprints(nb::module_& m) {
  nb::class_<Footprints>(m, "Footprints")
      .def(nb::init<std::optional<Rows>, std::optional<DoubleRows>, std::optional<Rows>, std::optional<Rows>,
                    std::optional<Rows>, std::optional<Rows>>(),
           nb::arg("uv").none(), nb::arg("precise_uv").none(), nb::arg("sigma").none(), nb::arg("covariance").none(),
           nb::arg("box").none(), nb::arg("spread").none());

  m.def("from_differentials",
        [](const Rows& dx, const Rows& dy, int width, int height, float filter_sigma, const Answers& out) {
          const nb::gil_scoped_release others_may_run;
          forEachQuery(out.shape(0), [&](std::size_t k) {
            const Footprint p =
                footprintFromDifferentials({}, {dx(k, 0), dx(k, 1)}, {dy(k, 0), dy(k, 1)}, width, height, filter_sigma);
            set(out, k, p.covariance);
          });
        });
  m.def("spread_of", [](const Rows& wi, const Rows& wo, const Rows& dndx, const Rows& dndy, const Rows& dwodx,
                        const Rows& dwody, float filter_sigma, const Answers& out) {
    const nb::gil_scoped_release others_may_run;
    forEachQuery(out.shape(0), [&](std::size_t k) {
      const auto vector = [&](const Rows& rows) { return std::array<float, 3>{rows(k, 0), rows(k, 1), rows(k, 2)}; };
      glint_footprint p = {};
      glint_footprint_set_spread(&p, vector(wi).data(), vector(wo).data(), vector(dndx).data(), vector(dndy).data(),
                                 vector(dwodx).data(), vector(dwody).data(), filter_sigma);
      from(out, k)[0] = p.spread[0], from(out, k)[1] = p.spread[1];
    });
  });
  m.def("bounced", [](const Rows& spreads, const Rows& slope_sigmas, const Answers& out) {
    const nb::gil_scoped_release others_may_run;
    forEachQuery(out.shape(0), [&](std::size_t k) { *from(out, k) = bounced({0, spreads(k, 0)}, slope_sigmas(k, 0)).spread; });
  });
  m.def("from_cone", [](const Rows& widths, const Rows& directions, const Rows& texels_per_unit, const Answers& out) {
    const nb::gil_scoped_release others_may_run;
    forEachQuery(out.shape(0), [&](std::size_t k) {
      const Footprint p =
          footprintOfCone({widths(k, 0), 0}, {}, {directions(k, 0), directions(k, 1), directions(k, 2)}, texels_per_unit(k, 0));
      set(out, k, p.covariance);
    });
  });
}

}  // namespace glint::python
