#pragma once

#include <cmath>

#include "glint/api/any_ndf.h"

namespace glint::api {

/// Calls ask(model) with the model of a wave-pyramid or a wave-cp, or other() for every other model.
template <class Ask, class Other>
auto askWave(const AnyNdf& model, Ask&& ask, Other&& other) {
  if (const auto* wave = std::get_if<AnisotropicNdf<WaveNdf>>(&model)) return ask(*wave);
  if (const auto* wave = std::get_if<AnisotropicNdf<WaveCpNdf>>(&model)) return ask(*wave);
  return other();
}

/// Whether a model is a distribution of psi, with channels.
inline bool isWave(const AnyNdf& model) {
  return askWave(
      model, [](const auto&) { return true; }, [] { return false; });
}

/// Channels of a model: those of a wave-pyramid or wave-cp; 1 for every other model.
inline int channelCount(const AnyNdf& model) {
  return askWave(
      model, [](const auto& wave) { return wave.round().channels(); }, [] { return 1; });
}

/// Density in linear sRGB towards psi (WaveNdf::densityRgb). Models without colours: their density, grey. Finite: colours that the
/// numbers of a file overflow are 0.
inline Rgb densityRgb(const AnyNdf& model, const Footprint& p, Vec2 psi) {
  const Rgb rgb = askWave(
      model, [&](const auto& wave) { return wave.densityRgb(p, psi); }, [&] { return Rgb::grey(model.density(p, psi)); });
  return std::isfinite(rgb.r) && std::isfinite(rgb.g) && std::isfinite(rgb.b) ? rgb : Rgb{};
}

/// Density of each channel towards psi (WaveNdf::densitySpectrum). Models without channels: their density.
/// @param out  [channelCount(model)]
inline void densitySpectrum(const AnyNdf& model, const Footprint& p, Vec2 psi, float* out) {
  askWave(
      model, [&](const auto& wave) { wave.densitySpectrum(p, psi, out); }, [&] { *out = model.density(p, psi); });
}

}  // namespace glint::api
