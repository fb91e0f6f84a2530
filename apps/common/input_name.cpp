#include "common/input_name.h"

#include "glint/model/error.h"
#include "glint/model/shown_text.h"

namespace glint::apps {

void requireText(const std::string& path, const std::string& name) {
  if (escapedText(name) == name) return;
  throw Error(ErrorCode::io, "input.name", path, "", "its name is not UTF-8, or holds a control character",
              "rename the file: assets record the names of their inputs");
}

}  // namespace glint::apps
