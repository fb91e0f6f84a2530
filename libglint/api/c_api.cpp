#include <algorithm>
#include <cstddef>
#include <cstring>
#include <new>
#include <string>

#include "glint/api/any_ndf.h"
#include "glint/api/batch.h"
#include "glint/api/glint.h"

struct glint_ndf {
  glint::api::OpenedNdf opened;
  std::string kind;
};

namespace {

using namespace glint;

static_assert(static_cast<int>(Surface::flat) == GLINT_SURFACE_FLAT &&
              static_cast<int>(Surface::smooth) == GLINT_SURFACE_SMOOTH);
static_assert(static_cast<int>(Boundary::wrap) == GLINT_BOUNDARY_WRAP &&
              static_cast<int>(Boundary::clamp) == GLINT_BOUNDARY_CLAMP);
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

glint_status fail(glint_status status, const char* message, const char* rule = "") {
  setText(last_error.message, message);
  setText(last_error.rule, rule);
  return status;
}

glint_status usage(const char* message) { return fail(GLINT_ERROR_USAGE, message, "api.arguments"); }

/// Runs work that may throw.
template <class Work>
glint_status guarded(Work&& work) noexcept {
  try {
    work();
    return GLINT_OK;
  } catch (const Error& error) {
    return fail(static_cast<glint_status>(error.code()), error.what(), error.rule().c_str());
  } catch (const std::bad_alloc&) {
    return fail(GLINT_ERROR_FAILED, "out of memory");
  } catch (const std::exception& error) {
    return fail(GLINT_ERROR_FAILED, error.what());
  } catch (...) {
    return fail(GLINT_ERROR_FAILED, "failed for a reason that it does not name");
  }
}

constexpr float kLeastSigmaR = 1e-4f, kMostSigmaR = 0.25f;
/// Size of the options in the first version of the struct; no caller's is smaller.
constexpr std::size_t kFirstOptionsSize = offsetof(glint_open_options, verify_hashes) + sizeof(int32_t);
static_assert(offsetof(glint_open_options, reserved) + sizeof(int32_t) == sizeof(glint_open_options),
              "padding at the end would be read as a member by a later library");

/// Takes options of an older or newer header: members that the caller does not have are 0, those that this library does not have
/// must be.
/// @return null if the options can be used, else what is wrong
const char* takeOptions(const glint_open_options* from, glint_open_options& to) {
  to = GLINT_OPEN_OPTIONS_INIT;
  if (from == nullptr) return nullptr;
  if (from->struct_size < kFirstOptionsSize) return "glint_open_options: struct_size is not sizeof(glint_open_options)";
  std::memcpy(&to, from, std::min(from->struct_size, sizeof to));
  const char* bytes = reinterpret_cast<const char*>(from);
  if (from->struct_size > sizeof to &&
      std::any_of(bytes + sizeof to, bytes + from->struct_size, [](char byte) { return byte != 0; }))
    return "glint_open_options: has members that this version of the library does not know";
  if (to.sigma_r != 0 && !(to.sigma_r >= kLeastSigmaR && to.sigma_r <= kMostSigmaR))
    return "glint_open_options: sigma_r is not in 1e-4 to 0.25; give 0 for 0.005";
  if (to.surface != GLINT_SURFACE_FLAT && to.surface != GLINT_SURFACE_SMOOTH) return "glint_open_options: unknown surface";
  if (to.boundary != GLINT_BOUNDARY_WRAP && to.boundary != GLINT_BOUNDARY_CLAMP) return "glint_open_options: unknown boundary";
  if (to.slant_tolerance != GLINT_SLANT_EXACT && !(to.slant_tolerance >= 0 && to.slant_tolerance <= 1))
    return "glint_open_options: slant_tolerance is not in 0 to 1; give 0 for 0.06, or GLINT_SLANT_EXACT";
  if (to.gaussian_boxes != 0 && to.gaussian_boxes != 1 && to.gaussian_boxes != 3)
    return "glint_open_options: gaussian_boxes is not 1 or 3; give 0 for 1";
  if (to.reserved != 0) return "glint_open_options: reserved is not 0";
  return nullptr;
}

api::NdfOptions optionsOf(const glint_open_options& o) {
  api::NdfOptions options;
  if (o.normals_path != nullptr) options.normals = o.normals_path;
  if (o.sigma_r != 0) options.sigma_r = o.sigma_r;
  options.surface = static_cast<Surface>(o.surface);
  options.boundary = static_cast<Boundary>(o.boundary);
  options.verify_hashes = o.verify_hashes != 0;
  options.alpha = o.alpha;
  if (o.slant_tolerance != 0) options.slant_tolerance = std::max(0.0f, o.slant_tolerance);
  if (o.gaussian_boxes == 3) options.gaussian_boxes = GaussianBoxes::three;
  return options;
}

Footprint footprintOf(const glint_footprint& p) {
  if (p.kind == GLINT_FOOTPRINT_BOX) return Footprint::box({p.u, p.v}, {p.m[0], p.m[1]}, {p.m[2], p.m[3]});
  return Footprint::gaussian({p.u, p.v}, {p.m[0], p.m[1], p.m[2]});
}

api::StridedFloats arrayOf(const glint_floats& a) { return {a.data, a.stride}; }

/// @return null if the footprints are complete, else what is missing
const char* faultOf(const glint_footprints& p) {
  if (p.u.data == nullptr || p.v.data == nullptr) return "glint_footprints: u and v must be given";
  const bool gaussian = p.xx.data != nullptr && p.yy.data != nullptr;
  const bool box = p.ax.data != nullptr && p.ay.data != nullptr && p.bx.data != nullptr && p.by.data != nullptr;
  if (p.sigma.data != nullptr || gaussian || box) return nullptr;
  return "glint_footprints: sigma, or xx and yy, or ax, ay, bx and by must be given";
}

api::FootprintArrays arraysOf(const glint_footprints& p) {
  api::FootprintArrays out;
  out.u = arrayOf(p.u);
  out.v = arrayOf(p.v);
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
  return out;
}

/// What is wrong with the arguments that all batches have; null if nothing.
const char* faultOf(const glint_ndf* ndf, const glint_footprints* footprints, const float* out) {
  if (ndf == nullptr) return "ndf is null";
  if (footprints == nullptr) return "footprints is null";
  if (out == nullptr) return "the array of answers is null";
  return faultOf(*footprints);
}

}  // namespace

