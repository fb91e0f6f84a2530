#include "glint-plan/json_field.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/json_file.h"
#include "common/suggest.h"
#include "glint/api/alternatives.h"
#include "glint/model/error.h"

namespace glint::apps {

using nlohmann::json;

JsonField JsonField::read(const std::string& path) {
  const json document = readJsonFile(path, "scene.json");
  if (!document.is_object())
    throw Error(ErrorCode::invalid_input, "scene.json", path, "", "holds JSON, but no object", "begin it with {");
  return {path, "", document};
}

void JsonField::refuse(const std::string& what, const std::string& remedy) const {
  throw Error(ErrorCode::invalid_input, "scene.field", file_, path_, what, remedy);
}

std::optional<JsonField> JsonField::find(const std::string& name) const {
  if (!value_.is_object()) refuse("is no object", "write it as {...}");
  const auto found = value_.find(name);
  if (found == value_.end()) return std::nullopt;
  return JsonField(file_, path_.empty() ? name : path_ + "." + name, *found);
}

JsonField JsonField::member(const std::string& name, const std::string& remedy) const {
  const std::optional<JsonField> found = find(name);
  if (!found) JsonField(file_, path_.empty() ? name : path_ + "." + name, {}).refuse("is missing", remedy);
  return *found;
}

void JsonField::allow(std::initializer_list<const char*> names) const {
  if (!value_.is_object()) refuse("is no object", "write it as {...}");
  for (const auto& [name, value] : value_.items()) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    const JsonField unknown(file_, path_.empty() ? name : path_ + "." + name, value);
    unknown.refuse("is no field of a scene", "give " + api::alternatives({names.begin(), names.end()}));
  }
}

std::vector<JsonField> JsonField::elements() const {
  if (!value_.is_array() || value_.empty()) refuse("is no list of one element or more", "write it as [...]");
  std::vector<JsonField> list;
  for (std::size_t k = 0; k < value_.size(); ++k) list.emplace_back(file_, fmt::format("{}[{}]", path_, k), value_[k]);
  return list;
}

std::string JsonField::text() const {
  if (!value_.is_string() || value_.get<std::string>().empty()) refuse("is no text", "write it in quotes");
  return value_.get<std::string>();
}

std::string JsonField::word(const std::vector<std::string>& words) const {
  const bool known = value_.is_string() && std::find(words.begin(), words.end(), value_.get<std::string>()) != words.end();
  if (!known) refuse(value_.dump() + " is not known here", "give " + api::alternatives({words.begin(), words.end()}));
  return value_.get<std::string>();
}

bool JsonField::flag() const {
  if (!value_.is_boolean()) refuse("is neither true nor false", "give one of them, without quotes");
  return value_.get<bool>();
}

double JsonField::number(double low, double high, const std::string& more) const {
  if (!value_.is_number()) refuse("is no number", "write it without quotes and units");
  const double number = value_.get<double>();
  if (std::isfinite(number) && number >= low && number <= high) return number;
  const bool above_0 = low == std::numeric_limits<double>::min(), endless = high == std::numeric_limits<double>::max();
  const std::string least = above_0 ? "a number above 0" : fmt::format("{:g} or more", low);
  const std::string remedy =
      endless ? least : fmt::format("a number {} {:g} to {:g}", above_0 ? "above 0," : "from", low, high);
  refuse(fmt::format("{:g} is out of range", number), "give " + remedy + (more.empty() ? "" : ": " + more));
}

int JsonField::integer(int low, int high) const {
  const double value = number(low, high);
  if (value != std::floor(value)) refuse("is no whole number", fmt::format("give one from {} to {}", low, high));
  return static_cast<int>(value);
}

}  // namespace glint::apps
