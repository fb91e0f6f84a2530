#pragma once

#include <string>

namespace glint::apps {

/// Opens something that nobody can use in place of stdin, stdout and stderr where these are closed, so that no file that is
/// opened later takes their numbers. Writing to them still fails.
void openStandardStreams();

/// Writes a text to stdout.
/// @throws Error io if it cannot be written. When the reader of a pipe has gone, ends the process by SIGPIPE as other filters
///         do, if SIGPIPE ended it when it began
void writeStdout(const std::string& text);

/// Flushes stdout; throws as writeStdout does.
void flushStdout();

/// Writes a text to stderr. Does nothing when that fails: there is nobody to tell.
void writeStderr(const std::string& text) noexcept;

}  // namespace glint::apps
