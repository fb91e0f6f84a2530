#include "common/json_file.h"

#include <fmt/format.h>

#include <set>
#include <string_view>
#include <vector>

#include "common/files.h"
#include "glint/model/error.h"
#include "glint/model/json_depth.h"

namespace glint::apps {
namespace {

using nlohmann::json;

/// Sees the members of all objects as a parser meets them.
class MemberWatch {
 public:
  MemberWatch(const std::string& path, const char* rule) : path_(path), rule_(rule) {}

  bool operator()(int /*depth*/, json::parse_event_t event, const json& value) {
    if (event == json::parse_event_t::object_start) names_.emplace_back();
    if (event == json::parse_event_t::object_end) names_.pop_back();
    if (event == json::parse_event_t::key && !names_.back().insert(value.get<std::string>()).second)
      throw Error(ErrorCode::invalid_input, rule_, path_, value.get<std::string>(), "stands twice in one object",
                  "keep the one that is meant");
    return true;
  }

 private:
  const std::string& path_;
  const char* rule_;
  std::vector<std::set<std::string>> names_;  // of each object that is open
};

std::string_view textOf(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

json readJsonFile(const std::string& path, const char* rule) {
  const std::vector<std::byte> bytes = readFile(path);
  const std::string_view text = textOf(bytes);
  if (jsonDepth(text) > kMostJsonDepth)
    throw Error(ErrorCode::invalid_input, rule, path, "", fmt::format("is nested deeper than {} levels", kMostJsonDepth),
                "no file of this kind is; check where it comes from");
  try {
    return json::parse(text, MemberWatch(path, rule));
  } catch (const json::exception& e) {
    const std::string reason = e.what();  // "[name of the exception] reason"
    throw Error(ErrorCode::invalid_input, rule, path, "", "is no JSON: " + reason.substr(reason.find("] ") + 2),
                "JSON has finite numbers only, and no comments");
  }
}

json readJsonOrNothing(const std::string& path) {
  const std::vector<std::byte> bytes = readFile(path);
  const std::string_view text = textOf(bytes);
  if (jsonDepth(text) > kMostJsonDepth) return json(json::value_t::discarded);
  return json::parse(text, nullptr, false);
}

}  // namespace glint::apps
