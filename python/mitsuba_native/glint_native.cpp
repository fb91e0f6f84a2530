// The BSDF `glint_native`: what the Python BSDF `glint` answers for one asset without layers, in C++, compiled against the headers of
// Mitsuba's wheel. Scalar variants need it: there every point is asked alone.

#include <mitsuba/core/fresolver.h>
#include <mitsuba/core/plugin.h>
#include <mitsuba/core/properties.h>
#include <mitsuba/render/bsdf.h>
#include <mitsuba/render/fresnel.h>
#include <mitsuba/render/texture.h>
#include <nanothread/nanothread.h>

#include <cmath>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "glint.h"

NAMESPACE_BEGIN(mitsuba)

/// Raises an error of Mitsuba that names the plugin, where a call of the library failed.
inline void check(glint_status status) {
  if (status != GLINT_OK) Throw("glint_native: %s", glint_error_message());
}

template <typename Float, typename Spectrum>
class GlintNative final : public BSDF<Float, Spectrum> {
 public:
  MI_IMPORT_BASE(BSDF, m_flags, m_components)
  MI_IMPORT_TYPES(Texture)

  explicit GlintNative(const Properties& props) : Base(props) {
    path_ = resolved(props.get<std::string>("asset"));
    open(props);
    place(props);
    sigma_ = props.get<ScalarFloat>("sigma", 0);
    scale_ = props.get<ScalarFloat>("footprint_scale", 1);
    if (sigma_ < 0 || !(scale_ > 0)) Throw("glint_native: %s: sigma and footprint_scale must be above 0", path_);
    readConductor(props);
    m_components.push_back(BSDFFlags::GlossyReflection | BSDFFlags::FrontSide | BSDFFlags::Anisotropic |
                           BSDFFlags::SpatiallyVarying | BSDFFlags::NeedsDifferentials);
    m_flags = m_components[0];
  }

  Spectrum eval(const BSDFContext& context, const SurfaceInteraction3f& si, const Vector3f& wo, Mask active) const override {
    return eval_pdf(context, si, wo, active).first;
  }

  Float pdf(const BSDFContext& context, const SurfaceInteraction3f& si, const Vector3f& wo, Mask active) const override {
    return eval_pdf(context, si, wo, active).second;
  }

  std::pair<Spectrum, Float> eval_pdf(const BSDFContext& context, const SurfaceInteraction3f& si, const Vector3f& wo,
                                      Mask active) const override {
    active &= Frame3f::cos_theta(si.wi) > 0.f && Frame3f::cos_theta(wo) > 0.f;
    if (!context.is_enabled(BSDFFlags::GlossyReflection) || dr::none_or<false>(active)) return {0.f, 0.f};
    const Frame frame = frameOf(si);
    const auto [f, pdf] = evaluate(queryOf(si), into(frame, si.wi), into(frame, wo), active);
    const UnpolarizedSpectrum value = f * Frame3f::cos_theta(wo) * reflectance(si, wo, active);
    return {depolarizer<Spectrum>(value) & active, dr::select(active, pdf, 0.f)};
  }

  std::pair<BSDFSample3f, Spectrum> sample(const BSDFContext& context, const SurfaceInteraction3f& si, Float, const Point2f& xi,
                                           Mask active) const override {
    BSDFSample3f drawn = dr::zeros<BSDFSample3f>();
    active &= Frame3f::cos_theta(si.wi) > 0.f;
    if (!context.is_enabled(BSDFFlags::GlossyReflection) || dr::none_or<false>(active)) return {drawn, 0.f};
    const Frame frame = frameOf(si);
    const auto [lit, weight, pdf] = draw(queryOf(si), into(frame, si.wi), xi, active);
    drawn.wo = outOf(frame, lit);
    drawn.pdf = dr::select(active && drawn.wo.z() > 0.f, pdf, 0.f);
    drawn.eta = 1.f;
    drawn.sampled_type = +BSDFFlags::GlossyReflection;
    active &= drawn.pdf > 0.f;
    const UnpolarizedSpectrum value = weight * reflectance(si, drawn.wo, active);
    return {drawn, depolarizer<Spectrum>(value) & active};
  }

