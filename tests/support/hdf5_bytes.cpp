#include "support/hdf5_bytes.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string_view>

#include "glint/formats/container/checksum.h"
#include "glint/formats/hash.h"

namespace glint::test {
namespace {

constexpr std::size_t kSuperblockBytes = 48, kChecksumBytes = 4;
constexpr unsigned kLayout = 8, kAttribute = 12, kContinuation = 16;

template <class T>
T load(const Bytes& bytes, std::size_t at) {
  T value{};
  if (at <= bytes.size() && bytes.size() - at >= sizeof(T)) std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

bool startsWith(const Bytes& bytes, std::size_t at, const char (&text)[5]) {
  return at + 4 <= bytes.size() && std::memcmp(bytes.data() + at, text, 4) == 0;
}

/// Calls use(type, begin, end) for the messages between two places.
template <class Use>
void forEachMessage(const Bytes& bytes, std::size_t at, std::size_t end, std::size_t head_bytes, Use use) {
  while (at + head_bytes <= end) {
    const std::size_t size = load<std::uint16_t>(bytes, at + 1);
    const std::size_t body = at + head_bytes;
    if (size > end - body) return;
    use(load<std::uint8_t>(bytes, at), body, body + size);
    at = body + size;
  }
}

/// Calls use(range, first message, bytes of a message's head) for every part of the object header at `at`.
template <class Use>
void forEachPart(const Bytes& bytes, std::size_t at, Use use) {
  const unsigned flags = load<std::uint8_t>(bytes, at + 5);
  const std::size_t head_bytes = (flags & 4) != 0 ? 6 : 4;
  std::size_t body = at + 6 + ((flags & 0x20) != 0 ? 16 : 0) + ((flags & 0x10) != 0 ? 4 : 0);
  std::uint64_t size = load<std::uint64_t>(bytes, body);
  const unsigned width = 1u << (flags & 3);
  if (width < 8) size &= (std::uint64_t{1} << (8 * width)) - 1;
  body += width;
  std::vector<ChecksummedRange> parts;
  const auto add = [&](std::uint64_t begin, std::uint64_t end) {
    if (end <= bytes.size() && begin + 8 <= end) parts.push_back({begin, end});
  };
  if (size < bytes.size()) add(at, body + size + kChecksumBytes);
  for (std::size_t k = 0; k < parts.size() && k < 100; ++k) {
    const ChecksummedRange part = parts[k];
    const std::size_t first = k == 0 ? body : part.begin + 4;
    use(part, first, head_bytes);
    forEachMessage(bytes, first, part.end - kChecksumBytes, head_bytes, [&](unsigned type, std::size_t begin, std::size_t) {
      const auto place = load<std::uint64_t>(bytes, begin), length = load<std::uint64_t>(bytes, begin + 8);
      if (type == kContinuation && place < bytes.size() && length <= bytes.size()) add(place, place + length);
    });
  }
}

template <class Use>
void forEachHeader(const Bytes& bytes, Use use) {
  for (std::size_t at = kSuperblockBytes; at + 8 < bytes.size(); ++at)
    if (startsWith(bytes, at, "OHDR")) use(at);
}

}  // namespace

Bytes readBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> chars{std::istreambuf_iterator<char>(file), {}};
  Bytes bytes(chars.size());
  std::transform(chars.begin(), chars.end(), bytes.begin(), [](char c) { return static_cast<std::byte>(c); });
  return bytes;
}

void writeBytes(const std::string& path, const Bytes& bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

std::vector<ChecksummedRange> checksummedRanges(const Bytes& bytes) {
  std::vector<ChecksummedRange> ranges;
  if (bytes.size() >= kSuperblockBytes) ranges.push_back({0, kSuperblockBytes});
  forEachHeader(bytes, [&](std::size_t at) {
    forEachPart(bytes, at, [&](ChecksummedRange part, std::size_t, std::size_t) { ranges.push_back(part); });
  });
  return ranges;
}

std::vector<ByteRange> messagesOf(const Bytes& bytes) {
  std::vector<ByteRange> messages;
  forEachHeader(bytes, [&](std::size_t at) {
    forEachPart(bytes, at, [&](ChecksummedRange part, std::size_t first, std::size_t head_bytes) {
      forEachMessage(bytes, first, part.end - kChecksumBytes, head_bytes, [&](unsigned, std::size_t begin, std::size_t end) {
        messages.push_back({begin, end});
      });
    });
  });
  return messages;
}

std::vector<ByteRange> datasetsOf(const Bytes& bytes) {
  std::vector<ByteRange> datasets;
  for (const ByteRange message : messagesOf(bytes)) {
    constexpr std::uint16_t kContiguous = 0x0103;  // version 3, class 1
    if (message.end - message.begin < 18 || load<std::uint16_t>(bytes, message.begin) != kContiguous) continue;
    const auto place = load<std::uint64_t>(bytes, message.begin + 2), size = load<std::uint64_t>(bytes, message.begin + 10);
    if (size > 0 && place < bytes.size() && size <= bytes.size() - place) datasets.push_back({place, place + size});
  }
  return datasets;
}

void renewChecksums(Bytes& bytes, const std::vector<ChecksummedRange>& ranges) {
  for (const ChecksummedRange& range : ranges) {
    if (range.end > bytes.size() || range.begin + kChecksumBytes > range.end) continue;
    const std::size_t place = range.end - kChecksumBytes;
    const std::uint32_t sum = formats::hdf5Checksum(std::span(bytes).subspan(range.begin, place - range.begin));
    std::memcpy(bytes.data() + place, &sum, sizeof sum);
  }
}

void renewHashes(Bytes& bytes) {
  forEachHeader(bytes, [&](std::size_t at) {
    std::uint64_t offset = 0, size = 0;
    std::vector<std::size_t> hashes;  // where their digits start
    forEachPart(bytes, at, [&](ChecksummedRange part, std::size_t first, std::size_t head_bytes) {
      const std::size_t last = part.end - kChecksumBytes;
      forEachMessage(bytes, first, last, head_bytes, [&](unsigned type, std::size_t begin, std::size_t end) {
        if (type == kLayout && load<std::uint16_t>(bytes, begin) == 0x0103) {
          offset = load<std::uint64_t>(bytes, begin + 2);
          size = load<std::uint64_t>(bytes, begin + 10);
        }
        constexpr std::string_view kName = "xxh3_128";
        const auto* text = reinterpret_cast<const char*>(bytes.data());
        const std::string_view body(text + begin, end - begin);
        if (type == kAttribute && body.find(kName) != body.npos && body.size() > 32) hashes.push_back(end - 32);
      });
    });
    if (offset > bytes.size() || size > bytes.size() - offset) return;
    const std::string hash = formats::hashBytes(bytes.data() + offset, size);
    for (const std::size_t place : hashes) std::memcpy(bytes.data() + place, hash.data(), 32);
  });
}

}  // namespace glint::test
