// Normals and heights: from arrays, and synthetic ones.

#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <cstdint>
#include <variant>
#include <vector>

#include "assets.h"
#include "build_job.h"
#include "glint/bake/common/slopes.h"
#include "glint/bake/ingest/ingest.h"
#include "glint/bake/ingest/normal_bounds.h"
#include "glint/bake/synth/synth.h"

namespace glint::python {
namespace {

/// Pixels, bottom row first: [height][width][channels].
using Pixels = nb::ndarray<nb::ro, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

bake::PixelArray pixelArray(const Pixels& image) {
  bake::PixelArray array;
  array.height = static_cast<int>(image.shape(0));
  array.width = static_cast<int>(image.shape(1));
  array.channels = static_cast<int>(image.shape(2));
  const std::size_t count = image.size();
  if (image.dtype() == nb::dtype<std::uint8_t>()) {
    array.pixels = std::span(static_cast<const std::uint8_t*>(image.data()), count);
  } else if (image.dtype() == nb::dtype<std::uint16_t>()) {
    array.pixels = std::span(static_cast<const std::uint16_t*>(image.data()), count);
  } else {
    array.pixels = std::span(static_cast<const float*>(image.data()), count);
  }
  return array;
}

/// A map with the arrays that it points to.
struct NormalMapData {
  int width = 0, height = 0;
  float texel_size_um = 0;
  std::vector<Vec2> normals;
  MapSlopes slopes;
  std::vector<bake::NormalBoundsStorage> bounds;

  NormalMapData(int w, int h, float texel, std::vector<Vec2> texels)
      : width(w),
        height(h),
        texel_size_um(texel),
        normals(std::move(texels)),
        slopes(bake::describeNormals(w, h, normals).slopes),
        bounds(bake::buildNormalBounds(w, h, normals)) {}

