#pragma once

#include <vector>

#include "glint/bake/sh/environment.h"
#include "glint/model/sh.h"
#include "glint/query/light/sh_window.h"

namespace glint::apps {

/// Intrinsic roughness of the facet that sunAnswers asks.
inline constexpr float kSunSigmaR = 0.05f;

/// A sun of 1.5 degrees of radius, at 40 degrees from the zenith in darkness.
bake::Environment sunLight();

/// Light that a facet that faces up reflects to views in the plane of the sun, from 75 degrees on one side to 75 on the other, by
/// spherical harmonics: values of the series, before those below 0 are cut.
std::vector<double> sunAnswers(const bake::Environment& light, int order, ShWindow window, const ShGrid& grid);

}  // namespace glint::apps
