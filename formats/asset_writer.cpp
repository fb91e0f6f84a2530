#include "glint/formats/asset_writer.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "glint/formats/atomic_file.h"
#include "glint/formats/digest.h"
#include "glint/formats/hash.h"
#include "glint/formats/hdf5_handle.h"
#include "glint/formats/load.h"
#include "glint/formats/streamed_writer.h"

namespace glint::formats {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxTextBytes = 60000;   // an object header message holds less than 64 KiB
constexpr std::uint64_t kBigBytes = 64 << 10;  // datasets from here on start on a page
constexpr hsize_t kPageBytes = 4096;
constexpr hsize_t kLineBytes = 64;  // a cache line: where all other datasets start

void writeAttribute(hid_t object, const std::string& name, const AttributeValue& value, const hdf5::TypeTable& types) {
  constexpr ErrorCode io = ErrorCode::io;
  const std::string place = "@" + name;
  const hsize_t count = value.count();
  const hdf5::Handle space(value.scalar ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &count, nullptr), "cannot be written",
                           place, io);
  if (value.type == ElementType::text) {
    std::size_t width = 1;
    bool ascii = true;
    for (const std::string& text : value.texts) {
      width = std::max(width, text.size());
      ascii &= std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 128; });
    }
    if (width * std::max<std::size_t>(value.texts.size(), 1) > kMaxTextBytes || [&] {
          return std::any_of(value.texts.begin(), value.texts.end(),
                             [](const std::string& t) { return t.find('\0') != t.npos; });
        }()) {
      throw Error(ErrorCode::usage, "attribute.size", {}, "/" + place, "is longer than 60000 bytes or holds a NUL");
    }
    const hdf5::Handle type(H5Tcopy(H5T_C_S1), "cannot be written", place, io);
    hdf5::check(H5Tset_size(type, width), "cannot be written", place, io);
    hdf5::check(H5Tset_strpad(type, H5T_STR_NULLPAD), "cannot be written", place, io);
    hdf5::check(H5Tset_cset(type, ascii ? H5T_CSET_ASCII : H5T_CSET_UTF8), "cannot be written", place, io);
    std::string bytes;
    for (const std::string& text : value.texts) bytes += text + std::string(width - text.size(), '\0');
    const hdf5::Handle attribute(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), "cannot be written",
                                 place, io);
    if (count > 0) hdf5::check(H5Awrite(attribute, type, bytes.data()), "cannot be written", place, io);
    return;
  }
  const hdf5::Handle attribute(H5Acreate2(object, name.c_str(), types[value.type], space, H5P_DEFAULT, H5P_DEFAULT),
                               "cannot be written", place, io);
  // Numbers are kept as doubles, which hold every type of the schema exactly; HDF5 converts them.
  if (count > 0) hdf5::check(H5Awrite(attribute, H5T_NATIVE_DOUBLE, value.numbers.data()), "cannot be written", place, io);
}

AttributeValue text(std::string value) { return {ElementType::text, true, {}, {std::move(value)}}; }

/// Root attributes that every kind has.
Attributes commonValues(std::string_view kind, const Provenance& provenance, const std::optional<UdimPlace>& udim) {
  std::vector<std::string> inputs;
  for (const InputRecord& input : provenance.inputs) inputs.push_back(input.hash_hex + "  " + input.name);
  Attributes values = {{"glint_format", text("glint")},
                       {"format_major", {ElementType::i32, true, {kFormatMajor}, {}}},
                       {"format_minor", {ElementType::i32, true, {kFormatMinor}, {}}},
                       {"required_features", {ElementType::text, false, {}, {}}},
                       {"kind", text(std::string(kind))},
                       {"generator", text(provenance.generator)},
                       {"command", text(provenance.command_json.empty() ? "{}" : provenance.command_json)},
                       {"inputs", {ElementType::text, false, {}, std::move(inputs)}}};
  if (udim) {
    values["required_features"].texts = {kUdimFeature};
    values["udim"] = {ElementType::i32, true, {static_cast<double>(udim->tile)}, {}};
    values["udim_margins"] = {ElementType::i32, false, {udim->margins.begin(), udim->margins.end()}, {}};
  }
  return values;
}

