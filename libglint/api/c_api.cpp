#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "glint/api/c_support.h"
#include "glint/api/pack.h"
#include "glint/api/plane_position.h"
#include "glint/api/wave_colours.h"
#include "glint/query/curved_ndf.h"
#include "glint/query/ray_footprint.h"

namespace {

using namespace glint;

static_assert(static_cast<int>(Surface::flat) == GLINT_SURFACE_FLAT &&
              static_cast<int>(Surface::smooth) == GLINT_SURFACE_SMOOTH);
static_assert(static_cast<int>(Boundary::wrap) == GLINT_BOUNDARY_WRAP &&
              static_cast<int>(Boundary::clamp) == GLINT_BOUNDARY_CLAMP);
static_assert(static_cast<int>(Interpolation::footprint) == GLINT_INTERPOLATION_FOOTPRINT &&
              static_cast<int>(Interpolation::trilinear) == GLINT_INTERPOLATION_TRILINEAR);
static_assert(static_cast<int>(Pixels::smooth) == GLINT_PIXELS_SMOOTH &&
              static_cast<int>(Pixels::constant) == GLINT_PIXELS_CONSTANT);
static_assert(static_cast<int>(ErrorCode::usage) == GLINT_ERROR_USAGE &&
              static_cast<int>(ErrorCode::unsupported) == GLINT_ERROR_UNSUPPORTED);

/// Fixed size, so that reporting an error cannot fail; longer messages are cut.
struct LastError {
  char message[1024] = "";
  char rule[64] = "";
};
thread_local LastError last_error;

template <std::size_t N>
void setText(char (&out)[N], const char* text) {
  const std::size_t size = std::min(std::strlen(text), N - 1);
  std::memmove(out, text, size);
  out[size] = '\0';
}

}  // namespace

namespace glint::api::c {

glint_status fail(glint_status status, const char* message, const char* rule) {
  setText(last_error.message, message);
  setText(last_error.rule, rule);
  return status;
}

glint_status usage(const char* where, const char* what) {
  char message[sizeof last_error.message];
  std::snprintf(message, sizeof message, "%s: %s", where, what);
  return fail(GLINT_ERROR_USAGE, message, "api.arguments");
}

glint_status badArgument(const char* where, std::initializer_list<Argument> arguments) {
  const auto isBad = [](const Argument& argument) { return argument.fault() != nullptr; };
  const Argument* first = std::find_if(arguments.begin(), arguments.end(), isBad);
  return usage(where, (std::string(first->name) + first->fault()).c_str());
}

namespace {

template <class Kind>
const char* handleFault(const Kind* handle, const char* null, const char* closed) {
  return handle == nullptr ? null : isOpen(handle) ? nullptr : closed;
}

}  // namespace

const char* faultOf(const glint_ndf* ndf) { return handleFault(ndf, "ndf is null", "ndf is closed, or of another kind"); }
const char* faultOf(const glint_brdf* brdf) { return handleFault(brdf, "brdf is null", "brdf is closed, or of another kind"); }
const char* faultOf(const glint_displaced* displaced) {
  return handleFault(displaced, "displaced is null", "displaced is closed, or of another kind");
}

const char* missingIn(const glint_footprints& p) {
  const bool precise = p.precise_u.data != nullptr && p.precise_v.data != nullptr;
  if (!precise && (p.u.data == nullptr || p.v.data == nullptr)) return "u and v of the footprints must be given";
  if ((p.spread_x.data == nullptr) != (p.spread_y.data == nullptr))
    return "spread_x and spread_y of the footprints must be given together";
  const bool gaussian = p.xx.data != nullptr && p.yy.data != nullptr;
  const bool box = p.ax.data != nullptr && p.ay.data != nullptr && p.bx.data != nullptr && p.by.data != nullptr;
  if (p.sigma.data != nullptr || gaussian || box) return nullptr;
  return "sigma, or xx and yy, or ax, ay, bx and by of the footprints must be given";
}

FootprintArrays arraysOf(const glint_footprints& p) {
  FootprintArrays out;
  out.u = arrayOf(p.u);
  out.v = arrayOf(p.v);
  if (p.precise_u.data != nullptr && p.precise_v.data != nullptr) {
    out.precise_u = arrayOf(p.precise_u);
    out.precise_v = arrayOf(p.precise_v);
  }
  out.sigma = arrayOf(p.sigma);
  if (p.xx.data != nullptr && p.yy.data != nullptr) {
    out.xx = arrayOf(p.xx);
    out.xy = arrayOf(p.xy);
    out.yy = arrayOf(p.yy);
  }
  out.ax = arrayOf(p.ax);
  out.ay = arrayOf(p.ay);
  out.bx = arrayOf(p.bx);
  out.by = arrayOf(p.by);
  out.spread_x = arrayOf(p.spread_x);
  out.spread_y = arrayOf(p.spread_y);
  return out;
}

const char* faultOf(const glint_source* source) {
  if (source == nullptr) return "source is null";
  return source->read == nullptr ? "read is null" : nullptr;
}

formats::Asset openMemory(const void* bytes, std::size_t size_bytes, const std::string& name,
                          const formats::OpenOptions& options) {
  return formats::Asset::openMemory({static_cast<const std::byte*>(bytes), size_bytes}, name, options);
}

formats::Asset openSource(const glint_source& source, const formats::OpenOptions& options) {
  const auto read = [&](std::uint64_t offset, std::span<std::byte> to) {
    return source.read(source.context, offset, to.data(), to.size()) == 0;
  };
  return formats::Asset::openSource({nameOr(source.name, "source"), source.size_bytes, read}, options);
}

std::string nameOr(const char* name, const char* other) { return name == nullptr ? other : name; }

}  // namespace glint::api::c

