// The BSDF `glint_native` of Mitsuba 3: the facets of an asset as conductors, in C++. It asks the library by its C interface.
// It answers as the BSDF `glint` does without layers; docs/MITSUBA.md has its parameters.

#include <glint.h>
#include <mitsuba/core/fresolver.h>
#include <mitsuba/core/fwd.h>
#include <mitsuba/core/plugin.h>
#include <mitsuba/core/properties.h>
#include <mitsuba/core/spectrum.h>
#include <mitsuba/render/bsdf.h>
#include <mitsuba/render/fresnel.h>
#include <mitsuba/render/texture.h>
#include <nanothread/nanothread.h>

#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

NAMESPACE_BEGIN(mitsuba)

/// A parameter that must lie in a range, as the BSDF `glint` has it.
/// @param above  whether `low` itself is out of range
inline float numberOf(const Properties& props, const char* name, float otherwise, float low = -dr::Infinity<float>,
                      bool above = false) {
  const float value = props.get<float>(name, otherwise);
  if (std::isfinite(value) && (value > low || (!above && value == low) || (value == otherwise && !props.has_property(name))))
    return value;
  Throw("glint_native: %s = %f is out of range; give a number %s %f", name, value, above ? "above" : "of at least", low);
}

/// The distribution and the BRDF of an asset. Facets are mirrors: reflectance is the caller's.
class GlintAsset {
 public:
  explicit GlintAsset(const Properties& props) : path_(fileOf(props, "asset")) {
    glint_open_options options = GLINT_OPEN_OPTIONS_INIT;
    const std::string normals = props.has_property("normals") ? fileOf(props, "normals") : "";
    if (!normals.empty()) options.normals_path = normals.c_str();
    options.sigma_r = props.get<float>("sigma_r", 0.f);
    options.alpha = props.get<float>("alpha", 0.f);
    options.surface = choice(props, "surface", "flat", "smooth");
    options.boundary = choice(props, "boundary", "wrap", "clamp");
    options.interpolation = choice(props, "interpolation", "footprint", "trilinear");
    options.pixels = choice(props, "pixels", "smooth", "constant");
    options.footprint_parts = props.get<int>("footprint_parts", 0);
    glint_ndf* ndf = nullptr;
    check(glint_ndf_open(path_.c_str(), &options, &ndf));
    ndf_.reset(ndf);
    info_.struct_size = sizeof info_;
    check(glint_ndf_get_info(ndf, &info_));
    int32_t channels = 0;
    check(glint_ndf_channels(ndf, &channels));
    coloured_ = channels > 1;
    glint_brdf_options mirrors = GLINT_BRDF_OPTIONS_INIT;
    mirrors.facets = choice(props, "facets", "distribution", "beckmann");
    glint_brdf* brdf = nullptr;
    check(glint_brdf_create(ndf, &mirrors, &brdf));
    brdf_.reset(brdf);
  }

  const std::string& path() const { return path_; }
  const glint_brdf* brdf() const { return brdf_.get(); }
  int width() const { return info_.width; }
  int height() const { return info_.height; }
  bool coloured() const { return coloured_; }
  bool endless() const {
    const std::string_view kind(info_.kind);
    return kind == "tiny-example" || kind.substr(0, 5) == "wang-";
  }
  /// Deviation that footprints without extent count as, texels.
  float fallbackSigma() const { return std::max(info_.smallest_sigma_texels, 0.5f); }

 private:
  struct Close {
    void operator()(glint_ndf* ndf) const { glint_ndf_close(ndf); }
    void operator()(glint_brdf* brdf) const { glint_brdf_destroy(brdf); }
  };

  /// A file as the scene names it: beside the scene, or in a folder that Mitsuba searches.
  static std::string fileOf(const Properties& props, const char* name) {
    return file_resolver()->resolve(fs::path(props.get<std::string>(name))).string();
  }

