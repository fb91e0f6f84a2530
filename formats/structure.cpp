#include "glint/formats/structure.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cstring>
#include <set>

#include "glint/formats/descriptor.h"
#include "glint/formats/hdf5_handle.h"
#include "glint/formats/hdf5_precheck.h"
#include "glint/formats/plain_text.h"
#include "glint/formats/system_error.h"

namespace glint::formats {
namespace {

static_assert(std::endian::native == std::endian::little, "assets are mapped as they are: little-endian");

constexpr int kMaxDepth = 4;
constexpr std::size_t kMaxLinks = 1024;
constexpr std::size_t kMaxNameBytes = 255;
constexpr std::size_t kMaxAttributes = 64;
constexpr std::size_t kMaxAttributeBytes = 65536;
constexpr int kMaxDims = 8;

constexpr unsigned char kSignature[8] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
constexpr std::size_t kSuperblockBytes = 48;  // of versions 2 and 3 with 8-byte offsets

template <class T>
T load(const std::byte* at) {
  T value;
  std::memcpy(&value, at, sizeof(T));
  return value;
}

/// Looks at the superblock before HDF5 does. Metadata reached from superblock version 2 or 3 is checksummed, so HDF5 detects
/// damage in it; older files, extensions and user blocks would bring in code that trusts what it reads.
void checkSuperblock(const Mapping& mapping) {
  if (mapping.size() < sizeof(kSignature) || std::memcmp(mapping.data(), kSignature, sizeof(kSignature)) != 0) {
    throwBroken("file.signature", {}, "is not an HDF5 file");
  }
  if (mapping.size() < kSuperblockBytes) throwBroken("file.truncated", {}, "ends inside its superblock");
  const auto version = load<std::uint8_t>(mapping.data() + 8);
  if (version != 2 && version != 3) {
    throwBroken("file.superblock", {}, "has superblock version " + std::to_string(version) + ", not 2 or 3");
  }
  if (load<std::uint8_t>(mapping.data() + 9) != 8 || load<std::uint8_t>(mapping.data() + 10) != 8) {
    throwBroken("file.superblock", {}, "has offsets or lengths that are not of 8 bytes");
  }
  if (load<std::uint64_t>(mapping.data() + 12) != 0) throwBroken("file.superblock", {}, "has a base address that is not 0");
  if (load<std::uint64_t>(mapping.data() + 20) != ~std::uint64_t{0}) {
    throwBroken("file.superblock", {}, "has a superblock extension");
  }
  const auto end = load<std::uint64_t>(mapping.data() + 28);
  if (end > mapping.size()) {
    throwBroken(
        "file.truncated", {},
        "has " + std::to_string(mapping.size()) + " bytes of the " + std::to_string(end) + " that its superblock declares");
  }
  if (end < mapping.size()) {
    throwBroken("file.trailing", {},
                "has " + std::to_string(mapping.size() - end) + " bytes after the end that its superblock declares");
  }
}

/// Names and kinds of the links of a group, collected by HDF5's iteration.
struct Links {
  std::vector<std::pair<std::string, bool>> entries;  // name, whether hard
  bool too_many = false;
};

herr_t collectLink(hid_t, const char* name, const H5L_info_t* info, void* data) {
  Links& links = *static_cast<Links*>(data);
  if (links.entries.size() >= kMaxLinks || std::strlen(name) > kMaxNameBytes) {
    links.too_many = true;
    return 1;
  }
  links.entries.emplace_back(name, info->type == H5L_TYPE_HARD);
  return 0;
}

herr_t collectAttribute(hid_t, const char* name, const H5A_info_t*, void* data) {
  static_cast<std::vector<std::string>*>(data)->emplace_back(name);
  return 0;
}

double numberAt(ElementType type, const std::byte* at) {
  switch (type) {
    case ElementType::i8:
      return load<std::int8_t>(at);
    case ElementType::i16:
      return load<std::int16_t>(at);
    case ElementType::i32:
      return load<std::int32_t>(at);
    case ElementType::u8:
      return load<std::uint8_t>(at);
    case ElementType::u16:
      return load<std::uint16_t>(at);
    case ElementType::u32:
      return load<std::uint32_t>(at);
    case ElementType::u64:
      return static_cast<double>(load<std::uint64_t>(at));
    case ElementType::f32:
      return load<float>(at);
    default:
      return 0;
  }
}

/// Walks a file from its root and fills a FileStructure.
class StructureReader {
 public:
  StructureReader(FileStructure& structure, Findings& findings) : structure_(structure), findings_(findings) {}

