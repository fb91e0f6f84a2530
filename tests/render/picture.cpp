#include "picture.h"

#include <OpenImageIO/imageio.h>
#include <tbb/parallel_for.h>

#include <array>
#include <span>
#include <stdexcept>
#include <variant>

#include "glint/query/brdf/microfacet_brdf.h"
#include "glint/query/curved_ndf.h"
#include "glint/query/ray_footprint.h"

namespace render {
namespace {

using glint::Footprint;

/// Towards the light: behind the square and above, so that the middle of the square mirrors it to the eye.
constexpr Vec3 kToLight = {0.06f, 0.705f, 0.7067f};

/// A tangent frame of the surface, as half vectors and normals of the map are given in.
struct Frame {
  explicit Frame(const Hit& hit) : s(normalized(hit.dpdu)), t(cross(hit.normal, s)), n(hit.normal) {}
  Vec3 local(Vec3 w) const { return {dot(w, s), dot(w, t), dot(w, n)}; }
  Vec3 s, t, n;
};

/// What a pixel, or one sample of it, sees.
struct Sample {
  bool covered = false;
  std::array<float, kMostLights> radiance{};
  Vec2 half;
  float sigma = 0;
};

/// Parts of all lights together.
constexpr std::size_t kMostParts = kMostLights * DiskLight::kMostParts;
using Means = std::array<double, kMostParts>;

/// Mean density over the half vectors of each part of a light.
template <glint::NdfModel M>
Means meansOver(const M& model, float /*sigma_r*/, const Footprint& footprint, std::span<const LightPart> parts) {
  Means means{};
  for (std::size_t k = 0; k < parts.size(); ++k)
    if (parts[k].share > 0) means[k] = model.mean(footprint, parts[k].range);
  return means;
}

/// The same by brute force. Visits the texels of a footprint once for all parts, because their weights cost most.
Means meansOver(const glint::Reference& model, float sigma_r, const Footprint& footprint, std::span<const LightPart> parts) {
  const float reach = glint::kLobeReach * sigma_r;
  glint::Box2 all = parts[0].range;
  for (const LightPart& part : parts)
    all = {{std::min(all.low.x, part.range.low.x), std::min(all.low.y, part.range.low.y)},
           {std::max(all.high.x, part.range.high.x), std::max(all.high.y, part.range.high.y)}};
  Means means{};
  const double total = model.forEachTexel(footprint, [&](float weight, Vec2 normal) {
    if (!glint::near(all, normal, normal, reach)) return;
    for (std::size_t k = 0; k < parts.size(); ++k)
      if (glint::near(parts[k].range, normal, normal, reach))
        means[k] += double{weight} * glint::lobeMass(parts[k].range, normal, sigma_r);
  });
  for (std::size_t k = 0; k < parts.size(); ++k) means[k] /= total * parts[k].range.area();
  return means;
}

template <glint::NdfModel M>
class Integrator {
 public:
  Integrator(const M& model, const glint::api::OpenedNdf& ndf, const Options& options)
      : model_(model),
        width_(ndf.info().width),
        height_(ndf.info().height),
        sigma_r_(ndf.info().sigma_r),
        masking_(ndf.slopes(), sigma_r_),
        options_(options),
        camera_(options.distance, options.size),
        scene_(options.shape, options.distance),
        filter_sigma_(filterOfSample(options.samples)) {
    for (const float diameter : options.lights) lights_.emplace_back(diameter);
  }

  int lightParts() const {
    int sum = 0;
    for (const DiskLight& light : lights_) sum += light.partCount();
    return sum;
  }

  /// Position in pixels from the left and the top.
  Sample sample(float x, float y) const {
    const Ray ray = camera_.ray(x, y);
    const std::optional<Hit> hit = scene_.intersect(ray);
    if (!hit) return {};
    const Frame frame(*hit);
    const Vec3 wo = frame.local(-1.0f * ray.direction), axis = frame.local(normalized(kToLight));
    Sample result;
    result.covered = true;
    const Footprint footprint = footprintOf(ray, *hit);
    const glint::Covariance& c = footprint.covariance;
    result.sigma = std::sqrt(std::sqrt(std::max(0.0f, c.xx * c.yy - c.xy * c.xy)));
    if (!glint::aboveHorizon(wo) || !glint::aboveHorizon(axis)) return result;
    const glint::HalfVector h = glint::halfVectorOf(axis, wo);
    result.half = h.disk;
    result.radiance = reflected(footprint, spreadOf(ray, *hit, frame, h), axis, wo);
    return result;
  }

 private:
  /// Deviation of the footprint of one of n x n samples, so that all samples together filter as one sample of half a pixel.
  static float filterOfSample(int n) {
    constexpr float kPixel = glint::kPixelFilterSigma;
    return std::sqrt(kPixel * kPixel - (1 - 1 / static_cast<float>(n * n)) / 12);
  }

  /// The image of the pixel's filter in texture space, or a round one of a given size.
  Footprint footprintOf(const Ray& ray, const Hit& hit) const {
    Vec2 dx = glint::uvDifferential(hit.dpdu, hit.dpdv, stepOnSurface(ray, hit, ray.dx));
    Vec2 dy = glint::uvDifferential(hit.dpdu, hit.dpdv, stepOnSurface(ray, hit, ray.dy));
    if (options_.sigma > 0) {
      dx = {options_.sigma / (filter_sigma_ * static_cast<float>(width_)), 0};
      dy = {0, options_.sigma / (filter_sigma_ * static_cast<float>(height_))};
    }
    if (options_.filter == Filter::gaussian)
      return glint::footprintFromDifferentials(hit.uv, dx, dy, width_, height_, filter_sigma_);
    const float half = std::sqrt(3.0f) * filter_sigma_;  // half side of a square of the same second moments, pixels
    const float u = half * static_cast<float>(width_), v = half * static_cast<float>(height_);
    return Footprint::box(hit.uv, {u * dx.x, v * dx.y}, {u * dy.x, v * dy.y});
  }

