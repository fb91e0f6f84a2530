#pragma once

#include <cstddef>
#include <span>

#include "glint/math/device.h"  // asks for C++20

namespace glint::formats {

/// Gives back the memory of all files that assets of this process map. Their pages count as memory of the process from their first
/// use on. Given back they do not, until they are used again: then they come from the system's cache of files, or from the disk.
/// Nothing is lost, and assets may be read meanwhile. Thread-safe.
void giveBackMappedFiles() noexcept;

/// Remembers the map of a file for giveBackMappedFiles(). @throws std::bad_alloc
void rememberMappedFile(std::span<const std::byte> bytes);
/// Forgets it, before it is unmapped.
void forgetMappedFile(std::span<const std::byte> bytes) noexcept;

}  // namespace glint::formats
