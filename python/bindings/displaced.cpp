#include <nanobind/stl/string.h>

#include "arrays.h"
#include "failure.h"
#include "ndf.h"
#include "ndf_handle.h"
#include "parallel.h"

namespace glint::python {
namespace {

Displaced open(const std::string& path, bool verify_hashes) {
  glint_displaced* displaced = nullptr;
  const nb::gil_scoped_release others_may_run;
  check(glint_displaced_open(path.c_str(), verify_hashes ? 1 : 0, &displaced));
  return Displaced(displaced);
}

nb::dict infoDict(const Displaced& displaced) {
  glint_displaced_info info = {};
  info.struct_size = sizeof info;
  check(glint_displaced_get_info(displaced.get(), &info));
  nb::dict d;
  nb::list factors;
  for (int l = 0; l < info.level_count; ++l) factors.append(info.factors[l]);
  d["width"] = info.width;
  d["height"] = info.height;
  d["level_count"] = info.level_count;
  d["channels"] = info.channels;
  d["base"] = info.base == GLINT_BASE_DIFFUSE ? "diffuse" : info.base == GLINT_BASE_GGX ? "ggx" : "table";
  d["texel_size_um"] = info.texel_size_um;
  d["file_bytes"] = info.file_bytes;
  d["factors"] = factors;
  return d;
}

/// Level, u and v of each query; positions as doubles.
glint_displaced_points pointsFrom(const Rows& levels, const DoubleRows& uv, std::size_t first) {
  glint_displaced_points p = {};
  p.level = member(levels, 0, first);
  p.precise_u = member(uv, 0, first), p.precise_v = member(uv, 1, first);
  return p;
}

void evaluate(const Displaced& displaced, int variant, const Rows& levels, const DoubleRows& uv, const Rows& wi, const Rows& wo,
              const Answers& reflected, const Answers& pdf, int threads) {
  const nb::gil_scoped_release others_may_run;
  inRuns(pdf.shape(0), threads, [&](std::size_t first, std::size_t count) {
    const glint_displaced_points p = pointsFrom(levels, uv, first);
    const glint_directions in = directions(wi, first), out = directions(wo, first);
    check(glint_displaced_evaluate_batch(displaced.get(), variant, count, &p, &in, &out, from(reflected, first),
                                         from(pdf, first)));
  });
}

void sample(const Displaced& displaced, int variant, const Rows& levels, const DoubleRows& uv, const Rows& wo, const Rows& xi,
            const Answers& wi, const Answers& weight, const Answers& pdf, int threads) {
  const nb::gil_scoped_release others_may_run;
  inRuns(pdf.shape(0), threads, [&](std::size_t first, std::size_t count) {
    const glint_displaced_points p = pointsFrom(levels, uv, first);
    const glint_directions out = directions(wo, first);
    check(glint_displaced_sample_batch(displaced.get(), variant, count, &p, &out, member(xi, 0, first), member(xi, 1, first),
                                       from(wi, first), from(weight, first), from(pdf, first)));
  });
}

void levels(const Displaced& displaced, const Rows& sigma, const Answers& out) {
  const nb::gil_scoped_release others_may_run;
  forEachQuery(out.shape(0), [&](std::size_t k) { check(glint_displaced_level(displaced.get(), sigma(k, 0), from(out, k))); });
}

/// Heights of a level as an array into the file, which `self` keeps open.
nb::ndarray<nb::numpy, const float, nb::ndim<2>> heights(nb::handle self, int level) {
  const float* data = nullptr;
  int32_t columns = 0, rows = 0;
  check(glint_displaced_heights(nb::cast<const Displaced&>(self).get(), level, &data, &columns, &rows));
  return {data, {static_cast<std::size_t>(rows), static_cast<std::size_t>(columns)}, self};
}

}  // namespace

void bindDisplaced(nb::module_& m) {
  nb::class_<Displaced>(m, "Displaced")
      .def("info", &infoDict)
      .def("levels", &levels)
      .def("heights", [](nb::handle self, int level) { return heights(self, level); })
      .def("evaluate", &evaluate)
      .def("sample", &sample);
  m.def("open_displaced", &open);
}

}  // namespace glint::python
