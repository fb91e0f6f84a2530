#pragma once

#include <vector>

#include "glint-plan/question.h"
#include "measure/candidates.h"

namespace glint::apps {

/// The methods and settings that could answer a question, the pyramids before what is compressed from them. Levels that the question
/// does not ask for are left out. Those of maps of different sizes have the same names.
std::vector<Candidate> planCandidates(const MapQuestion& question, int width, int height);

/// The candidate whose asset is the input of another; nullptr: the map.
const Candidate* sourceOf(const std::vector<Candidate>& all, const Candidate& candidate);

/// The tolerance with which a candidate is compressed; 0: it has none.
double toleranceOf(const Candidate& candidate);

/// Deviation of level 0 of a pyramid over its stride.
inline constexpr double kLevelSigma = 0.4330127;  // 1.5 / sqrt(12)

}  // namespace glint::apps