  void traverse(TraversalCallback* callback) override {
    callback->put("eta", eta_, ParamFlags::NonDifferentiable);
    callback->put("k", k_, ParamFlags::NonDifferentiable);
    if (specular_) callback->put("specular_reflectance", specular_, ParamFlags::NonDifferentiable);
  }

  std::string to_string() const override { return "GlintNative[asset = " + path_ + "]"; }

  MI_DECLARE_CLASS(GlintNative)

 private:
  /// Tangents of the map in the plane of si.sh_frame.
  struct Frame {
    Vector2f s, t;
  };

  /// Takes the spectra out of a conductor.
  struct Textures final : TraversalCallback {
    ref<Texture> eta, k;

   protected:
    void put_value(std::string_view, void*, uint32_t, const std::type_info&) override {}
    void put_object(std::string_view name, Object* value, uint32_t) override {
      if (name == "eta") eta = static_cast<Texture*>(value);
      if (name == "k") k = static_cast<Texture*>(value);
    }
  };

  /// Where and how large a shading point is on the map: uv, and covariance in texels^2.
  struct Query {
    Float u, v, xx, xy, yy;
  };

  /// The file that a path of a scene names: Mitsuba looks in the folder of the scene too.
  static std::string resolved(const std::string& path) { return file_resolver()->resolve(path).string(); }

  void open(const Properties& props) {
    glint_open_options options = GLINT_OPEN_OPTIONS_INIT;
    const std::string normals = props.has_property("normals") ? resolved(props.get<std::string>("normals")) : "";
    if (!normals.empty()) options.normals_path = normals.c_str();
    options.sigma_r = props.get<ScalarFloat>("sigma_r", 0);
    options.alpha = props.get<ScalarFloat>("alpha", 0);
    options.interpolation = choice(props, "interpolation", "footprint", "trilinear");
    options.pixels = choice(props, "pixels", "smooth", "constant");
    options.surface = choice(props, "surface", "flat", "smooth");
    options.boundary = choice(props, "boundary", "wrap", "clamp");
    glint_ndf* ndf = nullptr;
    check(glint_ndf_open(path_.c_str(), &options, &ndf));
    const std::unique_ptr<glint_ndf, void (*)(glint_ndf*)> closed_later(ndf, glint_ndf_close);
    glint_ndf_info info = {};
    info.struct_size = sizeof info;
    check(glint_ndf_get_info(ndf, &info));
    width_ = info.width, height_ = info.height;
    fallback_ = std::max(info.smallest_sigma_texels, 0.5f);
    if (std::string(info.kind) == "wave-pyramid" || std::string(info.kind) == "tiny-example")
      Throw("glint_native: %s: is of kind %s; take the BSDF `glint`", path_, info.kind);
    glint_brdf_options facets = GLINT_BRDF_OPTIONS_INIT;
    facets.facets = choice(props, "facets", "distribution", "beckmann");
    glint_brdf* brdf = nullptr;
    check(glint_brdf_create(ndf, &facets, &brdf));
    brdf_.reset(brdf);
  }

  /// 0 for the first word, which is the default, and 1 for the second.
  static int32_t choice(const Properties& props, const char* name, const char* first, const char* second) {
    const std::string word = props.get<std::string>(name, first);
    if (word != first && word != second) Throw("glint_native: parameter '%s' must be %s or %s, and is '%s'", name, first, second, word);
    return word == second ? 1 : 0;
  }

  void place(const Properties& props) {
    double scale_u = 1, scale_v = 1;
    if (props.has_property("texels_per_unit")) {
      const double texels = props.get<ScalarFloat>("texels_per_unit");
      scale_u = texels / width_, scale_v = texels / height_;
    } else {
      scale_u = scale_v = props.get<ScalarFloat>("uv_scale", 1);
    }
    if (!(scale_u > 0)) Throw("glint_native: %s: uv_scale and texels_per_unit must be above 0", path_);
    const double angle = props.get<ScalarFloat>("rotation", 0) * (3.14159265358979323846 / 180);
    cosine_ = std::cos(angle), sine_ = std::sin(angle);
    us_ = scale_u * cosine_, ut_ = scale_u * sine_, vs_ = -scale_v * sine_, vt_ = scale_v * cosine_;
  }