/// Attributes of a dataset.
Attributes attributesOf(const PackedArray& array, const std::string& hash) {
  return {
      {"long_name", text(std::string(array.long_name))}, {"units", text(std::string(array.units))}, {"xxh3_128", text(hash)}};
}

/// Groups of the arrays, those that hold groups included.
std::set<std::string> groupsOf(const PackedAsset& packed) {
  std::set<std::string> groups;
  for (const PackedArray& array : packed.arrays) addGroups(array.path, groups);
  return groups;
}

/// Attributes of the root, the digest of the whole asset included.
Attributes rootAttributes(const PackedAsset& packed, const Provenance& provenance, const std::optional<UdimPlace>& udim,
                          const std::map<std::string, std::string>& hashes) {
  FileStructure file;
  file.attributes = commonValues(packed.kind, provenance, udim);
  file.attributes.insert(packed.attributes.begin(), packed.attributes.end());
  for (const std::string& group : groupsOf(packed)) file.groups[group];
  for (const PackedArray& array : packed.arrays) {
    DatasetRecord& record = file.datasets[array.path];
    record.known_type = true;
    record.type = array.type;
    record.dims = array.dims;
    record.attributes = attributesOf(array, hashes.at(array.path));
  }
  file.attributes[std::string(kDigestAttribute)] = text(digestOf(file));
  return std::move(file.attributes);
}

/// Visits the bytes of an array in order.
/// @param visit  visit(bytes, offset): some bytes, and the number of bytes before them
template <class Visit>
void visitBytes(const PackedArray& array, const Visit& visit) {
  if (!array.source) return visit(std::span(static_cast<const std::byte*>(array.data), array.size_bytes), std::uint64_t{0});
  std::uint64_t done = 0;
  array.source([&](std::span<const std::byte> bytes) {
    if (done + bytes.size() <= array.size_bytes) visit(bytes, done);
    done += bytes.size();
  });
  if (done != array.size_bytes)
    throw Error(ErrorCode::failed, "dataset.storage", {}, "/" + array.path, "is given by a source of another size");
}

std::string hashOf(const PackedArray& array) {
  ByteHasher hasher;
  visitBytes(array, [&](std::span<const std::byte> bytes, std::uint64_t) { hasher.add(bytes.data(), bytes.size()); });
  return hasher.hash();
}

/// Where the bytes of a dataset go, and the hash that the metadata has of them.
struct WrittenDataset {
  std::uint64_t offset = 0;
  std::string hash;
};

/// Writes everything but the bytes of the datasets, and finds the places of these bytes in the file.
///
/// HDF5 only reserves the space: the bytes are then written with plain calls, at the speed of the disk and with its errors.
class MetadataWriter {
 public:
  MetadataWriter(const fs::path& path, const PackedAsset& packed) : path_(path), packed_(packed) {
    for (const PackedArray& array : packed.arrays) hashes_[array.path] = hashOf(array);
  }

  /// @return place and hash of each dataset by path
  std::map<std::string, WrittenDataset> write(const Provenance& provenance, const std::optional<UdimPlace>& udim) {
    const hdf5::LibraryScope scope;
    const hdf5::TypeTable types;
    {
      hdf5::Handle file = create();
      const hdf5::Handle root(H5Gopen2(file, "/", H5P_DEFAULT), "cannot be written", "/", ErrorCode::io);
      for (const auto& [name, value] : rootAttributes(packed_, provenance, udim, hashes_))
        writeAttribute(root, name, value, types);
      createGroups(file);
      createDatasets(file, false, types);
      hdf5::check(file.close(), "cannot be written", {}, ErrorCode::io);
    }
    hdf5::Handle file(H5Fopen(path_.c_str(), H5F_ACC_RDWR, access(kPageBytes)), "cannot be written", {}, ErrorCode::io);
    createDatasets(file, true, types);
    hdf5::check(file.close(), "cannot be written", {}, ErrorCode::io);
    return std::move(datasets_);
  }

