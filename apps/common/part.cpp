#include "common/part.h"

#include <fmt/format.h>

#include <string_view>

#include "common/numbers.h"
#include "glint/model/error.h"

namespace glint::apps {

Part parsePart(const std::string& text, const char* option, int most) {
  Part part;
  const std::size_t slash = text.find('/');
  const std::string_view all = text;
  const bool read = slash != std::string::npos && parseNumber(all.substr(0, slash), part.index).empty() &&
                    parseNumber(all.substr(slash + 1), part.count).empty();
  if (!read || part.count < 1 || part.count > most || part.index < 1 || part.index > part.count)
    throw Error(ErrorCode::usage, "cli.usage", "", option, "\"" + text + "\" is no part of a whole",
                fmt::format("give I/N with I from 1 to N and N at most {}, such as 1/4", most));
  return part;
}

}  // namespace glint::apps
