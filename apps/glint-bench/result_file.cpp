#include "glint-bench/result_file.h"

#include <fmt/format.h>

#include <string_view>
#include <vector>

#include "common/files.h"
#include "glint/model/error.h"
#include "glint/model/json_depth.h"

namespace glint::apps {

using Json = nlohmann::ordered_json;

Json parseResultFile(const std::string& path) {
  const std::vector<std::byte> bytes = readFile(path);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (jsonDepth(text) > kMostJsonDepth) {
    throw Error(ErrorCode::invalid_input, "bench.results", path, "",
                fmt::format("is nested deeper than {} levels", kMostJsonDepth),
                "no results are; check where the file comes from");
  }
  return Json::parse(text, nullptr, false);
}

std::optional<Json> readResultFile(const std::string& path, const std::string& schema, const std::string& what,
                                   const std::string& command, const std::function<void(const Json&)>& read) {
  Json document = parseResultFile(path);
  if (!document.is_object() || document.value("schema", Json()) != Json(schema)) return std::nullopt;
  try {
    read(document);
  } catch (const Json::exception&) {
    throw Error(ErrorCode::invalid_input, "bench.results", path, "", "lacks a part of the results of " + what,
                "make it again with " + command);
  }
  return document;
}

}  // namespace glint::apps