  void readConductor(const Properties& props) {
    const std::string material = props.get<std::string>("material", "none");
    if (props.has_property("eta") || props.has_property("k")) {
      eta_ = props.get_unbounded_texture<Texture>("eta", 0.f), k_ = props.get_unbounded_texture<Texture>("k", 1.f);
      mirror_ = false;
    } else if (material != "none") {
      // The textures that Mitsuba's own conductor makes of the name.
      Properties conductor("roughconductor");
      conductor.set("material", material);
      ref<Base> model = PluginManager::instance()->create_object<Base>(conductor);
      Textures found;
      model->traverse(&found);
      eta_ = found.eta, k_ = found.k;
      mirror_ = false;
    } else {
      mirror_ = true;
    }
    if (props.has_property("specular_reflectance")) specular_ = props.get_texture<Texture>("specular_reflectance", 1.f);
  }

  Frame frameOf(const SurfaceInteraction3f& si) const {
    const Vector3f along = si.to_local(si.dp_du), across = si.to_local(si.dp_dv);
    const Float length2 = along.x() * along.x() + along.y() * along.y();
    const Mask valid = dr::isfinite(length2) && length2 > 0.f;
    const Float inverse = dr::rsqrt(dr::select(valid, length2, 1.f));
    const Float x = dr::select(valid, along.x() * inverse, 1.f), y = dr::select(valid, along.y() * inverse, 0.f);
    const Float side = dr::select(across.y() * x - across.x() * y < 0.f, Float(-1.f), Float(1.f));
    const Vector2f s(x, y), t(-y * side, x * side);
    const auto c = static_cast<ScalarFloat>(cosine_), n = static_cast<ScalarFloat>(sine_);
    return {c * s + n * t, c * t - n * s};
  }

  static Vector3f into(const Frame& f, const Vector3f& v) {
    return {f.s.x() * v.x() + f.s.y() * v.y(), f.t.x() * v.x() + f.t.y() * v.y(), v.z()};
  }

  static Vector3f outOf(const Frame& f, const Vector3f& v) {
    return {f.s.x() * v.x() + f.t.x() * v.y(), f.s.y() * v.x() + f.t.y() * v.y(), v.z()};
  }

  Query queryOf(const SurfaceInteraction3f& si) const {
    // In double precision: far out floats lose texels.
    const Float64 s(si.uv.x()), t(si.uv.y());
    const Float64 u = us_ * s + ut_ * t, v = vs_ * s + vt_ * t;
    Query q;
    q.u = Float(u - dr::floor(u)), q.v = Float(v - dr::floor(v));
    if (sigma_ > 0) {
      q.xx = q.yy = sigma_ * sigma_, q.xy = 0.f;
      return q;
    }
    const Vector2f a = step(si.duv_dx), b = step(si.duv_dy);
    q.xx = a.x() * a.x() + b.x() * b.x(), q.xy = a.x() * a.y() + b.x() * b.y(), q.yy = a.y() * a.y() + b.y() * b.y();
    // Without differentials: the narrowest footprint.
    const Mask missing = !(q.xx + q.yy > 1e-12f);
    const Float narrow = static_cast<ScalarFloat>(fallback_ * fallback_);
    q.xx = dr::select(missing, narrow, q.xx), q.xy = dr::select(missing, 0.f, q.xy), q.yy = dr::select(missing, narrow, q.yy);
    return q;
  }

  /// Half axis of the footprint, texels, of a change of the mesh's uv from pixel to pixel.
  Vector2f step(const Vector2f& d) const {
    constexpr ScalarFloat kFilter = 0.5f, kLongest = 1e15f;
    const auto x = static_cast<ScalarFloat>(kFilter * scale_ * width_), y = static_cast<ScalarFloat>(kFilter * scale_ * height_);
    const Float a = x * (ScalarFloat(us_) * d.x() + ScalarFloat(ut_) * d.y()), b = y * (ScalarFloat(vs_) * d.x() + ScalarFloat(vt_) * d.y());
    const auto finite = [=](const Float& v) { return dr::select(dr::isnan(v), Float(0.f), dr::clip(v, -kLongest, kLongest)); };
    return {finite(a), finite(b)};
  }

