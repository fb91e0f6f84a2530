#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>

#include "glint/math/device.h"  // asks for C++20

namespace glint::formats {

/// Takes some bytes, which are valid during the call only.
using ByteSink = std::function<void(std::span<const std::byte>)>;

/// Gives bytes to a sink, piece after piece, in order. The same bytes at every call.
using ByteSource = std::function<void(const ByteSink&)>;

inline constexpr std::uint64_t kToTheEnd = ~std::uint64_t{0};

/// Reads a part of a file in pieces of at most 1 MiB.
/// @param size_bytes  or kToTheEnd
/// @throws Error (io) if the file cannot be read, or ends before
void readInPieces(const std::filesystem::path& path, std::uint64_t offset, std::uint64_t size_bytes, const ByteSink& sink);

}  // namespace glint::formats
