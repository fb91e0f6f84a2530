#pragma once

#include <string>

namespace glint::apps {

/// Opens /dev/null, for the wrong direction, in place of those of stdin, stdout and stderr that are closed: no file that is opened
/// later takes their numbers, and using such a stream fails.
void openStandardStreams();

/// Writes a text to stdout.
/// @throws Error io if it cannot be written. If the reader of a pipe has gone, ends the process by SIGPIPE as other filters do,
///         unless SIGPIPE was ignored when the process began
void writeStdout(const std::string& text);

/// Flushes stdout; throws as writeStdout does.
void flushStdout();

/// Writes a text to stderr. Does nothing when that fails: there is nobody to tell.
void writeStderr(const std::string& text) noexcept;

}  // namespace glint::apps