 private:
  static constexpr ErrorCode kIo = ErrorCode::io;

  /// Access to a file in which every object of `alignment` bytes or more starts at a multiple of `alignment`.
  static hdf5::Handle access(hsize_t alignment) {
    hdf5::Handle properties(H5Pcreate(H5P_FILE_ACCESS), "cannot create properties", {}, kIo);
    hdf5::check(H5Pset_fapl_sec2(properties), "cannot set properties", {}, kIo);
    hdf5::check(H5Pset_libver_bounds(properties, H5F_LIBVER_V18, H5F_LIBVER_V110), "cannot set properties", {}, kIo);
    hdf5::check(H5Pset_file_locking(properties, false, true), "cannot set properties", {}, kIo);
    // Small metadata need not be aligned; datasets below the threshold come from blocks that are switched off here.
    hdf5::check(H5Pset_alignment(properties, alignment == kLineBytes ? 1 : alignment, alignment), "cannot set properties", {},
                kIo);
    hdf5::check(H5Pset_small_data_block_size(properties, 0), "cannot set properties", {}, kIo);
    return properties;
  }

  /// Creation properties without times, attributes kept in the object header (which is checksummed as a whole).
  static hdf5::Handle creation(hid_t type) {
    hdf5::Handle properties(H5Pcreate(type), "cannot create properties", {}, kIo);
    hdf5::check(H5Pset_obj_track_times(properties, false), "cannot set properties", {}, kIo);
    hdf5::check(H5Pset_attr_phase_change(properties, 64, 0), "cannot set properties", {}, kIo);
    if (type != H5P_DATASET_CREATE) hdf5::check(H5Pset_link_phase_change(properties, 64, 0), "cannot set properties", {}, kIo);
    return properties;
  }

  hdf5::Handle create() const {
    return hdf5::Handle(H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, creation(H5P_FILE_CREATE), access(kLineBytes)),
                        "cannot be created", {}, kIo);
  }

  void createGroups(hid_t file) const {
    for (const std::string& group : groupsOf(packed_)) {
      const hdf5::Handle handle(H5Gcreate2(file, group.c_str(), H5P_DEFAULT, creation(H5P_GROUP_CREATE), H5P_DEFAULT),
                                "cannot be written", "/" + group, kIo);
    }
  }

  void createDatasets(hid_t file, bool big, const hdf5::TypeTable& types) {
    std::vector<const PackedArray*> sorted;
    for (const PackedArray& array : packed_.arrays) {
      if ((array.size_bytes >= kBigBytes) == big) sorted.push_back(&array);
    }
    std::sort(sorted.begin(), sorted.end(), [](const PackedArray* a, const PackedArray* b) { return a->path < b->path; });
    for (const PackedArray* array : sorted) createDataset(file, *array, types);
  }

  void createDataset(hid_t file, const PackedArray& array, const hdf5::TypeTable& types) {
    const std::string object = "/" + array.path;
    const hdf5::Handle properties = creation(H5P_DATASET_CREATE);
    hdf5::check(H5Pset_layout(properties, H5D_CONTIGUOUS), "cannot set properties", object, kIo);
    hdf5::check(H5Pset_alloc_time(properties, H5D_ALLOC_TIME_EARLY), "cannot set properties", object, kIo);
    hdf5::check(H5Pset_fill_time(properties, H5D_FILL_TIME_NEVER), "cannot set properties", object, kIo);
    const std::vector<hsize_t> dims(array.dims.begin(), array.dims.end());
    const hdf5::Handle space(H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr), "cannot be written", object,
                             kIo);
    const hdf5::Handle dataset(
        H5Dcreate2(file, array.path.c_str(), types[array.type], space, H5P_DEFAULT, properties, H5P_DEFAULT),
        "cannot be written", object, kIo);
    for (const auto& [name, value] : attributesOf(array, hashes_.at(array.path))) writeAttribute(dataset, name, value, types);
    if (array.size_bytes == 0) return;
    const haddr_t offset = H5Dget_offset(dataset);
    if (offset == HADDR_UNDEF) hdf5::fail("has no place in the file", object, kIo);
    datasets_[array.path] = {offset, hashes_.at(array.path)};
  }

  fs::path path_;
  const PackedAsset& packed_;
  std::map<std::string, std::string> hashes_;
  std::map<std::string, WrittenDataset> datasets_;
};

