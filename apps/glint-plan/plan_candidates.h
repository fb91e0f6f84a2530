#pragma once

#include <string>
#include <vector>

#include "glint-plan/question.h"
#include "measure/candidates.h"

namespace glint::apps {

/// The methods and settings that could answer a question, the pyramids before what is compressed from them. Levels that the question
/// does not ask for are left out. The names of candidates do not depend on the size of the map.
std::vector<Candidate> planCandidates(const MapQuestion& question, int width, int height);

/// The setting of Deng 2022: images of 256 x 256 pixels every 32 texels, compressed by CP of rank 16. The pyramid comes first.
std::vector<Candidate> paperCandidates(const MapQuestion& question);

/// The candidate whose asset is the input of another; nullptr: the map.
const Candidate* sourceOf(const std::vector<Candidate>& all, const Candidate& candidate);

/// The value of a flag of a candidate; empty: it has none.
std::string flagOf(const Candidate& candidate, const std::string& name);

/// The tolerance with which a candidate is compressed; 0: it has none.
double toleranceOf(const Candidate& candidate);

}  // namespace glint::apps
