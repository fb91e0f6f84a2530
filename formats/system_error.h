#pragma once

#include <filesystem>
#include <string>

namespace glint::formats {

/// What a user can do about an error of the system (a value of errno).
std::string remedyFor(int error);

/// Throws the Error (io) of a file that the system does not let us read (rule file.readable) or write (rule file.writable).
/// @param what  "cannot be opened"; the system's reason is added
[[noreturn]] void throwUnreadable(const std::filesystem::path& path, const std::string& what, int error);
[[noreturn]] void throwUnwritable(const std::filesystem::path& path, const std::string& what, int error);

}  // namespace glint::formats
