#pragma once

// Private to formats/.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>

namespace glint::formats {

/// The bytes of a whole file, read-only: mapped, owned or borrowed. They start at a multiple of 64.
class FileBytes {
 public:
  FileBytes() = default;
  FileBytes(FileBytes&& other) noexcept { swap(other); }
  FileBytes& operator=(FileBytes&& other) noexcept {
    swap(other);
    return *this;
  }
  ~FileBytes();

  /// Maps a regular file, or reads it into memory where `copy` is set.
  /// @throws Error  file.readable (io): cannot be opened or read, or is no regular file; file.signature: is empty
  static FileBytes ofFile(const std::filesystem::path& path, bool copy);

  /// Bytes that stay as long as this object, or a copy of them: where `copy` is set or their start is no multiple of 64.
  static FileBytes ofMemory(std::span<const std::byte> bytes, bool copy);

  /// Bytes that `read` fills in, in parts. Throws Error (io) where it returns false.
  static FileBytes ofSource(std::uint64_t size, const std::function<bool(std::uint64_t, std::span<std::byte>)>& read);

  const std::byte* data() const { return bytes_.data(); }
  std::size_t size() const { return bytes_.size(); }
  std::span<const std::byte> span() const { return bytes_; }
  /// Whether the bytes are those of the file itself.
  bool isMapped() const { return mapped_; }

 private:
  struct Release {
    void operator()(std::byte* bytes) const;
  };

  void swap(FileBytes& other) noexcept;
  /// Memory for `size` bytes, which become those of this object.
  std::span<std::byte> allocate(std::size_t size);

  std::span<const std::byte> bytes_;
  bool mapped_ = false;
  std::unique_ptr<std::byte, Release> owned_;
};

}  // namespace glint::formats