  void readFile(hid_t file) {
    const hdf5::Handle root(H5Gopen2(file, "/", H5P_DEFAULT), "cannot be opened", "/");
    H5O_info_t info;
    hdf5::check(H5Oget_info2(root, &info, H5O_INFO_BASIC | H5O_INFO_NUM_ATTRS), "cannot be read", "/");
    structure_.attributes = readAttributes(root, "/", info.num_attrs);
    readGroup(root, "", 1);
  }

 private:
  /// Runs one step; what it throws becomes a finding, so that the rest of the file is still looked at.
  template <class Step>
  void attempt(Step step) {
    try {
      step();
    } catch (const Error& error) {
      findings_.add(error);
    }
  }

  void readGroup(hid_t group, const std::string& prefix, int depth) {
    const std::string here = prefix.empty() ? "/" : "/" + prefix.substr(0, prefix.size() - 1);
    Links links;
    hdf5::check(H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, nullptr, &collectLink, &links), "links cannot be read", here);
    if (links.too_many) throwBroken("group.size", here, "has more than 1024 links, or one with a name over 255 bytes");
    for (const auto& [name, hard] : links.entries) {
      const std::string path = prefix + name;
      attempt([&] {
        if (!isPlainText(name)) throwBroken("text.utf8", here, "has a link whose name is no plain text");
        if (!hard) throwBroken("link.hard", "/" + path, "is a soft, external or user-defined link");
        readObject(group, name, path, depth);
      });
    }
  }

  void readObject(hid_t group, const std::string& name, const std::string& path, int depth) {
    const std::string object = "/" + path;
    H5O_info_t info;
    // Reads the object's header only: opening a virtual or external dataset might already touch other files.
    hdf5::check(
        H5Oget_info_by_name2(group, name.c_str(), &info, H5O_INFO_BASIC | H5O_INFO_NUM_ATTRS | H5O_INFO_HDR, H5P_DEFAULT),
        "cannot be read", object);
    if (info.rc != 1 || !seen_.insert(info.addr).second) throwBroken("link.single", object, "has several links");
    if (info.type == H5O_TYPE_GROUP) {
      if (depth >= kMaxDepth) throwBroken("group.depth", object, "is nested too deep");
      const hdf5::Handle child(H5Gopen2(group, name.c_str(), H5P_DEFAULT), "cannot be opened", object);
      readGroup(child, path + "/", depth + 1);
    } else if (info.type == H5O_TYPE_DATASET) {
      constexpr std::uint64_t kExternalFiles = std::uint64_t{1} << 7;  // header message 0x0007
      if ((info.hdr.mesg.present & kExternalFiles) != 0) throwBroken("dataset.external", object, "is stored in another file");
      const hdf5::Handle dataset(H5Dopen2(group, name.c_str(), H5P_DEFAULT), "cannot be opened", object);
      readDataset(dataset, path, info.num_attrs);
    } else {
      throwBroken("object.type", object, "is neither a group nor a dataset");
    }
  }

  void readDataset(hid_t dataset, const std::string& path, hsize_t attribute_count) {
    const std::string object = "/" + path;
    DatasetRecord record;
    checkLayout(dataset, object);
    const hdf5::Handle type(H5Dget_type(dataset), "type cannot be read", object);
    if (H5Tdetect_class(type, H5T_VLEN) != 0 || H5Tis_variable_str(type) != 0 || H5Tdetect_class(type, H5T_REFERENCE) != 0) {
      throwBroken("dataset.vlen", object, "has elements of variable length or references");
    }
    if (H5Tcommitted(type) != 0) throwBroken("dataset.type", object, "has a committed element type");
    record.known_type = types_.find(type, record.type);
    const hdf5::Handle space(H5Dget_space(dataset), "sizes cannot be read", object);
    const int rank = H5Sget_simple_extent_ndims(space);
    if (rank < 0 || rank > kMaxDims || H5Sget_simple_extent_type(space) == H5S_NULL) {
      throwBroken("dataset.dims", object, "has a dataspace that no kind uses");
    }
    hsize_t dims[kMaxDims] = {};
    hdf5::check(H5Sget_simple_extent_dims(space, dims, nullptr), "sizes cannot be read", object);
    record.dims.assign(dims, dims + rank);
    locate(dataset, H5Tget_size(type), object, record);
    record.attributes = readAttributes(dataset, object, attribute_count);
    structure_.datasets.emplace(path, std::move(record));
  }