  /// Half widths of the box of half vectors of the pixel.
  Vec2 spreadOf(const Ray& ray, const Hit& hit, const Frame& frame, const glint::HalfVector& h) const {
    if (!options_.curvature) return {};
    const auto turn = [&](Vec3 step) {
      const Vec3 dn = frame.local(hit.curvature * stepOnSurface(ray, hit, step));
      return glint::halfVectorDifferential(h, dn, frame.local(-1.0f * step));
    };
    return glint::halfVectorSpread(turn(ray.dx), turn(ray.dy), filter_sigma_);
  }

  std::array<float, kMostLights> reflected(const Footprint& footprint, Vec2 spread, Vec3 axis, Vec3 wo) const {
    const glint::MicrofacetBrdf<M> brdf(model_, footprint, masking_, glint::Fresnel::mirror());
    std::array<LightPart, kMostParts> parts;
    std::size_t count = 0;
    for (const DiskLight& light : lights_) count += light.parts(axis, wo, std::span(parts).subspan(count));
    const auto asked = std::span(parts).first(count);
    const bool curved = spread.x > 0 || spread.y > 0;
    const Means means = curved ? meansOver(glint::CurvedNdf<M>(model_, spread), sigma_r_, footprint, asked)
                               : meansOver(model_, sigma_r_, footprint, asked);
    std::array<float, kMostLights> radiance{};
    std::size_t next = 0;
    for (std::size_t l = 0; l < lights_.size(); ++l) {
      double sum = 0;
      for (int k = 0; k < lights_[l].partCount(); ++k, ++next) {
        const LightPart& part = parts[next];
        if (part.share > 0) sum += double{part.share} * means[next] * brdf.response(part.wi, wo, part.h).g * part.wi.z;
      }
      radiance[l] = static_cast<float>(sum);
    }
    return radiance;
  }

  const M& model_;
  int width_, height_;
  float sigma_r_;
  glint::SmithMasking masking_;
  Options options_;
  Camera camera_;
  Scene scene_;
  std::vector<DiskLight> lights_;
  float filter_sigma_;
};

/// Mean over the samples of a pixel.
template <class M>
Sample pixel(const Integrator<M>& integrator, const Options& options, int x, int y) {
  const int n = options.samples;
  const float step = 1 / static_cast<float>(n), scale = step * step;
  Sample mean;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const float at_x = static_cast<float>(x) + (static_cast<float>(i) + 0.5f) * step + options.shift.x;
      const float at_y = static_cast<float>(y) + (static_cast<float>(j) + 0.5f) * step + options.shift.y;
      const Sample s = integrator.sample(at_x, at_y);
      mean.covered |= s.covered;
      for (std::size_t l = 0; l < kMostLights; ++l) mean.radiance[l] += scale * s.radiance[l];
      mean.half = mean.half + scale * s.half;
      mean.sigma += scale * s.sigma;
    }
  }
  return mean;
}

/// Sums are over rows from the top, whatever the number of threads.
Picture pictureOf(const std::vector<Sample>& samples, const Options& options) {
  const std::size_t lights = options.lights.size();
  Picture picture;
  picture.size = options.size;
  picture.channels = static_cast<int>(lights) + Picture::kPlaceChannels;
  picture.mean_radiance.assign(lights, 0);
  for (const Sample& s : samples) {
    for (std::size_t l = 0; l < lights; ++l) {
      picture.pixels.push_back(s.radiance[l]);
      picture.mean_radiance[l] += s.radiance[l];
    }
    picture.pixels.insert(picture.pixels.end(), {s.half.x, s.half.y, s.sigma});
    picture.covered += s.covered;
  }
  for (double& mean : picture.mean_radiance) mean /= std::max(1, picture.covered);
  return picture;
}

template <class M>
Picture renderModel(const M& model, const glint::api::OpenedNdf& ndf, const Options& options) {
  const Integrator<M> integrator(model, ndf, options);
  const auto size = static_cast<std::size_t>(options.size);
  std::vector<Sample> samples(size * size);
  tbb::parallel_for(std::size_t{0}, size, [&](std::size_t y) {
    for (std::size_t x = 0; x < size; ++x)
      samples[y * size + x] = pixel(integrator, options, static_cast<int>(x), static_cast<int>(y));
  });
  Picture picture = pictureOf(samples, options);
  picture.means = integrator.lightParts();
  return picture;
}

}  // namespace

Picture render(const glint::api::OpenedNdf& ndf, const Options& options) {
  return std::visit([&](const auto& model) { return renderModel(model, ndf, options); }, ndf.model());
}

void write(const Picture& picture, const std::string& path) {
  OIIO::ImageSpec spec(picture.size, picture.size, picture.channels, OIIO::TypeDesc::FLOAT);
  spec.channelnames.clear();
  for (int l = 0; l < picture.channels - Picture::kPlaceChannels; ++l)
    spec.channelnames.push_back("radiance." + std::to_string(l));
  spec.channelnames.insert(spec.channelnames.end(), {"half.x", "half.y", "sigma"});
  const auto file = OIIO::ImageOutput::create(path);
  if (!file || !file->open(path, spec) || !file->write_image(OIIO::TypeDesc::FLOAT, picture.pixels.data()) || !file->close())
    throw std::runtime_error(path + ": " + (file ? file->geterror() : OIIO::geterror()));
}

}  // namespace render
