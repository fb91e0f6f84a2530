#ifndef H5_USE_110_API
#define H5_USE_110_API
#endif
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <set>

#include "glint/bake/bin_map/bin_map.h"
#include "glint/formats/asset_reader.h"
#include "glint/formats/asset_writer.h"
#include "glint/formats/findings.h"
#include "glint/formats/hdf5_handle.h"
#include "glint/formats/kinds/kind.h"
#include "glint/formats/validate.h"
#include "glint/query/detail/bin_map/bin_blocks.h"
#include "support/hdf5_bytes.h"
#include "support/sample_assets.h"
#include "support/source_folder.h"
#include "support/temp_folder.h"
#include "support/test_maps.h"

namespace glint::formats::formats_rules_test {
namespace {

namespace fs = std::filesystem;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

enum class Base {
  normals,
  heights,
  pyramid,
  pyramid_normals,
  compressed_normals,
  shard,
  shard_normals,
  compressed,
  compressed_f32,
  spots,
  bin_map,
  histograms,
  moments,
  tiny_scattered,
  tiny_tiled,
  wang_tiles,
  wang_pyramid,
  wang_cp,
  wave,
  wave_cp,
  sh_lobes,
  sh_light,
  displacement,
  displacement_rgb,
  displacement_table
};
constexpr Base kBases[] = {Base::shard_normals,
                           Base::pyramid_normals,
                           Base::compressed_normals,
                           Base::normals,
                           Base::heights,
                           Base::pyramid,
                           Base::shard,
                           Base::compressed,
                           Base::compressed_f32,
                           Base::spots,
                           Base::bin_map,
                           Base::histograms,
                           Base::moments,
                           Base::tiny_scattered,
                           Base::tiny_tiled,
                           Base::wang_tiles,
                           Base::wang_pyramid,
                           Base::wang_cp,
                           Base::wave,
                           Base::wave_cp,
                           Base::sh_lobes,
                           Base::sh_light,
                           Base::displacement,
                           Base::displacement_rgb,
                           Base::displacement_table};

void writeBase(const fs::path& path, Base base) {
  const Provenance provenance = test::sampleProvenance();
  switch (base) {
    case Base::normals:
      return writeAsset(path, test::sampleNormals(32, 32).map, provenance);
    case Base::heights:
      return writeAsset(path, test::sampleHeights(16, 16).map, provenance);
    case Base::pyramid:
      return writeAsset(path, test::samplePyramid(32, BlockPrecision::f32).pyramid, provenance);
    case Base::pyramid_normals:
      return writeAsset(path, test::samplePyramidWithNormals(32, NearType::i16).pyramid, provenance);
    case Base::compressed_normals:
      return writeAsset(path, test::sampleNdfCpWithNormals(32, NearType::f32).ndf, provenance);
    case Base::shard:
      return writeAsset(path, test::samplePyramidShard(32).shard, provenance);
    case Base::shard_normals:
      return writeAsset(path, test::samplePyramidShardWithNormals(32).shard, provenance);
    case Base::compressed:
      return writeAsset(path, test::sampleNdfCp(32, CompressionMethod::cp, CoefficientType::i8).ndf, provenance);
    case Base::displacement:
      return writeAsset(path, test::sampleDisplacement(32).displacement, provenance);
    case Base::spots:
      return writeAsset(
          path, test::sampleNdfCp(32, CompressionMethod::tucker, CoefficientType::i8, test::SampleForm::spots).ndf, provenance);
    case Base::displacement_rgb:
      return writeAsset(path, test::sampleDisplacement(32, true).displacement, provenance);
    case Base::displacement_table:
      return writeAsset(path, test::sampleDisplacedTable(32).displacement, provenance);
    case Base::compressed_f32:
      return writeAsset(path, test::sampleNdfCp(32, CompressionMethod::cp, CoefficientType::f32).ndf, provenance);
    case Base::bin_map:
      return writeAsset(path, test::sampleBinMap(64, 48).map, provenance);
    case Base::histograms:
      return writeAsset(path, test::sampleHistograms(22, 19).sat, provenance);
    case Base::moments:
      return writeAsset(path, test::sampleSlopeMoments(9, 4).moments, provenance);
    case Base::tiny_scattered:
      return writeAsset(path, test::sampleTinyExample(8, TinyMode::scattered).example, provenance);
    case Base::tiny_tiled:
      return writeAsset(path, test::sampleTinyExample(8, TinyMode::tiled).example, provenance);
    case Base::wang_tiles:
      return writeAsset(path, test::sampleWangTiles().tiles, provenance);
    case Base::wang_pyramid:
      return writeAsset(path, test::sampleWangPyramid().asset, provenance);
    case Base::wang_cp:
      return writeAsset(path, test::sampleWangCp().asset, provenance);
    case Base::wave:
      return writeAsset(path, test::sampleWavePyramid(64, WaveChannels::spectral, BlockPrecision::f16).wave, provenance);
    case Base::wave_cp:
      return writeAsset(path, test::sampleWaveCp(64, WaveChannels::spectral).wave, provenance);
    case Base::sh_lobes:
      return writeAsset(path, test::sampleShLobes().lobes, provenance);
    case Base::sh_light:
      return writeAsset(path, test::sampleShLight().light, provenance);
  }
}

/// An asset opened for changes with plain HDF5.
class Patch {
 public:
  explicit Patch(const fs::path& path, hsize_t alignment = 64) {
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_V110);
    H5Pset_alignment(access, 1, alignment);
    H5Pset_small_data_block_size(access, 0);
    file_ = H5Fopen(path.c_str(), H5F_ACC_RDWR, access);
    H5Pclose(access);
  }
  ~Patch() { H5Fclose(file_); }
  Patch(const Patch&) = delete;
  Patch& operator=(const Patch&) = delete;

  hid_t file() const { return file_; }

  void remove(const char* object, const char* attribute) const { H5Adelete_by_name(file_, object, attribute, H5P_DEFAULT); }

  void set(const char* object, const char* attribute, hid_t type, hid_t memory_type, const void* value,
           hsize_t count = 0) const {
    if (H5Aexists_by_name(file_, object, attribute, H5P_DEFAULT) > 0) remove(object, attribute);
    const hid_t space = count == 0 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &count, nullptr);
    const hid_t id = H5Acreate_by_name(file_, object, attribute, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(id, memory_type, value);
    H5Aclose(id);
    H5Sclose(space);
  }
  void setInteger(const char* attribute, int value) const { set("/", attribute, H5T_STD_I32LE, H5T_NATIVE_INT, &value); }
  void setReal(const char* attribute, float value) const { set("/", attribute, H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, &value); }
  void setText(const char* attribute, const std::string& value, hsize_t count = 0) const {
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, value.size());
    set("/", attribute, type, type, value.data(), count);
    H5Tclose(type);
  }

  /// Changes element `index` of a dataset of T.
  template <class T>
  void change(const char* path, std::size_t index, const std::function<void(T&)>& edit) const {
    const hid_t dataset = H5Dopen2(file_, path, H5P_DEFAULT);
    const hid_t type = H5Dget_type(dataset);
    std::vector<T> values(H5Dget_storage_size(dataset) / sizeof(T));
    H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    edit(values.at(index));
    H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    H5Tclose(type);
    H5Dclose(dataset);
  }

  /// Replaces a dataset by a new one made with other properties; `prepare` may change them.
  void replace(
      const char* path, hid_t type, std::vector<hsize_t> dims, bool write,
      const std::function<void(hid_t)>& prepare = [](hid_t) {}) const {
    if (H5Lexists(file_, path, H5P_DEFAULT) > 0) H5Ldelete(file_, path, H5P_DEFAULT);
    const hid_t properties = H5Pcreate(H5P_DATASET_CREATE);
    prepare(properties);
    const hid_t space = H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr);
    const hid_t dataset = H5Dcreate2(file_, path, type, space, H5P_DEFAULT, properties, H5P_DEFAULT);
    hsize_t size = 16;
    for (const hsize_t n : dims) size *= n;
    const std::vector<char> zeros(write ? size : 0);
    if (write) H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, zeros.data());
    for (const char* name : {"long_name", "units", "xxh3_128"}) {
      const hid_t text = H5Tcopy(H5T_C_S1);
      H5Tset_size(text, 32);
      set(path, name, text, text, "00000000000000000000000000000000");
      H5Tclose(text);
    }
    H5Dclose(dataset);
    H5Sclose(space);
    H5Pclose(properties);
  }

 private:
  hid_t file_;
};

constexpr unsigned kMost = 2000;  // more links and attributes than a file may have

/// A new group that keeps up to `compact` links and attributes in its object header.
class Group {
 public:
  Group(hid_t file, const char* name, unsigned compact) {
    const hid_t properties = H5Pcreate(H5P_GROUP_CREATE);
    H5Pset_link_phase_change(properties, compact, 0);
    H5Pset_est_link_info(properties, compact, 8);  // room for all: each link would add a part to the header
    H5Pset_attr_phase_change(properties, compact, 0);
    id_ = H5Gcreate2(file, name, H5P_DEFAULT, properties, H5P_DEFAULT);
    H5Pclose(properties);
  }
  ~Group() { H5Gclose(id_); }
  Group(const Group&) = delete;
  Group& operator=(const Group&) = delete;
  hid_t id() const { return id_; }