namespace {

using namespace glint::api::c;

constexpr float kLeastSigmaR = 1e-4f, kMostSigmaR = 0.25f;
/// Size of the options in the first version of the struct.
constexpr std::size_t kFirstOptionsSize = offsetof(glint_open_options, verify_hashes) + sizeof(int32_t);
static_assert(offsetof(glint_open_options, kept_normals) + sizeof(int32_t) == sizeof(glint_open_options),
              "padding at the end would be read as a member by a later library");

/// @return null if the options can be used, else the fault
const char* takeOptions(const glint_open_options* from, glint_open_options& to) {
  to = GLINT_OPEN_OPTIONS_INIT;
  if (from == nullptr) return nullptr;
  if (const char* fault = takeSized(*from, kFirstOptionsSize, to)) return fault;
  if (to.sigma_r != 0 && !(to.sigma_r >= kLeastSigmaR && to.sigma_r <= kMostSigmaR))
    return "sigma_r is not in 1e-4 to 0.25; give 0 for 0.005";
  if (to.surface != GLINT_SURFACE_FLAT && to.surface != GLINT_SURFACE_SMOOTH) return "unknown surface";
  if (to.boundary != GLINT_BOUNDARY_WRAP && to.boundary != GLINT_BOUNDARY_CLAMP) return "unknown boundary";
  if (!(to.alpha >= 0 && to.alpha <= 1)) return "alpha is not in 0 to 1; give 0 for the smallest of the asset";
  if (to.slant_tolerance != GLINT_SLANT_EXACT && !(to.slant_tolerance >= 0 && to.slant_tolerance <= 1))
    return "slant_tolerance is not in 0 to 1; give 0 for 0.06, or GLINT_SLANT_EXACT";
  if (to.gaussian_boxes != 0 && to.gaussian_boxes != 1 && to.gaussian_boxes != 3)
    return "gaussian_boxes is not 1 or 3; give 0 for 1";
  if (!(to.footprint_parts >= 0 && to.footprint_parts <= IsotropicParts::kMost))
    return "footprint_parts is not in 1 to 32; give 0 for 32";
  if (to.interpolation != GLINT_INTERPOLATION_FOOTPRINT && to.interpolation != GLINT_INTERPOLATION_TRILINEAR)
    return "unknown interpolation";
  if (to.pixels != GLINT_PIXELS_SMOOTH && to.pixels != GLINT_PIXELS_CONSTANT) return "unknown pixels";
  if (to.bins != GLINT_BINS_LOBES && to.bins != GLINT_BINS_EVEN) return "unknown bins";
  if (to.kept_normals != GLINT_KEPT_NORMALS_USED && to.kept_normals != GLINT_KEPT_NORMALS_IGNORED)
    return "unknown kept_normals";
  if (to.estimator != GLINT_ESTIMATOR_EXACT && to.estimator != GLINT_ESTIMATOR_PUBLISHED) return "unknown estimator";
  return nullptr;
}

api::NdfOptions optionsOf(const glint_open_options& o) {
  api::NdfOptions options;
  if (o.normals_path != nullptr) options.normals = o.normals_path;
  if (o.sigma_r != 0) options.sigma_r = o.sigma_r;
  options.use_kept_normals = o.kept_normals == GLINT_KEPT_NORMALS_USED;
  options.surface = static_cast<Surface>(o.surface);
  options.boundary = static_cast<Boundary>(o.boundary);
  options.checks.verify_hashes = o.verify_hashes != 0;
  options.checks.copy = o.copy != 0;
  options.alpha = o.alpha;
  options.estimator = static_cast<BinEstimator>(o.estimator);
  options.histogram_bins = static_cast<HistogramBins>(o.bins);
  if (o.slant_tolerance != 0) options.slant_tolerance = std::max(0.0f, o.slant_tolerance);
  if (o.footprint_parts != 0) options.footprint_parts = o.footprint_parts;
  options.interpolation = static_cast<Interpolation>(o.interpolation);
  options.pixels = static_cast<Pixels>(o.pixels);
  if (o.gaussian_boxes == 3) options.gaussian_boxes = GaussianBoxes::three;
  return options;
}

/// The handle of an opened asset.
glint_ndf* handleOf(api::OpenedNdf opened) {
  std::string kind(opened.asset().kind());
  return new glint_ndf(std::make_shared<NdfBody>(NdfBody{std::move(opened), std::move(kind)}));
}

glint_footprint gaussianAt(double u, double v, const Covariance& c) {
  return {GLINT_FOOTPRINT_GAUSSIAN, u, v, {c.xx, c.xy, c.yy, 0}, {0, 0}};
}

/// The fault of the arguments that all batches have; null if there is none.
const char* faultOf(const glint_ndf* ndf, const glint_footprints* footprints, const float* out) {
  if (const char* fault = faultOf(ndf)) return fault;
  if (footprints == nullptr) return "footprints is null";
  if (out == nullptr) return "the array of answers is null";
  return missingIn(*footprints);
}

}  // namespace

