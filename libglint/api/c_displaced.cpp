#include <cmath>
#include <memory>
#include <utility>

#include "glint/api/c_support.h"
#include "glint/query/brdf/displaced_brdf.h"

namespace glint::api::c {

struct DisplacedBody {
  explicit DisplacedBody(formats::Asset opened) : asset(std::move(opened)), brdf(asset.get<Displacement>()) {}

  formats::Asset asset;
  DisplacedBrdf brdf;
};

}  // namespace glint::api::c

namespace {

using namespace glint;
using namespace glint::api::c;

static_assert(GLINT_DISPLACED_MAX_LEVELS == kMaxDisplacementLevels);
static_assert(static_cast<int>(BaseBrdf::Kind::diffuse) == GLINT_BASE_DIFFUSE &&
              static_cast<int>(BaseBrdf::Kind::ggx) == GLINT_BASE_GGX &&
              static_cast<int>(BaseBrdf::Kind::table) == GLINT_BASE_TABLE);

DisplacedVariant variantOf(int32_t variant) {
  if (variant == GLINT_DISPLACED_LOBES) return DisplacedVariant::lobes;
  if (variant == GLINT_DISPLACED_SINGLE) return DisplacedVariant::single;
  return DisplacedVariant::full;
}

/// One point of the coarse surface.
struct Point {
  Point(const glint_displaced& displaced, int32_t variant_id, float level, Vec2 at)
      : brdf(displaced.body().brdf), variant(variantOf(variant_id)), levels(brdf.levelsAt(level)), uv(at) {}

  void evaluate(Vec3 wi, Vec3 wo, float* reflected, float* pdf) const {
    if (reflected != nullptr) set(reflected, brdf.reflected(levels, uv, wi, wo, variant));
    if (pdf != nullptr) *pdf = brdf.pdf(levels, uv, wi, wo);
  }

  void sample(Vec3 wo, Vec2 xi, float* wi, float* weight, float* pdf) const {
    const DirectionSample drawn = brdf.sample(levels, uv, wo, xi);
    *pdf = drawn.pdf > 0 ? drawn.pdf : 0;
    set(wi, *pdf > 0 ? drawn.direction : Vec3{});
    set(weight, *pdf > 0 ? 1 / drawn.pdf * brdf.reflected(levels, uv, drawn.direction, wo, variant) : Rgb{});
  }

  const DisplacedBrdf& brdf;
  DisplacedVariant variant;
  LevelBlend levels;
  Vec2 uv;
};

/// Points as a structure of arrays.
struct PointArrays {
  explicit PointArrays(const glint_displaced_points& p)
      : level(arrayOf(p.level)),
        u(arrayOf(p.u)),
        v(arrayOf(p.v)),
        precise_u(arrayOf(p.precise_u)),
        precise_v(arrayOf(p.precise_v)) {}

  /// Whether each point has a level and a position.
  bool complete() const { return level.data != nullptr && (isPrecise() || (u.data != nullptr && v.data != nullptr)); }
  Vec2 uv(std::size_t k) const {
    return isPrecise() ? wrappedUv(precise_u[k], precise_v[k]) : wrappedUv(double{u[k]}, double{v[k]});
  }

  api::StridedFloats level, u, v;
  api::StridedDoubles precise_u, precise_v;

 private:
  bool isPrecise() const { return precise_u.data != nullptr && precise_v.data != nullptr; }
};

/// The fault of the arguments that both batches have; null if there is none.
const char* faultOf(const glint_displaced* displaced, const glint_displaced_points* points, const glint_directions* wo) {
  if (const char* fault = faultOf(displaced)) return fault;
  if (points == nullptr || !PointArrays(*points).complete()) return "level, u and v of the points must be given";
  return complete(wo) ? nullptr : "x, y and z of wo must be given";
}

}  // namespace

glint_status glint_displaced_open(const char* path, int32_t verify_hashes, glint_displaced** displaced) {
  if (path == nullptr) return usage("glint_displaced_open", "path is null");
  if (displaced == nullptr) return usage("glint_displaced_open", "displaced is null");
  return guarded([&] {
    *displaced = new glint_displaced(std::make_shared<DisplacedBody>(formats::Asset::open(path, {verify_hashes != 0})));
  });
}

glint_status glint_displaced_open_memory(const void* bytes, size_t size_bytes, const char* name, int32_t verify_hashes,
                                         int32_t copy, glint_displaced** displaced) {
  if (bytes == nullptr) return usage("glint_displaced_open_memory", "bytes is null");
  if (displaced == nullptr) return usage("glint_displaced_open_memory", "displaced is null");
  return guarded([&] {
    const formats::OpenOptions options{.verify_hashes = verify_hashes != 0, .copy = copy != 0};
    *displaced =
        new glint_displaced(std::make_shared<DisplacedBody>(openMemory(bytes, size_bytes, nameOr(name, "memory"), options)));
  });
}

glint_status glint_displaced_open_source(const glint_source* source, int32_t verify_hashes, glint_displaced** displaced) {
  if (const char* fault = faultOf(source)) return usage("glint_displaced_open_source", fault);
  if (displaced == nullptr) return usage("glint_displaced_open_source", "displaced is null");
  return guarded([&] {
    const formats::OpenOptions options{.verify_hashes = verify_hashes != 0};
    *displaced = new glint_displaced(std::make_shared<DisplacedBody>(openSource(*source, options)));
  });
}

void glint_displaced_close(glint_displaced* displaced) { glint_displaced::close(displaced); }

