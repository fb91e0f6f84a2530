#pragma once

// Private to formats/: what a kind has to say beyond its schema. To add a kind: an entry in schema.cpp, its struct in AnyAsset,
// a file here with the four functions, a line in codecs(), and accessors in asset_reader.h and asset_writer.h.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "glint/formats/findings.h"
#include "glint/formats/structure.h"
#include "glint/model/bin_map.h"
#include "glint/model/displacement.h"
#include "glint/model/histogram_sat.h"
#include "glint/model/ndf_cp.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/model/normal_map.h"
#include "glint/model/sh.h"

namespace glint::formats {

/// The model struct of any kind. Its spans point into a Mapping.
using AnyAsset =
    std::variant<std::monostate, NormalMap, HeightMap, NdfPyramid, NdfCp, BinMap, HistogramSat, ShLight, ShLobes, Displacement>;

/// Typed access to a file that has passed the checks against its schema.
class Content {
 public:
  explicit Content(const FileStructure& structure) : structure_(structure) {}

  int integer(std::string_view attribute) const { return static_cast<int>(number(attribute, 0)); }
  int integer(std::string_view attribute, int index) const { return static_cast<int>(number(attribute, index)); }
  float real(std::string_view attribute) const { return static_cast<float>(number(attribute, 0)); }
  float real(std::string_view attribute, int index) const { return static_cast<float>(number(attribute, index)); }
  const std::string& text(std::string_view attribute) const { return structure_.attributes.find(attribute)->second.texts[0]; }
  bool is(std::string_view attribute, std::string_view value) const { return text(attribute) == value; }

  /// Whether an attribute or dataset is there: ask before reading one that older minor versions do not have (its `since`).
  bool hasAttribute(std::string_view attribute) const { return structure_.attributes.contains(attribute); }
  bool hasDataset(const std::string& path) const { return structure_.datasets.contains(path); }

  const DatasetRecord& dataset(const std::string& path) const { return structure_.datasets.at(path); }
  /// The whole dataset as a list of T; T may span several elements, e.g. Vec2.
  template <class T>
  std::span<const T> array(const std::string& path) const {
    const DatasetRecord& record = dataset(path);
    return {reinterpret_cast<const T*>(record.data), static_cast<std::size_t>(record.size_bytes / sizeof(T))};
  }

 private:
  double number(std::string_view attribute, int index) const {
    return structure_.attributes.find(attribute)->second.numbers[static_cast<std::size_t>(index)];
  }
  const FileStructure& structure_;
};

/// One dataset to write.
struct PackedArray {
  std::string path;
  ElementType type = ElementType::f32;
  std::vector<std::uint64_t> dims;
  const void* data = nullptr;
  std::uint64_t size_bytes = 0;
};

/// An asset as attributes and arrays, in the order of the schema. Points into the model struct.
struct PackedAsset {
  std::string_view kind;
  std::vector<std::pair<std::string, AttributeValue>> attributes;
  std::vector<PackedArray> arrays;

  void integer(std::string name, std::int64_t value);
  void real(std::string name, float value);
  void text(std::string name, std::string_view value);
  void integers(std::string name, std::vector<double> values);
  void reals(std::string name, std::vector<double> values);
  /// Adds an array. Throws Error (usage) if `count` elements are not what `dims` say.
  void array(std::string path, ElementType type, std::vector<std::uint64_t> dims, const void* data, std::uint64_t count);
};

PackedAsset pack(const NormalMap& map);
PackedAsset pack(const HeightMap& map);
PackedAsset pack(const NdfPyramid& pyramid);
PackedAsset pack(const NdfCp& ndf);
PackedAsset pack(const BinMap& map);
PackedAsset pack(const HistogramSat& sat);
PackedAsset pack(const ShLight& light);
PackedAsset pack(const ShLobes& lobes);
PackedAsset pack(const Displacement& displacement);

void unpack(const Content& content, NormalMap& map);
void unpack(const Content& content, HeightMap& map);
void unpack(const Content& content, NdfPyramid& pyramid);
void unpack(const Content& content, NdfCp& ndf);
void unpack(const Content& content, BinMap& map);
void unpack(const Content& content, HistogramSat& sat);
void unpack(const Content& content, ShLight& light);
void unpack(const Content& content, ShLobes& lobes);
void unpack(const Content& content, Displacement& displacement);

// checkIndex: everything that a query follows, so that no query can read out of bounds. Cost: the bytes of the index arrays.
void checkIndex(const NormalMap& map, Findings& findings);
void checkIndex(const HeightMap& map, Findings& findings);
void checkIndex(const NdfPyramid& pyramid, Findings& findings);
void checkIndex(const NdfCp& ndf, Findings& findings);
void checkIndex(const BinMap& map, Findings& findings);
void checkIndex(const HistogramSat& sat, Findings& findings);
void checkIndex(const ShLight& light, Findings& findings);
void checkIndex(const ShLobes& lobes, Findings& findings);
void checkIndex(const Displacement& displacement, Findings& findings);

// checkData: the values. Called after checkIndex has passed.
void checkData(const NormalMap& map, Findings& findings);
void checkData(const HeightMap& map, Findings& findings);
void checkData(const NdfPyramid& pyramid, Findings& findings);
void checkData(const NdfCp& ndf, Findings& findings);
void checkData(const BinMap& map, Findings& findings);
void checkData(const HistogramSat& sat, Findings& findings);
void checkData(const ShLight& light, Findings& findings);
void checkData(const ShLobes& lobes, Findings& findings);
void checkData(const Displacement& displacement, Findings& findings);

/// The functions of one kind.
struct Codec {
  std::string_view kind;
  AnyAsset (*unpack)(const Content&);
  void (*check_index)(const AnyAsset&, Findings&);
  void (*check_data)(const AnyAsset&, Findings&);
};

/// Name of the kind whose assets are of this struct.
template <class Model>
std::string_view kindName();

/// The codec of a kind, or nullptr.
const Codec* findCodec(std::string_view kind);

}  // namespace glint::formats