  static int32_t choice(const Properties& props, const char* name, const char* first, const char* second) {
    const std::string_view word = props.get<std::string_view>(name, first);
    if (word != first && word != second)
      Throw("glint_native: '%s' is not known as %s; give %s or %s", word, name, first, second);
    return word == second ? 1 : 0;
  }

  static void check(glint_status status) {
    if (status != GLINT_OK) Throw("glint_native: %s", glint_error_message());
  }

  std::string path_;
  std::unique_ptr<glint_ndf, Close> ndf_;
  std::unique_ptr<glint_brdf, Close> brdf_;
  glint_ndf_info info_ = {};
  bool coloured_ = false;
};

/// One number of each lane; a single number is that of all lanes.
struct Column {
  const float* data;
  size_t stride;
  float operator[](size_t k) const { return data[k * stride]; }
};

/// What a BRDF is asked at the lanes of a wavefront: the map's uv, its change to the next pixels, and directions in its frame.
struct Queries {
  size_t count = 0;
  Column uv[2], duv_dx[2], duv_dy[2], viewed[3];
  Column lit[3] = {};  ///< to evaluate
  Column xi[2] = {};   ///< to sample
};

/// Makes footprints: covariances in texels^2, or one deviation for all.
struct FootprintMaker {
  int width, height;
  float scale;     ///< factor of the size that differentials give
  float sigma;     ///< texels; 0: of the differentials
  float fallback;  ///< texels: deviation where differentials have no extent

  std::array<float, 3> covariance(float dudx, float dvdx, float dudy, float dvdy) const {
    if (sigma > 0) return {sigma * sigma, 0, sigma * sigma};
    const glint_footprint p =
        glint_footprint_from_differentials(0, 0, scale * dudx, scale * dvdx, scale * dudy, scale * dvdy, width, height);
    constexpr float kNoExtent = 1e-6f;
    if (p.m[0] + p.m[2] > kNoExtent * kNoExtent) return {p.m[0], p.m[1], p.m[2]};
    return {fallback * fallback, 0, fallback * fallback};
  }
};

/// Answers queries in runs, whose footprints stay in the nearest cache.
class Batches {
 public:
  Batches(const GlintAsset& asset, const FootprintMaker& footprints) : asset_(asset), footprints_(footprints) {}

  /// @param f    [count][3] in 1/sr, without a cosine
  /// @param pdf  [count] per unit solid angle
  void evaluate(const Queries& q, float* f, float* pdf) const {
    inRuns(q, [&](size_t first, size_t count, const glint_footprints& footprints) {
      const glint_directions wi = directions(q.lit, first), wo = directions(q.viewed, first);
      return glint_brdf_evaluate_batch(asset_.brdf(), count, &footprints, &wi, &wo, f + 3 * first, pdf + first);
    });
  }

  /// @param wi      [count][3]
  /// @param weight  [count][3] f cosine / pdf
  void sample(const Queries& q, float* wi, float* weight, float* pdf) const {
    inRuns(q, [&](size_t first, size_t count, const glint_footprints& footprints) {
      const glint_directions wo = directions(q.viewed, first);
      return glint_brdf_sample_batch(asset_.brdf(), count, &footprints, &wo, floats(q.xi[0], first), floats(q.xi[1], first),
                                     wi + 3 * first, weight + 3 * first, pdf + first);
    });
  }

 private:
  static constexpr size_t kRun = 512;

  static glint_floats floats(const Column& column, size_t first) {
    return {column.data + first * column.stride, static_cast<ptrdiff_t>(column.stride * sizeof(float))};
  }
  static glint_directions directions(const Column (&w)[3], size_t first) {
    return {floats(w[0], first), floats(w[1], first), floats(w[2], first)};
  }