  UnpolarizedSpectrum reflectance(const SurfaceInteraction3f& si, const Vector3f& lit, Mask active) const {
    UnpolarizedSpectrum value = 1.f;
    if (!mirror_) {
      const Vector3f h = dr::normalize(si.wi + lit);
      const dr::Complex<UnpolarizedSpectrum> eta(eta_->eval(si, active), k_->eval(si, active));
      value = fresnel_conductor(UnpolarizedSpectrum(dr::dot(si.wi, h)), eta);
    }
    return specular_ ? value * specular_->eval(si, active) : value;
  }

  /// f and pdf, as if facets were perfect mirrors.
  std::pair<Float, Float> evaluate(const Query& q, const Vector3f& viewed, const Vector3f& lit, const Mask& active) const {
    if constexpr (!dr::is_array_v<Float>) {
      const glint_footprint p = {GLINT_FOOTPRINT_GAUSSIAN, q.u, q.v, {q.xx, q.xy, q.yy, 0}};
      float f[3] = {}, pdf = 0;
      glint_brdf_evaluate(brdf_.get(), &p, lit.data(), viewed.data(), f, &pdf);
      return {f[0], pdf};
    } else {
      Inputs in({q.u, q.v, q.xx, q.xy, q.yy, viewed.x(), viewed.y(), viewed.z(), lit.x(), lit.y(), lit.z()}, active);
      std::vector<float> f(3 * in.lanes()), pdf(in.lanes());
      in.inRuns([&](std::size_t first, std::size_t count) {
        const glint_footprints p = in.footprints(first);
        const glint_directions out = in.directions(5, first), inward = in.directions(8, first);
        glint_brdf_evaluate_batch(brdf_.get(), count, &p, &inward, &out, &f[3 * first], &pdf[first]);
      });
      return {in.spread(f.data(), 3), in.spread(pdf.data(), 1)};
    }
  }

  /// Direction, weight and pdf, as if facets were perfect mirrors.
  std::tuple<Vector3f, Float, Float> draw(const Query& q, const Vector3f& viewed, const Point2f& xi, const Mask& active) const {
    if constexpr (!dr::is_array_v<Float>) {
      const glint_footprint p = {GLINT_FOOTPRINT_GAUSSIAN, q.u, q.v, {q.xx, q.xy, q.yy, 0}};
      float lit[3] = {}, weight[3] = {}, pdf = 0;
      glint_brdf_sample(brdf_.get(), &p, viewed.data(), xi.x(), xi.y(), lit, weight, &pdf);
      return {Vector3f(lit[0], lit[1], lit[2]), weight[0], pdf};
    } else {
      Inputs in({q.u, q.v, q.xx, q.xy, q.yy, viewed.x(), viewed.y(), viewed.z(), xi.x(), xi.y()}, active);
      std::vector<float> lit(3 * in.lanes()), weight(3 * in.lanes()), pdf(in.lanes());
      in.inRuns([&](std::size_t first, std::size_t count) {
        const glint_footprints p = in.footprints(first);
        const glint_directions out = in.directions(5, first);
        glint_brdf_sample_batch(brdf_.get(), count, &p, &out, in.column(8, first), in.column(9, first), &lit[3 * first],
                                &weight[3 * first], &pdf[first]);
      });
      return {Vector3f(in.spread(&lit[0], 3), in.spread(&lit[1], 3), in.spread(&lit[2], 3)), in.spread(weight.data(), 3),
              in.spread(pdf.data(), 1)};
    }
  }

