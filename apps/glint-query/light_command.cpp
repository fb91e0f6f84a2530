#include "glint-query/light_command.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <type_traits>

#include "common/files.h"
#include "glint/bake/sh/lobes.h"
#include "glint/formats/asset_reader.h"

namespace glint::apps {
namespace {

/// The texels of a footprint as a histogram of one bin each: exact, and as slow as their number.
class TexelHistogram {
 public:
  TexelHistogram(const Reference& reference, const Footprint& footprint) {
    const double total = reference.forEachTexel(footprint, [&](float weight, Vec2 normal) {
      weights_.push_back(weight);
      normals_.push_back(normal);
    });
    for (float& weight : weights_) weight = static_cast<float>(weight / total);
  }
  template <class Visitor>
  void forEachBin(const Footprint&, Visitor&& visitor) const {
    for (std::size_t k = 0; k < weights_.size(); ++k) visitor(static_cast<int>(k), weights_[k]);
  }
  Vec2 binNormal(int bin) const { return normals_[static_cast<std::size_t>(bin)]; }

 private:
  std::vector<float> weights_;
  std::vector<Vec2> normals_;
};

template <class T, class Histogram>
ShLightIntegral integrate(const ShLight& light, std::span<const float> zonal, float sigma_r, const Histogram& histogram,
                          const Footprint& footprint, Vec3 wo, const ShLightOptions& options) {
  const int order = std::min(light.order, static_cast<int>(zonal.size()) - 1);
  std::vector<T> memory(ShRecurrence<T>::size(order)), scratch(ShLightQuery<T>::scratchSize(order));
  const ShRecurrence<T> recurrence(order, memory);
  return ShLightQuery<T>(light, zonal, recurrence, sigma_r).integral(histogram, footprint, {}, wo, options, scratch);
}

}  // namespace

LightCommand::LightCommand(Tool& tool) : tool_(tool) {
  tool.section("Light (kinds normals and histogram-sat)");
  const Option& light = tool.option(
      "--light", path_, "ask for the light that the footprint reflects: table of kind sh-light, in the frame of the surface");
  tool.option("--lobes", lobes_path_, "--light: asset of kind sh-lobes whose roughness is taken instead of --sigma-r")
      .needs(light);
  tool.option("--order", options_.order, "--light: highest band that is summed")
      .range(0, kMaxShOrder)
      .defaultText("the table's")
      .needs(light);
  tool.choice("--window", options_.window, {{"none", ShWindow::none}, {"lanczos", ShWindow::lanczos}, {"hann", ShWindow::hann}},
              "--light: weights of the bands: none is sharpest, the others ring less around bright light");
  tool.option("--tolerance", options_.tolerance, "--light: leave out bands that change less than this share of the mean light")
      .range(0, 1)
      .needs(light);
  const Option& fresnel = tool.option("--fresnel", fresnel_, "--light: reflectance R G B at the angle of --wo")
                              .count(3)
                              .range(0, 1)
                              .defaultText("1 1 1")
                              .needs(light);
  const Option& ior = tool.option("--ior", ior_, "--light: instead of --fresnel, refractive index of a dielectric")
                          .range(1e-3, 1e3)
                          .defaultText("none")
                          .needs(light)
                          .excludes(fresnel);
  Option& eta = tool.option("--eta", eta_, "--light: instead of --fresnel, refractive index R G B of a metal; needs --k")
                    .count(3)
                    .range(0, 1e3)
                    .needs(light)
                    .excludes(fresnel)
                    .excludes(ior);
  eta.needs(tool.option("--k", k_, "--light: extinction R G B of a metal").count(3).range(0, 1e3).needs(eta));
  const Option& shadowing =
      tool.option("--shadowing", shadowing_, "--light: G of --wo and its mirror direction").range(0, 1).needs(light);
  tool.flag("--smith", smith_, "--light: instead of --shadowing, G by the slopes of the map").needs(light).excludes(shadowing);
  tool.addCheck([this] { check(); });
}

void LightCommand::check() const {
  if (!asked()) return;
  checkRegular(path_);
  tool_.addInput(path_);
  if (lobes_path_.empty()) return;
  checkRegular(lobes_path_);
  tool_.addInput(lobes_path_);
}

LightCommand::Lobe LightCommand::lobe(const NdfAsset& asset, int order) const {
  if (!lobes_path_.empty()) {
    const formats::Asset lobes = formats::Asset::openForBuilding(lobes_path_);
    return {{lobes.get<ShLobes>().zonal.begin(), lobes.get<ShLobes>().zonal.end()}, lobes.get<ShLobes>().sigma_r};
  }
  const std::vector<double> f = bake::zonalLobe(asset.facetRoughness(), order);
  return {{f.begin(), f.end()}, asset.facetRoughness()};
}

Rgb LightCommand::transfer(const NdfAsset& asset, float sigma_r, Vec3 wo) const {
  const Rgb given = {fresnel_[0], fresnel_[1], fresnel_[2]};
  Fresnel fresnel = Fresnel::mirror();
  if (ior_ > 0) fresnel = Fresnel::dielectric(ior_);
  if (!eta_.empty()) fresnel = Fresnel::conductor({eta_[0], eta_[1], eta_[2]}, {k_[0], k_[1], k_[2]});
  if (!smith_) return transferFactor(1, shadowing_, wo.z) * (given * fresnel.reflectance(wo.z));
  return given * transferFactor(fresnel, SmithMasking(asset.slopes(), sigma_r), wo);
}

void LightCommand::report(const ShLightIntegral& integral, Rgb transfer) {
  const Rgb value = {integral.value[0], integral.value[1], integral.value[2]}, radiance = transfer * value;
  tool_.print(fmt::format("{:.6g} {:.6g} {:.6g}\n", radiance.r, radiance.g, radiance.b));
  if (integral.clamped)
    tool_.warn("the series falls below zero and was clamped: ask for a higher order or for --window lanczos");
  tool_.setResult({{"radiance", {radiance.r, radiance.g, radiance.b}},
                   {"transfer", {transfer.r, transfer.g, transfer.b}},
                   {"light_integral", integral.value},
                   {"signed_light_integral", integral.signed_value},
                   {"clamped", integral.clamped},
                   {"order", integral.order}});
}

void LightCommand::run(const NdfAsset& asset, const Footprint& footprint, Vec3 wo) {
  if (asset.info().surface != Surface::flat)
    throw Error(ErrorCode::unsupported, "query.light", "", "--surface", "light is summed over facets, not over smooth surfaces",
                "leave out --surface smooth");
  const formats::Asset light_asset = formats::Asset::openForBuilding(path_);
  const ShLight& light = light_asset.get<ShLight>();
  const Lobe lobe = this->lobe(asset, light.order);
  const auto ask = [&](const auto& histogram) {
    return light.order <= kShFloatOrder
               ? integrate<float>(light, lobe.zonal, lobe.sigma_r, histogram, footprint, wo, options_)
               : integrate<double>(light, lobe.zonal, lobe.sigma_r, histogram, footprint, wo, options_);
  };
  const ShLightIntegral integral = std::visit(
      [&](const auto& m) -> ShLightIntegral {
        using Model = std::decay_t<decltype(m)>;
        if constexpr (std::is_same_v<Model, Reference>)
          return ask(TexelHistogram(m, footprint));
        else if constexpr (requires { m.binNormal(0); })
          return ask(m);
        else
          throw Error(ErrorCode::unsupported, "query.light", "", "",
                      "this kind of asset cannot list the normals of a footprint", "ask the normals, or a histogram of them");
      },
      asset.model());
  report(integral, transfer(asset, lobe.sigma_r, wo));
}

}  // namespace glint::apps