  template <class Ask>
  void inRuns(const Queries& q, Ask&& ask) const {
    drjit::parallel_for(drjit::blocked_range<size_t>(0, q.count, kRun), [&](const drjit::blocked_range<size_t>& run) {
      for (size_t first = run.begin(); first < run.end(); first += kRun) {
        const size_t count = std::min(kRun, run.end() - first);
        float xx[kRun], xy[kRun], yy[kRun];
        for (size_t k = 0; k < count; ++k) {
          const size_t lane = first + k;
          const auto c = footprints_.covariance(q.duv_dx[0][lane], q.duv_dx[1][lane], q.duv_dy[0][lane], q.duv_dy[1][lane]);
          xx[k] = c[0], xy[k] = c[1], yy[k] = c[2];
        }
        glint_footprints p = {};
        p.u = floats(q.uv[0], first), p.v = floats(q.uv[1], first);
        constexpr ptrdiff_t kNext = sizeof(float);
        p.xx = {xx, kNext}, p.xy = {xy, kNext}, p.yy = {yy, kNext};
        ask(first, count, p);  // fails for null arguments only
      }
    });
  }

  const GlintAsset& asset_;
  const FootprintMaker& footprints_;
};

template <typename Float, typename Spectrum>
class GlintNative final : public BSDF<Float, Spectrum> {
 public:
  MI_IMPORT_BASE(BSDF, m_flags, m_components)
  MI_IMPORT_TYPES(Texture)

  explicit GlintNative(const Properties& props) : Base(props), asset_(props) {
    if (asset_.coloured() && !is_rgb_v<Spectrum>)
      Throw("glint_native: %s: colours of kinds wave-pyramid and wave-cp need an RGB variant; take the BSDF `glint`",
            asset_.path());
    const float scale = numberOf(props, "uv_scale", 1.f, 0.f, true);
    const bool in_texels = props.has_property("texels_per_unit");
    if (in_texels && props.has_property("uv_scale"))
      Throw("glint_native: 'texels_per_unit' says the same as 'uv_scale'; give one of them");
    const float texels = numberOf(props, "texels_per_unit", 1.f, 0.f, true);
    const double scale_u = in_texels ? double(texels) / asset_.width() : double(scale);
    const double scale_v = in_texels ? double(texels) / asset_.height() : double(scale);
    const double angle = double(numberOf(props, "rotation", 0.f)) * dr::Pi<double> / 180;
    cosine_ = std::cos(angle), sine_ = std::sin(angle);
    to_map_ = {scale_u * cosine_, scale_u * sine_, -scale_v * sine_, scale_v * cosine_};
    footprints_ = {asset_.width(), asset_.height(), numberOf(props, "footprint_scale", 1.f, 0.f, true),
                   numberOf(props, "sigma", 0.f, 0.f, true), asset_.fallbackSigma()};
    readConductor(props);
    m_flags = BSDFFlags::GlossyReflection | BSDFFlags::FrontSide | BSDFFlags::Anisotropic | BSDFFlags::SpatiallyVarying |
              BSDFFlags::NeedsDifferentials;
    m_components.push_back(m_flags);
  }

  void traverse(TraversalCallback* callback) override {
    if (mirror_) return;
    callback->put("eta", eta_, ParamFlags::NonDifferentiable);
    callback->put("k", k_, ParamFlags::NonDifferentiable);
    if (reflectance_) callback->put("specular_reflectance", reflectance_, ParamFlags::NonDifferentiable);
  }

  std::pair<BSDFSample3f, Spectrum> sample(const BSDFContext& ctx, const SurfaceInteraction3f& si, Float, const Point2f& xi,
                                           Mask active) const override {
    MI_MASKED_FUNCTION(ProfilerPhase::BSDFSample, active);
    BSDFSample3f bs = dr::zeros<BSDFSample3f>();
    active &= Frame3f::cos_theta(si.wi) > 0.f;
    if (!ctx.is_enabled(BSDFFlags::GlossyReflection)) return {bs, 0.f};
    const Tangents frame = tangents(si);
    const auto [wi, weight, pdf] = drawn(si, into(frame, si.wi), xi, active);
    bs.wo = outOf(frame, wi);
    active &= (pdf > 0.f) & (Frame3f::cos_theta(bs.wo) > 0.f);
    bs.pdf = dr::select(active, pdf, 0.f);
    bs.eta = 1.f;
    bs.sampled_type = +BSDFFlags::GlossyReflection;
    bs.sampled_component = 0;
    const Vector3f h = dr::normalize(bs.wo + si.wi);
    return {bs, depolarizer<Spectrum>(weight * reflectance(si, dr::dot(si.wi, h), active)) & active};
  }