 private:
  hid_t id_;
};

struct Fixture {
  const char* rule;
  Base base;
  std::function<void(const fs::path&)> damage;
  bool opens = false;  ///< whether readers still accept the file
};

Fixture patched(const char* rule, Base base, std::function<void(const Patch&)> change, bool opens = false) {
  return {rule, base, [change](const fs::path& path) { change(Patch(path)); }, opens};
}

void overwrite(const fs::path& path, std::streamoff offset, const std::string& bytes) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(offset);
  file << bytes;
}

constexpr hsize_t kSize = 16;  // of Base::heights

/// One failing file for every rule, and several where there are several ways to break it.
std::vector<Fixture> fileFixtures() {
  return {
      {"file.readable", Base::heights, [](const fs::path& path) { fs::remove(path); }},
      {"file.readable", Base::heights, [](const fs::path& path) { fs::remove(path), fs::create_directory(path); }},
      {"file.signature", Base::heights, [](const fs::path& path) { overwrite(path, 0, "GIF89a"); }},
      {"file.signature", Base::heights, [](const fs::path& path) { fs::resize_file(path, 0); }},
      {"file.superblock", Base::heights,
       [](const fs::path& path) {
         H5Fclose(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));  // HDF5's default: version 0
       }},
      {"file.truncated", Base::heights, [](const fs::path& path) { fs::resize_file(path, fs::file_size(path) - 1); }},
      {"file.trailing", Base::heights,
       [](const fs::path& path) { std::ofstream(path, std::ios::binary | std::ios::app) << "more"; }},
      {"file.padding", Base::heights, [](const fs::path& path) { overwrite(path, 60, "x"); }, true},
      {"file.hdf5", Base::heights, [](const fs::path& path) { overwrite(path, 44, "damaged checksum"); }},
      {"file.hdf5", Base::heights, [](const fs::path& path) { overwrite(path, 70, "damaged header"); }},
  };
}

std::vector<Fixture> linkFixtures() {
  return {
      patched("group.depth", Base::heights,
              [](const Patch& patch) {
                std::string path;
                for (int k = 0; k < 6; ++k) H5Gclose(H5Gcreate2(patch.file(), (path += "/g").c_str(), 0, 0, 0));
              }),
      patched("group.size", Base::heights,
              [](const Patch& patch) {
                const Group group(patch.file(), "g", kMost);
                for (int k = 0; k < 1100; ++k) H5Gclose(H5Gcreate2(group.id(), ("l" + std::to_string(k)).c_str(), 0, 0, 0));
              }),
      patched("object.heap", Base::heights,
              [](const Patch& patch) {
                for (int k = 0; k < 1100; ++k) H5Gclose(H5Gcreate2(patch.file(), ("l" + std::to_string(k)).c_str(), 0, 0, 0));
              }),
      patched("object.heap", Base::heights,
              [](const Patch& patch) {
                for (int k = 0; k < 80; ++k) patch.setInteger(("a" + std::to_string(k)).c_str(), k);
              }),
      patched("file.objects", Base::heights,
              [](const Patch& patch) {
                for (int g = 0; g < 5; ++g) {
                  const Group group(patch.file(), ("g" + std::to_string(g)).c_str(), kMost);
                  for (int k = 0; k < 1000; ++k) H5Gclose(H5Gcreate2(group.id(), ("l" + std::to_string(k)).c_str(), 0, 0, 0));
                }
              }),
      patched("text.padding", Base::heights,
              [](const Patch& patch) { patch.setText("generator", std::string("tool 1.0\0hidden", 15)); }),
      patched("text.utf8", Base::heights, [](const Patch& patch) { patch.setText("generator", "tool \u202e0.1"); }),
      patched("group.size", Base::heights,
              [](const Patch& patch) { H5Lcreate_soft("/heights", patch.file(), std::string(300, 'x').c_str(), 0, 0); }),
      patched("text.utf8", Base::heights, [](const Patch& patch) { patch.setText("generator", "tool \xff 1.0"); }),
      patched("text.utf8", Base::heights, [](const Patch& patch) { patch.setText("generator", "\x1b[2J"); }),
      patched("text.utf8", Base::heights, [](const Patch& patch) { patch.setInteger("\xc3(", 1); }),
      patched("text.utf8", Base::heights, [](const Patch& patch) { H5Gclose(H5Gcreate2(patch.file(), "\x1b[31m", 0, 0, 0)); }),
      patched("link.hard", Base::heights,
              [](const Patch& patch) {
                H5Lmove(patch.file(), "heights", patch.file(), "other", 0, 0);
                H5Lcreate_soft("/other", patch.file(), "heights", 0, 0);
              }),
      patched("link.hard", Base::heights,
              [](const Patch& patch) { H5Lcreate_external("/etc/passwd", "/", patch.file(), "secrets", 0, 0); }),
      patched("link.hard", Base::normals,
              [](const Patch& patch) {
                H5Ldelete(patch.file(), "bounds", 0);
                H5Lcreate_external("other.glint", "/bounds", patch.file(), "bounds", 0, 0);
              }),
      patched("link.single", Base::heights,
              [](const Patch& patch) { H5Lcreate_hard(patch.file(), "heights", patch.file(), "again", 0, 0); }),
      patched("link.single", Base::normals,
              [](const Patch& patch) { H5Lcreate_hard(patch.file(), "bounds", patch.file(), "bounds/loop", 0, 0); }),
      patched("object.type", Base::heights,
              [](const Patch& patch) {
                const hid_t type = H5Tcopy(H5T_STD_I32LE);
                H5Tcommit2(patch.file(), "type", type, 0, 0, 0);
                H5Tclose(type);
              }),
      patched("object.attributes", Base::heights,
              [](const Patch& patch) {
                const Group group(patch.file(), "g", kMost);
                for (int k = 0; k < 80; ++k)
                  patch.set("g", ("a" + std::to_string(k)).c_str(), H5T_STD_I32LE, H5T_NATIVE_INT, &k);
              }),
  };
}

/// Says behind right checksums that the attribute `inputs` has 2^20 elements.
void growInputs(const fs::path& path) {
  test::Bytes bytes = test::readBytes(path.string());
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  constexpr std::size_t kNameAndType = 7 + 8, kDimension = 4;  // "inputs" and its NUL, a datatype of 8 bytes; then a dataspace
  const std::uint64_t count = 1 << 20;
  for (const std::size_t place : {0, 8})  // its size, and the most that it may be
    std::memcpy(bytes.data() + text.find("inputs") + kNameAndType + kDimension + place, &count, sizeof count);
  test::renewChecksums(bytes, test::checksummedRanges(bytes));
  test::writeBytes(path.string(), bytes);
}

std::vector<Fixture> attributeFixtures() {
  return {
      patched("attribute.fixed", Base::heights,
              [](const Patch& patch) {
                const hid_t type = H5Tcopy(H5T_C_S1);
                H5Tset_size(type, H5T_VARIABLE);
                const char* text = "tool 1.0";
                patch.set("/", "generator", type, type, &text);
                H5Tclose(type);
              }),
      {"attribute.size", Base::heights, &growInputs},
      patched("object.heap", Base::heights, [](const Patch& patch) { patch.setText("command", std::string(100000, ' ')); }),
      patched("attribute.missing", Base::heights, [](const Patch& patch) { patch.remove("/", "width"); }),
      patched("attribute.missing", Base::heights, [](const Patch& patch) { patch.remove("/", "glint_format"); }),
      patched("attribute.missing", Base::heights, [](const Patch& patch) { patch.remove("/heights", "units"); }),
      patched("attribute.missing", Base::heights, [](const Patch& patch) { patch.remove("/heights", "xxh3_128"); }),
      patched("attribute.type", Base::heights,
              [](const Patch& patch) {
                const double width = kSize;
                patch.set("/", "width", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &width);
              }),
      patched("attribute.type", Base::heights, [](const Patch& patch) { patch.setReal("width", kSize); }),
      patched("attribute.type", Base::heights,
              [](const Patch& patch) {
                const int widths[2] = {kSize, kSize};
                patch.set("/", "width", H5T_STD_I32LE, H5T_NATIVE_INT, widths, 2);
              }),
      patched("attribute.type", Base::pyramid,
              [](const Patch& patch) {
                const int columns[2] = {4, 2};
                patch.set("/", "level_columns", H5T_STD_I32LE, H5T_NATIVE_INT, columns, 2);
              }),
      patched("attribute.value", Base::heights, [](const Patch& patch) { patch.setInteger("width", 0); }),
      patched("attribute.value", Base::heights, [](const Patch& patch) { patch.setInteger("height", -16); }),
      patched("attribute.value", Base::pyramid, [](const Patch& patch) { patch.setReal("sigma_r", kNan); }),
      patched("attribute.value", Base::pyramid, [](const Patch& patch) { patch.setReal("sigma_r", 0); }),
      patched("attribute.value", Base::pyramid, [](const Patch& patch) { patch.setReal("value_scale", INFINITY); }),
      patched("attribute.value", Base::pyramid, [](const Patch& patch) { patch.setInteger("resolution", 2048); }),
      patched("attribute.value", Base::pyramid, [](const Patch& patch) { patch.setInteger("level_count", 17); }),
      patched("attribute.value", Base::pyramid, [](const Patch& patch) { patch.setText("surface", "bumpy"); }),
      patched(
          "attribute.json", Base::heights, [](const Patch& patch) { patch.setText("command", "{\"a\": 1"); }, true),
      patched(
          "attribute.json", Base::heights, [](const Patch& patch) { patch.setText("command", "[1]"); }, true),
      patched(
          "file.digest", Base::heights, [](const Patch& patch) { patch.setText("generator", "another 1.0"); }, true),
      patched(
          "file.digest", Base::heights, [](const Patch& patch) { patch.setText("digest", std::string(32, '0')); }, true),
      patched(
          "group.unknown", Base::heights, [](const Patch& patch) { H5Gclose(H5Gcreate2(patch.file(), "g", 0, 0, 0)); }, true),
      patched(
          "attribute.unknown", Base::heights, [](const Patch& patch) { patch.setInteger("answer", 42); }, true),
      patched("format.name", Base::heights, [](const Patch& patch) { patch.setText("glint_format", "other"); }),
      patched("format.major", Base::heights, [](const Patch& patch) { patch.setInteger("format_major", 2); }),
      patched(
          "format.minor", Base::heights, [](const Patch& patch) { patch.setInteger("format_minor", 7); }, true),
      patched("format.feature", Base::heights, [](const Patch& patch) { patch.setText("required_features", "zstd", 1); }),
      patched("format.kind", Base::heights, [](const Patch& patch) { patch.setText("kind", "hologram"); }),
  };
}

