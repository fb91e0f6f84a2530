#pragma once

#include <string>

namespace glint::apps {

/// Throws unless a name can stand in an asset or a manifest: these hold UTF-8, without control characters.
/// @param path  of the file, for the error
/// @throws Error io
void requireText(const std::string& path, const std::string& name);

}  // namespace glint::apps