  Spectrum eval(const BSDFContext& ctx, const SurfaceInteraction3f& si, const Vector3f& wo, Mask active) const override {
    return eval_pdf(ctx, si, wo, active).first;
  }

  Float pdf(const BSDFContext& ctx, const SurfaceInteraction3f& si, const Vector3f& wo, Mask active) const override {
    return eval_pdf(ctx, si, wo, active).second;
  }

  std::pair<Spectrum, Float> eval_pdf(const BSDFContext& ctx, const SurfaceInteraction3f& si, const Vector3f& wo,
                                      Mask active) const override {
    MI_MASKED_FUNCTION(ProfilerPhase::BSDFEvaluate, active);
    const Float cosine = Frame3f::cos_theta(wo);
    active &= (Frame3f::cos_theta(si.wi) > 0.f) & (cosine > 0.f);
    if (!ctx.is_enabled(BSDFFlags::GlossyReflection)) return {0.f, 0.f};
    const Tangents frame = tangents(si);
    const auto [f, pdf] = value(si, into(frame, si.wi), into(frame, wo), active);
    const Vector3f h = dr::normalize(wo + si.wi);
    const UnpolarizedSpectrum reflected = f * reflectance(si, dr::dot(si.wi, h), active) * cosine;
    return {depolarizer<Spectrum>(reflected) & active, dr::select(active, pdf, 0.f)};
  }

  std::string to_string() const override { return "GlintNative[asset = " + asset_.path() + "]"; }

  MI_DECLARE_CLASS(GlintNative)

 private:
  /// Tangents of the map, as vectors of the plane of si.sh_frame.
  struct Tangents {
    Vector2f s, t;
  };

  /// Takes the textures that the Mitsuba BSDF `roughconductor` makes of the same parameters.
  void readConductor(const Properties& props) {
    Properties conductor(props);
    conductor.set_plugin_name("roughconductor");
    conductor.remove_property("alpha");  // ours is that of a bin map
    for (const char* name : {"material", "eta", "k", "specular_reflectance"})
      if (props.has_property(name)) props.mark_queried(name);
    mirror_ =
        props.get<std::string_view>("material", props.has_property("eta") || props.has_property("k") ? "" : "none") == "none";
    if (mirror_) conductor.set("material", std::string("none"), false);
    ref<Base> model = PluginManager::instance()->create_object<Base>(conductor);
    TextureCollector collector;
    model->traverse(&collector);
    eta_ = collector.eta, k_ = collector.k, reflectance_ = collector.specular_reflectance;
  }

  struct TextureCollector final : TraversalCallback {
    ref<Texture> eta, k, specular_reflectance;
    void put_value(std::string_view, void*, uint32_t, const std::type_info&) override {}
    void put_object(std::string_view name, Object* value, uint32_t) override {
      auto* texture = dynamic_cast<Texture*>(value);
      if (name == "eta") eta = texture;
      if (name == "k") k = texture;
      if (name == "specular_reflectance") specular_reflectance = texture;
    }
  };

  UnpolarizedSpectrum reflectance(const SurfaceInteraction3f& si, const Float& cosine, Mask active) const {
    UnpolarizedSpectrum share(1.f);
    if (!mirror_) {
      const dr::Complex<UnpolarizedSpectrum> index(eta_->eval(si, active), k_->eval(si, active));
      share = fresnel_conductor(UnpolarizedSpectrum(cosine), index);
    }
    return reflectance_ ? share * reflectance_->eval(si, active) : share;
  }

