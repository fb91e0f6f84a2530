#include "glint/formats/hdf5_handle.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstring>
#include <string_view>

#include "glint/formats/rules.h"
#include "glint/formats/system_error.h"
#include "glint/model/ndf_cp.h"

namespace glint::formats::hdf5 {
namespace {

std::mutex& libraryMutex() {
  static std::mutex mutex;
  return mutex;
}

/// IEEE half precision, which HDF5 1.10 has no constant for.
Handle halfType() {
  Handle type(H5Tcopy(H5T_IEEE_F32LE), "cannot copy a type", {});
  check(H5Tset_fields(type, 15, 10, 5, 0, 10), "cannot set a type", {});
  check(H5Tset_size(type, 2), "cannot set a type", {});
  check(H5Tset_ebias(type, 15), "cannot set a type", {});
  return type;
}

Handle clusterType() {
  Handle type(H5Tcreate(H5T_COMPOUND, sizeof(NdfCluster)), "cannot create a type", {});
  const auto insert = [&](const char* field, std::size_t offset, hid_t member) {
    check(H5Tinsert(type, field, offset, member), "cannot create a type", {});
  };
  insert("first_coefficient", offsetof(NdfCluster, first_coefficient), H5T_STD_U64LE);
  insert("first_basis", offsetof(NdfCluster, first_basis), H5T_STD_U32LE);
  insert("first_scale", offsetof(NdfCluster, first_scale), H5T_STD_U32LE);
  insert("first_word", offsetof(NdfCluster, first_word), H5T_STD_U32LE);
  insert("slice_count", offsetof(NdfCluster, slice_count), H5T_STD_U32LE);
  insert("columns", offsetof(NdfCluster, columns), H5T_STD_U16LE);
  insert("narrow_columns", offsetof(NdfCluster, narrow_columns), H5T_STD_U16LE);
  insert("rank_x", offsetof(NdfCluster, rank_x), H5T_STD_U8LE);
  insert("rank_y", offsetof(NdfCluster, rank_y), H5T_STD_U8LE);
  const Handle half = halfType();
  insert("floor_unit", offsetof(NdfCluster, floor_unit), half);
  return type;
}

/// Number after "errno = " in a message of HDF5; 0 if there is none.
int systemErrorIn(std::string_view message) {
  constexpr std::string_view kLabel = "errno = ";
  const std::size_t place = message.rfind(kLabel);  // a file's name comes before
  int number = 0;
  if (place != message.npos) std::from_chars(message.data() + place + kLabel.size(), message.data() + message.size(), number);
  return number;
}

/// The message up to the list of "name = value" that HDF5 adds: times, names of files and addresses in memory.
std::string_view withoutValues(std::string_view message) {
  const std::size_t equals = message.find(" = ");
  if (equals == message.npos) return message;
  return message.substr(0, std::min(message.find_last_of(":,", equals), equals));
}

herr_t keepDeepest(unsigned, const H5E_error2_t* entry, void* data) {
  Cause& cause = *static_cast<Cause*>(data);
  if (entry->desc == nullptr) return 0;
  if (const int error = systemErrorIn(entry->desc); error != 0) cause.system_error = error;
  cause.text = withoutValues(entry->desc);
  return 0;
}

}  // namespace

LibraryScope::LibraryScope() : lock_(libraryMutex()) {
  // HDF5 leaks internally on some damaged files and then complains on stderr when the program ends. Nothing of ours is open by
  // then, so its exit handler has nothing to do. No effect if the program has started HDF5 before.
  [[maybe_unused]] static const herr_t once = H5dont_atexit();
  H5Eget_auto2(H5E_DEFAULT, &print_, &print_data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  H5PLget_loading_state(&plugins_);
  H5PLset_loading_state(0);
}

LibraryScope::~LibraryScope() {
  H5PLset_loading_state(plugins_);
  H5Eset_auto2(H5E_DEFAULT, print_, print_data_);
}

Cause rootCause() {
  Cause cause;
  // H5E_WALK_DOWNWARD ends at the function that detected the error.
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_DOWNWARD, &keepDeepest, &cause);
  H5Eclear2(H5E_DEFAULT);
  if (cause.text.empty()) cause.text = "unknown error of HDF5";
  return cause;
}

void fail(const char* what, const std::string& object, ErrorCode code) {
  const Cause cause = rootCause();
  const bool writes = code == ErrorCode::io;
  // A damaged file can ask for an impossible call: EINVAL is then the file's fault.
  if (cause.system_error != 0 && (writes || cause.system_error != EINVAL)) {
    throw Error(ErrorCode::io, writes ? "file.writable" : "file.readable", {}, object,
                std::string(what) + ": " + std::strerror(cause.system_error), remedyFor(cause.system_error));
  }
  const Rule& rule = findRule("file.hdf5");
  throw Error(code, std::string(rule.id), {}, object, std::string(what) + " (" + cause.text + ")",
              writes ? "check the disk's space and permissions" : std::string(rule.remedy));
}

herr_t Handle::close() {
  const hid_t id = std::exchange(id_, H5I_INVALID_HID);
  switch (id < 0 ? H5I_BADID : H5Iget_type(id)) {
    case H5I_FILE:
      return H5Fclose(id);
    case H5I_GROUP:
      return H5Gclose(id);
    case H5I_DATASET:
      return H5Dclose(id);
    case H5I_DATATYPE:
      return H5Tclose(id);
    case H5I_DATASPACE:
      return H5Sclose(id);
    case H5I_ATTR:
      return H5Aclose(id);
    case H5I_GENPROP_LST:
      return H5Pclose(id);
    default:
      return 0;
  }
}

TypeTable::TypeTable() {
  const auto set = [&](ElementType type, Handle handle) { types_[static_cast<std::size_t>(type)] = std::move(handle); };
  const auto copy = [](hid_t type) { return Handle(H5Tcopy(type), "cannot copy a type", {}); };
  set(ElementType::i8, copy(H5T_STD_I8LE));
  set(ElementType::i16, copy(H5T_STD_I16LE));
  set(ElementType::i32, copy(H5T_STD_I32LE));
  set(ElementType::u8, copy(H5T_STD_U8LE));
  set(ElementType::u16, copy(H5T_STD_U16LE));
  set(ElementType::u32, copy(H5T_STD_U32LE));
  set(ElementType::u64, copy(H5T_STD_U64LE));
  set(ElementType::f16, halfType());
  set(ElementType::f32, copy(H5T_IEEE_F32LE));
  set(ElementType::ndf_cluster, clusterType());
}

bool TypeTable::find(hid_t type, ElementType& found) const {
  for (std::size_t k = 0; k < types_.size(); ++k) {
    if (types_[k] >= 0 && H5Tequal(types_[k], type) > 0) {
      found = static_cast<ElementType>(k);
      return true;
    }
  }
  return false;
}

}  // namespace glint::formats::hdf5
