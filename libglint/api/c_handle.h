#pragma once

// Private to libglint/api. Handles of the C interface.

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

namespace glint::api::c {

/// What all handles begin with. A shell is never freed: a function that is given a closed handle still reads the shell, and
/// finds it closed. All shells are in one list, which keeps them reachable for tools that look for lost memory.
class Shell {
 public:
  Shell(const Shell&) = delete;
  Shell& operator=(const Shell&) = delete;

  /// Whether the handle is one of the given kind, and not closed.
  bool isOpen(std::uint32_t magic) const { return magic_.load(std::memory_order_relaxed) == magic; }

 protected:
  explicit Shell(std::uint32_t magic) : magic_(magic) {
    while (!all_.compare_exchange_weak(next_, this)) {
    }
  }
  ~Shell() = default;

  /// Ends the handle. Returns false if it was of another kind, or closed.
  bool end(std::uint32_t magic) { return magic_.compare_exchange_strong(magic, 0); }

 private:
  static inline std::atomic<const Shell*> all_ = nullptr;

  std::atomic<std::uint32_t> magic_;
  const Shell* next_ = nullptr;
};

/// A handle: a shell around a body. Several handles may share a body, which is freed when the last of them is closed.
/// @tparam kMagic  number of the kind of handle
template <class Body, std::uint32_t kMagic>
class Handle : public Shell {
 public:
  explicit Handle(std::shared_ptr<const Body> body) : Shell(kMagic), body_(std::move(body)) {}

  /// Whether a pointer that a caller gives is an open handle of this kind.
  static bool isOpen(const Handle* handle) { return handle != nullptr && handle->Shell::isOpen(kMagic); }

  /// Of an open handle.
  const Body& body() const { return *body_; }
  const std::shared_ptr<const Body>& shared() const { return body_; }

  /// Frees the handle's share of the body. Nothing happens to a handle that is null, closed or of another kind.
  static void close(Handle* handle) {
    if (handle != nullptr && handle->end(kMagic)) handle->body_.reset();
  }

 private:
  std::shared_ptr<const Body> body_;
};

/// What an open glint_ndf holds.
struct NdfBody;
/// What a glint_brdf holds.
struct BrdfBody;
/// What an open glint_displaced holds.
struct DisplacedBody;

}  // namespace glint::api::c

struct glint_ndf : glint::api::c::Handle<glint::api::c::NdfBody, 0x666e6c67> {
  using Handle::Handle;
};
struct glint_brdf : glint::api::c::Handle<glint::api::c::BrdfBody, 0x62726c67> {
  using Handle::Handle;
};
struct glint_displaced : glint::api::c::Handle<glint::api::c::DisplacedBody, 0x64736c67> {
  using Handle::Handle;
};
