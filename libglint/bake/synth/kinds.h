#pragma once

#include <vector>

#include "glint/bake/synth/synth.h"

/// Private to synthHeights and synthNormals: one function for each kind of surface. Results are [height][width]; heights are
/// not scaled.
namespace glint::bake {

/// Gaussian random field with the correlation exp(-(x/correlation_x)^2 - (y/correlation_y)^2). O(n log n) for n texels.
std::vector<float> noiseHeights(const SynthOptions& options, float correlation_x, float correlation_y);

std::vector<Vec2> flakeNormals(const SynthOptions& options);
std::vector<Vec2> flake2dNormals(const SynthOptions& options);
std::vector<float> flake2dPresence(const SynthOptions& options);
std::vector<float> leatherHeights(const SynthOptions& options);
std::vector<float> scratchHeights(const SynthOptions& options);
std::vector<float> weaveHeights(const SynthOptions& options);
std::vector<float> twillHeights(const SynthOptions& options);
std::vector<float> silkHeights(const SynthOptions& options);
std::vector<float> bumpHeights(const SynthOptions& options);
std::vector<float> scaleHeights(const SynthOptions& options);
std::vector<float> structuredHeights(const SynthOptions& options);
std::vector<float> reliefHeights(const SynthOptions& options);
std::vector<float> woodHeights(const SynthOptions& options);
std::vector<float> sawtoothHeights(const SynthOptions& options);
std::vector<float> gratingHeights(const SynthOptions& options);

}  // namespace glint::bake