  /// Lanes of a wavefront as numbers in memory: the active ones, one after another.
  class Inputs {
   public:
    Inputs(std::vector<Float> columns, const Mask& active) {
      if (jit_flag(JitFlag::SymbolicScope))
        Throw("glint_native: needs evaluated loops and calls. Render with glint_ndf.mitsuba.render(scene), with the integrator "
              "`glint_path`, or inside `with glint_ndf.mitsuba.wavefront():`");
      width_ = dr::width(active);
      for (const Float& column : columns) width_ = std::max(width_, dr::width(column));
      Mask whole = active && dr::full<Mask>(true, width_);
      dr::eval(whole);
      for (Float& column : columns) {
        column += dr::zeros<Float>(width_);
        dr::eval(column);
      }
      dr::sync_thread();
      for (std::size_t k = 0; k < width_; ++k)
        if (dr::detach(whole).data()[k]) lane_.push_back(k);
      for (const Float& column : columns) {
        const float* from = dr::detach(column).data();
        std::vector<float>& to = columns_.emplace_back(lane_.size());
        for (std::size_t k = 0; k < lane_.size(); ++k) to[k] = from[lane_[k]];
      }
    }

    std::size_t lanes() const { return lane_.size(); }

    glint_floats column(std::size_t index, std::size_t first) const { return {columns_[index].data() + first, sizeof(float)}; }

    glint_footprints footprints(std::size_t first) const {
      glint_footprints p = {};
      p.u = column(0, first), p.v = column(1, first), p.xx = column(2, first), p.xy = column(3, first), p.yy = column(4, first);
      return p;
    }

    glint_directions directions(std::size_t index, std::size_t first) const {
      return {column(index, first), column(index + 1, first), column(index + 2, first)};
    }

    /// Calls ask(first, count) for runs of lanes, on all threads.
    template <typename Ask>
    void inRuns(Ask&& ask) const {
      constexpr std::size_t kRun = 4096;
      if (lanes() == 0) return;
      drjit::parallel_for(drjit::blocked_range<std::size_t>(0, lanes(), kRun),
                          [&](const drjit::blocked_range<std::size_t>& run) { ask(run.begin(), run.end() - run.begin()); });
    }

    /// Every `stride`-th answer as a Float of all lanes, 0 where a lane was not asked.
    Float spread(const float* answers, std::size_t stride) const {
      std::vector<float> all(width_, 0.0f);
      for (std::size_t k = 0; k < lane_.size(); ++k) all[lane_[k]] = answers[k * stride];
      return dr::load<Float>(all.data(), width_);
    }

   private:
    std::size_t width_ = 0;
    std::vector<std::size_t> lane_;
    std::vector<std::vector<float>> columns_;
  };

  struct Destroy {
    void operator()(glint_brdf* brdf) const { glint_brdf_destroy(brdf); }
  };

  std::string path_;
  std::unique_ptr<glint_brdf, Destroy> brdf_;
  int width_ = 0, height_ = 0;
  float fallback_ = 0;
  double us_ = 1, ut_ = 0, vs_ = 0, vt_ = 1, cosine_ = 1, sine_ = 0;
  ScalarFloat sigma_ = 0, scale_ = 1;
  ref<Texture> eta_, k_, specular_;
  bool mirror_ = false;
};

namespace {

template <typename Float, typename Spectrum>
void add(PluginRegisterFn add_variant, std::string_view name, const char* variant) {
  using Plugin = GlintNative<Float, Spectrum>;
  add_variant(name, variant, Plugin::Type, [](void*, const Properties& props) -> ref<Object> { return new Plugin(props); });
}

}  // namespace

/// Entry point of Mitsuba. The variants that are tested; each takes a few seconds to compile.
extern "C" MI_EXPORT void init_plugin(std::string_view name, PluginRegisterFn add_variant) {
  using Wavefront = dr::DiffArray<JitBackend::LLVM, float>;
  add<float, Color<float, 3>>(add_variant, name, "scalar_rgb");
  add<float, mitsuba::Spectrum<float, 4>>(add_variant, name, "scalar_spectral");
  add<Wavefront, Color<Wavefront, 3>>(add_variant, name, "llvm_ad_rgb");
  add<Wavefront, mitsuba::Spectrum<Wavefront, 4>>(add_variant, name, "llvm_ad_spectral");
}

NAMESPACE_END(mitsuba)
