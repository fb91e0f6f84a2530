#include "glint/formats/hash.h"

#include <memory>
#include <span>

#include "glint/formats/file_pieces.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace glint::formats {
namespace {

std::string hex(XXH128_hash_t hash) {
  XXH128_canonical_t canonical;
  XXH128_canonicalFromHash(&canonical, hash);
  std::string digits;
  for (const unsigned char byte : canonical.digest) {
    digits += "0123456789abcdef"[byte >> 4];
    digits += "0123456789abcdef"[byte & 15];
  }
  return digits;
}

}  // namespace

std::string hashBytes(const void* data, std::size_t size_bytes) { return hex(XXH3_128bits(data, size_bytes)); }

/// Not of XXH3_createState(), which gives none without a sign where memory runs out.
struct ByteHasher::State {
  XXH3_state_t xxh;
};

ByteHasher::ByteHasher() : state_(std::make_unique<State>()) {
  XXH3_INITSTATE(&state_->xxh);
  XXH3_128bits_reset(&state_->xxh);
}
ByteHasher::ByteHasher(ByteHasher&&) noexcept = default;
ByteHasher::~ByteHasher() = default;

void ByteHasher::add(const void* data, std::size_t size_bytes) { XXH3_128bits_update(&state_->xxh, data, size_bytes); }

std::string ByteHasher::hash() const { return hex(XXH3_128bits_digest(&state_->xxh)); }

std::string hashFile(const std::filesystem::path& path) {
  ByteHasher hasher;
  readInPieces(path, 0, kToTheEnd, [&](std::span<const std::byte> piece) { hasher.add(piece.data(), piece.size()); });
  return hasher.hash();
}

std::string hashOfFile(const std::filesystem::path& path, std::uint64_t offset, std::uint64_t size_bytes) {
  ByteHasher hasher;
  readInPieces(path, offset, size_bytes, [&](std::span<const std::byte> piece) { hasher.add(piece.data(), piece.size()); });
  return hasher.hash();
}

}  // namespace glint::formats