  /// dp/du made orthogonal to the normal, and the perpendicular on dp/dv's side, both turned by the rotation of the map.
  Tangents tangents(const SurfaceInteraction3f& si) const {
    const Vector3f along = si.to_local(si.dp_du), across = si.to_local(si.dp_dv);
    const Float length2 = along.x() * along.x() + along.y() * along.y();
    const Mask valid = dr::isfinite(length2) & (length2 > 0.f);
    const Float scale = dr::rsqrt(dr::select(valid, length2, 1.f));
    const Float x = dr::select(valid, along.x() * scale, 1.f), y = dr::select(valid, along.y() * scale, 0.f);
    const Float side = dr::select(across.y() * x - across.x() * y < 0.f, -1.f, 1.f);
    const Vector2f s(x, y), t(-y * side, x * side);
    const float c = float(cosine_), n = float(sine_);
    return {c * s + n * t, c * t - n * s};
  }

  static Vector3f into(const Tangents& frame, const Vector3f& v) {
    return {frame.s.x() * v.x() + frame.s.y() * v.y(), frame.t.x() * v.x() + frame.t.y() * v.y(), v.z()};
  }

  static Vector3f outOf(const Tangents& frame, const Vector3f& v) {
    return {frame.s.x() * v.x() + frame.t.x() * v.y(), frame.s.y() * v.x() + frame.t.y() * v.y(), v.z()};
  }

  /// uv of the map, modulo 1 where it repeats. Products are taken in double precision: far out floats lose texels.
  Point2f mapUv(const SurfaceInteraction3f& si) const {
    using Wide = dr::float64_array_t<Float>;
    const Wide u(si.uv.x()), v(si.uv.y());
    const Wide x = to_map_[0] * u + to_map_[1] * v, y = to_map_[2] * u + to_map_[3] * v;
    if (asset_.endless()) return {Float(x), Float(y)};
    return {Float(x - dr::floor(x)), Float(y - dr::floor(y))};
  }

  Vector2f mapChange(const Vector2f& d) const {
    return {float(to_map_[0]) * d.x() + float(to_map_[1]) * d.y(), float(to_map_[2]) * d.x() + float(to_map_[3]) * d.y()};
  }

  // Scalar variants ask once, others hand the memory of a wavefront over.

  /// f without a cosine and as if facets were perfect mirrors, and pdf of `lit`. Directions in the frame of the map.
  std::pair<UnpolarizedSpectrum, Float> value(const SurfaceInteraction3f& si, Vector3f viewed, Vector3f lit,
                                              Mask active) const {
    lit.z() = dr::select(active, lit.z(), -1.f);  // nothing is asked below the horizon
    return asked(si, viewed, lit, [&](const Queries& q, const Batches& batches, size_t count) {
      std::vector<float> f(3 * count), pdf(count);
      batches.evaluate(q, f.data(), pdf.data());
      return std::pair<UnpolarizedSpectrum, Float>(spectrumOf(f, count), arrayOf(pdf.data(), count, 1));
    });
  }

  /// Direction in the frame of the map, weight f cosine / pdf and pdf; pdf 0: nothing was drawn.
  std::tuple<Vector3f, UnpolarizedSpectrum, Float> drawn(const SurfaceInteraction3f& si, Vector3f viewed, const Point2f& xi,
                                                         Mask active) const {
    viewed.z() = dr::select(active, viewed.z(), -1.f);
    const Vector3f random(xi.x(), xi.y(), 0.f);
    return asked(si, viewed, random, [&](const Queries& given, const Batches& batches, size_t count) {
      Queries q = given;
      q.xi[0] = q.lit[0], q.xi[1] = q.lit[1];
      std::vector<float> wi(3 * count), weight(3 * count), pdf(count);
      batches.sample(q, wi.data(), weight.data(), pdf.data());
      const Vector3f direction(arrayOf(wi.data(), count, 3), arrayOf(wi.data() + 1, count, 3),
                               arrayOf(wi.data() + 2, count, 3));
      return std::tuple<Vector3f, UnpolarizedSpectrum, Float>(direction, spectrumOf(weight, count),
                                                              arrayOf(pdf.data(), count, 1));
    });
  }