int32_t glint_abi_version(void) { return GLINT_ABI_VERSION; }
const char* glint_version(void) { return GLINT_VERSION; }
const char* glint_error_message(void) { return last_error.message; }
const char* glint_error_rule(void) { return last_error.rule; }

glint_status glint_ndf_open(const char* path, const glint_open_options* options, glint_ndf** ndf) {
  if (path == nullptr) return usage("glint_ndf_open", "path is null");
  if (ndf == nullptr) return usage("glint_ndf_open", "ndf is null");
  glint_open_options given;
  if (const char* fault = takeOptions(options, given)) return usage("glint_open_options", fault);
  return guarded([&] { *ndf = handleOf(api::OpenedNdf::open(path, optionsOf(given))); });
}

glint_status glint_ndf_open_memory(const void* bytes, size_t size_bytes, const char* name, const glint_open_options* options,
                                   glint_ndf** ndf) {
  if (bytes == nullptr) return usage("glint_ndf_open_memory", "bytes is null");
  if (ndf == nullptr) return usage("glint_ndf_open_memory", "ndf is null");
  glint_open_options given;
  if (const char* fault = takeOptions(options, given)) return usage("glint_open_options", fault);
  return guarded([&] {
    const api::NdfOptions use = optionsOf(given);
    const std::string shown = nameOr(name, "memory");
    *ndf = handleOf(api::OpenedNdf::open(openMemory(bytes, size_bytes, shown, use.checks), shown, use));
  });
}

glint_status glint_ndf_open_source(const glint_source* source, const glint_open_options* options, glint_ndf** ndf) {
  if (const char* fault = faultOf(source)) return usage("glint_ndf_open_source", fault);
  if (ndf == nullptr) return usage("glint_ndf_open_source", "ndf is null");
  glint_open_options given;
  if (const char* fault = takeOptions(options, given)) return usage("glint_open_options", fault);
  return guarded([&] {
    const api::NdfOptions use = optionsOf(given);
    *ndf = handleOf(api::OpenedNdf::open(openSource(*source, use.checks), nameOr(source->name, "source"), use));
  });
}