  static void checkLayout(hid_t dataset, const std::string& object) {
    const hdf5::Handle properties(H5Dget_create_plist(dataset), "properties cannot be read", object);
    const H5D_layout_t layout = H5Pget_layout(properties);
    if (layout == H5D_VIRTUAL) throwBroken("dataset.virtual", object, "is a virtual dataset");
    if (H5Pget_external_count(properties) != 0) throwBroken("dataset.external", object, "is stored in another file");
    if (layout != H5D_CONTIGUOUS) throwBroken("dataset.layout", object, "is chunked or compact, not contiguous");
    if (H5Pget_nfilters(properties) != 0) throwBroken("dataset.layout", object, "has filters");
  }

  /// Finds the dataset's bytes in the mapping and checks that all of them are there.
  void locate(hid_t dataset, std::size_t element_bytes, const std::string& object, DatasetRecord& record) const {
    std::uint64_t size = element_bytes;
    for (const std::uint64_t n : record.dims) {
      if (__builtin_mul_overflow(size, n, &size)) throwBroken("dataset.storage", object, "has sizes whose product overflows");
    }
    record.size_bytes = size;
    if (size == 0) return;
    const haddr_t offset = H5Dget_offset(dataset);
    if (offset == HADDR_UNDEF) throwBroken("dataset.storage", object, "has no bytes in the file");
    if (offset > structure_.mapping.size() || size > structure_.mapping.size() - offset) {
      throwBroken("dataset.storage", object,
                  "needs " + std::to_string(size) + " bytes at offset " + std::to_string(offset) + " of a file of " +
                      std::to_string(structure_.mapping.size()));
    }
    if (H5Dget_storage_size(dataset) < size) throwBroken("dataset.storage", object, "has fewer bytes than its sizes say");
    if (offset % 8 != 0) throwBroken("dataset.alignment", object, "lies at offset " + std::to_string(offset));
    if (offset % 64 != 0) {
      findings_.add("dataset.alignment_64", object, "lies at offset " + std::to_string(offset) + ", not a multiple of 64");
    }
    record.offset = offset;
    record.data = structure_.mapping.data() + offset;
  }

  Attributes readAttributes(hid_t object_id, const std::string& object, hsize_t count) {
    if (count > kMaxAttributes) {
      throwBroken("object.attributes", object, "has " + std::to_string(count) + " attributes, over 64");
    }
    std::vector<std::string> names;
    hdf5::check(H5Aiterate2(object_id, H5_INDEX_NAME, H5_ITER_INC, nullptr, &collectAttribute, &names),
                "attributes cannot be read", object);
    Attributes attributes;
    for (const std::string& name : names) {
      attempt([&] { readAttribute(object_id, object, name, attributes); });
    }
    return attributes;
  }

