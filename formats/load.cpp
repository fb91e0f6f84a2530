#include "glint/formats/load.h"

#include <algorithm>
#include <utility>

#include "glint/formats/conformance.h"
#include "glint/formats/digest.h"
#include "glint/formats/hash.h"
#include "glint/formats/json_text.h"

namespace glint::formats {
namespace {

std::string textOf(const Attributes& attributes, std::string_view attribute) {
  const auto found = attributes.find(attribute);
  return found == attributes.end() || found->second.texts.empty() ? std::string() : found->second.texts[0];
}

int numberOf(const Attributes& attributes, std::string_view attribute) {
  const auto found = attributes.find(attribute);
  if (found == attributes.end() || found->second.type != ElementType::i32 || found->second.numbers.empty()) return 0;
  return static_cast<int>(found->second.numbers[0]);
}

std::vector<std::string> textsOf(const Attributes& attributes, std::string_view attribute) {
  const auto found = attributes.find(attribute);
  return found == attributes.end() ? std::vector<std::string>() : found->second.texts;
}

/// The tile of a UDIM set that the asset covers.
std::optional<UdimPlace> placeOf(const Attributes& attributes) {
  const auto margins = attributes.find("udim_margins");
  UdimPlace place;
  place.tile = numberOf(attributes, "udim");
  if (place.tile < kFirstUdim || margins == attributes.end() || margins->second.numbers.size() != place.margins.size())
    return {};
  for (std::size_t k = 0; k < place.margins.size(); ++k) place.margins[k] = static_cast<int>(margins->second.numbers[k]);
  return place;
}

/// Collects what the file says about itself, as far as it could be read.
AssetInfo describe(const FileStructure& structure) {
  AssetInfo info;
  info.kind = textOf(structure.attributes, "kind");
  info.format_major = numberOf(structure.attributes, "format_major");
  info.format_minor = numberOf(structure.attributes, "format_minor");
  info.required_features = textsOf(structure.attributes, "required_features");
  info.provenance.generator = textOf(structure.attributes, "generator");
  info.provenance.command_json = textOf(structure.attributes, "command");
  for (const std::string& line : textsOf(structure.attributes, "inputs")) {
    const std::size_t gap = line.find("  ");
    info.provenance.inputs.push_back({gap == std::string::npos ? std::string() : line.substr(gap + 2), line.substr(0, gap)});
  }
  info.udim = placeOf(structure.attributes);
  info.file_bytes = structure.bytes.size();
  for (const auto& [path, record] : structure.datasets) {
    info.datasets.push_back({"/" + path, record.known_type ? std::string(name(record.type)) : "unknown", record.dims,
                             record.size_bytes, record.offset, textOf(record.attributes, "xxh3_128"),
                             textOf(record.attributes, "units"), textOf(record.attributes, "long_name")});
  }
  return info;
}

/// Attributes of the kind that the file has.
std::vector<AttributeInfo> describe(const Attributes& attributes, const KindSchema& schema) {
  std::vector<AttributeInfo> list;
  for (const AttributeSchema& attribute : schema.attributes) {
    const auto found = attributes.find(attribute.name);
    if (found == attributes.end()) continue;
    const AttributeValue& value = found->second;
    list.push_back({std::string(attribute.name), std::string(name(value.type)), value.scalar, attribute.count == "level_count",
                    value.numbers, value.texts, std::string(attribute.units), std::string(attribute.long_name)});
  }
  return list;
}

/// Looks for bytes that belong to no object and are not 0.
void checkPadding(const FileStructure& structure, Findings& findings) {
  const std::byte* bytes = structure.bytes.data();
  const auto check = [&](std::uint64_t begin, std::uint64_t end) {
    const std::byte* bad = std::find_if(bytes + begin, bytes + end, [](std::byte b) { return b != std::byte{0}; });
    if (bad == bytes + end) return;
    findings.add("file.padding", {},
                 "has a byte that is not 0 at offset " + std::to_string(bad - bytes) + ", where no object is");
  };
  std::uint64_t end = 0;
  for (const Extent& extent : structure.extents) {
    if (extent.begin > end) check(end, extent.begin);
    end = std::max(end, extent.end);
  }
  check(end, structure.bytes.size());
}

void checkDigest(const FileStructure& structure, Findings& findings) {
  const std::string stored = textOf(structure.attributes, kDigestAttribute);
  if (!structure.attributes.contains(kDigestAttribute)) return;
  const std::string actual = digestOf(structure);
  if (stored != actual) findings.add("file.digest", {}, "has contents with digest " + actual + ", not " + stored);
}

}  // namespace

LoadedAsset loadFile(Findings& findings, bool copy) {
  FileBytes bytes;
  try {
    bytes = FileBytes::ofFile(findings.path(), copy);
  } catch (const Error& error) {
    findings.add(error);
    return {};
  }
  return loadAsset(std::move(bytes), findings);
}

LoadedAsset loadAsset(FileBytes bytes, Findings& findings) {
  LoadedAsset loaded;
  loaded.structure = readStructure(std::move(bytes), findings);
  if (loaded.structure.attributes.empty() && findings.failed()) return loaded;
  loaded.info = describe(loaded.structure);
  findings.report().kind = loaded.info.kind;
  const KindSchema* schema = checkHeader(loaded.structure, findings);
  if (schema != nullptr) checkConformance(loaded.structure, *schema, findings);
  if (findings.failed()) return loaded;
  const Kind* kind = findKind(loaded.info.kind);
  loaded.info.attributes = describe(loaded.structure.attributes, *schema);
  const AnyAsset asset = kind->read(loaded.structure);
  kind->check_index(asset, findings);
  if (findings.failed()) return loaded;
  loaded.asset = asset;
  loaded.kind = kind;
  return loaded;
}

void checkValues(const LoadedAsset& loaded, Findings& findings) {
  if (!isJsonObject(loaded.info.provenance.command_json)) findings.add("attribute.json", "/@command", "is no JSON object");
  loaded.kind->check_values(*loaded.asset, findings);
}

void checkHashes(const LoadedAsset& loaded, Findings& findings, HashFrom from) {
  if (loaded.structure.extents.empty()) return;  // the structure could not be read
  checkDigest(loaded.structure, findings);
  checkPadding(loaded.structure, findings);
  for (const auto& [path, record] : loaded.structure.datasets) {
    const std::string stored = textOf(record.attributes, "xxh3_128");
    const std::string actual = from == HashFrom::memory || record.size_bytes == 0
                                   ? hashBytes(record.data, record.size_bytes)
                                   : hashOfFile(findings.path(), record.offset, record.size_bytes);
    if (stored != actual) {
      findings.add("dataset.hash", "/" + path, "has bytes with hash " + actual + ", not " + (stored.empty() ? "none" : stored));
    }
  }
}

}  // namespace glint::formats
