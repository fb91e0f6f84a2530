#pragma once

// Private to formats/ and apps/.

#include <unistd.h>

namespace glint::formats {

/// A file descriptor, closed at the end of its scope; none if it is below 0.
struct Descriptor {
  explicit Descriptor(int file) : id(file) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (id >= 0) ::close(id);
  }
  int id;
};

}  // namespace glint::formats
