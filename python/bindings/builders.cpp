#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>

#include "assets.h"
#include "build_job.h"
#include "glint/api/any_ndf.h"
#include "glint/bake/bin_map/bin_map.h"
#include "glint/bake/compressed/compress.h"
#include "glint/bake/displace/displace.h"
#include "glint/bake/displace/merl_table.h"
#include "glint/bake/histogram/histogram_sat.h"
#include "glint/bake/ingest/near_normals.h"
#include "glint/bake/moments/slope_moments.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/bake/wave/colour_weights.h"
#include "glint/bake/wave/compress_wave.h"
#include "glint/bake/wave/wave_pyramid.h"

namespace glint::python {
namespace {

Surface surfaceOf(const std::string& word) {
  return choose<Surface>("surface", word, {{"flat", Surface::flat}, {"smooth", Surface::smooth}});
}

Boundary boundaryOf(const std::string& word) {
  return choose<Boundary>("boundary", word, {{"wrap", Boundary::wrap}, {"clamp", Boundary::clamp}});
}

BlockPrecision precisionOf(const std::string& word) {
  return choose<BlockPrecision>("precision", word, {{"half", BlockPrecision::f16}, {"float", BlockPrecision::f32}});
}

/// A pyramid, compressed or not, with the normals that it keeps.
template <class Data>
struct WithNormals {
  Data images;
  std::optional<bake::NearNormalsData> kept;

