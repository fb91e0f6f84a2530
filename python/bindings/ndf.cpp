#include "ndf.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>

#include <array>
#include <string>
#include <tuple>

#include "failure.h"
#include "footprints.h"
#include "ndf_handle.h"
#include "parallel.h"

namespace glint::python {
namespace {

glint_ndf_info infoOf(const Ndf& ndf) {
  glint_ndf_info info = {};
  info.struct_size = sizeof info;
  check(glint_ndf_get_info(ndf.get(), &info));
  return info;
}

nb::dict infoDict(const Ndf& ndf) {
  const glint_ndf_info info = infoOf(ndf);
  nb::dict d;
  d["kind"] = info.kind;
  d["width"] = info.width;
  d["height"] = info.height;
  d["resolution"] = info.resolution;
  d["level_count"] = info.level_count;
  d["sigma_r"] = info.sigma_r;
  d["surface"] = info.surface == GLINT_SURFACE_FLAT ? "flat" : "smooth";
  d["boundary"] = info.boundary == GLINT_BOUNDARY_WRAP ? "wrap" : "clamp";
  d["has_normals"] = info.has_normals != 0;
  d["finest_sigma"] = info.finest_sigma_texels;
  d["coarsest_sigma"] = info.coarsest_sigma_texels;
  d["smallest_sigma"] = info.smallest_sigma_texels;
  d["file_bytes"] = info.file_bytes;
  d["udim_tiles"] = info.udim_tiles;
  return d;
}

Ndf open(const std::string& path, const std::optional<std::string>& normals, float sigma_r, int surface, int boundary,
         float alpha, float slant_tolerance, int gaussian_boxes, int footprint_parts, int interpolation, int pixels,
         int estimator, int bins, int kept_normals, bool verify_hashes) {
  glint_open_options o = GLINT_OPEN_OPTIONS_INIT;
  if (normals) o.normals_path = normals->c_str();
  o.sigma_r = sigma_r;
  o.surface = surface;
  o.boundary = boundary;
  o.verify_hashes = verify_hashes ? 1 : 0;
  o.alpha = alpha;
  o.slant_tolerance = slant_tolerance;
  o.gaussian_boxes = gaussian_boxes;
  o.footprint_parts = footprint_parts;
  o.interpolation = interpolation;
  o.pixels = pixels;
  o.estimator = estimator;
  o.bins = bins;
  o.kept_normals = kept_normals;
  glint_ndf* ndf = nullptr;
  const nb::gil_scoped_release others_may_run;
  check(glint_ndf_open(path.c_str(), &o, &ndf));
  return Ndf(ndf);
}

void density(const Ndf& ndf, const Footprints& footprints, const Rows& h, const Answers& out, int threads) {
  const nb::gil_scoped_release others_may_run;
  inRuns(out.shape(0), threads, [&](std::size_t first, std::size_t count) {
    const glint_footprints p = footprints.from(first);
    check(glint_density_batch(ndf.get(), count, &p, member(h, 0, first), member(h, 1, first), from(out, first)));
  });
}

void densityRgb(const Ndf& ndf, const Footprints& footprints, const Rows& psi, const Answers& out, int threads) {
  const nb::gil_scoped_release others_may_run;
  inRuns(out.shape(0), threads, [&](std::size_t first, std::size_t count) {
    const glint_footprints p = footprints.from(first);
    check(glint_density_rgb_batch(ndf.get(), count, &p, member(psi, 0, first), member(psi, 1, first), from(out, first)));
  });
}

void densitySpectrum(const Ndf& ndf, const Footprints& footprints, const Rows& psi, const Answers& out, int threads) {
  const nb::gil_scoped_release others_may_run;
  inRuns(out.shape(0), threads, [&](std::size_t first, std::size_t count) {
    for (std::size_t k = first; k < first + count; ++k) {
      const glint_footprint p = footprints.at(k);
      check(
          glint_density_spectrum(ndf.get(), &p, *member(psi, 0, k).data, *member(psi, 1, k).data, from(out, k), out.shape(1)));
    }
  });
}

void mean(const Ndf& ndf, const Footprints& footprints, const Rows& ranges, const Answers& out, int threads) {
  const nb::gil_scoped_release others_may_run;
  inRuns(out.shape(0), threads, [&](std::size_t first, std::size_t count) {
    const glint_footprints p = footprints.from(first);
    check(glint_mean_batch(ndf.get(), count, &p, member(ranges, 0, first), member(ranges, 1, first), member(ranges, 2, first),
                           member(ranges, 3, first), from(out, first)));
  });
}

void sample(const Ndf& ndf, const Footprints& footprints, const Rows& xi, const Answers& hx, const Answers& hy,
            const Answers& pdf, int threads) {
  const nb::gil_scoped_release others_may_run;
  inRuns(pdf.shape(0), threads, [&](std::size_t first, std::size_t count) {
    const glint_footprints p = footprints.from(first);
    check(glint_sample_batch(ndf.get(), count, &p, member(xi, 0, first), member(xi, 1, first), from(hx, first), from(hy, first),
                             from(pdf, first)));
  });
}

std::tuple<std::array<float, 2>, std::array<float, 3>> slopes(const Ndf& ndf) {
  std::array<float, 2> mean;
  std::array<float, 3> covariance;
  check(glint_ndf_slopes(ndf.get(), mean.data(), covariance.data()));
  return {mean, covariance};
}

}  // namespace

void bindNdf(nb::module_& m) {
  nb::class_<Ndf>(m, "Ndf")
      .def("info", &infoDict)
      .def("channels",
           [](const Ndf& ndf) {
             int32_t channels = 0;
             check(glint_ndf_channels(ndf.get(), &channels));
             return channels;
           })
      .def("slopes",
           [](const Ndf& ndf) {
             const auto [mean, covariance] = slopes(ndf);
             return nb::make_tuple(nb::make_tuple(mean[0], mean[1]),
                                   nb::make_tuple(covariance[0], covariance[1], covariance[2]));
           })
      .def("density", &density)
      .def("density_rgb", &densityRgb)
      .def("density_spectrum", &densitySpectrum)
      .def("mean", &mean)
      .def("sample", &sample);
  m.def("open_ndf", &open, nb::arg("path"), nb::arg("normals").none(), nb::kw_only(), nb::arg("sigma_r"), nb::arg("surface"),
        nb::arg("boundary"), nb::arg("alpha"), nb::arg("slant_tolerance"), nb::arg("gaussian_boxes"),
        nb::arg("footprint_parts"), nb::arg("interpolation"), nb::arg("pixels"), nb::arg("estimator"), nb::arg("bins"),
        nb::arg("kept_normals"), nb::arg("verify_hashes"));
}

}  // namespace glint::python