void glint_ndf_close(glint_ndf* ndf) { glint_ndf::close(ndf); }

glint_status glint_ndf_get_info(const glint_ndf* ndf, glint_ndf_info* info) {
  if (const char* fault = faultOf(ndf)) return usage("glint_ndf_get_info", fault);
  if (info == nullptr) return usage("glint_ndf_get_info", "info is null");
  const api::NdfInfo& from = ndf->body().opened.info();
  glint_ndf_info all = {};
  all.kind = ndf->body().kind.c_str();
  all.width = from.width;
  all.height = from.height;
  all.resolution = from.resolution;
  all.level_count = from.level_count;
  all.sigma_r = from.sigma_r;
  all.finest_sigma_texels = from.finest_sigma_texels;
  all.coarsest_sigma_texels = from.coarsest_sigma_texels;
  all.surface = static_cast<int32_t>(from.surface);
  all.boundary = static_cast<int32_t>(from.boundary);
  all.has_normals = ndf->body().opened.hasNormals() ? 1 : 0;
  all.smallest_sigma_texels = from.smallest_sigma_texels;
  all.file_bytes = ndf->body().opened.fileBytes();
  if (const auto* set = std::get_if<api::UdimNdf>(&ndf->body().opened.model()))
    all.udim_tiles = static_cast<int32_t>(set->tiles().tiles().size());
  return giveSized(all, info) ? GLINT_OK : usage("glint_ndf_info", kWrongStructSize);
}

glint_footprint glint_footprint_isotropic(double u, double v, float sigma_texels) {
  return gaussianAt(u, v, Footprint::isotropic({}, sigma_texels).covariance);
}

glint_footprint glint_footprint_box(double u, double v, float ax, float ay, float bx, float by) {
  return {GLINT_FOOTPRINT_BOX, u, v, {ax, ay, bx, by}, {0, 0}};
}

glint_footprint glint_footprint_from_differentials(double u, double v, float dudx, float dvdx, float dudy, float dvdy,
                                                   int32_t width, int32_t height) {
  return gaussianAt(u, v, footprintFromDifferentials({}, {dudx, dvdx}, {dudy, dvdy}, width, height).covariance);
}

glint_ray_cone glint_ray_cone_propagated(glint_ray_cone cone, float distance) {
  const RayCone after = propagated({cone.width, cone.spread}, distance);
  return {after.width, after.spread};
}

glint_ray_cone glint_ray_cone_bounced(glint_ray_cone cone, float slope_sigma) {
  const RayCone after = bounced({cone.width, cone.spread}, slope_sigma);
  return {after.width, after.spread};
}

glint_footprint glint_footprint_from_cone(glint_ray_cone cone, double u, double v, const float direction[3],
                                          float texels_per_unit) {
  const Vec3 towards = direction == nullptr ? Vec3{0, 0, 1} : vectorOf(direction);
  return gaussianAt(u, v, footprintOfCone({cone.width, cone.spread}, {}, towards, texels_per_unit).covariance);
}

glint_status glint_footprint_set_spread(glint_footprint* footprint, const float wi[3], const float wo[3], const float dndx[3],
                                        const float dndy[3], const float dwodx[3], const float dwody[3], float filter_sigma) {
  if (footprint == nullptr || wi == nullptr || wo == nullptr || dndx == nullptr || dndy == nullptr)
    return badArgument("glint_footprint_set_spread",
                       {{footprint, "footprint"}, {wi, "wi"}, {wo, "wo"}, {dndx, "dndx"}, {dndy, "dndy"}});
  const HalfVector h = halfVectorOf(vectorOf(wi), vectorOf(wo));
  const auto turn = [&](const float* dn, const float* dwo) {
    return halfVectorDifferential(h, vectorOf(dn), dwo == nullptr ? Vec3{0, 0, 0} : vectorOf(dwo));
  };
  const Vec2 spread = halfVectorSpread(turn(dndx, dwodx), turn(dndy, dwody), filter_sigma);
  const auto usable = [](float x) { return x > 0 ? x : 0; };  // NaN, below the horizon, counts as 0
  footprint->spread[0] = usable(spread.x);
  footprint->spread[1] = usable(spread.y);
  return GLINT_OK;
}

