#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace glint::test {

using Bytes = std::vector<std::byte>;

Bytes readBytes(const std::string& path);
void writeBytes(const std::string& path, const Bytes& bytes);

/// A range of bytes of HDF5's metadata whose last four are the checksum of those before.
struct ChecksummedRange {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// A range of bytes of a file.
struct ByteRange {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Bodies of all messages of object headers, as far as they can be followed.
std::vector<ByteRange> messagesOf(const Bytes& bytes);

/// Bytes of all datasets that lie inside the file.
std::vector<ByteRange> datasetsOf(const Bytes& bytes);

/// The superblock and every part of an object header in the bytes of an asset, as far as it can be followed.
std::vector<ChecksummedRange> checksummedRanges(const Bytes& bytes);

/// Sets the checksums of these ranges to those of the bytes, so that damage gets past them.
void renewChecksums(Bytes& bytes, const std::vector<ChecksummedRange>& ranges);

/// Sets the attributes xxh3_128 of all datasets to the hashes of their bytes. Checksums have to be renewed afterwards.
void renewHashes(Bytes& bytes);

}  // namespace glint::test
