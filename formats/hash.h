#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

namespace glint::formats {

/// XXH3 128-bit hash of some bytes (seed 0, canonical order): 32 lower-case hexadecimal digits.
std::string hashBytes(const void* data, std::size_t size_bytes);

/// The same of a whole file. Throws Error (io) if it cannot be read.
std::string hashFile(const std::filesystem::path& path);

/// The same of a part of a file, which is read in pieces. Throws Error (io) if it cannot be read, or ends before.
std::string hashOfFile(const std::filesystem::path& path, std::uint64_t offset, std::uint64_t size_bytes);

/// The same of bytes that come in pieces.
class ByteHasher {
 public:
  ByteHasher();
  ByteHasher(ByteHasher&&) noexcept;
  ~ByteHasher();
  void add(const void* data, std::size_t size_bytes);
  std::string hash() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace glint::formats
