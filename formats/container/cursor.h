#pragma once

// Private to formats/container/.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>

#include "glint/formats/findings.h"

namespace glint::formats {

/// "an attribute", "a link".
inline std::string withArticle(std::string_view noun) {
  return (noun[0] == 'a' || noun[0] == 'o' ? "an " : "a ") + std::string(noun);
}

/// Reads little-endian numbers one after the other. Reading beyond the end throws Error (rule file.hdf5).
class Cursor {
 public:
  /// @param object  place in the file, for messages; must outlive the cursor
  /// @param what    name of the part that is read, e.g. "data layout"
  Cursor(std::span<const std::byte> bytes, const std::string& object, const char* what)
      : bytes_(bytes), object_(object), what_(what) {}

  [[noreturn]] void fail(const std::string& fault) const {
    throwBroken("file.hdf5", object_, "has " + withArticle(what_) + " " + fault);
  }
  void require(bool holds, const char* fault) const {
    if (!holds) fail(fault);
  }

  std::span<const std::byte> take(std::uint64_t size) {
    require(size <= bytes_.size(), "that ends too early");
    const auto taken = bytes_.first(static_cast<std::size_t>(size));
    bytes_ = bytes_.subspan(static_cast<std::size_t>(size));
    return taken;
  }
  /// An unsigned integer of up to 8 bytes.
  std::uint64_t number(unsigned size_bytes) {
    std::uint64_t value = 0;
    std::memcpy(&value, take(size_bytes).data(), size_bytes);
    return value;
  }
  std::string_view text(std::uint64_t size) {
    const auto bytes = take(size);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  std::uint64_t left() const { return bytes_.size(); }
  const std::string& object() const { return object_; }

 private:
  std::span<const std::byte> bytes_;
  const std::string& object_;
  const char* what_;
};

}  // namespace glint::formats
