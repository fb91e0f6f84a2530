#pragma once

#include <nlohmann/json.hpp>

namespace glint::apps {

/// {processor, cores, system} of this machine.
nlohmann::ordered_json machineJson();

}  // namespace glint::apps