int32_t glint_abi_version(void) { return GLINT_ABI_VERSION; }
const char* glint_version(void) { return GLINT_VERSION; }
const char* glint_error_message(void) { return last_error.message; }
const char* glint_error_rule(void) { return last_error.rule; }

glint_status glint_ndf_open(const char* path, const glint_open_options* options, glint_ndf** ndf) {
  if (path == nullptr) return usage("glint_ndf_open: path is null");
  if (ndf == nullptr) return usage("glint_ndf_open: ndf is null");
  glint_open_options given;
  if (const char* fault = takeOptions(options, given)) return usage(fault);
  return guarded([&] {
    auto opened = api::OpenedNdf::open(path, optionsOf(given));
    std::string kind(opened.asset().kind());
    *ndf = new glint_ndf{std::move(opened), std::move(kind)};
  });
}

void glint_ndf_close(glint_ndf* ndf) { delete ndf; }

glint_status glint_ndf_get_info(const glint_ndf* ndf, glint_ndf_info* info) {
  if (ndf == nullptr) return usage("glint_ndf_get_info: ndf is null");
  if (info == nullptr) return usage("glint_ndf_get_info: info is null");
  if (info->struct_size <= sizeof info->struct_size) return usage("glint_ndf_info: struct_size is not sizeof(glint_ndf_info)");
  const api::NdfInfo& from = ndf->opened.info();
  glint_ndf_info all = {};
  all.struct_size = info->struct_size;
  all.kind = ndf->kind.c_str();
  all.width = from.width;
  all.height = from.height;
  all.resolution = from.resolution;
  all.level_count = from.level_count;
  all.sigma_r = from.sigma_r;
  all.finest_sigma_texels = from.finest_sigma_texels;
  all.surface = static_cast<int32_t>(from.surface);
  all.boundary = static_cast<int32_t>(from.boundary);
  all.has_normals = ndf->opened.hasNormals() ? 1 : 0;
  all.file_bytes = ndf->opened.asset().info().file_bytes;
  std::memcpy(info, &all, std::min(info->struct_size, sizeof all));
  return GLINT_OK;
}

