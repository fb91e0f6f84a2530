#include "glint-bench/result_file.h"

#include "common/files.h"
#include "glint/model/error.h"

namespace glint::apps {

using Json = nlohmann::ordered_json;

std::optional<Json> readResultFile(const std::string& path, const std::string& schema, const std::string& what,
                                   const std::string& command, const std::function<void(const Json&)>& read) {
  const std::vector<std::byte> bytes = readFile(path);
  const auto* text = reinterpret_cast<const char*>(bytes.data());
  Json document = Json::parse(text, text + bytes.size(), nullptr, false);
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
