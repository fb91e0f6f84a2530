#include "glint-query/light_query.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <type_traits>

#include "common/files.h"
#include "glint/bake/sh_lobes.h"
#include "glint/formats/asset_reader.h"
#include "glint/query/sh_transfer.h"

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

LightQuery::LightQuery(Tool& tool) : tool_(tool) {
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
  tool.option("--fresnel", fresnel_, "--light: reflectance R G B at the angle of --wo")
      .count(3)
      .range(0, 1)
      .defaultText("1 1 1")
      .needs(light);
  tool.option("--shadowing", shadowing_, "--light: G of --wo and its mirror direction").range(0, 1).needs(light);
  tool.addCheck([this] { check(); });
}

void LightQuery::check() const {
  if (!asked()) return;
  checkReadable(path_);
  if (!lobes_path_.empty()) checkReadable(lobes_path_);
}

void LightQuery::run(const AnyNdf& model, const api::NdfInfo& info, const Footprint& footprint, Vec3 wo) {
  if (info.surface != Surface::flat)
    throw Error(ErrorCode::unsupported, "query.light", "", "--surface", "light is summed over facets, not over smooth surfaces",
                "leave out --surface smooth");
  float sigma_r = info.sigma_r;
  const formats::Asset asset = formats::Asset::open(path_);
  const ShLight& light = asset.shLight();
  std::vector<float> zonal;
  if (!lobes_path_.empty()) {
    const formats::Asset lobes = formats::Asset::open(lobes_path_);
    zonal.assign(lobes.shLobes().zonal.begin(), lobes.shLobes().zonal.end());
    sigma_r = lobes.shLobes().sigma_r;
  } else {
    const std::vector<double> f = bake::zonalLobe(sigma_r, light.order);
    zonal.assign(f.begin(), f.end());
  }
  const auto ask = [&](const auto& histogram) {
    return light.order <= kShFloatOrder ? integrate<float>(light, zonal, sigma_r, histogram, footprint, wo, options_)
                                        : integrate<double>(light, zonal, sigma_r, histogram, footprint, wo, options_);
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
      model);

  nlohmann::json radiance = nlohmann::json::array(), signed_integral = nlohmann::json::array(), value = nlohmann::json::array();
  for (std::size_t c = 0; c < 3; ++c) {
    value.push_back(integral.value[c]);
    signed_integral.push_back(integral.signed_value[c]);
    radiance.push_back(transferFactor(fresnel_[c], shadowing_, wo.z) * integral.value[c]);
  }
  tool_.print(
      fmt::format("{:.6g} {:.6g} {:.6g}\n", radiance[0].get<float>(), radiance[1].get<float>(), radiance[2].get<float>()));
  if (integral.clamped)
    tool_.warn("the series falls below zero and was clamped: ask for a higher order or for --window lanczos");
  tool_.setResult({{"radiance", radiance},
                   {"light_integral", value},
                   {"signed_light_integral", signed_integral},
                   {"clamped", integral.clamped},
                   {"order", integral.order}});
}

}  // namespace glint::apps
