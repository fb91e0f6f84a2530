#include "common/error_json.h"

namespace glint::apps {

const char* codeName(ErrorCode code) {
  switch (code) {
    case ErrorCode::usage:
      return "usage";
    case ErrorCode::io:
      return "io";
    case ErrorCode::invalid_input:
      return "invalid_input";
    case ErrorCode::failed:
      return "failed";
    case ErrorCode::unsupported:
      return "unsupported";
    case ErrorCode::differs:
      return "differs";
  }
  return "failed";
}

nlohmann::ordered_json errorJson(const Error& error) {
  return {{"code", codeName(error.code())}, {"rule", error.rule()},    {"path", error.path()},
          {"object", error.object()},       {"message", error.what()}, {"remedy", error.remedy()}};
}

}  // namespace glint::apps