std::vector<Fixture> storageFixtures() {
  const auto external = [](hid_t properties) { H5Pset_external(properties, "/etc/passwd", 0, kSize * kSize * 4); };
  const auto chunked = [](hid_t properties) {
    const hsize_t chunk[2] = {4, 4};
    H5Pset_chunk(properties, 2, chunk);
    H5Pset_deflate(properties, 1);
  };
  const auto compact = [](hid_t properties) { H5Pset_layout(properties, H5D_COMPACT); };
  const auto virtually = [](hid_t properties) {
    const hsize_t dims[2] = {kSize, kSize};
    const hid_t space = H5Screate_simple(2, dims, nullptr);
    H5Pset_virtual(properties, space, "other.glint", "/heights", space);
    H5Sclose(space);
  };
  return {
      patched("dataset.vlen", Base::heights,
              [](const Patch& patch) {
                const hid_t type = H5Tvlen_create(H5T_IEEE_F32LE);
                patch.replace("heights", type, {kSize, kSize}, false);
                H5Tclose(type);
              }),
      patched("dataset.virtual", Base::heights,
              [=](const Patch& patch) {
                patch.replace("heights", H5T_IEEE_F32LE, {kSize, kSize}, false, virtually);
              }),
      patched("dataset.external", Base::heights,
              [=](const Patch& patch) {
                patch.replace("heights", H5T_IEEE_F32LE, {kSize, kSize}, false, external);
              }),
      patched("dataset.layout", Base::heights,
              [=](const Patch& patch) {
                patch.replace("heights", H5T_IEEE_F32LE, {kSize, kSize}, true, chunked);
              }),
      patched("dataset.layout", Base::heights,
              [=](const Patch& patch) {
                patch.replace("heights", H5T_IEEE_F32LE, {kSize, kSize}, true, compact);
              }),
      patched("dataset.storage", Base::heights,
              [](const Patch& patch) {
                patch.replace("heights", H5T_IEEE_F32LE, {kSize, kSize}, false);
              }),
      patched("dataset.storage", Base::heights,
              [](const Patch& patch) {
                patch.replace("heights", H5T_IEEE_F32LE, {1u << 30, 1u << 30}, false);
              }),
      {"dataset.alignment", Base::heights,
       [](const fs::path& path) {
         Patch(path, 4099).replace("heights", H5T_IEEE_F32LE, {kSize, kSize}, true);
       }},
      {"dataset.alignment_64", Base::heights,
       [](const fs::path& path) {
         Patch(path, 4104).replace("heights", H5T_IEEE_F32LE, {kSize, kSize}, true);
       },
       true},
  };
}

std::vector<Fixture> datasetFixtures() {
  return {
      patched(
          "dataset.unknown", Base::heights, [](const Patch& patch) { patch.replace("extra", H5T_IEEE_F32LE, {kSize}, true); },
          true),
      patched("dataset.missing", Base::heights, [](const Patch& patch) { H5Ldelete(patch.file(), "heights", 0); }),
      patched("dataset.missing", Base::pyramid_normals, [](const Patch& patch) { H5Ldelete(patch.file(), "near/normals", 0); }),
      patched("dataset.missing", Base::compressed_normals,
              [](const Patch& patch) { H5Ldelete(patch.file(), "near/bounds/level_02", 0); }),
      patched("attribute.missing", Base::pyramid_normals, [](const Patch& patch) { patch.remove("/", "near_step"); }),
      patched("attribute.missing", Base::pyramid_normals,
              [](const Patch& patch) { patch.remove("/", "near_bounds_level_count"); }),
      patched(
          "dataset.unknown", Base::pyramid_normals, [](const Patch& patch) { patch.remove("/", "near_normals"); }, true),
      patched(
          "attribute.unknown", Base::pyramid, [](const Patch& patch) { patch.setReal("near_step", 0); }, true),
      patched("dataset.type", Base::pyramid_normals, [](const Patch& patch) { patch.setText("near_normals", "f32"); }),
      patched("dataset.missing", Base::pyramid, [](const Patch& patch) { H5Ldelete(patch.file(), "level_01/masks", 0); }),
      patched("dataset.type", Base::heights,
              [](const Patch& patch) {
                patch.replace("heights", H5T_STD_I32LE, {kSize, kSize}, true);
              }),
      patched("dataset.type", Base::heights,
              [](const Patch& patch) {
                patch.replace("heights", H5T_IEEE_F32BE, {kSize, kSize}, true);
              }),
      patched("dataset.type", Base::pyramid, [](const Patch& patch) { patch.setText("precision", "f16"); }),
      patched("dataset.type", Base::compressed,
              [](const Patch& patch) {
                patch.replace("clusters", H5T_STD_U64LE, {2, 16}, true);
              }),
      patched("dataset.type", Base::heights,
              [](const Patch& patch) {
                const hid_t type = H5Tcopy(H5T_IEEE_F32LE);
                H5Tcommit2(patch.file(), "type", type, 0, 0, 0);
                patch.replace("heights", type, {kSize, kSize}, true);
                H5Ldelete(patch.file(), "type", 0);
                H5Tclose(type);
              }),
      patched("dataset.dims", Base::heights,
              [](const Patch& patch) {
                patch.replace("heights", H5T_IEEE_F32LE, {kSize, kSize - 1}, true);
              }),
      patched("dataset.dims", Base::heights,
              [](const Patch& patch) { patch.replace("heights", H5T_IEEE_F32LE, {kSize * kSize}, true); }),
      patched("dataset.dims", Base::heights, [](const Patch& patch) { patch.setInteger("width", kSize + 1); }),
      patched("dataset.dims", Base::pyramid,
              [](const Patch& patch) { patch.replace("level_00/block_means", H5T_IEEE_F32LE, {3}, true); }),
      patched("dataset.dims", Base::compressed,
              [](const Patch& patch) { patch.replace("image_slots", H5T_STD_U16LE, {20}, true); }),
      patched(
          "dataset.hash", Base::heights,
          [](const Patch& patch) { patch.change<float>("heights", 3, [](float& h) { h += 1; }); }, true),
  };
}

std::vector<Fixture> pyramidFixtures() {
  return {
      patched("shape.resolution", Base::pyramid, [](const Patch& patch) { patch.setInteger("resolution", 65); }),
      patched("shape.strides", Base::pyramid,
              [](const Patch& patch) {
                const float strides[3] = {8, 16.5f, 32};
                patch.set("/", "level_strides", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, strides, 3);
              }),
      patched("shape.slopes", Base::pyramid,
              [](const Patch& patch) {
                const float covariance[3] = {0.1f, 0.2f, 0.1f};
                patch.set("/", "slope_covariance", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, covariance, 3);
              }),
      patched("shape.slopes", Base::compressed,
              [](const Patch& patch) {
                const float covariance[3] = {-0.1f, 0, 0.1f};
                patch.set("/", "slope_covariance", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, covariance, 3);
              }),
      patched("shape.grid", Base::pyramid, [](const Patch& patch) { patch.setInteger("width", 64); }),
      patched("shape.grid", Base::compressed, [](const Patch& patch) { patch.setInteger("height", 31 * 2); }),
      patched("normals.bounds_levels", Base::normals,
              [](const Patch& patch) {
                patch.setInteger("bounds_level_count", 4);
                H5Ldelete(patch.file(), "bounds/level_04", 0);
              }),
      patched("near.step", Base::pyramid_normals, [](const Patch& patch) { patch.setReal("near_step", 0x1p-14f); }),
      patched("near.step", Base::pyramid_normals, [](const Patch& patch) { patch.setReal("near_step", 2e-5f); }),
      patched("near.step", Base::compressed_normals, [](const Patch& patch) { patch.setReal("near_step", 0.5f); }),
      patched("near.bounds_levels", Base::pyramid_normals,
              [](const Patch& patch) {
                patch.setInteger("near_bounds_level_count", 4);
                H5Ldelete(patch.file(), "near/bounds/level_04", 0);
              }),
      patched(
          "pyramid.masks", Base::pyramid,
          [](const Patch& patch) { patch.change<std::uint64_t>("level_00/masks", 2, [](auto& mask) { mask |= 1ull << 16; }); }),
      patched(
          "pyramid.mask_ranks", Base::pyramid,
          [](const Patch& patch) { patch.change<std::uint32_t>("level_00/mask_ranks", 2, [](auto& first) { first += 1; }); }),
      patched(
          "pyramid.mask_ranks", Base::pyramid,
          [](const Patch& patch) { patch.change<std::uint32_t>("level_02/mask_ranks", 1, [](auto& first) { first = ~0u; }); }),
      patched("pyramid.mask_ranks", Base::pyramid,
              [](const Patch& patch) { patch.change<std::uint64_t>("level_01/masks", 1, [](auto& mask) { mask ^= 1; }); }),
  };
}

