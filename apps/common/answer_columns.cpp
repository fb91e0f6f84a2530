#include "common/answer_columns.h"

#include <algorithm>
#include <vector>

#include "common/numbers.h"

namespace glint::apps {
namespace {

/// Keys of the columns of a header, without the quotes around them.
std::vector<std::string> keysOf(std::string_view header) {
  std::vector<std::string> keys;
  while (true) {
    const std::size_t end = std::min(header.find(','), header.size());
    std::string name(header.substr(0, end));
    std::erase_if(name, [](char c) { return c == '"' || c == '\r'; });
    keys.push_back(columnKey(name));
    if (end == header.size()) return keys;
    header.remove_prefix(end + 1);
  }
}

}  // namespace

std::string columnKey(std::string_view name) {
  std::string key(trimBlanks(name));
  for (char& c : key)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return key;
}

bool isAnswerHeader(std::string_view line) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  if (line.starts_with(kByteOrderMark)) line.remove_prefix(kByteOrderMark.size());
  const std::vector<std::string> keys = keysOf(line);
  if (keys == keysOf(kHalfVectorSamples) || keys == keysOf(kLightSamples)) return true;
  const auto has = [&](const char* name) { return std::find(keys.begin(), keys.end(), name) != keys.end(); };
  const bool answered =
      keys.back() == kDensity || keys.back() == kMean || keys.back() == kReflected || keys.back() == kReflectedRgb.back();
  return answered && has(kCentre[0]) && has(kCentre[1]) && (has(kHalf[0]) || has(kRange[0]) || has(kLight[0]));
}

}  // namespace glint::apps
