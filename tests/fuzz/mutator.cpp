#include "fuzz/mutator.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <limits>

namespace glint::test {
namespace {

/// Numbers at which readers go wrong: around 0, around the ends of types, around the limits of the format.
constexpr std::uint64_t kNumbers[] = {
    0,          1,          2,          7,          8,          15,         16,        63,    64,         65,        127,
    128,        255,        256,        1024,       1025,       4095,       4096,      32767, 65535,      65536,     0x7fffffff,
    0x80000000, 0xffffffff, 1ull << 32, 1ull << 48, 1ull << 62, 1ull << 63, ~0ull - 1, ~0ull, 0x7fc00000, 0x7f800000};

/// One run of changes to the bytes of a file.
class Mutation {
 public:
  Mutation(Bytes& bytes, std::mt19937& random) : bytes_(bytes), random_(random) {}

  void run() {
    const auto messages = messagesOf(bytes_);
    const auto datasets = datasetsOf(bytes_);
    for (std::size_t k = 1 + below(4); k > 0 && !bytes_.empty(); --k) {
      const std::size_t choice = below(8);
      if (choice < 4 && !messages.empty()) {
        editMessage(messages[below(messages.size())]);
      } else if (choice < 7 && !datasets.empty()) {
        editRange(datasets[below(datasets.size())]);
      } else {
        editRange({0, bytes_.size()});
      }
    }
  }

 private:
  std::size_t below(std::size_t n) { return n == 0 ? 0 : random_() % n; }

  void put(std::size_t at, std::uint64_t value, std::size_t size) {
    if (at <= bytes_.size() && size <= bytes_.size() - at) std::memcpy(bytes_.data() + at, &value, size);
  }

  /// Changes the body of a message, or the kind, size or flags in the 4 bytes before it.
  void editMessage(ByteRange message) {
    constexpr std::size_t kHead = 4;
    if (below(10) == 0) return editRange({message.begin - kHead, message.begin});
    // The first bytes of a message say most.
    if (below(2) == 0) message.end = std::min(message.end, message.begin + 24);
    editRange(message);
  }

  void editRange(ByteRange range) {
    if (range.begin >= range.end) return;
    const std::size_t at = range.begin + below(range.end - range.begin);
    const std::size_t size = std::size_t{1} << below(4);
    switch (below(7)) {
      case 0:
        bytes_[at] ^= static_cast<std::byte>(1u << below(8));
        return;
      case 1:
        bytes_[at] = static_cast<std::byte>(random_());
        return;
      case 2:
        return put(at, kNumbers[below(std::size(kNumbers))], size);
      case 3:  // a number a little larger or smaller
        return step(at, size);
      case 4:
        return put(at / size * size, kNumbers[below(std::size(kNumbers))], size);
      case 5:
        return copy(range.begin + below(range.end - range.begin), at, 1 + below(32));
      default:
        return copy(below(bytes_.size()), at, 1 + below(32));
    }
  }

  void step(std::size_t at, std::size_t size) {
    std::uint64_t value = 0;
    if (size > bytes_.size() - at) return;
    std::memcpy(&value, bytes_.data() + at, size);
    put(at, value + below(17) - 8, size);
  }

  void copy(std::size_t from, std::size_t to, std::size_t size) {
    size = std::min({size, bytes_.size() - from, bytes_.size() - to});
    std::memmove(bytes_.data() + to, bytes_.data() + from, size);
  }

  Bytes& bytes_;
  std::mt19937& random_;
};

}  // namespace

Bytes mutate(Bytes bytes, std::mt19937& random) {
  const auto ranges = checksummedRanges(bytes);
  Mutation(bytes, random).run();
  if (random() % 2 == 0) renewHashes(bytes);
  if (random() % 8 != 0) renewChecksums(bytes, ranges);
  return bytes;
}

}  // namespace glint::test