  NormalMap view() const {
    NormalMap map;
    map.width = width, map.height = height, map.texel_size_um = texel_size_um;
    map.normals = normals;
    map.slopes = slopes;
    bake::attachBounds(map, bounds);
    return map;
  }
};

struct HeightMapData {
  int width = 0, height = 0;
  float texel_size_um = 0;
  std::vector<float> heights;
  HeightMap view() const { return {width, height, texel_size_um, heights}; }
};

bake::IngestOptions ingestOptions(const std::string& convention, const std::string& encoding, const std::string& dequantize,
                                  const std::string& boundary, bool fix_invalid, bool allow_constant, float height_scale,
                                  const std::optional<double>& no_data, std::uint64_t seed) {
  using bake::Convention;
  using bake::Dequantize;
  using bake::Encoding;
  bake::IngestOptions o;
  o.name = "array";
  o.convention =
      choose<Convention>("convention", convention, {{"opengl", Convention::opengl}, {"directx", Convention::directx}});
  o.encoding = choose<Encoding>("encoding", encoding,
                                {{"auto", Encoding::automatic}, {"unorm", Encoding::unorm}, {"snorm", Encoding::snorm}});
  o.dequantize = choose<Dequantize>("dequantize", dequantize,
                                    {{"auto", Dequantize::automatic}, {"none", Dequantize::none}, {"tpdf", Dequantize::tpdf}});
  o.boundary = choose<Boundary>("boundary", boundary, {{"wrap", Boundary::wrap}, {"clamp", Boundary::clamp}});
  o.fix_invalid = fix_invalid;
  o.allow_constant = allow_constant;
  o.height_scale = height_scale;
  o.no_data = no_data;
  o.seed = seed;
  return o;
}

nb::dict reportDict(const bake::IngestReport& r) {
  nb::dict d;
  d["texels"] = r.texels;
  d["dequantized"] = r.dequantized;
  d["non_finite"] = r.non_finite;
  d["downward"] = r.downward;
  d["clipped"] = r.clipped;
  d["non_unit"] = r.non_unit;
  d["no_data"] = r.no_data;
  d["repaired"] = r.repaired;
  d["cliffs"] = r.cliffs;
  d["mean_tilt_deg"] = r.mean_tilt_deg;
  d["steepest_tilt_deg"] = r.steepest_tilt_deg;
  return d;
}

/// @param kind  what the array holds: "normal" or "height"
/// @param to    what is written: "normals" or "heights"
nb::dict ingest(const BuildJob& job, const Pixels& image, const std::string& kind, const std::string& to,
                const std::string& convention, const std::string& encoding, const std::string& dequantize,
                const std::string& boundary, bool fix_invalid, bool allow_constant, float height_scale,
                const std::optional<double>& no_data, std::uint64_t seed, float texel_size_um) {
  const bake::IngestOptions o =
      ingestOptions(convention, encoding, dequantize, boundary, fix_invalid, allow_constant, height_scale, no_data, seed);
  const bool of_heights = choose<bool>("kind", kind, {{"normal", false}, {"height", true}});
  const bool to_heights = choose<bool>("to", to, {{"normals", false}, {"heights", true}});
  if (to_heights && !of_heights)
    throw Error(ErrorCode::usage, "api.arguments", "", "to", "heights cannot be made from normals",
                "give kind=\"height\" or to=\"normals\"");
  const bake::PixelArray array = pixelArray(image);
  bake::IngestReport report;
  const auto writeNormals = [&](std::vector<Vec2> normals) {
    run(job, provenanceOf(job),
        [&](const bake::ProgressFn&) { return NormalMapData(array.width, array.height, texel_size_um, std::move(normals)); });
  };
  if (!of_heights) {
    bake::IngestedNormals made = unlocked([&] { return bake::ingestNormals(array, o); });
    report = made.report;
    writeNormals({made.normals.begin(), made.normals.end()});
  } else {
    bake::IngestedHeights made = unlocked([&] { return bake::ingestHeights(array, o); });
    report = made.report;
    if (!to_heights) {
      writeNormals(unlocked([&] { return bake::normalsFromHeights(array.width, array.height, made.heights, o.boundary); }));
    } else {
      run(job, provenanceOf(job), [&](const bake::ProgressFn&) {
        return HeightMapData{array.width, array.height, texel_size_um, {made.heights.begin(), made.heights.end()}};
      });
    }
  }
  return reportDict(report);
}

bake::SynthKind synthKind(const std::string& word) {
  using bake::SynthKind;
  return choose<SynthKind>("kind", word,
                           {{"isotropic", SynthKind::isotropic},
                            {"brushed", SynthKind::brushed},
                            {"flakes", SynthKind::flakes},
                            {"scratches", SynthKind::scratches},
                            {"leather", SynthKind::leather},
                            {"weave", SynthKind::weave},
                            {"twill", SynthKind::twill},
                            {"silk", SynthKind::silk},
                            {"bumps", SynthKind::bumps},
                            {"scales", SynthKind::scales},
                            {"structured", SynthKind::structured},
                            {"relief", SynthKind::relief},
                            {"wood", SynthKind::wood},
                            {"anisotropic", SynthKind::anisotropic},
                            {"sawtooth", SynthKind::sawtooth},
                            {"flat", SynthKind::flat},
                            {"grating", SynthKind::grating},
                            {"flake2d", SynthKind::flake2d}});
}

/// Options that are not given have the values with which maps of the kind look typical.
void synth(const BuildJob& job, const std::string& kind, int width, int height, std::uint64_t seed, bool heights,
           float texel_size_um, const nb::dict& given) {
  bake::SynthOptions o = bake::defaultSynthOptions(synthKind(kind));
  o.width = width, o.height = height, o.seed = seed;
  const std::pair<const char*, float*> numbers[] = {
      {"alpha", &o.alpha},          {"gamma", &o.gamma},        {"correlation", &o.correlation_texels},
      {"streak", &o.streak_texels}, {"density", &o.density},    {"feature", &o.feature_texels},
      {"slope", &o.slope},          {"depth", &o.depth_texels}, {"flake_size_uv", &o.flake_size_uv},
      {"roughness", &o.roughness},  {"coverage", &o.coverage}};
  for (const auto& [name, value] : numbers)
    if (given.contains(name)) *value = nb::cast<float>(given[name]);
  if (given.contains("profile"))
    o.profile = choose<bake::GratingProfile>("profile", nb::cast<std::string>(given["profile"]),
                                             {{"sine", bake::GratingProfile::sine}, {"blazed", bake::GratingProfile::blazed}});
  if (heights) {
    run(job, provenanceOf(job), [&](const bake::ProgressFn&) {
      return HeightMapData{width, height, texel_size_um, bake::synthHeights(o)};
    });
  } else {
    run(job, provenanceOf(job),
        [&](const bake::ProgressFn&) { return NormalMapData(width, height, texel_size_um, bake::synthNormals(o)); });
  }
}

/// Copies of the texels, bottom row first.
nb::object texels(const std::string& path) {
  const formats::Asset asset = formats::Asset::open(path);
  const bool heights = asset.kind() == formats::kKindName<HeightMap>;
  const auto copy = [](const float* from, std::vector<std::size_t> shape) {
    std::size_t count = 1;
    for (const std::size_t n : shape) count *= n;
    auto* values = new float[count];
    std::copy(from, from + count, values);
    nb::capsule owner(values, [](void* p) noexcept { delete[] static_cast<float*>(p); });
    return nb::cast(nb::ndarray<nb::numpy, float>(values, shape.size(), shape.data(), owner));
  };
  if (heights) {
    const HeightMap& map = asset.get<HeightMap>();
    return copy(map.heights.data(), {static_cast<std::size_t>(map.height), static_cast<std::size_t>(map.width)});
  }
  const NormalMap& map = asset.get<NormalMap>();
  return copy(&map.normals.data()->x, {static_cast<std::size_t>(map.height), static_cast<std::size_t>(map.width), 2});
}

}  // namespace

void bindMaps(nb::module_& m) {
  const nb::kw_only words_only;
  m.def("ingest", &ingest, nb::arg("job"), nb::arg("image"), words_only, nb::arg("kind"), nb::arg("to"), nb::arg("convention"),
        nb::arg("encoding"), nb::arg("dequantize"), nb::arg("boundary"), nb::arg("fix_invalid"), nb::arg("allow_constant"),
        nb::arg("height_scale"), nb::arg("no_data").none(), nb::arg("seed"), nb::arg("texel_size_um"));
  m.def("synth", &synth, nb::arg("job"), words_only, nb::arg("kind"), nb::arg("width"), nb::arg("height"), nb::arg("seed"),
        nb::arg("heights"), nb::arg("texel_size_um"), nb::arg("given"));
  m.def("texels", &texels);
  m.def("hash_array", [](const nb::ndarray<nb::ro, nb::c_contig, nb::device::cpu>& a) {
    const nb::gil_scoped_release others_may_run;
    return formats::hashBytes(a.data(), a.nbytes());
  });
}

}  // namespace glint::python