glint_status glint_ndf_slopes(const glint_ndf* ndf, float mean[2], float covariance[3]) {
  if (!isOpen(ndf) || mean == nullptr || covariance == nullptr)
    return badArgument("glint_ndf_slopes", {{ndf, "ndf"}, {mean, "mean"}, {covariance, "covariance"}});
  const MapSlopes slopes = ndf->body().opened.slopes();
  mean[0] = slopes.mean.x, mean[1] = slopes.mean.y;
  covariance[0] = slopes.covariance.xx, covariance[1] = slopes.covariance.xy, covariance[2] = slopes.covariance.yy;
  return GLINT_OK;
}

glint_status glint_ndf_pack(const glint_ndf* ndf, void* buffer, size_t capacity, size_t* size) {
  if (!isOpen(ndf) || size == nullptr) return badArgument("glint_ndf_pack", {{ndf, "ndf"}, {size, "size"}});
  std::vector<std::byte> packed;
  const glint_status status = guarded([&] { packed = api::pack(ndf->body().opened); });
  if (status != GLINT_OK) return status;
  if (buffer != nullptr) {
    if (capacity < packed.size()) return usage("glint_ndf_pack", "the buffer is smaller than the packed model");
    std::memcpy(buffer, packed.data(), packed.size());
  }
  *size = packed.size();
  return GLINT_OK;
}

glint_status glint_density(const glint_ndf* ndf, const glint_footprint* footprint, float hx, float hy, float* density) {
  if (!isOpen(ndf) || footprint == nullptr || density == nullptr)
    return badArgument("glint_density", {{ndf, "ndf"}, {footprint, "footprint"}, {density, "density"}});
  *density = api::densityAt(ndf->body().opened.model(), footprint->u, footprint->v, footprintOf(*footprint), {hx, hy},
                            spreadOf(*footprint));
  return GLINT_OK;
}

glint_status glint_density_rgb(const glint_ndf* ndf, const glint_footprint* footprint, float psi_x, float psi_y, float rgb[3]) {
  if (!isOpen(ndf) || footprint == nullptr || rgb == nullptr)
    return badArgument("glint_density_rgb", {{ndf, "ndf"}, {footprint, "footprint"}, {rgb, "rgb"}});
  const api::AnyNdf model = api::movedTo(ndf->body().opened.model(), footprint->u, footprint->v);
  set(rgb, api::densityRgb(model, footprintOf(*footprint), {psi_x, psi_y}));
  return GLINT_OK;
}

glint_status glint_ndf_channels(const glint_ndf* ndf, int32_t* channels) {
  if (!isOpen(ndf) || channels == nullptr) return badArgument("glint_ndf_channels", {{ndf, "ndf"}, {channels, "channels"}});
  *channels = api::channelCount(ndf->body().opened.model());
  return GLINT_OK;
}

glint_status glint_density_spectrum(const glint_ndf* ndf, const glint_footprint* footprint, float psi_x, float psi_y,
                                    float* densities, size_t capacity) {
  if (!isOpen(ndf) || footprint == nullptr || densities == nullptr)
    return badArgument("glint_density_spectrum", {{ndf, "ndf"}, {footprint, "footprint"}, {densities, "densities"}});
  const api::AnyNdf model = api::movedTo(ndf->body().opened.model(), footprint->u, footprint->v);
  if (capacity < static_cast<size_t>(api::channelCount(model)))
    return usage("glint_density_spectrum", "capacity is below the number of channels (glint_ndf_channels)");
  api::densitySpectrum(model, footprintOf(*footprint), {psi_x, psi_y}, densities);
  return GLINT_OK;
}

glint_status glint_mean(const glint_ndf* ndf, const glint_footprint* footprint, float x0, float y0, float x1, float y1,
                        float* mean) {
  if (!isOpen(ndf) || footprint == nullptr || mean == nullptr)
    return badArgument("glint_mean", {{ndf, "ndf"}, {footprint, "footprint"}, {mean, "mean"}});
  *mean = api::meanAt(ndf->body().opened.model(), footprint->u, footprint->v, footprintOf(*footprint), {{x0, y0}, {x1, y1}},
                      spreadOf(*footprint));
  return GLINT_OK;
}

