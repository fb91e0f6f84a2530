#include "glint-query/light_command.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>
#include <type_traits>

#include "common/files.h"
#include "common/input_asset.h"
#include "glint-query/command_forms.h"
#include "glint-query/directions.h"
#include "glint/bake/sh/lobes.h"

namespace glint::apps {
namespace {

/// Whether a model lists the normals of a footprint, as texels or as bins.
template <class Model>
constexpr bool kListsNormals = std::is_same_v<Model, Reference> || requires(const Model& model) {
  model.binNormal(0);
};

std::vector<std::string_view> kindsThatListNormals() {
  std::vector<std::string_view> kinds;
  api::NdfModels::forEach([&]<class Model>(std::type_identity<Model>) {
    if (kListsNormals<Model>) kinds.push_back(api::NdfTraits<Model>::kKind);
  });
  return kinds;
}

/// The texels of a footprint as a histogram with a bin for each texel: exact, O(texels of the footprint).
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

LightCommand::LightCommand(Tool& tool)
    : tool_(tool), asset_(tool, {.kinds = kindsThatListNormals(), .smooth_surfaces = false}), footprint_(tool) {
  footprint_.centreOption().required();
  tool.option("--light", path_, "light: table of kind sh-light, in the frame of the surface").required();
  tool.option("--wo", wo_, "outgoing direction X Y Z, z out of the surface").count(3).required();
  tool.option("--lobes", lobes_path_, "asset of kind sh-lobes whose roughness is taken instead of --sigma-r");
  tool.option("--order", options_.order, "highest band that is summed").range(0, kMaxShOrder).defaultText("the table's");
  tool.choice("--window", options_.window, {{"none", ShWindow::none}, {"lanczos", ShWindow::lanczos}, {"hann", ShWindow::hann}},
              "weights of the bands: none is sharpest, the others ring less around bright light");
  tool.option("--tolerance", options_.tolerance, "leave out bands that change less than this share of the mean light")
      .range(0, 1);
  tool.option("--ndf-epsilon", options_.ndf_epsilon,
              "leave out bands in which all coefficients of the footprint's normals are at most this share of their mean; e.g. "
              "1e-6. Sums of more than 128 bands leave out none")
      .range(0, 1);
  addReflectance();
  for (const CommandForm& form : {kDistributionForm, kReflectanceForm}) tool.pointTo(form.line, form.options);
  tool.addCheck([this] { check(); });
}

void LightCommand::addReflectance() {
  const Option& fresnel =
      tool_.option("--fresnel", fresnel_, "reflectance R G B at the angle of --wo").count(3).range(0, 1).defaultText("1 1 1");
  const Option& ior = tool_.option("--ior", ior_, "instead of --fresnel, refractive index of a dielectric")
                          .range(1e-3, 1e3)
                          .defaultText("none")
                          .excludes(fresnel);
  Option& eta = tool_.option("--eta", eta_, "instead of --fresnel, refractive index R G B of a metal; needs --k")
                    .count(3)
                    .range(0, 1e3)
                    .excludes(fresnel)
                    .excludes(ior);
  eta.needs(tool_.option("--k", k_, "extinction R G B of a metal").count(3).range(0, 1e3).needs(eta));
  const Option& shadowing = tool_.option("--shadowing", shadowing_, "G of --wo and its mirror direction").range(0, 1);
  tool_.flag("--smith", smith_, "instead of --shadowing, G by the slopes of the map").excludes(shadowing);
}

void LightCommand::check() const {
  footprint_.check();
  if (!(wo_[2] > 0))
    throw Error(ErrorCode::usage, "query.arguments", "", "--wo", "the outgoing direction is not above the surface",
                "give X Y Z with Z > 0");
  checkRegular(path_);
  tool_.addInput(path_);
  if (lobes_path_.empty()) return;
  checkRegular(lobes_path_);
  tool_.addInput(lobes_path_);
}

void LightCommand::run() {
  asset_.open(inputChecks(tool_));
  if (const auto fault = asset_.unanswerable(footprint_.footprint()))
    throw Error(ErrorCode::usage, "query.footprint", asset_.path(), "", fault->what, fault->remedy);
  const formats::Asset light_asset = openInput(tool_, path_);
  const ShLight& light = light_asset.get<ShLight>();
  const Lobe facets = lobe(light.order);
  const Vec3 wo = directionOf(wo_, "--wo");
  report(integral(light, facets, wo), transfer(facets.sigma_r, wo));
}

LightCommand::Lobe LightCommand::lobe(int order) const {
  if (!lobes_path_.empty()) {
    const formats::Asset lobes = openInput(tool_, lobes_path_);
    return {{lobes.get<ShLobes>().zonal.begin(), lobes.get<ShLobes>().zonal.end()}, lobes.get<ShLobes>().sigma_r};
  }
  const std::vector<double> f = bake::zonalLobe(asset_.facetRoughness(), order);
  return {{f.begin(), f.end()}, asset_.facetRoughness()};
}

ShLightIntegral LightCommand::integral(const ShLight& light, const Lobe& lobe, Vec3 wo) const {
  const Footprint footprint = footprint_.footprint();
  const auto ask = [&](const auto& histogram) {
    return light.order <= kShFloatOrder
               ? integrate<float>(light, lobe.zonal, lobe.sigma_r, histogram, footprint, wo, options_)
               : integrate<double>(light, lobe.zonal, lobe.sigma_r, histogram, footprint, wo, options_);
  };
  return std::visit(
      [&]<class Model>(const Model& model) -> ShLightIntegral {
        if constexpr (std::is_same_v<Model, Reference>)
          return ask(TexelHistogram(model, footprint));
        else if constexpr (kListsNormals<Model>)
          return ask(model);
        else
          throw std::logic_error("a model that lists no normals was opened");
      },
      asset_.model());
}

Rgb LightCommand::transfer(float sigma_r, Vec3 wo) const {
  const Rgb given = {fresnel_[0], fresnel_[1], fresnel_[2]};
  Fresnel fresnel = Fresnel::mirror();
  if (ior_ > 0) fresnel = Fresnel::dielectric(ior_);
  if (!eta_.empty()) fresnel = Fresnel::conductor({eta_[0], eta_[1], eta_[2]}, {k_[0], k_[1], k_[2]});
  if (!smith_) return transferFactor(1, shadowing_, wo.z) * (given * fresnel.reflectance(wo.z));
  return given * transferFactor(fresnel, SmithMasking(asset_.slopes(), sigma_r), wo);
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

}  // namespace glint::apps