  void readAttribute(hid_t object_id, const std::string& object, const std::string& name, Attributes& attributes) {
    if (!isPlainText(name)) throwBroken("text.utf8", object, "has an attribute whose name is no plain text");
    const std::string place = object + "@" + name;
    const hdf5::Handle attribute(H5Aopen(object_id, name.c_str(), H5P_DEFAULT), "cannot be opened", place);
    const hdf5::Handle type(H5Aget_type(attribute), "type cannot be read", place);
    if (H5Tdetect_class(type, H5T_VLEN) != 0 || H5Tis_variable_str(type) != 0 || H5Tcommitted(type) != 0) {
      throwBroken("attribute.fixed", place, "has variable length or a committed type");
    }
    const hdf5::Handle space(H5Aget_space(attribute), "size cannot be read", place);
    const H5S_class_t space_class = H5Sget_simple_extent_type(space);
    const hssize_t points = H5Sget_simple_extent_npoints(space);
    const std::size_t element_bytes = H5Tget_size(type);
    if (space_class == H5S_NULL || points < 0 || H5Sget_simple_extent_ndims(space) > 1) {
      throwBroken("attribute.type", place, "is neither a scalar nor a list");
    }
    if (element_bytes == 0 || static_cast<std::size_t>(points) > kMaxAttributeBytes / element_bytes) {
      throwBroken("attribute.size", place, "has more than 65536 bytes");
    }
    AttributeValue value;
    value.scalar = space_class == H5S_SCALAR;
    const bool is_text = H5Tget_class(type) == H5T_STRING;
    if (is_text) value.type = ElementType::text;
    if (!is_text && !types_.find(type, value.type)) throwBroken("attribute.type", place, "has a type that no schema uses");
    std::vector<std::byte> bytes(static_cast<std::size_t>(points) * element_bytes);
    if (!bytes.empty()) hdf5::check(H5Aread(attribute, type, bytes.data()), "cannot be read", place);
    for (std::size_t k = 0; k < static_cast<std::size_t>(points); ++k) {
      const std::byte* at = bytes.data() + k * element_bytes;
      if (is_text) {
        const char* chars = reinterpret_cast<const char*>(at);
        value.texts.emplace_back(chars, ::strnlen(chars, element_bytes));
        if (!isPlainText(value.texts.back())) throwBroken("text.utf8", place, "is no plain text");
      } else {
        value.numbers.push_back(numberAt(value.type, at));
      }
    }
    attributes.emplace(name, std::move(value));
  }

  FileStructure& structure_;
  Findings& findings_;
  hdf5::TypeTable types_;
  std::set<haddr_t> seen_;
};

/// Opens the file in HDF5 without locks (assets never change in place) and makes sure that it is the file we mapped.
hdf5::Handle openInHdf5(const std::filesystem::path& path, const struct stat& mapped) {
  const hdf5::Handle access(H5Pcreate(H5P_FILE_ACCESS), "cannot create properties", {});
  hdf5::check(H5Pset_fapl_sec2(access), "cannot set properties", {});
  hdf5::check(H5Pset_file_locking(access, false, true), "cannot set properties", {});
  hdf5::Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access), "cannot be read by HDF5", {});
  void* descriptor = nullptr;
  hdf5::check(H5Fget_vfd_handle(file, access, &descriptor), "has no descriptor", {});
  struct stat opened = {};
  if (::fstat(*static_cast<int*>(descriptor), &opened) != 0 || opened.st_dev != mapped.st_dev ||
      opened.st_ino != mapped.st_ino) {
    throwBroken("file.readable", {}, "was replaced while it was being opened");
  }
  return file;
}

}  // namespace

Mapping::Mapping(int file, std::size_t size) : size_(size) {
  void* address = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, file, 0);
  if (address == MAP_FAILED) throwUnreadable({}, "cannot be mapped", errno);
  data_ = static_cast<const std::byte*>(address);
}

Mapping::~Mapping() {
  if (data_ != nullptr) ::munmap(const_cast<std::byte*>(data_), size_);
}

FileStructure readStructure(const std::filesystem::path& path, Findings& findings) {
  FileStructure structure;
  try {
    // Non-blocking: opening a pipe or device must not hang; only regular files pass the next check.
    const Descriptor descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (descriptor.id < 0) throwUnreadable({}, "cannot be opened", errno);
    struct stat status = {};
    if (::fstat(descriptor.id, &status) != 0) throwUnreadable({}, "cannot be opened", errno);
    if (!S_ISREG(status.st_mode)) throwBroken("file.readable", {}, "is not a regular file");
    if (status.st_size == 0) throwBroken("file.signature", {}, "is empty");
    structure.mapping = Mapping(descriptor.id, static_cast<std::size_t>(status.st_size));
    checkSuperblock(structure.mapping);
    structure.places = checkObjectHeaders({structure.mapping.data(), structure.mapping.size()});
    const hdf5::LibraryScope scope;
    const hdf5::Handle file = openInHdf5(path, status);
    StructureReader(structure, findings).readFile(file);
  } catch (const Error& error) {
    findings.add(error);
  }
  return structure;
}

}  // namespace glint::formats
