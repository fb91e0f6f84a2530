#pragma once

// Private to libglint/api. Functions that the sources of the C interface share.

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <initializer_list>
#include <new>
#include <string>

#include "glint.h"
#include "glint/api/any_ndf.h"
#include "glint/api/batch.h"
#include "glint/api/brdf_batch.h"
#include "glint/api/c_handle.h"
#include "glint/math/rgb.h"
#include "glint/math/vec.h"

namespace glint::api::c {

struct NdfBody {
  OpenedNdf opened;
  std::string kind;
};

/// Sets the thread's last error. Returns the status.
glint_status fail(glint_status status, const char* message, const char* rule = "");

/// Fails for an argument.
/// @param where  function or struct
/// @param what   the fault
glint_status usage(const char* where, const char* what);

/// Whether a handle that a caller gives can be asked.
template <class Kind>
bool isOpen(const Kind* handle) {
  return Kind::isOpen(handle);
}

/// An argument that must not be null, and open if it is a handle.
struct Argument {
  template <class T>
  Argument(const T* given, const char* given_name) : pointer(given), name(given_name) {
    if constexpr (std::is_base_of_v<Shell, T>) closed = given != nullptr && !isOpen(given);
  }

  /// null if there is none, else what is wrong
  const char* fault() const { return pointer == nullptr ? " is null" : closed ? " is closed, or of another kind" : nullptr; }

  const void* pointer;
  const char* name;
  bool closed = false;
};

/// The fault of a handle; null if there is none.
const char* faultOf(const glint_ndf* ndf);
const char* faultOf(const glint_brdf* brdf);
const char* faultOf(const glint_displaced* displaced);

/// The fault of a source of bytes; null if there is none.
const char* faultOf(const glint_source* source);

/// The asset of bytes in memory that a caller gives.
formats::Asset openMemory(const void* bytes, std::size_t size_bytes, const std::string& name,
                          const formats::OpenOptions& options);
/// The asset of bytes that a caller's function reads.
formats::Asset openSource(const glint_source& source, const formats::OpenOptions& options);
/// A name that a caller gives, or another where that is null.
std::string nameOr(const char* name, const char* other);

/// Fails for the first argument that is null or closed, and names it. There must be one.
glint_status badArgument(const char* where, std::initializer_list<Argument> arguments);

/// Runs work that may throw.
template <class Work>
glint_status guarded(Work&& work) noexcept {
  try {
    work();
    return GLINT_OK;
  } catch (const Error& error) {
    return fail(static_cast<glint_status>(error.code()), error.what(), error.rule().c_str());
  } catch (const std::bad_alloc&) {
    return fail(GLINT_ERROR_FAILED, "out of memory");
  } catch (const std::exception& error) {
    return fail(GLINT_ERROR_FAILED, error.what());
  } catch (...) {
    return fail(GLINT_ERROR_FAILED, "failed for a reason that it does not name");
  }
}

/// No struct will ever be larger. A larger struct_size is a mistake, and would be read beyond the caller's memory.
inline constexpr std::size_t kMostStructSize = GLINT_MOST_STRUCT_SIZE;
inline constexpr const char* kWrongStructSize = "struct_size is not the size of the struct";

/// Takes a struct of options of an older or newer header. Members that the caller does not have stay as they are; members that
/// this library does not have must be 0.
/// @param first_size  size of the struct in its first version: no caller has a smaller one
/// @return null if the options can be used, else the fault
template <class Options>
const char* takeSized(const Options& from, std::size_t first_size, Options& to) {
  if (from.struct_size < first_size || from.struct_size > kMostStructSize) return kWrongStructSize;
  std::memcpy(&to, &from, std::min(from.struct_size, sizeof to));
  const char* bytes = reinterpret_cast<const char*>(&from);
  const bool unknown = from.struct_size > sizeof to &&
                       std::any_of(bytes + sizeof to, bytes + from.struct_size, [](char byte) { return byte != 0; });
  return unknown ? "has members that this version of the library does not know" : nullptr;
}

/// Fills the members of a struct of answers that the caller has.
/// @return whether struct_size is one that a caller can have
template <class Info>
bool giveSized(Info all, Info* info) {
  if (info->struct_size <= sizeof info->struct_size || info->struct_size > kMostStructSize) return false;
  all.struct_size = info->struct_size;
  std::memcpy(info, &all, std::min(info->struct_size, sizeof all));
  return true;
}

inline Footprint footprintOf(const glint_footprint& p) {
  const Vec2 centre = wrappedUv(p.u, p.v);
  if (p.kind == GLINT_FOOTPRINT_BOX) return Footprint::box(centre, {p.m[0], p.m[1]}, {p.m[2], p.m[3]});
  return Footprint::gaussian(centre, {p.m[0], p.m[1], p.m[2]});
}

inline Vec2 spreadOf(const glint_footprint& p) { return {p.spread[0], p.spread[1]}; }

inline StridedFloats arrayOf(const glint_floats& a) { return {a.data, a.stride}; }
inline StridedDoubles arrayOf(const glint_doubles& a) { return {a.data, a.stride}; }

/// @return null if the footprints are complete, else the fault
const char* missingIn(const glint_footprints& p);
FootprintArrays arraysOf(const glint_footprints& p);

inline Vec3 vectorOf(const float w[3]) { return {w[0], w[1], w[2]}; }
inline void set(float out[3], Vec3 w) { out[0] = w.x, out[1] = w.y, out[2] = w.z; }
inline void set(float out[3], Rgb c) { out[0] = c.r, out[1] = c.g, out[2] = c.b; }

inline DirectionArrays arraysOf(const glint_directions& d) { return {arrayOf(d.x), arrayOf(d.y), arrayOf(d.z)}; }

inline bool complete(const glint_directions* d) { return d && d->x.data && d->y.data && d->z.data; }

}  // namespace glint::api::c