  auto view() const {
    auto asset = images.view();
    if (kept) asset.near_normals = kept->view();
    return asset;
  }
};

std::optional<bake::NearNormalsData> kept(const NearNormals& normals, std::optional<NearType> type) {
  if (!type) return {};
  return bake::keepNormals(normals, *type);
}

void pyramid(const BuildJob& job, float stride, float overlap, int resolution, float sigma_r, const std::string& surface,
             const std::string& boundary, int levels, const std::string& precision, const std::string& keep_normals) {
  bake::PyramidOptions o;
  o.stride = stride;
  o.overlap = overlap;
  o.resolution = resolution > 0 ? resolution : bake::resolutionFor(sigma_r);
  o.sigma_r = sigma_r;
  o.surface = surfaceOf(surface);
  o.boundary = boundaryOf(boundary);
  o.levels = levels;
  o.precision = precisionOf(precision);
  using Type = std::optional<NearType>;
  const auto type =
      choose<Type>("keep_normals", keep_normals, {{"none", std::nullopt}, {"i16", NearType::i16}, {"f32", NearType::f32}});
  const formats::Asset input = openInput(job);
  const NormalMap& map = input.get<NormalMap>();
  run(job, provenanceOf(job), [&](const bake::ProgressFn& progress) {
    return WithNormals<bake::NdfPyramidData>{bake::buildPyramid(map, o, progress), kept(map, type)};
  });
}

void wavePyramid(const BuildJob& job, float stride, float overlap, int resolution, int levels, const std::string& precision,
                 float coherence_um, const std::vector<float>& wavelengths_um, bool spectral) {
  bake::WaveOptions o;
  o.stride = stride;
  o.overlap = overlap;
  o.resolution = resolution;
  o.levels = levels;
  o.precision = precisionOf(precision);
  o.coherence_um = coherence_um;
  o.wavelengths_um = wavelengths_um;
  o.spectral = spectral;
  const formats::Asset input = openInput(job);
  const HeightMap& map = input.get<HeightMap>();
  run(job, provenanceOf(job), [&](const bake::ProgressFn& progress) { return bake::buildWavePyramid(map, o, progress); });
}

nb::dict reportDict(const bake::CompressionReport& r) {
  nb::dict d;
  d["seen"] = r.total.seen.seen;
  d["seen_worst"] = r.total.seen.worst;
  d["bias"] = r.total.seen.bias;
  d["rel_l2"] = r.total.rel_l2;
  d["total_bytes"] = r.total_bytes;
  d["ratio_to_stored"] = r.ratio_to_stored;
  return d;
}

/// What a compressed pyramid keeps.
/// @param type     that is asked for; nothing: that of the pyramid, or 16 bits of `normals`
/// @param normals  the map that the pyramid was made from, and its file; may be empty
/// @throws Error usage: there are no such normals; invalid_input: they are of another map
std::optional<bake::NearNormalsData> keptBy(const formats::Asset& input, const std::string& path, std::optional<NearType> type,
                                            const std::optional<formats::Asset>& normals, const std::string& normals_path) {
  const NdfPyramid& from = input.get<NdfPyramid>();
  if (normals) {
    const NormalMap& map = normals->get<NormalMap>();
    api::requireSameMap(input, path, from.shape.width, from.shape.height, map, normals_path);
    const bool floats = from.near_normals && !from.near_normals->coded();
    return bake::keepNormals(map, type.value_or(floats ? NearType::f32 : NearType::i16));
  }
  const bool fewer = from.near_normals && from.near_normals->coded() && type == NearType::f32;
  if ((type && !from.near_normals) || fewer)
    throw Error(ErrorCode::usage, "api.arguments", path, "keep_normals",
                fewer ? "the pyramid keeps normals in 16 bits, and \"f32\" asks for more" : "the pyramid keeps no normals",
                "give normals=, the asset that the pyramid was made from");
  if (!from.near_normals) return {};
  return bake::keepNormals(*from.near_normals, type.value_or(from.near_normals->type));
}

nb::dict compress(const BuildJob& job, const std::string& normals_path, const std::string& method, int rank, double tolerance,
                  const std::string& metric, const std::string& quantize, bool spots, int regions, double min_improvement,
                  int max_iterations, const std::string& keep_normals) {
  bake::CompressionOptions o;
  using Method = std::optional<CompressionMethod>;
  o.method = choose<Method>("method", method,
                            {{"auto", std::nullopt},
                             {"cp", CompressionMethod::cp},
                             {"tucker", CompressionMethod::tucker},
                             {"pca", CompressionMethod::pca}});
  o.rank = rank;
  o.tolerance = tolerance;
  o.metric = choose<bake::ErrorMetric>("metric", metric, {{"seen", bake::ErrorMetric::seen}, {"l2", bake::ErrorMetric::l2}});
  using Type = std::optional<CoefficientType>;
  o.coefficient_type = choose<Type>(
      "quantize", quantize,
      {{"auto", std::nullopt}, {"f32", CoefficientType::f32}, {"f16", CoefficientType::f16}, {"i8", CoefficientType::i8}});
  o.spots = spots;
  o.regions = regions;
  o.min_improvement = min_improvement;
  o.max_iterations = max_iterations;
  const formats::Asset input = openInput(job);
  enum class Keep { as_pyramid, none, i16, f32 };
  const Keep keep = choose<Keep>("keep_normals", keep_normals,
                                 {{"auto", Keep::as_pyramid}, {"none", Keep::none}, {"i16", Keep::i16}, {"f32", Keep::f32}});
  std::optional<formats::Asset> normals;
  if (!normals_path.empty()) {
    if (keep == Keep::none)
      throw Error(ErrorCode::usage, "api.arguments", "", "normals", "keep_normals=\"none\" keeps none of them",
                  "leave one of them out");
    normals = unlocked([&] { return formats::Asset::openForBuilding(normals_path); });
  }
  std::optional<NearType> as_asked;
  if (keep == Keep::i16 || keep == Keep::f32) as_asked = keep == Keep::i16 ? NearType::i16 : NearType::f32;
  formats::Provenance provenance = formats::chained(provenanceOf(job), input.info().provenance);
  if (normals) provenance.inputs.push_back({"normals", unlocked([&] { return formats::hashFile(normals_path); })});
  bake::CompressionReport report;
  if (input.kind() == formats::kKindName<WavePyramid>) {
    if (as_asked || normals)
      throw Error(ErrorCode::usage, "api.arguments", job.input, "keep_normals", "a wave-pyramid keeps no normals",
                  "leave keep_normals and normals out");
    run(job, provenance, [&](const bake::ProgressFn& progress) {
      return bake::compressWavePyramid(input.get<WavePyramid>(), o, &report, progress);
    });
    return reportDict(report);
  }
  run(job, provenance, [&](const bake::ProgressFn& progress) {
    WithNormals<bake::NdfCpData> made;
    if (keep != Keep::none) made.kept = keptBy(input, job.input, as_asked, normals, normals_path);
    made.images = bake::compressPyramid(input.get<NdfPyramid>(), o, &report, progress);
    return made;
  });
  return reportDict(report);
}

void binMap(const BuildJob& job, float alpha, float alpha_max, int leaf_size) {
  const bake::BinMapOptions o = {alpha, leaf_size, alpha_max};
  const formats::Asset input = openInput(job);
  const NormalMap& map = input.get<NormalMap>();
  run(job, provenanceOf(job), [&](const bake::ProgressFn& progress) { return bake::buildBinMap(map, o, progress); });
}

void histogram(const BuildJob& job, int theta_bins, int phi_bins, int stride) {
  const bake::HistogramSatOptions o = {theta_bins, phi_bins, stride};
  const formats::Asset input = openInput(job);
  const NormalMap& map = input.get<NormalMap>();
  run(job, provenanceOf(job), [&](const bake::ProgressFn& progress) { return bake::buildHistogramSat(map, o, progress); });
}

void moments(const BuildJob& job, int finest_level, const std::string& boundary, const std::string& gradient) {
  bake::SlopeMomentsOptions o;
  o.finest_level = finest_level;
  o.boundary = boundaryOf(boundary);
  o.gradient =
      choose<bake::Gradient>("gradient", gradient, {{"central", bake::Gradient::central}, {"sobel", bake::Gradient::sobel}});
  const formats::Asset input = openInput(job);
  run(job, provenanceOf(job), [&](const bake::ProgressFn& progress) {
    if (input.kind() == formats::kKindName<HeightMap>) return bake::buildSlopeMoments(input.get<HeightMap>(), o, progress);
    return bake::buildSlopeMoments(input.get<NormalMap>(), o, progress);
  });
}

/// A base BRDF from a file in MERL's form.
std::shared_ptr<const bake::MeasuredBrdf> measuredBrdf(const std::string& path) {
  std::error_code failed;
  const std::uintmax_t size = std::filesystem::file_size(path, failed);
  std::ifstream file(path, std::ios::binary);
  if (failed || !file)
    throw Error(ErrorCode::io, "file.readable", path, "", "cannot be read", "check the path and the permissions");
  std::vector<std::byte> bytes(std::min<std::uintmax_t>(size, 12));
  const auto read = [&](std::size_t first) {
    file.read(reinterpret_cast<char*>(bytes.data() + first), static_cast<std::streamsize>(bytes.size() - first));
    bytes.resize(first + static_cast<std::size_t>(file.gcount()));
  };
  try {
    read(0);
    bake::checkMerlSize(bytes, size);
    const std::size_t head = bytes.size();
    bytes.resize(size);
    read(head);
    return std::make_shared<const bake::MeasuredBrdf>(bake::readMerl(bytes));
  } catch (const Error& error) {
    throw Error(error.code(), error.rule(), path, error.object(), error.clause(), error.remedy());
  }
}

void displace(const BuildJob& job, const std::string& table_path, const std::vector<int>& factors, const std::string& base,
              float albedo, float alpha, float eta, float k, int lobes, int angular, int spatial, float scale_tolerance,
              int bounces, std::uint64_t seed) {
  bake::DisplaceOptions o;
  o.factors = factors;
  o.base.kind = choose<BaseBrdf::Kind>(
      "base", base, {{"diffuse", BaseBrdf::Kind::diffuse}, {"ggx", BaseBrdf::Kind::ggx}, {"table", BaseBrdf::Kind::table}});
  o.base.albedo = albedo;
  o.base.alpha = alpha;
  o.base.eta = eta;
  o.base.k = k;
  o.lobes = lobes;
  o.angular = angular;
  o.spatial = spatial;
  o.scale_tolerance = scale_tolerance;
  o.bounces = bounces;
  o.seed = seed;
  const formats::Asset input = openInput(job);
  const HeightMap& map = input.get<HeightMap>();
  formats::Provenance provenance = provenanceOf(job);
  if (o.base.kind == BaseBrdf::Kind::table) {
    o.table = unlocked([&] { return measuredBrdf(table_path); });
    o.base = o.table->base();
    provenance.inputs.push_back(
        {std::filesystem::path(table_path).filename().string(), unlocked([&] { return formats::hashFile(table_path); })});
  }
  run(job, provenance, [&](const bake::ProgressFn& progress) { return bake::displace(map, o, progress); });
}

}  // namespace

void bindMaps(nb::module_& m);

void bindBuilders(nb::module_& m) {
  nb::class_<BuildJob>(m, "BuildJob")
      .def(
          "__init__",
          [](BuildJob* job, std::string output, std::string command_json, std::string input, std::string input_name,
             std::string array_hash, int threads, nb::object progress) {
            new (job) BuildJob{std::move(output),     std::move(command_json), std::move(input),
                               std::move(input_name), std::move(array_hash),   threads,
                               std::move(progress)};
          },
          nb::arg("output"), nb::arg("command_json"), nb::arg("input"), nb::arg("input_name"), nb::arg("array_hash"),
          nb::arg("threads"), nb::arg("progress").none());
  const nb::kw_only words_only;
  m.def("pyramid", &pyramid, nb::arg("job"), words_only, nb::arg("stride"), nb::arg("overlap"), nb::arg("resolution"),
        nb::arg("sigma_r"), nb::arg("surface"), nb::arg("boundary"), nb::arg("levels"), nb::arg("precision"),
        nb::arg("keep_normals"));
  m.def("wave_pyramid", &wavePyramid, nb::arg("job"), words_only, nb::arg("stride"), nb::arg("overlap"), nb::arg("resolution"),
        nb::arg("levels"), nb::arg("precision"), nb::arg("coherence_um"), nb::arg("wavelengths_um"), nb::arg("spectral"));
  m.def("compress", &compress, nb::arg("job"), nb::arg("normals_path"), words_only, nb::arg("method"), nb::arg("rank"),
        nb::arg("tolerance"), nb::arg("metric"), nb::arg("quantize"), nb::arg("spots"), nb::arg("regions"),
        nb::arg("min_improvement"), nb::arg("max_iterations"), nb::arg("keep_normals"));
  m.def("bin_map", &binMap, nb::arg("job"), words_only, nb::arg("alpha"), nb::arg("alpha_max"), nb::arg("leaf_size"));
  m.def("histogram", &histogram, nb::arg("job"), words_only, nb::arg("theta_bins"), nb::arg("phi_bins"), nb::arg("stride"));
  m.def("moments", &moments, nb::arg("job"), words_only, nb::arg("finest_level"), nb::arg("boundary"), nb::arg("gradient"));
  m.def("displace", &displace, nb::arg("job"), nb::arg("table_path"), words_only, nb::arg("factors"), nb::arg("base"),
        nb::arg("albedo"), nb::arg("alpha"), nb::arg("eta"), nb::arg("k"), nb::arg("lobes"), nb::arg("angular"),
        nb::arg("spatial"), nb::arg("scale_tolerance"), nb::arg("bounces"), nb::arg("seed"));
  m.def("even_wavelengths", [](int count) {
    if (count < 1 || count > kMostWaveChannels)
      throw Error(ErrorCode::usage, "option.range", "", "wavelengths", std::to_string(count) + " wavelengths",
                  "give 1 to " + std::to_string(kMostWaveChannels) + ", or a list in micrometres");
    return bake::evenWavelengths(count);
  });
  bindMaps(m);
}

}  // namespace glint::python
