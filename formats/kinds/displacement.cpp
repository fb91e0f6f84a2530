#include <cmath>

#include "glint/formats/kinds/codec.h"

namespace glint::formats {
namespace {

std::string pathOf(int level, const char* dataset) { return levelPath("level_{l}/", level) + dataset; }

/// Calls add(level) for each level and collects the results.
template <class Get>
std::vector<double> listed(const Displacement& displacement, Get get) {
  std::vector<double> values;
  for (int l = 0; l < displacement.level_count; ++l) values.push_back(static_cast<double>(get(displacement.levels[l])));
  return values;
}

/// Adds a finding if some of `count` elements are bad.
template <class Bad>
void report(Findings& findings, const char* rule, int level, const char* dataset, std::size_t count, const char* what,
            Bad bad) {
  std::size_t number = 0, first = 0;
  for (std::size_t k = 0; k < count; ++k)
    if (bad(k) && number++ == 0) first = k;
  if (number == 0) return;
  findings.add(rule, "/" + pathOf(level, dataset),
               std::to_string(number) + " " + what + " (first is element " + std::to_string(first) + ")");
}

bool hasColors(const Displacement& d) { return d.level_count > 0 && !d.levels[0].lobe_colors.empty(); }
bool hasAlphas(const Displacement& d) { return d.level_count > 0 && !d.levels[0].lobe_alphas.empty(); }

}  // namespace

PackedAsset pack(const Displacement& displacement) {
  PackedAsset packed{"displacement", {}, {}};
  const Displacement& d = displacement;
  packed.integer("width", d.width);
  packed.integer("height", d.height);
  packed.real("texel_size_um", d.texel_size_um);
  packed.text("base", d.base.kind == BaseBrdf::Kind::diffuse ? "diffuse" : "ggx");
  packed.real("albedo", d.base.albedo);
  packed.real("alpha", d.base.alpha);
  packed.real("eta", d.base.eta);
  packed.real("k", d.base.k);
  packed.integer("rgb", d.channels == 3);
  packed.integer("lobe_count", d.lobe_count);
  packed.integer("has_lobe_colors", hasColors(d));
  packed.integer("has_lobe_alphas", hasAlphas(d));
  packed.integer("angular", d.angular);
  packed.integer("level_count", d.level_count);
  packed.integers("level_factors", listed(d, [](const DisplacementLevel& l) { return l.factor; }));
  packed.integers("level_columns", listed(d, [](const DisplacementLevel& l) { return l.columns; }));
  packed.integers("level_rows", listed(d, [](const DisplacementLevel& l) { return l.rows; }));
  packed.integers("level_spatial_columns", listed(d, [](const DisplacementLevel& l) { return l.spatial_columns; }));
  packed.integers("level_spatial_rows", listed(d, [](const DisplacementLevel& l) { return l.spatial_rows; }));
  packed.reals("level_rank1_residuals", listed(d, [](const DisplacementLevel& l) { return l.rank1_residual; }));
  packed.reals("level_rank1_energies", listed(d, [](const DisplacementLevel& l) { return l.rank1_energy; }));
  packed.reals("level_interreflected", listed(d, [](const DisplacementLevel& l) { return l.interreflected_share; }));
  packed.reals("level_distant", listed(d, [](const DisplacementLevel& l) { return l.distant_share; }));
  const auto directions = static_cast<std::uint64_t>(d.angular) * static_cast<std::uint64_t>(d.angular);
  const auto channels = static_cast<std::uint64_t>(d.channels), lobes = static_cast<std::uint64_t>(d.lobe_count);
  for (int l = 0; l < d.level_count; ++l) {
    const DisplacementLevel& level = d.levels[l];
    const auto rows = static_cast<std::uint64_t>(level.rows), columns = static_cast<std::uint64_t>(level.columns);
    packed.array(pathOf(l, "heights"), ElementType::f32, {rows, columns}, level.heights.data(), level.heights.size());
    packed.array(pathOf(l, "lobes"), ElementType::f32, {rows, columns, lobes, 4}, level.lobes.data(), 4 * level.lobes.size());
    packed.array(pathOf(l, "slopes"), ElementType::f32, {rows, columns, 5}, level.slopes.data(), 5 * level.slopes.size());
    packed.array(pathOf(l, "fit_errors"), ElementType::f32, {rows, columns}, level.fit_errors.data(), level.fit_errors.size());
    packed.array(pathOf(l, "spatial_scale"), ElementType::f32,
                 {static_cast<std::uint64_t>(level.spatial_rows), static_cast<std::uint64_t>(level.spatial_columns), channels},
                 level.spatial_scale.data(), level.spatial_scale.size());
    packed.array(pathOf(l, "angular_scale"), ElementType::f16, {directions * (directions + 1) / 2, channels},
                 level.angular_scale.data(), level.angular_scale.size());
    if (hasColors(d))
      packed.array(pathOf(l, "lobe_colors"), ElementType::f32, {rows, columns, lobes, channels}, level.lobe_colors.data(),
                   level.lobe_colors.size());
    if (hasAlphas(d))
      packed.array(pathOf(l, "lobe_alphas"), ElementType::f32, {rows, columns, lobes}, level.lobe_alphas.data(),
                   level.lobe_alphas.size());
  }
  return packed;
}

void unpack(const Content& content, Displacement& displacement) {
  displacement.width = content.integer("width");
  displacement.height = content.integer("height");
  displacement.texel_size_um = content.real("texel_size_um");
  displacement.base.kind = content.is("base", "diffuse") ? BaseBrdf::Kind::diffuse : BaseBrdf::Kind::ggx;
  displacement.base.albedo = content.real("albedo");
  displacement.base.alpha = content.real("alpha");
  displacement.base.eta = content.real("eta");
  displacement.base.k = content.real("k");
  displacement.channels = content.integer("rgb") == 1 ? 3 : 1;
  displacement.lobe_count = content.integer("lobe_count");
  displacement.angular = content.integer("angular");
  displacement.level_count = content.integer("level_count");
  for (int l = 0; l < displacement.level_count; ++l) {
    DisplacementLevel& level = displacement.levels[l];
    level.factor = content.integer("level_factors", l);
    level.columns = content.integer("level_columns", l);
    level.rows = content.integer("level_rows", l);
    level.spatial_columns = content.integer("level_spatial_columns", l);
    level.spatial_rows = content.integer("level_spatial_rows", l);
    level.rank1_residual = content.real("level_rank1_residuals", l);
    level.rank1_energy = content.real("level_rank1_energies", l);
    level.interreflected_share = content.real("level_interreflected", l);
    level.distant_share = content.real("level_distant", l);
    level.heights = content.array<float>(pathOf(l, "heights"));
    level.lobes = content.array<VmfLobe>(pathOf(l, "lobes"));
    level.slopes = content.array<MapSlopes>(pathOf(l, "slopes"));
    level.fit_errors = content.array<float>(pathOf(l, "fit_errors"));
    level.spatial_scale = content.array<float>(pathOf(l, "spatial_scale"));
    level.angular_scale = content.array<std::uint16_t>(pathOf(l, "angular_scale"));
    if (content.integer("has_lobe_colors") == 1) level.lobe_colors = content.array<float>(pathOf(l, "lobe_colors"));
    if (content.integer("has_lobe_alphas") == 1) level.lobe_alphas = content.array<float>(pathOf(l, "lobe_alphas"));
  }
}

void checkIndex(const Displacement& displacement, Findings& findings) {
  for (int l = 0; l < displacement.level_count; ++l) {
    const DisplacementLevel& level = displacement.levels[l];
    const auto covers = [&](int cells, int texels) { return static_cast<std::int64_t>(cells) * level.factor == texels; };
    if (covers(level.columns, displacement.width) && covers(level.rows, displacement.height) &&
        (l == 0 || level.factor > displacement.levels[l - 1].factor))
      continue;
    findings.add("displacement.levels", "/@level_factors",
                 "level " + std::to_string(l) + " has " + std::to_string(level.columns) + " x " + std::to_string(level.rows) +
                     " cells of " + std::to_string(level.factor) + " texels on a map of " + std::to_string(displacement.width) +
                     " x " + std::to_string(displacement.height));
  }
}

void checkData(const Displacement& displacement, Findings& findings) {
  for (int l = 0; l < displacement.level_count; ++l) {
    const DisplacementLevel& level = displacement.levels[l];
    report(findings, "displacement.heights", l, "heights", level.heights.size(), "heights are not finite",
           [&](std::size_t k) { return !std::isfinite(level.heights[k]); });
    report(findings, "displacement.lobes", l, "lobes", level.lobes.size(), "lobes are out of range", [&](std::size_t k) {
      const VmfLobe& lobe = level.lobes[k];
      return !(dot(lobe.mu, lobe.mu) <= 1 && lobe.kappa >= 0 && lobe.kappa <= kMaxKappa && lobe.amplitude >= 0 &&
               std::isfinite(lobe.amplitude));
    });
    report(findings, "displacement.bases", l, "lobe_colors", level.lobe_colors.size(), "colours are out of range",
           [&](std::size_t k) { return !(level.lobe_colors[k] >= 0 && level.lobe_colors[k] <= 1); });
    report(findings, "displacement.bases", l, "lobe_alphas", level.lobe_alphas.size(), "alphas are out of range",
           [&](std::size_t k) { return !(level.lobe_alphas[k] > 0 && level.lobe_alphas[k] <= 1); });
    report(findings, "displacement.moments", l, "slopes", level.slopes.size(), "cells have moments that are not finite",
           [&](std::size_t k) {
             const MapSlopes& m = level.slopes[k];
             return !std::isfinite(m.mean.x + m.mean.y + m.covariance.xx + m.covariance.xy + m.covariance.yy);
           });
    report(findings, "displacement.moments", l, "fit_errors", level.fit_errors.size(), "errors are not finite",
           [&](std::size_t k) { return !std::isfinite(level.fit_errors[k]); });
    report(findings, "displacement.scales", l, "spatial_scale", level.spatial_scale.size(),
           "factors are negative or not finite",
           [&](std::size_t k) { return !(std::isfinite(level.spatial_scale[k]) && level.spatial_scale[k] >= 0); });
    report(
        findings, "displacement.scales", l, "angular_scale", level.angular_scale.size(), "factors are negative or not finite",
        [&](std::size_t k) { return (level.angular_scale[k] & 0x7c00) == 0x7c00 || (level.angular_scale[k] & 0x8000) != 0; });
  }
}

}  // namespace glint::formats