glint_status glint_displaced_get_info(const glint_displaced* displaced, glint_displaced_info* info) {
  if (const char* fault = faultOf(displaced)) return usage("glint_displaced_get_info", fault);
  if (info == nullptr) return usage("glint_displaced_get_info", "info is null");
  const Displacement& from = displaced->body().brdf.asset();
  glint_displaced_info all = {};
  all.width = from.width;
  all.height = from.height;
  all.level_count = from.level_count;
  all.channels = from.channels;
  all.base = static_cast<int32_t>(from.base.kind);
  all.texel_size_um = from.texel_size_um;
  all.file_bytes = displaced->body().asset.info().file_bytes;
  for (int l = 0; l < from.level_count; ++l) all.factors[l] = from.levels[l].factor;
  return giveSized(all, info) ? GLINT_OK : usage("glint_displaced_info", kWrongStructSize);
}

glint_status glint_displaced_heights(const glint_displaced* displaced, int32_t level, const float** heights, int32_t* columns,
                                     int32_t* rows) {
  if (!isOpen(displaced) || heights == nullptr || columns == nullptr || rows == nullptr)
    return badArgument("glint_displaced_heights",
                       {{displaced, "displaced"}, {heights, "heights"}, {columns, "columns"}, {rows, "rows"}});
  const Displacement& asset = displaced->body().brdf.asset();
  if (level < 0 || level >= asset.level_count) return usage("glint_displaced_heights", "the asset has no such level");
  *heights = asset.levels[level].heights.data();
  *columns = asset.levels[level].columns;
  *rows = asset.levels[level].rows;
  return GLINT_OK;
}

glint_status glint_displaced_level(const glint_displaced* displaced, float sigma_texels, float* level) {
  if (!isOpen(displaced) || level == nullptr)
    return badArgument("glint_displaced_level", {{displaced, "displaced"}, {level, "level"}});
  const LevelBlend levels = displaced->body().brdf.levelsFor(std::sqrt(12.0f) * sigma_texels);
  *level = static_cast<float>(levels.first) + levels.weight;
  return GLINT_OK;
}

glint_status glint_displaced_evaluate(const glint_displaced* displaced, int32_t variant, float level, double u, double v,
                                      const float wi[3], const float wo[3], float reflected[3], float* pdf) {
  if (!isOpen(displaced) || wi == nullptr || wo == nullptr)
    return badArgument("glint_displaced_evaluate", {{displaced, "displaced"}, {wi, "wi"}, {wo, "wo"}});
  if (reflected == nullptr && pdf == nullptr) return usage("glint_displaced_evaluate", "reflected and pdf are null");
  Point(*displaced, variant, level, wrappedUv(u, v)).evaluate(vectorOf(wi), vectorOf(wo), reflected, pdf);
  return GLINT_OK;
}

glint_status glint_displaced_sample(const glint_displaced* displaced, int32_t variant, float level, double u, double v,
                                    const float wo[3], float xi1, float xi2, float wi[3], float weight[3], float* pdf) {
  if (!isOpen(displaced) || wo == nullptr || wi == nullptr || weight == nullptr || pdf == nullptr)
    return badArgument("glint_displaced_sample",
                       {{displaced, "displaced"}, {wo, "wo"}, {wi, "wi"}, {weight, "weight"}, {pdf, "pdf"}});
  Point(*displaced, variant, level, wrappedUv(u, v)).sample(vectorOf(wo), {xi1, xi2}, wi, weight, pdf);
  return GLINT_OK;
}

glint_status glint_displaced_evaluate_batch(const glint_displaced* displaced, int32_t variant, size_t count,
                                            const glint_displaced_points* points, const glint_directions* wi,
                                            const glint_directions* wo, float* reflected, float* pdfs) {
  if (count == 0) return GLINT_OK;
  if (const char* fault = faultOf(displaced, points, wo)) return usage("glint_displaced_evaluate_batch", fault);
  if (!complete(wi)) return usage("glint_displaced_evaluate_batch", "x, y and z of wi must be given");
  if (reflected == nullptr && pdfs == nullptr) return usage("glint_displaced_evaluate_batch", "reflected and pdfs are null");
  const PointArrays at(*points);
  const api::DirectionArrays i = arraysOf(*wi), o = arraysOf(*wo);
  for (std::size_t k = 0; k < count; ++k)
    Point(*displaced, variant, at.level[k], at.uv(k))
        .evaluate(i[k], o[k], reflected == nullptr ? nullptr : reflected + 3 * k, pdfs == nullptr ? nullptr : pdfs + k);
  return GLINT_OK;
}

glint_status glint_displaced_sample_batch(const glint_displaced* displaced, int32_t variant, size_t count,
                                          const glint_displaced_points* points, const glint_directions* wo, glint_floats xi1,
                                          glint_floats xi2, float* wi, float* weights, float* pdfs) {
  if (count == 0) return GLINT_OK;
  if (const char* fault = faultOf(displaced, points, wo)) return usage("glint_displaced_sample_batch", fault);
  if (xi1.data == nullptr || xi2.data == nullptr) return usage("glint_displaced_sample_batch", "xi1 and xi2 must be given");
  if (wi == nullptr || weights == nullptr || pdfs == nullptr)
    return usage("glint_displaced_sample_batch", "wi, weights and pdfs must be given");
  const PointArrays at(*points);
  const api::DirectionArrays o = arraysOf(*wo);
  const api::HalfVectorArrays xi = {arrayOf(xi1), arrayOf(xi2)};
  for (std::size_t k = 0; k < count; ++k)
    Point(*displaced, variant, at.level[k], at.uv(k)).sample(o[k], xi[k], wi + 3 * k, weights + 3 * k, pdfs + k);
  return GLINT_OK;
}