/// Shortens the arrays of images of a compressed pyramid to 20.
void keep20Images(const Patch& patch) {
  for (const char* path : {"image_regions", "image_slots"}) patch.replace(path, H5T_STD_U16LE, {20}, true);
  for (const char* path : {"image_scales", "density_scales"}) patch.replace(path, H5T_IEEE_F32LE, {20}, true);
  patch.replace("block_masks", H5T_STD_U64LE, {20, 1}, true);
  patch.replace("first_block", H5T_STD_U32LE, {21}, true);
}

std::vector<Fixture> ndfCpFixtures() {
  return {
      patched("compressed.images", Base::compressed, &keep20Images),
      patched("compressed.slots", Base::compressed,
              [](const Patch& patch) { patch.change<std::uint16_t>("image_regions", 5, [](auto& region) { region = 2; }); }),
      patched("compressed.slots", Base::compressed,
              [](const Patch& patch) { patch.change<std::uint16_t>("image_slots", 5, [](auto& slot) { slot = 40; }); }),
      patched("compressed.slots", Base::compressed,
              [](const Patch& patch) { patch.change<std::uint16_t>("image_slots", 5, [](auto& slot) { slot ^= 1; }); }),
      patched("compressed.masks", Base::compressed,
              [](const Patch& patch) { patch.change<std::uint64_t>("masks", 5, [](auto& mask) { mask |= 1ull << 40; }); }),
      patched(
          "compressed.masks", Base::compressed,
          [](const Patch& patch) { patch.change<NdfCluster>("clusters", 5, [](auto& cluster) { cluster.slice_count += 1; }); }),
      patched("compressed.mask_ranks", Base::compressed,
              [](const Patch& patch) { patch.change<std::uint32_t>("mask_ranks", 5, [](auto& rank) { rank = 1; }); }),
      patched("compressed.first_block", Base::compressed,
              [](const Patch& patch) { patch.change<std::uint32_t>("first_block", 5, [](auto& first) { first = ~0u; }); }),
      patched("compressed.first_block", Base::compressed,
              [](const Patch& patch) { patch.change<std::uint64_t>("block_masks", 5, [](auto& mask) { mask ^= 1; }); }),
      patched("compressed.first_block", Base::compressed,
              [](const Patch& patch) { patch.replace("block_masses", H5T_STD_U8LE, {20}, true); }),
      patched(
          "compressed.ranks", Base::compressed,
          [](const Patch& patch) { patch.change<NdfCluster>("clusters", 5, [](auto& cluster) { cluster.columns = 60000; }); }),
      patched("compressed.ranks", Base::compressed,
              [](const Patch& patch) { patch.change<NdfCluster>("clusters", 5, [](auto& cluster) { cluster.rank_y = 1; }); }),
      patched("compressed.ranges", Base::compressed,
              [](const Patch& patch) {
                patch.change<NdfCluster>("clusters", 5, [](auto& cluster) { cluster.first_basis = ~0u; });
              }),
      patched("compressed.ranges", Base::compressed,
              [](const Patch& patch) {
                patch.change<NdfCluster>("clusters", 5, [](auto& cluster) { cluster.first_coefficient += 1000; });
              }),
      patched("compressed.ranges", Base::compressed,
              [](const Patch& patch) {
                patch.change<NdfCluster>("clusters", 5, [](auto& cluster) { cluster.first_scale = 1000; });
              }),
      patched(
          "compressed.ranges", Base::compressed,
          [](const Patch& patch) { patch.change<NdfCluster>("clusters", 5, [](auto& cluster) { cluster.first_word = ~0u; }); }),
      patched("compressed.ranks", Base::compressed,
              [](const Patch& patch) {
                patch.change<NdfCluster>("clusters", 5, [](auto& cluster) { cluster.narrow_columns = 4; });
              }),
      patched("compressed.places", Base::compressed,
              [](const Patch& patch) { patch.change<std::uint16_t>("block_places", 5, [](auto& place) { place = 4; }); }),
      patched("compressed.places", Base::compressed,
              [](const Patch& patch) { patch.change<std::uint16_t>("place_blocks", 5, [](auto& block) { block = 60000; }); }),
      patched("compressed.spots", Base::spots,
              [](const Patch& patch) { patch.change<std::uint8_t>("coefficients", 0, [](auto& before) { before = 1; }); }),
      patched("compressed.spots", Base::spots,
              [](const Patch& patch) {
                std::uint32_t slices = 0;
                patch.change<NdfCluster>("clusters", 0, [&](auto& cluster) { slices = cluster.slice_count; });
                patch.change<std::uint8_t>("coefficients", firstSpotOffset(slices), [](auto& x) { x = kLastSpotPlace + 1; });
              }),
      patched("compressed.spots", Base::spots,
              [](const Patch& patch) { patch.replace("spot_sums", H5T_IEEE_F32LE, {304}, true); }),
  };
}

std::vector<Fixture> displacementFixtures() {
  const auto nan = [](float& value) { value = kNan; };
  return {
      patched("displacement.levels", Base::displacement, [](const Patch& patch) { patch.setInteger("width", 36); }),
      patched("displacement.levels", Base::displacement, [](const Patch& patch) { patch.setInteger("width", 3); }),
      patched("dataset.missing", Base::displacement, [](const Patch& patch) { patch.setInteger("more_terms", 1); }),
      patched("displacement.base", Base::displacement, [](const Patch& patch) { patch.setText("base", "table"); }),
      patched("displacement.base", Base::displacement_table, [](const Patch& patch) { patch.setText("base", "ggx"); }),
      patched("dataset.missing", Base::displacement, [](const Patch& patch) { patch.setReal("diffuse_share", 0.5f); }),
      patched(
          "displacement.base_table", Base::displacement_table,
          [](const Patch& patch) { patch.change<float>("base_table", 40000, [](float& f) { f = -0.5f; }); }, true),
      patched("displacement.levels", Base::displacement,
              [](const Patch& patch) {
                const int factors[2] = {4, 4};
                patch.set("/", "level_factors", H5T_STD_I32LE, H5T_NATIVE_INT, factors, 2);
              }),
      patched(
          "displacement.bases", Base::displacement_rgb,
          [](const Patch& patch) { patch.change<float>("level_00/lobe_colors", 4, [](float& c) { c = 1.25f; }); }, true),
      patched(
          "displacement.bases", Base::displacement_rgb,
          [](const Patch& patch) { patch.change<float>("level_01/lobe_alphas", 1, [](float& a) { a = 0; }); }, true),
      patched("dataset.missing", Base::displacement, [](const Patch& patch) { patch.setInteger("has_lobe_colors", 1); }),
      patched(
          "displacement.heights", Base::displacement,
          [nan](const Patch& patch) { patch.change<float>("level_01/heights", 3, nan); }, true),
      patched(
          "displacement.lobes", Base::displacement,
          [](const Patch& patch) { patch.change<float>("level_00/lobes", 0, [](float& mu) { mu = 1.5f; }); }, true),
      patched(
          "displacement.lobes", Base::displacement,
          [](const Patch& patch) { patch.change<float>("level_00/lobes", 7, [](float& amplitude) { amplitude = -1; }); }, true),
      patched(
          "displacement.terms", Base::displacement_rgb,
          [nan](const Patch& patch) { patch.change<float>("level_01/spatial_terms", 3, nan); }, true),
      patched(
          "displacement.terms", Base::displacement_rgb,
          [](const Patch& patch) {
            patch.change<std::uint16_t>("level_00/angular_terms", 44, [](std::uint16_t& s) { s = 0xfc00; });
          },
          true),
      patched(
          "displacement.singular_values", Base::displacement,
          [](const Patch& patch) { patch.change<float>("level_00/singular_shares", 0, [](float& x) { x = 1.5f; }); }, true),
      patched(
          "displacement.moments", Base::displacement,
          [nan](const Patch& patch) { patch.change<float>("level_00/slopes", 8, nan); }, true),
      patched(
          "displacement.moments", Base::displacement,
          [nan](const Patch& patch) { patch.change<float>("level_00/fit_errors", 8, nan); }, true),
      patched(
          "displacement.scales", Base::displacement,
          [](const Patch& patch) { patch.change<float>("level_00/spatial_scale", 1, [](float& t) { t = -0.5f; }); }, true),
      patched(
          "displacement.scales", Base::displacement,
          [](const Patch& patch) {
            patch.change<std::uint16_t>("level_01/angular_scale", 44, [](std::uint16_t& s) { s = 0x7c00; });
          },
          true),
  };
}