/// Writes the metadata.
/// @return place and hash of each dataset by path
std::map<std::string, WrittenDataset> writeMetadata(AtomicFile& file, const PackedAsset& packed, const Provenance& provenance,
                                                    const std::optional<UdimPlace>& udim) {
  try {
    return MetadataWriter(file.path(), packed).write(provenance, udim);
  } catch (const Error& error) {
    // HDF5 forgets why a file could not grow.
    std::uint64_t size = kBigBytes;
    for (const PackedArray& array : packed.arrays) size += array.size_bytes;
    if (error.rule() == "file.hdf5") file.reserve(size);
    throw;
  }
}

/// Reads the finished file as a reader would.
void checkWritten(const fs::path& temporary) {
  Findings findings(temporary);
  loadFile(findings);
  for (const Finding& finding : findings.report().findings) {
    if (finding.severity != Severity::error) continue;
    if (findRule(finding.rule).code == ErrorCode::io)
      throw Error(ErrorCode::io, finding.rule, {}, finding.object, "cannot be read back: " + finding.message, finding.remedy);
    throw Error(ErrorCode::failed, finding.rule, {}, finding.object, "cannot be written as a valid asset: " + finding.message);
  }
}

void writePacked(const fs::path& path, const PackedAsset& packed, const Provenance& provenance, const WriteOptions& options) {
  if (!options.overwrite && findOutput(path).kind == OutputTarget::Kind::file) {
    throw Error(ErrorCode::io, "file.writable", path.string(), {}, "exists", "pass --force to replace it");
  }
  AtomicFile file(path);
  const auto datasets = writeMetadata(file, packed, provenance, options.udim);
  for (const PackedArray& array : packed.arrays) {
    if (array.size_bytes == 0) continue;
    const auto& [start, hash] = datasets.at(array.path);
    // A source is read twice, and may have changed: arrays in memory have not.
    ByteHasher hasher;
    visitBytes(array, [&, first = start](std::span<const std::byte> bytes, std::uint64_t offset) {
      if (array.source) hasher.add(bytes.data(), bytes.size());
      file.write(bytes.data(), bytes.size(), first + offset);
    });
    if (array.source && hasher.hash() != hash)
      throw Error(ErrorCode::failed, "dataset.hash", {}, "/" + array.path, "is read from a file that has changed meanwhile",
                  "run the program again");
  }
  checkWritten(file.path());
  file.publish(options.overwrite);
}

}  // namespace

void writeAsset(const fs::path& path, const AnyAsset& asset, const Provenance& provenance, const WriteOptions& options) {
  writeStreamedAsset(path, asset, provenance, {}, options);
}

void writeStreamedAsset(const fs::path& path, const AnyAsset& asset, const Provenance& provenance, const ByteSources& sources,
                        const WriteOptions& options) {
  try {
    PackedAsset packed = kinds()[asset.index()]->pack(asset);
    for (PackedArray& array : packed.arrays)
      if (const auto source = sources.find("/" + array.path); source != sources.end()) array.source = source->second;
    writePacked(path, packed, provenance, options);
  } catch (const Error& error) {
    if (!error.path().empty()) throw;
    // Rules and HDF5 know the object only: name the file that was to be written.
    throw Error(error.code(), error.rule(), path.string(), error.object(), error.clause(), error.remedy());
  }
}

}  // namespace glint::formats
