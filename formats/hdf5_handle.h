#pragma once

// Private to formats/: the only header of the project that includes HDF5's.

#include <hdf5.h>

#include <array>
#include <mutex>
#include <string>
#include <utility>

#include "glint/formats/schema.h"
#include "glint/model/error.h"

namespace glint::formats::hdf5 {

/// Exclusive use of the HDF5 library with error printing and plugins off; both are restored at the end.
///
/// The lock is there because HDF5 may be built without thread safety; plugins are off because a file can name one to load.
class LibraryScope {
 public:
  LibraryScope();
  ~LibraryScope();
  LibraryScope(const LibraryScope&) = delete;
  LibraryScope& operator=(const LibraryScope&) = delete;

 private:
  std::unique_lock<std::mutex> lock_;
  unsigned int plugins_ = 0;
  H5E_auto2_t print_ = nullptr;
  void* print_data_ = nullptr;
};

/// Why a call of HDF5 failed.
struct Cause {
  std::string text;      ///< what the function that detected the error says, without names, times and addresses
  int system_error = 0;  ///< errno of the call of the system that failed, if it was one
};

/// The cause that HDF5's error stack tells, which is then cleared.
Cause rootCause();

/// Throws Error that says what failed and why: the system's reason (code io, rule file.readable or, if `code` is io,
/// file.writable), or HDF5's own (rule file.hdf5, code `code`).
[[noreturn]] void fail(const char* what, const std::string& object, ErrorCode code = ErrorCode::invalid_input);

/// Owner of an HDF5 identifier.
class Handle {
 public:
  Handle() = default;
  /// Takes `id`; throws as `fail` does if it is negative.
  Handle(hid_t id, const char* what, const std::string& object, ErrorCode code = ErrorCode::invalid_input) : id_(id) {
    if (id < 0) fail(what, object, code);
  }
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  ~Handle() { close(); }

  operator hid_t() const { return id_; }  // NOLINT: a Handle is used wherever HDF5 takes an identifier

  /// Closes now; negative if that failed, e.g. because a file could not be flushed.
  herr_t close();

 private:
  hid_t id_ = H5I_INVALID_HID;
};

/// Throws as `fail` does if `status` is negative; returns it otherwise.
template <class Status>
Status check(Status status, const char* what, const std::string& object, ErrorCode code = ErrorCode::invalid_input) {
  if (status < 0) fail(what, object, code);
  return status;
}

/// The HDF5 types of all elements but text.
class TypeTable {
 public:
  TypeTable();
  hid_t operator[](ElementType type) const { return types_[static_cast<std::size_t>(type)]; }
  /// Finds the element type that equals `type`. Returns false if there is none.
  bool find(hid_t type, ElementType& found) const;

 private:
  std::array<Handle, static_cast<std::size_t>(ElementType::ndf_cluster) + 1> types_;
};

}  // namespace glint::formats::hdf5