glint_status glint_sample(const glint_ndf* ndf, const glint_footprint* footprint, float xi1, float xi2, float* hx, float* hy,
                          float* pdf) {
  if (!isOpen(ndf) || footprint == nullptr || hx == nullptr || hy == nullptr || pdf == nullptr)
    return badArgument("glint_sample", {{ndf, "ndf"}, {footprint, "footprint"}, {hx, "hx"}, {hy, "hy"}, {pdf, "pdf"}});
  const HalfVectorSample drawn = api::sampleAt(ndf->body().opened.model(), footprint->u, footprint->v, footprintOf(*footprint),
                                               {xi1, xi2}, spreadOf(*footprint));
  *hx = drawn.h.x;
  *hy = drawn.h.y;
  *pdf = drawn.pdf;
  return GLINT_OK;
}

glint_status glint_density_batch(const glint_ndf* ndf, size_t count, const glint_footprints* footprints, glint_floats hx,
                                 glint_floats hy, float* densities) {
  if (count == 0) return GLINT_OK;
  if (const char* fault = faultOf(ndf, footprints, densities)) return usage("glint_density_batch", fault);
  if (hx.data == nullptr || hy.data == nullptr) return usage("glint_density_batch", "hx and hy must be given");
  api::densities(ndf->body().opened.model(), count, arraysOf(*footprints), {arrayOf(hx), arrayOf(hy)}, densities);
  return GLINT_OK;
}

glint_status glint_density_rgb_batch(const glint_ndf* ndf, size_t count, const glint_footprints* footprints, glint_floats psi_x,
                                     glint_floats psi_y, float* rgb) {
  if (count == 0) return GLINT_OK;
  if (const char* fault = faultOf(ndf, footprints, rgb)) return usage("glint_density_rgb_batch", fault);
  if (psi_x.data == nullptr || psi_y.data == nullptr) return usage("glint_density_rgb_batch", "psi_x and psi_y must be given");
  const api::FootprintArrays arrays = arraysOf(*footprints);
  const api::HalfVectorArrays psi = {arrayOf(psi_x), arrayOf(psi_y)};
  const api::AnyNdf& model = ndf->body().opened.model();
  for (size_t k = 0; k < count; ++k) set(rgb + 3 * k, api::densityRgb(api::movedTo(model, arrays, k), arrays[k], psi[k]));
  return GLINT_OK;
}

glint_status glint_mean_batch(const glint_ndf* ndf, size_t count, const glint_footprints* footprints, glint_floats x0,
                              glint_floats y0, glint_floats x1, glint_floats y1, float* means) {
  if (count == 0) return GLINT_OK;
  if (const char* fault = faultOf(ndf, footprints, means)) return usage("glint_mean_batch", fault);
  if (x0.data == nullptr || y0.data == nullptr || x1.data == nullptr || y1.data == nullptr)
    return usage("glint_mean_batch", "x0, y0, x1 and y1 must be given");
  api::means(ndf->body().opened.model(), count, arraysOf(*footprints), {arrayOf(x0), arrayOf(y0), arrayOf(x1), arrayOf(y1)},
             means);
  return GLINT_OK;
}

glint_status glint_sample_batch(const glint_ndf* ndf, size_t count, const glint_footprints* footprints, glint_floats xi1,
                                glint_floats xi2, float* hx, float* hy, float* pdfs) {
  if (count == 0) return GLINT_OK;
  if (const char* fault = faultOf(ndf, footprints, pdfs)) return usage("glint_sample_batch", fault);
  if (xi1.data == nullptr || xi2.data == nullptr) return usage("glint_sample_batch", "xi1 and xi2 must be given");
  if (hx == nullptr || hy == nullptr) return usage("glint_sample_batch", "hx and hy must be given");
  api::samples(ndf->body().opened.model(), count, arraysOf(*footprints), {arrayOf(xi1), arrayOf(xi2)}, {hx, hy, pdfs});
  return GLINT_OK;
}