std::vector<Fixture> dataFixtures() {
  return {
      patched(
          "normals.finite", Base::normals,
          [](const Patch& patch) { patch.change<Vec2>("normals", 7, [](Vec2& n) { n.y = kNan; }); }, true),
      patched(
          "normals.disk", Base::normals,
          [](const Patch& patch) { patch.change<Vec2>("normals", 7, [](Vec2& n) {
                                     n = {0.8f, -0.7f};
                                   }); }, true),
      patched(
          "normals.bounds", Base::normals,
          [](const Patch& patch) { patch.change<Vec2>("normals", 7, [](Vec2& n) {
                                     n = {0.7f, -0.7f};
                                   }); }, true),
      patched(
          "normals.bounds", Base::normals,
          [](const Patch& patch) { patch.change<NormalBounds>("bounds/level_02", 3, [](auto& node) { node.high_x = -1; }); },
          true),
      patched(
          "near.disk", Base::compressed_normals,
          [](const Patch& patch) { patch.change<Vec2>("near/normals", 7, [](Vec2& n) { n.y = kNan; }); }, true),
      patched(
          "near.disk", Base::pyramid_normals,
          [](const Patch& patch) { patch.change<NormalCode>("near/normals", 7, [](NormalCode& n) {
                                     n = {30000, 20000};
                                   }); },
          true),
      patched(
          "near.bounds", Base::pyramid_normals,
          [](const Patch& patch) {
            patch.change<CodeBounds>("near/bounds/level_02", 3, [](auto& node) { node.high_x = -32768; });
          },
          true),
      patched(
          "normals.slopes", Base::normals,
          [](const Patch& patch) {
            const float mean[] = {0, 0}, covariance[] = {4, 0, 4};
            patch.set("/", "slope_mean", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, mean, 2);
            patch.set("/", "slope_covariance", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, covariance, 3);
          },
          true),
      patched(
          "heights.finite", Base::heights,
          [](const Patch& patch) { patch.change<float>("heights", 7, [](float& h) { h = -INFINITY; }); }, true),
      patched(
          "pyramid.pixels", Base::pyramid,
          [](const Patch& patch) { patch.change<float>("level_00/pixels", 99, [](float& d) { d = -1; }); }, true),
      patched(
          "pyramid.pixels", Base::pyramid,
          [](const Patch& patch) { patch.change<float>("level_00/pixels", 99, [](float& d) { d = kNan; }); }, true),
      patched(
          "pyramid.block_means", Base::pyramid,
          [](const Patch& patch) { patch.change<float>("level_01/block_means", 2, [](float& mean) { mean *= 1.01f; }); }, true),
      patched(
          "pyramid.integral", Base::pyramid,
          [](const Patch& patch) { patch.change<float>("level_00/pixels", 99, [](float& d) { d += 100; }); }, true),
  };
}

std::vector<Fixture> compressedDataFixtures() {
  return {
      patched(
          "compressed.image_scales", Base::compressed,
          [](const Patch& patch) { patch.change<float>("image_scales", 3, [](float& scale) { scale = 0; }); }, true),
      patched(
          "compressed.density_scales", Base::compressed,
          [](const Patch& patch) { patch.change<float>("density_scales", 3, [](float& scale) { scale *= 1.01f; }); }, true),
      patched(
          "compressed.density_scales", Base::compressed,
          [](const Patch& patch) { patch.change<float>("density_scales", 3, [](float& scale) { scale = kNan; }); }, true),
      patched(
          "compressed.block_masks", Base::compressed,
          [](const Patch& patch) {
            // As many bits as before, one of them elsewhere.
            patch.change<std::uint64_t>("block_masks", 5,
                                        [](auto& mask) { mask = (mask & (mask - 1)) | (~mask & (mask + 1)); });
          },
          true),
      patched(
          "compressed.block_masses", Base::compressed,
          [](const Patch& patch) { patch.change<std::uint8_t>("block_masses", 3, [](auto& code) { code -= 2; }); }, true),
      patched(
          "compressed.block_masses", Base::compressed,
          [](const Patch& patch) { patch.change<std::uint8_t>("block_masses", 3, [](auto& code) { code += 2; }); }, true),
      patched(
          "compressed.scales", Base::compressed,
          [](const Patch& patch) { patch.change<float>("scales", 3, [](float& scale) { scale = kNan; }); }, true),
      patched(
          "compressed.floors", Base::compressed,
          [](const Patch& patch) {
            patch.change<NdfCluster>("clusters", 5, [](auto& cluster) { cluster.floor_unit = 0x7c00; });
          },
          true),
      patched(
          "compressed.floors", Base::compressed,
          [](const Patch& patch) {
            patch.change<NdfCluster>("clusters", 5, [](auto& cluster) { cluster.floor_unit = 0x8001; });
          },
          true),
      patched(
          "compressed.factors", Base::compressed_f32,
          [](const Patch& patch) { patch.change<float>("coefficients", 3, [](float& c) { c = INFINITY; }); }, true),
      patched(
          "compressed.integral", Base::compressed,
          [](const Patch& patch) { patch.change<float>("image_scales", 3, [](float& scale) { scale *= 1.1f; }); }, true),
  };
}

std::vector<Fixture> histogramFixtures() {
  return {
      patched("histogram.bins", Base::histograms,
              [](const Patch& patch) { patch.change<std::uint16_t>("bin_ids", 1, [](auto& id) { id = 0; }); }),
      patched("histogram.bins", Base::histograms, [](const Patch& patch) { patch.setInteger("theta_bins", 1); }),
      patched("histogram.bins", Base::histograms,
              [](const Patch& patch) {
                patch.setInteger("theta_bins", 64);
                patch.setInteger("phi_bins", 256);
              }),
      patched("histogram.strides", Base::histograms,
              [](const Patch& patch) {
                patch.setInteger("coarse_stride", 9);
                patch.replace("coarse_sums", H5T_STD_U32LE, {4, 4, 32}, true);
              }),
      patched("shape.slopes", Base::histograms,
              [](const Patch& patch) {
                const float covariance[3] = {0.1f, 0.2f, 0.1f};
                patch.set("/", "slope_covariance", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, covariance, 3);
              }),
      patched("histogram.texels", Base::histograms,
              [](const Patch& patch) { patch.change<std::uint16_t>("texels", 70, [](auto& bin) { bin = 60000; }); }),
      patched(
          "histogram.bin_slopes", Base::histograms,
          [](const Patch& patch) { patch.change<MapSlopes>("bin_slopes", 1, [](MapSlopes& s) { s.covariance.xx = -1; }); },
          true),
      patched(
          "histogram.bin_slopes", Base::histograms,
          [](const Patch& patch) { patch.change<MapSlopes>("bin_slopes", 0, [](MapSlopes& s) { s.mean.y = kNan; }); }, true),
      patched(
          "histogram.bin_slopes", Base::histograms,
          [](const Patch& patch) {
            patch.change<MapSlopes>("bin_slopes", 0, [](MapSlopes& s) {
              s.covariance.xx = s.covariance.yy = std::numeric_limits<float>::infinity();
            });
          },
          true),
      patched(
          "histogram.bin_normals", Base::histograms,
          [](const Patch& patch) { patch.change<Vec2>("bin_normals", 1, [](Vec2& n) { n.x = kNan; }); }, true),
      patched(
          "histogram.totals", Base::histograms,
          [](const Patch& patch) { patch.change<std::uint64_t>("bin_totals", 1, [](auto& total) { ++total; }); }, true),
      patched(
          "histogram.sums", Base::histograms,
          [](const Patch& patch) { patch.change<std::uint16_t>("sums", 200, [](auto& sum) { ++sum; }); }, true),
      patched(
          "histogram.sums", Base::histograms,
          [](const Patch& patch) { patch.change<std::uint32_t>("coarse_sums", 90, [](auto& sum) { ++sum; }); }, true),
      patched(
          "histogram.sums", Base::histograms,
          [](const Patch& patch) { patch.change<std::uint16_t>("row_sums", 90, [](auto& sum) { --sum; }); }, true),
      patched(
          "histogram.sums", Base::histograms,
          [](const Patch& patch) { patch.change<std::uint16_t>("column_sums", 0, [](auto& sum) { ++sum; }); }, true),
  };
}

