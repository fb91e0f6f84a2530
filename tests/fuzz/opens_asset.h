#pragma once

#include <cstddef>
#include <cstdint>

/// Opens, validates and asks the bytes of an asset. Ends the program where an answer is negative or not finite.
/// @return whether the bytes opened as an asset
bool opensAsset(const std::uint8_t* data, std::size_t size);