  template <class Answer>
  auto asked(const SurfaceInteraction3f& si, const Vector3f& viewed, const Vector3f& other, Answer&& answer) const {
    const Point2f uv = mapUv(si);
    const Vector2f dx = mapChange(si.duv_dx), dy = mapChange(si.duv_dy);
    Queries q;
    q.count = 1;
    if constexpr (dr::is_jit_v<Float>) {
      if (jit_flag(JitFlag::SymbolicScope))
        Throw(
            "glint_native: %s: symbolic loops and calls cannot ask an asset. Render with glint_ndf.mitsuba.render(scene), with "
            "the integrator `glint_path`, or inside `with glint_ndf.mitsuba.wavefront():`",
            asset_.path());
      dr::eval(uv, dx, dy, viewed, other);
      dr::sync_thread();
      q.count = std::max({dr::width(uv), dr::width(dx), dr::width(dy), dr::width(viewed), dr::width(other)});
    }
    for (size_t c = 0; c < 2; ++c) q.uv[c] = column(uv[c]), q.duv_dx[c] = column(dx[c]), q.duv_dy[c] = column(dy[c]);
    for (size_t c = 0; c < 3; ++c) q.viewed[c] = column(viewed[c]), q.lit[c] = column(other[c]);
    return answer(q, Batches(asset_, footprints_), q.count);
  }

  static Column column(const Float& x) {
    if constexpr (dr::is_jit_v<Float>)
      return {x.data(), dr::width(x) == 1 ? size_t(0) : size_t(1)};
    else
      return {&x, 0};
  }

  /// Every stride-th number as an array of the variant.
  static Float arrayOf(const float* data, size_t count, size_t stride) {
    if constexpr (dr::is_jit_v<Float>) {
      if (stride == 1) return dr::load<Float>(data, count);
      std::vector<float> numbers(count);
      for (size_t k = 0; k < count; ++k) numbers[k] = data[k * stride];
      return dr::load<Float>(numbers.data(), count);
    } else {
      return data[0];
    }
  }

  UnpolarizedSpectrum spectrumOf(const std::vector<float>& rgb, size_t count) const {
    if constexpr (is_rgb_v<Spectrum>) {
      if (asset_.coloured())
        return {arrayOf(rgb.data(), count, 3), arrayOf(rgb.data() + 1, count, 3), arrayOf(rgb.data() + 2, count, 3)};
    }
    return UnpolarizedSpectrum(arrayOf(rgb.data(), count, 3));
  }

  GlintAsset asset_;
  FootprintMaker footprints_ = {};
  double cosine_ = 1, sine_ = 0;
  std::array<double, 4> to_map_ = {1, 0, 0, 1};  ///< uv of the mesh to uv of the map, by rows
  ref<Texture> eta_, k_, reflectance_;
  bool mirror_ = false;
};

namespace {
template <typename Float, typename Spectrum>
void registerFor(PluginRegisterFn callback, std::string_view id, const char* variant) {
  using Plugin = GlintNative<Float, Spectrum>;
  callback(id, variant, Plugin::Type, [](void*, const Properties& p) -> ref<Object> { return new Plugin(p); });
}
}  // namespace

extern "C" MI_EXPORT void init_plugin(std::string_view id, PluginRegisterFn callback) {
  using Compiled = dr::DiffArray<JitBackend::LLVM, float>;
  registerFor<float, Color<float, 3>>(callback, id, "scalar_rgb");
  registerFor<float, Spectrum<float, 4>>(callback, id, "scalar_spectral");
  registerFor<Compiled, Color<Compiled, 3>>(callback, id, "llvm_ad_rgb");
  registerFor<Compiled, Spectrum<Compiled, 4>>(callback, id, "llvm_ad_spectral");
}

NAMESPACE_END(mitsuba)