std::vector<Fixture> waveFixtures() {
  const auto changed = [](const char* rule, const char* array, std::size_t index, float value) {
    return patched(rule, Base::wave,
                   [=](const Patch& patch) { patch.change<float>(array, index, [=](float& number) { number = value; }); });
  };
  const auto changedHalf = [](const char* rule, std::size_t index, std::uint16_t value) {
    return patched(
        rule, Base::wave,
        [=](const Patch& patch) {
          patch.change<std::uint16_t>("level_00/channel_pixels", index, [=](std::uint16_t& half) { half = value; });
        },
        true);
  };
  constexpr std::uint16_t kHalfNan = 0x7e00, kHalfOfMinus1 = 0xbc00, kHalfOf9 = 0x4880;
  return {
      patched("wave.channels", Base::wave, [](const Patch& patch) { patch.setText("channel_meaning", "xyz"); }),
      patched("wave.channels", Base::wave_cp, [](const Patch& patch) { patch.setText("channel_meaning", "xyz"); }),
      patched("wave.wavelengths", Base::wave_cp,
              [](const Patch& patch) { patch.change<float>("wavelengths_um", 1, [](float& number) { number = 0.7f; }); }),
      patched("wave.colours", Base::wave_cp,
              [](const Patch& patch) { patch.change<float>("channel_rgb", 3, [](float& number) { number = 0.5f; }); }),
      patched("compressed.images", Base::wave_cp, &keep20Images),
      changed("wave.wavelengths", "wavelengths_um", 1, 0.7f),
      changed("wave.wavelengths", "wavelengths_um", 0, 0),
      changed("wave.wavelengths", "wavelengths_um", 4, kNan),
      changed("wave.colours", "channel_rgb", 3, 0.5f),
      changed("wave.colours", "channel_rgb", 3, kNan),
      changedHalf("wave.pixels", 7, kHalfNan),
      changedHalf("wave.pixels", 7, kHalfOfMinus1),
      changedHalf("wave.grey", 7, kHalfOf9),
  };
}

std::vector<Fixture> momentsFixtures() {
  const auto changed = [](const char* rule, const char* level, std::size_t index, float value) {
    return patched(
        rule, Base::moments,
        [=](const Patch& patch) { patch.change<float>(level, index, [=](float& number) { number = value; }); }, true);
  };
  return {
      patched("moments.levels", Base::moments, [](const Patch& patch) { patch.setInteger("width", 8 << 1); }),
      patched("moments.levels", Base::moments, [](const Patch& patch) { patch.setInteger("finest_level", 0); }),
      patched("moments.levels", Base::moments, [](const Patch& patch) { patch.setInteger("finest_level", 20); }),
      changed("moments.finite", "level_00/moments", 7, kNan),
      changed("moments.finite", "level_00/moments", 5, 3e6f),
      changed("moments.covariance", "level_01/moments", 2, -0.1f),
      changed("moments.covariance", "level_00/moments", 8, 0.4f),
      changed("moments.top", "level_02/moments", 0, 0.1f),
  };
}

std::vector<Fixture> shardFixtures() {
  return {
      patched("shard.region", Base::shard, [](const Patch& patch) { patch.setInteger("region_index", 3); }),
      patched("shard.rows", Base::shard, [](const Patch& patch) { patch.setInteger("region_count", 4); }),
      {"shard.near_rows", Base::shard_normals,
       [](const fs::path& path) {
         const Patch patch(path);
         patch.setInteger("near_rows", kSize / 2);
         patch.replace("near/normals", H5T_IEEE_F32LE, {kSize / 2, 32, 2}, true);
       }},
      patched("attribute.missing", Base::shard_normals, [](const Patch& patch) { patch.remove("/", "near_rows"); }),
      patched(
          "near.disk", Base::shard_normals,
          [](const Patch& patch) { patch.change<Vec2>("near/normals", 7, [](Vec2& n) { n.y = kNan; }); }, true),
  };
}

std::vector<Fixture> tinyFixtures() {
  const auto reals = [](const char* attribute, std::vector<float> values) {
    return
        [=](const Patch& patch) { patch.set("/", attribute, H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, values.data(), values.size()); };
  };
  return {
      patched("tiny.size", Base::tiny_tiled, [](const Patch& patch) { patch.setInteger("width", 12); }),
      patched("tiny.size", Base::tiny_tiled,
              [](const Patch& patch) {
                patch.setInteger("width", 4);
                patch.setInteger("height", 4);
              }),
      patched("tiny.levels", Base::tiny_tiled, [](const Patch& patch) { patch.setText("mode", "scattered"); }),
      patched("tiny.levels", Base::tiny_scattered, [](const Patch& patch) { patch.setText("mode", "tiled"); }),
      patched("tiny.matrix", Base::tiny_tiled, reals("matrix", {1, 2, 2, 4})),
      patched("tiny.transforms", Base::tiny_scattered, reals("scale", {2, 1})),
      patched("tiny.reach", Base::tiny_scattered, reals("shear", {-6, 0})),
      patched("tiny.reach", Base::tiny_scattered, [](const Patch& patch) { patch.setReal("density", 8); }),
      patched(
          "tiny.normals", Base::tiny_scattered,
          [](const Patch& patch) { patch.change<float>("normals", 3, [](float& x) { x = 1.5f; }); }, true),
      patched(
          "tiny.normals", Base::tiny_tiled,
          [](const Patch& patch) { patch.change<float>("normals", 8, [](float& x) { x = kNan; }); }, true),
  };
}

std::vector<Fixture> wangFixtures() {
  const auto changed = [](const char* rule, std::size_t number, float value) {
    return patched(
        rule, Base::wang_tiles,
        [=](const Patch& patch) { patch.change<float>("normals", number, [=](float& x) { x = value; }); }, true);
  };
  const std::size_t row = 2 * WangTiles::kLeastSize, tile = row * WangTiles::kLeastSize;
  return {
      patched("wang.set", Base::wang_tiles,
              [](const Patch& patch) {
                patch.setInteger("colors_h", 3);
                patch.setInteger("colors_v", 3);
              }),
      patched("wang.corners", Base::wang_tiles, [](const Patch& patch) { patch.setInteger("colors_v", 4); }),
      changed("wang.disk", 3 * tile + 5, kNan),
      changed("wang.disk", 2 * row + 7, 1.25f),
      changed("wang.sides", 5 * tile + 6, 0.3125f),               // south
      changed("wang.sides", 16 * tile - row + 6, 0.3125f),        // north
      changed("wang.sides", 9 * tile + 4 * row, 0.3125f),         // west
      changed("wang.sides", 2 * tile + 5 * row - 1, 0.3125f),     // east
      changed("wang.slopes", 2 * tile + 4 * row + 10, 0.96875f),  // inside
      patched("wang.levels", Base::wang_pyramid, [](const Patch& patch) { patch.setInteger("tile_count", 32); }),
      patched("wang.levels", Base::wang_cp, [](const Patch& patch) { patch.setInteger("tile_count", 32); }),
      patched(
          "wang.masses", Base::wang_pyramid,
          [](const Patch& patch) { patch.change<float>("level_00/masses", 1, [](float& x) { x = 0.5f; }); }, true),
      patched(
          "wang.masses", Base::wang_cp,
          [](const Patch& patch) { patch.change<float>("level_00/masses", 0, [](float& x) { x = kNan; }); }, true),
  };
}

std::vector<Fixture> binMapFixtures() {
  const auto changed = [](const char* rule, const char* path, std::size_t index, auto edit, bool opens = false) {
    using T = std::remove_cvref_t<decltype(edit(0))>;
    return patched(
        rule, Base::bin_map, [=](const Patch& patch) { patch.change<T>(path, index, [=](T& value) { value = edit(value); }); },
        opens);
  };
  const auto word = [](auto f) { return [=](std::uint64_t v) -> std::uint64_t { return f(v); }; };
  const auto u32 = [](auto f) { return [=](std::uint32_t v) -> std::uint32_t { return f(v); }; };
  const auto u16 = [](auto f) { return [=](std::uint16_t v) -> std::uint16_t { return static_cast<std::uint16_t>(f(v)); }; };
  const auto flip = [](auto v) { return v ^ 1; };
  const auto raise = [](auto v) { return v + 1; };
  return {
      patched("bin_map.alpha", Base::bin_map, [](const Patch& patch) { patch.setReal("alpha_min", 0.5f); }),
      patched("bin_map.alpha", Base::bin_map, [](const Patch& patch) { patch.setReal("alpha_max", 0.25f); }),
      changed("bin_map.cells", "cell_starts/offsets", 0, u16(raise)),
      changed("bin_map.cells", "cell_starts/offsets", 2, u16([](auto) { return 0xffff; })),
      changed("bin_map.cells", "cell_starts/bases", 1, word([](auto) { return ~0ull; })),
      // Of each tile the kind and number, then the first cell. Tile 4 is split, and its children come after the last tile.
      changed("bin_map.nodes", "nodes", 0, u32([](auto v) { return v + 1; })),
      changed("bin_map.nodes", "nodes", 0, u32([](auto v) { return v + 64; })),
      changed("bin_map.nodes", "nodes", 0, u32([](auto) { return 0u; })),
      changed("bin_map.nodes", "nodes", 0, u32([](auto) { return 40u; })),
      changed("bin_map.nodes", "nodes", 1, u32(raise)),
      changed("bin_map.nodes", "nodes", 2 * 4 + 1, u32([](auto) { return 4u; })),
      changed("bin_map.nodes", "nodes", 2 * 4 + 1, u32([](auto) { return 0xfffffffeu; })),
      changed("bin_map.nodes", "nodes", 2 * 9, u32([](auto) { return BinMap::kSplit; })),
      changed("bin_map.classes", "class_keys", 3, u32([](auto) { return 0u; })),
      changed("bin_map.classes", "class_keys", 36, u32([](auto v) { return v + 1000; })),
      changed("bin_map.classes", "texel_classes", 100, u16([](auto) { return 0xffff; })),
      changed("bin_map.texels", "texels", 100, u32(flip), true),
      changed("bin_map.texels", "texels", 100, u32([](auto) { return 0xffffffffu; }), true),
      changed("bin_map.moments", "block_moments", 2, u16([](auto) { return 0x7c00; }), true),
      changed("bin_map.moments", "block_moments", 0, u16([](auto) { return 0x8400; }), true),
  };
}

