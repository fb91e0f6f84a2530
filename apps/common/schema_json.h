#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace glint::apps {

/// The table of formats/schema.h as JSON. Keys are in the order of the table.
nlohmann::ordered_json schemaJson();

/// The contents of formats/schema.json.
std::string schemaText();

}  // namespace glint::apps