glint_footprint glint_footprint_isotropic(float u, float v, float sigma_texels) {
  const float variance = sigma_texels * sigma_texels;
  return {GLINT_FOOTPRINT_GAUSSIAN, u, v, {variance, 0, variance, 0}};
}

glint_status glint_density(const glint_ndf* ndf, const glint_footprint* footprint, float hx, float hy, float* density) {
  if (ndf == nullptr || footprint == nullptr || density == nullptr) return usage("glint_density: an argument is null");
  *density = std::visit(
      [&](const auto& model) {
        return model.density(footprintOf(*footprint), {hx, hy});
      },
      ndf->opened.model());
  return GLINT_OK;
}

glint_status glint_mean(const glint_ndf* ndf, const glint_footprint* footprint, float x0, float y0, float x1, float y1,
                        float* mean) {
  if (ndf == nullptr || footprint == nullptr || mean == nullptr) return usage("glint_mean: an argument is null");
  *mean = std::visit(
      [&](const auto& model) {
        return model.mean(footprintOf(*footprint), {{x0, y0}, {x1, y1}});
      },
      ndf->opened.model());
  return GLINT_OK;
}

glint_status glint_sample(const glint_ndf* ndf, const glint_footprint* footprint, float xi1, float xi2, float* hx, float* hy,
                          float* pdf) {
  if (ndf == nullptr || footprint == nullptr || hx == nullptr || hy == nullptr || pdf == nullptr)
    return usage("glint_sample: an argument is null");
  const HalfVectorSample drawn = std::visit(
      [&](const auto& model) {
        return model.sample(footprintOf(*footprint), {xi1, xi2});
      },
      ndf->opened.model());
  *hx = drawn.h.x;
  *hy = drawn.h.y;
  *pdf = drawn.pdf;
  return GLINT_OK;
}

glint_status glint_density_batch(const glint_ndf* ndf, size_t count, const glint_footprints* footprints, glint_floats hx,
                                 glint_floats hy, float* densities) {
  if (count == 0) return GLINT_OK;
  if (const char* fault = faultOf(ndf, footprints, densities)) return usage(fault);
  if (hx.data == nullptr || hy.data == nullptr) return usage("glint_density_batch: hx and hy must be given");
  api::densities(ndf->opened.model(), count, arraysOf(*footprints), {arrayOf(hx), arrayOf(hy)}, densities);
  return GLINT_OK;
}

glint_status glint_mean_batch(const glint_ndf* ndf, size_t count, const glint_footprints* footprints, glint_floats x0,
                              glint_floats y0, glint_floats x1, glint_floats y1, float* means) {
  if (count == 0) return GLINT_OK;
  if (const char* fault = faultOf(ndf, footprints, means)) return usage(fault);
  if (x0.data == nullptr || y0.data == nullptr || x1.data == nullptr || y1.data == nullptr)
    return usage("glint_mean_batch: x0, y0, x1 and y1 must be given");
  api::means(ndf->opened.model(), count, arraysOf(*footprints), {arrayOf(x0), arrayOf(y0), arrayOf(x1), arrayOf(y1)}, means);
  return GLINT_OK;
}

glint_status glint_sample_batch(const glint_ndf* ndf, size_t count, const glint_footprints* footprints, glint_floats xi1,
                                glint_floats xi2, float* hx, float* hy, float* pdfs) {
  if (count == 0) return GLINT_OK;
  if (const char* fault = faultOf(ndf, footprints, pdfs)) return usage(fault);
  if (xi1.data == nullptr || xi2.data == nullptr) return usage("glint_sample_batch: xi1 and xi2 must be given");
  if (hx == nullptr || hy == nullptr) return usage("glint_sample_batch: hx and hy must be given");
  api::samples(ndf->opened.model(), count, arraysOf(*footprints), {arrayOf(xi1), arrayOf(xi2)}, {hx, hy, pdfs});
  return GLINT_OK;
}