std::vector<Fixture> shFixtures() {
  return {
      patched("sh.grid", Base::sh_lobes,
              [](const Patch& patch) {
                patch.setInteger("grid_rows", 1);
                patch.replace("lobes", H5T_IEEE_F32LE, {1, 4, 4}, true);
              }),
      patched("sh.grid", Base::sh_lobes,
              [](const Patch& patch) {
                patch.setInteger("grid_columns", 0);
                patch.replace("lobes", H5T_IEEE_F32LE, {3, 0, 4}, false);
              }),
      patched(
          "sh.finite", Base::sh_lobes, [](const Patch& patch) { patch.change<float>("zonal", 1, [](float& f) { f = kNan; }); },
          true),
      patched(
          "sh.finite", Base::sh_lobes,
          [](const Patch& patch) { patch.change<float>("lobes", 9, [](float& c) { c = INFINITY; }); }, true),
      patched(
          "sh.finite", Base::sh_light,
          [](const Patch& patch) { patch.change<float>("scales", 2, [](float& scale) { scale = -1; }); }, true),
      patched(
          "sh.finite", Base::sh_light,
          [](const Patch& patch) { patch.change<std::uint16_t>("light", 40, [](auto& c) { c = 0x7e00; }); }, true),
      patched(
          "sh.zonal", Base::sh_lobes, [](const Patch& patch) { patch.change<float>("lobes", 4, [](float& c) { c *= 2; }); },
          true),
      patched(
          "sh.band_norms", Base::sh_light,
          [](const Patch& patch) { patch.change<float>("band_norms", 4, [](float& norm) { norm *= 1.1f; }); }, true),
  };
}

std::vector<Fixture> allFixtures() {
  std::vector<Fixture> all;
  for (auto list :
       {fileFixtures(), linkFixtures(), attributeFixtures(), storageFixtures(), datasetFixtures(), pyramidFixtures(),
        ndfCpFixtures(), dataFixtures(), compressedDataFixtures(), histogramFixtures(), momentsFixtures(), tinyFixtures(),
        shardFixtures(), wangFixtures(), waveFixtures(), binMapFixtures(), shFixtures(), displacementFixtures()}) {
    all.insert(all.end(), list.begin(), list.end());
  }
  return all;
}

/// Files that break it have 740 MB: BinMapsOfTooManyTexelsAreRefused breaks it without one.
constexpr std::string_view kRuleOfHugeFiles = "bin_map.size";
/// ShardsEndInTheMean breaks it: a changed file would break the rules of sizes first.
constexpr std::string_view kRuleOfMeans = "shard.mean";

TEST(FormatRules, EveryRuleHasAFailingFile) {
  std::set<std::string_view> covered = {kRuleOfHugeFiles, kRuleOfMeans};
  for (const Fixture& fixture : allFixtures()) covered.insert(fixture.rule);
  for (const Rule& rule : rules()) EXPECT_TRUE(covered.contains(rule.id)) << rule.id;
}

TEST(FormatRules, ShardsEndInTheMean) {
  test::SamplePyramidShard sample = test::samplePyramidShard(64);
  --sample.shard.images.shape.level_count;
  const test::TempFolder folder;
  try {
    writeAsset(folder.path() / "shard.glint", sample.shard, test::sampleProvenance());
    FAIL() << "is written";
  } catch (const Error& error) {
    EXPECT_EQ(error.rule(), kRuleOfMeans) << error.what();
  }
}

TEST(FormatRules, IdsAreUnique) {
  std::set<std::string_view> ids;
  for (const Rule& rule : rules()) EXPECT_TRUE(ids.insert(rule.id).second) << rule.id;
}

TEST(FormatRules, GoodFilesBreakNoRule) {
  const test::TempFolder folder;
  for (const Base base : kBases) {
    const fs::path path = folder / (std::to_string(static_cast<int>(base)) + ".glint");
    writeBase(path, base);
    for (const Finding& finding : validateAsset(path).findings) {
      ADD_FAILURE() << finding.rule << " " << finding.object << " " << finding.message;
    }
  }
}

TEST(FormatRules, EveryFailingFileIsNamedByItsRule) {
  const test::TempFolder folder;
  for (const Base base : kBases) {
    writeBase(folder / (std::to_string(static_cast<int>(base)) + ".glint"), base);
  }
  int number = 0;
  for (const Fixture& fixture : allFixtures()) {
    const fs::path path = folder / ("bad" + std::to_string(number++) + ".glint");
    fs::copy_file(folder / (std::to_string(static_cast<int>(fixture.base)) + ".glint"), path);
    fixture.damage(path);
    const ValidationReport report = validateAsset(path);
    std::string found;
    for (const Finding& finding : report.findings)
      found += finding.rule + " (" + finding.object + ": " + finding.message + ") ";
    SCOPED_TRACE("fixture " + std::to_string(number - 1) + " for " + fixture.rule + ", found " + found);
    const auto hit =
        std::find_if(report.findings.begin(), report.findings.end(), [&](const Finding& f) { return f.rule == fixture.rule; });
    ASSERT_NE(hit, report.findings.end());
    EXPECT_EQ(hit->severity, findRule(fixture.rule).severity);
    EXPECT_FALSE(hit->message.empty());
    try {
      Asset::open(path);
      EXPECT_TRUE(fixture.opens);
    } catch (const Error& error) {
      EXPECT_FALSE(fixture.opens);
      EXPECT_EQ(error.rule(), fixture.rule);
      EXPECT_EQ(error.code(), findRule(fixture.rule).code);
      EXPECT_EQ(error.path(), path.string());
    }
  }
}

TEST(FormatRules, AsManyClassesAsBlocksMustBeTheBlocks) {
  const test::TempFolder folder;
  const test::OwnedMap map(64, 64, test::randomNormals(64, 64, 0.9f, 3));
  bake::BinMapData data = bake::buildBinMap(map.map(), {0.02f, 8});
  ASSERT_EQ(data.view().classCount(), data.view().blockCount());
  ASSERT_GT(data.tile_bits, 0);
  writeAsset(folder / "good.glint", data.view(), {});
  EXPECT_TRUE(validateAsset(folder / "good.glint").findings.empty());
  ++data.class_keys[1];  // the second class begins within the second block
  writeAsset(folder / "bad.glint", data.view(), {});
  const ValidationReport report = validateAsset(folder / "bad.glint");
  EXPECT_TRUE(std::any_of(report.findings.begin(), report.findings.end(), [](const Finding& f) {
    return f.rule == "bin_map.classes" && f.message.find("as many classes") != std::string::npos;
  }));
}

TEST(FormatRules, BinMapsOfTooManyTexelsAreRefused) {
  auto sample = test::sampleBinMap(64, 48);
  const auto broken = [&](int width, int height) {
    sample.map.width = width, sample.map.height = height;
    Findings findings("huge.glint");
    kindOf<BinMap>().check_index(sample.map, findings);
    EXPECT_EQ(findings.report().findings.size(), 1u);
    return findings.report().findings.at(0).rule;
  };
  EXPECT_EQ(broken((1 << 14) + 1, (1 << 13) + 1), kRuleOfHugeFiles);  // 15 and 14 bits
  EXPECT_EQ(broken((1 << 28) + 1, 1), kRuleOfHugeFiles);
  EXPECT_EQ(broken(1 << 14, 1 << 14), "bin_map.cells");  // as many as there may be, but they are not listed
  EXPECT_EQ(findRule(kRuleOfHugeFiles).code, ErrorCode::unsupported);
}

TEST(FormatRules, TexelsInBinsBeyondTheSquareAreFound) {
  std::vector<Vec2> normals(64 * 64);
  for (std::size_t k = 0; k < normals.size(); ++k) normals[k] = {0.9f + 0.0999f * static_cast<float>(k % 64) / 63, 0};
  NormalMap map;
  map.width = map.height = 64;
  map.normals = normals;
  bake::BinMapData data = bake::buildBinMap(map, {0.01f});
  const auto found = [&] {
    Findings findings("a.glint");
    kindOf<BinMap>().check_values(data.view(), findings);
    return findings.report().findings;
  };
  EXPECT_TRUE(found().empty());
  // Moves a texel of the last column of bins to the next, which its block has, too.
  const BinBlocks blocks(data.view());
  const int last = data.bins_per_axis - 1;
  bool moved = false;
  blocks.forEachBlock({last, last + 1, 0, last + 1}, [&](const BinBlock& block) {
    const TexelCode code = blocks.code(block);
    const int shift = code.subbin_bits - block.side_bits;
    for (std::uint64_t k = blocks.begin(block); k < blocks.end(block) && !moved && block.column + block.side() > last + 1;
         ++k) {
      if (block.column + static_cast<int>(code.subbinX(blocks.texel(k)) >> shift) != last) continue;
      data.texels[k] += 1u << (code.column_bits + code.row_bits + shift);
      moved = true;
    }
  });
  ASSERT_TRUE(moved);
  ASSERT_EQ(found().size(), 1u);
  EXPECT_EQ(found()[0].rule, "bin_map.texels");
}

