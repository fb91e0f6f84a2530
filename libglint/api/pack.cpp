#include "glint/api/pack.h"

#include <cstdint>
#include <string>
#include <string_view>

#include "glint/api/alternatives.h"
#include "glint/api/packer.h"

namespace glint::api {
namespace {

template <class Model>
std::vector<std::byte> packed(const NdfSource<AssetOf<Model>>& source) {
  Packer packer;
  NdfTraits<Model>::pack(source, packer);
  return packer.finish();
}

[[noreturn]] void refuseKind(const OpenedNdf& opened) {
  if (std::holds_alternative<UdimNdf>(opened.model()))
    throw Error(ErrorCode::unsupported, "udim.pack", opened.path().string(), "", "is a UDIM set, which has no packed form",
                "ask the set on the processor, or ingest the image of one tile as a map of its own");
  std::vector<std::string_view> packing;
  NdfModels::forEach([&]<class Model>(std::type_identity<Model>) {
    if (NdfTraits<Model>::kPacks) packing.push_back(NdfTraits<Model>::kKind);
  });
  throw Error(ErrorCode::unsupported, "format.kind", opened.path().string(), "",
              "is of kind " + std::string(opened.asset().kind()) + ", which has no packed form",
              "pack an asset of kind " + alternatives(packing));
}

}  // namespace

std::vector<std::byte> pack(const NdfPyramid& pyramid, const NormalMap* normals) {
  return packed<AnisotropicNdf<PyramidNdf>>({pyramid, {}, normals});
}

std::vector<std::byte> pack(const NdfCp& compressed, const NormalMap* normals) {
  return packed<AnisotropicNdf<CpNdf>>({compressed, {}, normals});
}

std::vector<std::byte> pack(const NormalMap& normals, float sigma_r, Surface surface, Boundary boundary) {
  NdfOptions options;
  options.sigma_r = sigma_r;
  options.surface = surface;
  options.boundary = boundary;
  return packed<Reference>({normals, options});
}

std::vector<std::byte> pack(const OpenedNdf& opened) {
  return std::visit(
      [&]<class Model>(const Model&) -> std::vector<std::byte> {
        if constexpr (NdfTraits<Model>::kPacks)
          return packed<Model>(opened.source<Model>());
        else
          refuseKind(opened);
      },
      opened.model());
}

PackedNdfView viewPacked(std::span<const std::byte> buffer) {
  const auto refuse = [](const std::string& fault) {
    throw Error(ErrorCode::invalid_input, "packed.header", {}, {}, fault, "make the buffer with the same version of glint");
  };
  if (buffer.size() < sizeof(PackedHeader))
    refuse("a packed buffer of " + std::to_string(buffer.size()) + " bytes has no header");
  if (reinterpret_cast<std::uintptr_t>(buffer.data()) % 16 != 0) refuse("a packed buffer is not aligned to 16 bytes");
  const auto& header = *reinterpret_cast<const PackedHeader*>(buffer.data());
  if (header.magic != kPackedMagic) refuse("this is no packed buffer");
  if (header.version != kPackedVersion)
    refuse("a packed buffer has version " + std::to_string(header.version) + ", not " + std::to_string(kPackedVersion));
  if (header.size_bytes != buffer.size()) refuse("a packed buffer is not whole");
  return PackedNdfView(buffer.data());
}

}  // namespace glint::api
