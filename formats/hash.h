#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace glint::formats {

/// XXH3 128-bit hash of some bytes (seed 0, canonical order): 32 lower-case hexadecimal digits.
std::string hashBytes(const void* data, std::size_t size_bytes);

/// The same of a whole file. Throws Error (io) if it cannot be read.
std::string hashFile(const std::filesystem::path& path);

}  // namespace glint::formats