TEST(FormatRules, NothingOfHdf5StaysOpen) {
  const test::TempFolder folder;
  const auto open_objects = [] { return H5Fget_obj_count(static_cast<hid_t>(H5F_OBJ_ALL), H5F_OBJ_ALL); };
  writeBase(folder / "good.glint", Base::heights);
  const auto objects = open_objects();
  const Asset asset = Asset::open(folder / "good.glint");
  EXPECT_EQ(open_objects(), objects);
  int number = 0;
  for (const Fixture& fixture : allFixtures()) {
    const fs::path path = folder / ("bad" + std::to_string(number++) + ".glint");
    writeBase(path, fixture.base);
    fixture.damage(path);
    validateAsset(path);
    EXPECT_EQ(open_objects(), objects) << fixture.rule;
  }
}

TEST(FormatRules, FilesMayLackADigest) {
  const test::TempFolder folder;
  const fs::path path = folder / "a.glint";
  writeBase(path, Base::heights);
  Patch(path).remove("/", "digest");
  EXPECT_THAT(validateAsset(path).findings, testing::IsEmpty());
}

TEST(FormatVersions, ANewerMinorIsReadWithAWarning) {
  const test::TempFolder folder;
  writeBase(folder / "a.glint", Base::heights);
  Patch(folder / "a.glint").setInteger("format_minor", 9);
  const Asset asset = Asset::open(folder / "a.glint");
  ASSERT_EQ(asset.info().warnings.size(), 1u);
  EXPECT_THAT(asset.info().warnings[0], testing::HasSubstr("1.9"));
  EXPECT_EQ(asset.get<HeightMap>().width, static_cast<int>(kSize));
}

TEST(FormatVersions, ANewerMajorIsRefusedNamingBothVersions) {
  const test::TempFolder folder;
  writeBase(folder / "a.glint", Base::heights);
  Patch(folder / "a.glint").setInteger("format_major", 3);
  try {
    Asset::open(folder / "a.glint");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::unsupported);
    EXPECT_THAT(error.what(), testing::HasSubstr("3.0"));
    EXPECT_THAT(error.what(), testing::HasSubstr("1.0"));
  }
}

TEST(GoldenFiles, OfVersion1_0KeepTheirValues) {
  const fs::path folder = test::goldenFolder();
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    EXPECT_TRUE(validateAsset(entry.path()).findings.empty()) << entry.path();
    EXPECT_EQ(Asset::open(entry.path()).info().provenance, test::sampleProvenance());
    ++count;
  }
  EXPECT_EQ(count, 27u);
}

TEST(GoldenFiles, OfVersion1_0GiveTheRecordedValues) {
  const fs::path folder = test::goldenFolder();
  const Asset normals = Asset::open(folder / "normals.glint");
  EXPECT_EQ(normals.get<NormalMap>().at(5, 3).x, 0.194547504f);
  EXPECT_EQ(normals.get<NormalMap>().at(63, 47).y, -0.139912933f);
  EXPECT_EQ(normals.get<NormalMap>().bounds[3].nodes[2].high_x, 0.283465505f);
  EXPECT_EQ(Asset::open(folder / "heights.glint").get<HeightMap>().heights[3 * 64 + 5], 0.0129489619f);
  const Asset displacement = Asset::open(folder / "displacement.glint");
  EXPECT_EQ(displacement.get<Displacement>().base.eta, 1.5f);
  EXPECT_EQ(displacement.get<Displacement>().levels[1].lobes[1].amplitude, 0.375f);
  EXPECT_EQ(displacement.get<Displacement>().levels[1].angular_scale[44], 0x3f80);  // 1.875
  const Asset colored = Asset::open(folder / "displacement-rgb.glint");
  EXPECT_EQ(colored.get<Displacement>().levels[1].lobe_colors[4], 0.625f);
  EXPECT_EQ(colored.get<Displacement>().levels[1].angular_scale[3 * 44 + 2], 0x3f80);
  const Asset pyramid = Asset::open(folder / "ndf-pyramid.glint");
  EXPECT_EQ(test::pyramidPixel(pyramid.get<NdfPyramid>(), 0, 5, 30, 33), 4.3046875f);
  EXPECT_EQ(test::pyramidPixel(pyramid.get<NdfPyramid>(), 1, 2, 35, 29), 4.7890625f);
  EXPECT_EQ(test::pyramidPixel(pyramid.get<NdfPyramid>(), 2, 0, 24, 32), 6.00390625f);
  const Asset histograms = Asset::open(folder / "histogram-sat.glint");
  const HistogramSat& sat = histograms.get<HistogramSat>();
  ASSERT_EQ(sat.bin_count, 20);
  EXPECT_EQ(sat.bin_ids[9], 9);
  EXPECT_EQ(sat.bin_totals[9], 3u);
  EXPECT_FLOAT_EQ(sat.bin_normals[9].x, 0.0831450075f);
  EXPECT_EQ(sat.sums[(4 * 7 + 5) * 32 + 9], 1);
  EXPECT_EQ(sat.slopes.covariance.xy, 0.03125f);
  const Asset tiny = Asset::open(folder / "tiny-example-scattered.glint");
  EXPECT_EQ(tiny.get<TinyExample>().transforms.shear.low, -0.25f);
  EXPECT_EQ(tiny.get<TinyExample>().images.shape.levels[3].stride, 16);
  EXPECT_EQ(tiny.get<TinyExample>().overlap, TinyOverlap::nearest);
  const Asset moments = Asset::open(folder / "slope-moments.glint");
  EXPECT_EQ(moments.get<SlopeMoments>().levels[0].texels[5].mean.x, -0.0625f);
  EXPECT_EQ(moments.get<SlopeMoments>().levels[2].texels[0].covariance.xx, 0.03515625f);
  const Asset wang = Asset::open(folder / "wang-tiles.glint");
  EXPECT_EQ(wang.get<WangTiles>().at(9, 3, 2).x, -0.25f);
  EXPECT_EQ(wang.get<WangTiles>().plane_seed, 7);
  const Asset tile_images = Asset::open(folder / "wang-pyramid.glint");
  EXPECT_EQ(tile_images.get<WangPyramid>().plane.tiles.plane_seed, 7);
  EXPECT_EQ(tile_images.get<WangPyramid>().plane.grids[0].margin, 1);
  EXPECT_EQ(tile_images.get<WangPyramid>().plane.grids[0].masses[1], 0.75f);
  EXPECT_EQ(Asset::open(folder / "wang-cp.glint").get<WangCp>().images.shape.levels[0].rows, 16);
  const Asset compressed_wave = Asset::open(folder / "wave-cp.glint");
  EXPECT_EQ(compressed_wave.get<WaveCp>().images.shape.levels[0].rows, 3 * compressed_wave.get<WaveCp>().shape.levels[0].rows);
  EXPECT_EQ(compressed_wave.get<WaveCp>().wavelengths_um[2], 0.4f + 0.125f);
  const Asset wave_asset = Asset::open(folder / "wave-pyramid.glint");
  const WavePyramid& wave = wave_asset.get<WavePyramid>();
  EXPECT_EQ(wave.channel_rgb[1], (Rgb{1 / 3.0f - 0.5f, 1 / 3.0f, 1 / 3.0f + 0.5f}));
  EXPECT_EQ(wave.wavelengths_um[2], 0.4f + 0.125f);
  EXPECT_EQ(static_cast<const float*>(Asset::open(folder / "sh-lobes.glint").get<ShLobes>().coefficients)[5 * 4 + 3], 0.4f);
  EXPECT_EQ(Asset::open(folder / "sh-light.glint").get<ShLight>().band_norms[7], 12.2799206f);
  struct Recorded {
    const char* file;
    float values[3];
  };
  for (const Recorded& recorded : {Recorded{"cp-i8", {3.49882889f, 3.00286174f, 2.97668457f}},
                                   Recorded{"tucker-f16", {4.83468008f, 3.82640028f, 3.10592413f}},
                                   Recorded{"pca-i8", {3.49882889f, 3.0028615f, 2.97668457f}},
                                   Recorded{"narrow-i8", {4.72693872f, 3.72354555f, 3.08629251f}},
                                   Recorded{"spots-i8", {0.513697445f, 0.513941109f, 0.515995741f}},
                                   Recorded{"cp-f32", {3.49453115f, 3.00421071f, 2.98451018f}}}) {
    const Asset asset = Asset::open(folder / ("ndf-cp-" + std::string(recorded.file) + ".glint"));
    EXPECT_FLOAT_EQ(test::ndfCpPixel(asset.get<NdfCp>(), 5, 30, 33), recorded.values[0]);
    EXPECT_FLOAT_EQ(test::ndfCpPixel(asset.get<NdfCp>(), 18, 35, 29), recorded.values[1]);
    EXPECT_FLOAT_EQ(test::ndfCpPixel(asset.get<NdfCp>(), 20, 24, 32), recorded.values[2]);
  }
}

}  // namespace
}  // namespace glint::formats::formats_rules_test
