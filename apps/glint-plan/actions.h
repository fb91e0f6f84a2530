#pragma once

#include "glint-plan/plan_options.h"

namespace glint::apps {

/// Plans a scene, or says what was understood of it.
void planScene(Tool& tool, const PlanOptions& options);

/// Builds and measures a plan; exit code 7 if it does not hold.
void checkScene(Tool& tool, const PlanOptions& options);

}  // namespace glint::apps
