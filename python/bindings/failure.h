#pragma once

// Errors on their way to Python, where they are exceptions of glint_ndf.errors.

#include <nanobind/nanobind.h>

#include <exception>
#include <string>

#include "glint.h"

namespace glint::python {

/// A call of the C interface that did not succeed.
class Failure : public std::exception {
 public:
  /// Takes the message and the rule of this thread's last error.
  explicit Failure(glint_status status) : status_(status), message_(glint_error_message()), rule_(glint_error_rule()) {}

  glint_status status() const { return status_; }
  const char* what() const noexcept override { return message_.c_str(); }
  const std::string& rule() const { return rule_; }

 private:
  glint_status status_;
  std::string message_, rule_;
};

inline void check(glint_status status) {
  if (status != GLINT_OK) throw Failure(status);
}

/// Makes exceptions of Failure and glint::Error. Call once, when the module is loaded.
void registerErrors();

}  // namespace glint::python
