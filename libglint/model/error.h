#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

#include "glint/model/shown_text.h"

namespace glint {

/// Classes of errors that a caller or a pipeline treats differently. Values are the exit codes of the tools.
enum class ErrorCode : std::uint8_t {
  usage = 1,          ///< an argument is missing, unknown or out of range
  io = 2,             ///< a file cannot be opened, read or written
  invalid_input = 3,  ///< a file was read, but its contents cannot be used
  failed = 4,         ///< the work itself failed (memory, no convergence)
  unsupported = 5,    ///< valid, but this version cannot handle it
  differs = 7,        ///< a comparison found a difference
};

/// The only exception of the libraries: says the error, its place, and what the user can do. Its text is one line of at most
/// some hundred characters of UTF-8, whatever bytes a file's name or another library's message brings in.
class Error : public std::runtime_error {
 public:
  /// @param rule    stable id of the broken rule, e.g. "normals.finite"; empty if there is none
  /// @param path    file at fault; empty if there is none
  /// @param object  place in the file, e.g. "/level_0/masks" or "texel (3, 7)"; may be empty
  /// @param what    what is wrong, a clause without a full stop
  /// @param remedy  what the user can do, a clause without a full stop; may be empty
  Error(ErrorCode code, std::string rule, std::string path, std::string object, std::string what, std::string remedy = {})
      : std::runtime_error(message(path, object, what, remedy)),
        clause_(shownText(what, kMostClause)),
        code_(code),
        rule_(std::move(rule)),
        path_(std::move(path)),
        object_(std::move(object)),
        remedy_(std::move(remedy)) {}

  ErrorCode code() const { return code_; }
  const std::string& rule() const { return rule_; }
  const std::string& path() const { return path_; }
  const std::string& object() const { return object_; }
  const std::string& remedy() const { return remedy_; }
  /// What is wrong, without the file, the place and the remedy that what() adds.
  const std::string& clause() const { return clause_; }

 private:
  static constexpr std::size_t kMostPath = 400, kMostObject = 120, kMostClause = 400, kMostRemedy = 400;

  static std::string message(const std::string& path, const std::string& object, const std::string& what,
                             const std::string& remedy) {
    std::string text;
    if (!path.empty()) text += shownPath(path, kMostPath) + ": ";
    if (!object.empty()) text += shownText(object, kMostObject) + ": ";
    text += shownText(what, kMostClause);
    if (!remedy.empty()) text += "; " + shownText(remedy, kMostRemedy);
    return text;
  }

  std::string clause_;
  ErrorCode code_;
  std::string rule_;
  std::string path_;
  std::string object_;
  std::string remedy_;
};

}  // namespace glint
