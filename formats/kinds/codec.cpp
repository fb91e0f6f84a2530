#include "glint/formats/kinds/codec.h"

#include <array>

namespace glint::formats {
namespace {

template <class Model>
Codec codec() {
  return {kindName<Model>(),
          [](const Content& content) {
            Model model;
            unpack(content, model);
            return AnyAsset(model);
          },
          [](const AnyAsset& asset, Findings& findings) { checkIndex(std::get<Model>(asset), findings); },
          [](const AnyAsset& asset, Findings& findings) { checkData(std::get<Model>(asset), findings); }};
}

}  // namespace

template <>
std::string_view kindName<BinMap>() {
  return "bin-map";
}
template <>
std::string_view kindName<Displacement>() {
  return "displacement";
}
template <>
std::string_view kindName<HeightMap>() {
  return "heights";
}
template <>
std::string_view kindName<HistogramSat>() {
  return "histogram-sat";
}
template <>
std::string_view kindName<NdfCp>() {
  return "ndf-cp";
}
template <>
std::string_view kindName<NdfPyramid>() {
  return "ndf-pyramid";
}
template <>
std::string_view kindName<NormalMap>() {
  return "normals";
}
template <>
std::string_view kindName<ShLight>() {
  return "sh-light";
}
template <>
std::string_view kindName<ShLobes>() {
  return "sh-lobes";
}

const Codec* findCodec(std::string_view kind) {
  static const std::array codecs = {codec<BinMap>(),       codec<Displacement>(), codec<HeightMap>(),
                                    codec<HistogramSat>(), codec<NdfCp>(),        codec<NdfPyramid>(),
                                    codec<NormalMap>(),    codec<ShLight>(),      codec<ShLobes>()};
  for (const Codec& codec : codecs) {
    if (codec.kind == kind) return &codec;
  }
  return nullptr;
}

void PackedAsset::integer(std::string name, std::int64_t value) {
  attributes.emplace_back(std::move(name), AttributeValue{ElementType::i32, true, {static_cast<double>(value)}, {}});
}

void PackedAsset::real(std::string name, float value) {
  attributes.emplace_back(std::move(name), AttributeValue{ElementType::f32, true, {value}, {}});
}

void PackedAsset::text(std::string name, std::string_view value) {
  attributes.emplace_back(std::move(name), AttributeValue{ElementType::text, true, {}, {std::string(value)}});
}

void PackedAsset::integers(std::string name, std::vector<double> values) {
  attributes.emplace_back(std::move(name), AttributeValue{ElementType::i32, false, std::move(values), {}});
}

void PackedAsset::reals(std::string name, std::vector<double> values) {
  attributes.emplace_back(std::move(name), AttributeValue{ElementType::f32, false, std::move(values), {}});
}

void PackedAsset::array(std::string path, ElementType type, std::vector<std::uint64_t> dims, const void* data,
                        std::uint64_t count) {
  std::uint64_t expected = 1;
  for (const std::uint64_t n : dims) expected *= n;
  if (expected != count || (count != 0 && data == nullptr)) {
    throw Error(
        ErrorCode::usage, "dataset.dims", {}, "/" + path,
        "holds " + std::to_string(data == nullptr ? 0 : count) + " elements where its sizes need " + std::to_string(expected));
  }
  arrays.push_back({std::move(path), type, std::move(dims), data, count * sizeBytes(type)});
}

}  // namespace glint::formats
