#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include "glint/math/device.h"  // asks for C++20

namespace glint::formats {

/// What the name of an output stands for.
struct OutputTarget {
  enum class Kind : std::uint8_t {
    missing,  ///< nothing yet: a file will be made
    file,     ///< a regular file, which will be replaced
    stream,   ///< a device, a pipe or an open descriptor (/dev/stdout), which will be written to
  };
  Kind kind = Kind::missing;
  std::filesystem::path path;  ///< behind all symbolic links
  int descriptor = -1;         ///< of this process, if the name is one of /dev/fd; -1 otherwise
};

/// Follows symbolic links. The last link may lead to a file that does not exist yet.
/// @throws Error io  a folder, socket or disk; links in a circle; a name that is too long
OutputTarget findOutput(const std::filesystem::path& name);

/// The one way in which files are made: whole or not at all.
///
/// The bytes go to a file under a unique hidden name in the target's folder, which publish() flushes to the disk and renames.
/// It has the permissions, and where allowed the owner, of the file that it replaces. A symbolic link stays: the file at
/// its end is replaced. Devices and pipes are written to in one go at the end, from a temporary file elsewhere.
///
/// The temporary file is locked as long as its writer lives. Temporary files of killed writers are not locked: the next writer of
/// the same target removes them. The lock belongs to the open file description, so HDF5, which may lock the same file by flock,
/// does not meet it.
class AtomicFile {
 public:
  /// @throws Error io  as findOutput, or the temporary file cannot be made
  explicit AtomicFile(const std::filesystem::path& name);
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  /// Removes the temporary file unless it was published.
  ~AtomicFile();

  /// The temporary file. Who opens it by this name must not replace it.
  const std::filesystem::path& path() const { return path_; }

  /// Writes at an offset; bytes that nobody writes are zero.
  /// @throws Error io
  void write(const void* data, std::uint64_t size_bytes, std::uint64_t offset);

  /// Takes space for this many bytes. For callers whose own library does not say why it could not write.
  /// @throws Error io  there is not so much, or files may not be so long
  void reserve(std::uint64_t size_bytes);

  /// Gives the file its name. Call once, last.
  /// @param overwrite  replace a file that exists
  /// @throws Error io
  void publish(bool overwrite);

 private:
  void create(const std::filesystem::path& folder);
  void keepPermissions();
  void copyToStream();

  std::filesystem::path name_;
  OutputTarget target_;
  std::filesystem::path path_;
  int file_ = -1;
  int slot_ = -1;  ///< of the files that removeTemporaryFiles() removes
  bool renamed_ = false;
};

/// Replaces a file by these bytes, as AtomicFile does; a device or pipe is written to.
/// @throws Error io
void writeFile(const std::filesystem::path& name, std::span<const std::byte> bytes);

/// Removes the temporary files of every AtomicFile that this process has not finished. For handlers of signals that end the
/// process: may be called at any time and from any thread, and calls nothing that POSIX does not allow there. The library
/// installs no handler itself.
void removeTemporaryFiles() noexcept;

}  // namespace glint::formats
