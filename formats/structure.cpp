#include "glint/formats/structure.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "glint/formats/container/container.h"
#include "glint/formats/container/element.h"
#include "glint/formats/plain_text.h"
#include "glint/math/half.h"

namespace glint::formats {
namespace {

template <class T>
T load(const std::byte* at) {
  T value;
  std::memcpy(&value, at, sizeof(T));
  return value;
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
    case ElementType::f16:
      return ieeeHalfToFloat(load<std::uint16_t>(at));
    case ElementType::f32:
      return load<float>(at);
    default:
      return 0;
  }
}

/// Fills a FileStructure with what a container holds.
class StructureReader {
 public:
  StructureReader(FileStructure& structure, Findings& findings) : structure_(structure), findings_(findings) {}

  void read(const Container& container) {
    for (const ContainerObject& object : container.objects) {
      Attributes attributes = readAttributes(object);
      if (object.path == "/" && object.header.is_group) {
        structure_.attributes = std::move(attributes);
      } else if (object.header.is_group) {
        structure_.groups.emplace(object.path.substr(1), std::move(attributes));
      } else {
        attempt([&] { readDataset(object, std::move(attributes)); });
      }
    }
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

  void readDataset(const ContainerObject& object, Attributes attributes) {
    const std::string& path = object.path;
    if (path == "/") throwBroken("object.type", path, "is a dataset");
    if (!object.header.breaches.empty())
      throwBroken(object.header.breaches[0].rule, path, std::string(object.header.breaches[0].message));
    const Element element = readElement(object.header.element, path);
    if (element.variable) throwBroken("dataset.vlen", path, "has elements of variable length or references");
    const Extents extents = readExtents(object.header.extents, path);
    if (extents.null) throwBroken("dataset.dims", path, "has a dataspace that no kind uses");
    DatasetRecord record;
    record.known_type = element.type.has_value() && *element.type != ElementType::text;
    if (record.known_type) record.type = *element.type;
    record.dims = extents.dims;
    if (__builtin_mul_overflow(extents.count, element.size, &record.size_bytes))
      throwBroken("dataset.storage", path, "has sizes whose product overflows");
    locate(object, record);
    record.attributes = std::move(attributes);
    structure_.datasets.emplace(path.substr(1), std::move(record));
  }

  /// Finds the bytes of a dataset. The container has checked that what the object reserves is inside the file.
  void locate(const ContainerObject& object, DatasetRecord& record) {
    const std::uint64_t place = object.header.place;
    if (object.header.size_bytes != record.size_bytes) {
      throwBroken("dataset.storage", object.path,
                  "has " + std::to_string(object.header.size_bytes) + " bytes, where its sizes need " +
                      std::to_string(record.size_bytes));
    }
    if (record.size_bytes == 0) return;
    if (place == kNowhere) throwBroken("dataset.storage", object.path, "has no bytes in the file");
    if (place % 8 != 0) throwBroken("dataset.alignment", object.path, "lies at offset " + std::to_string(place));
    if (place % 64 != 0) {
      findings_.add("dataset.alignment_64", object.path, "lies at offset " + std::to_string(place) + ", not a multiple of 64");
    }
    record.offset = place;
    record.data = structure_.bytes.data() + place;
  }

  Attributes readAttributes(const ContainerObject& object) {
    Attributes attributes;
    for (const RawAttribute& attribute : object.header.attributes) {
      attempt([&] {
        const std::string place = object.path + "@" + std::string(attribute.name);
        attributes.emplace(attribute.name, readValue(attribute, place));
      });
    }
    return attributes;
  }

  static AttributeValue readValue(const RawAttribute& attribute, const std::string& place) {
    if (attribute.committed) throwBroken("attribute.fixed", place, "has variable length or a committed type");
    const Element element = readElement(attribute.element, place);
    if (element.variable) throwBroken("attribute.fixed", place, "has variable length or a committed type");
    if (!element.type || *element.type == ElementType::ndf_cluster)
      throwBroken("attribute.type", place, "has a type that no schema uses");
    const Extents extents = readExtents(attribute.extents, place);
    if (extents.null || extents.dims.size() > 1) throwBroken("attribute.type", place, "is neither a scalar nor a list");
    if (extents.count > kMaxAttributeBytes / element.size) throwBroken("attribute.size", place, "has more than 65536 bytes");
    if (extents.count * element.size > attribute.value.size())
      throwBroken("file.hdf5", place, "has fewer bytes than its size says");
    AttributeValue value;
    value.type = *element.type;
    value.scalar = extents.dims.empty();
    for (std::uint64_t k = 0; k < extents.count; ++k) {
      const auto at =
          attribute.value.subspan(static_cast<std::size_t>(k * element.size), static_cast<std::size_t>(element.size));
      if (value.type == ElementType::text) {
        value.texts.push_back(readText(at, place));
      } else {
        value.numbers.push_back(numberAt(value.type, at.data()));
      }
    }
    return value;
  }

  static std::string readText(std::span<const std::byte> bytes, const std::string& place) {
    const auto end = std::find(bytes.begin(), bytes.end(), std::byte{0});
    if (std::any_of(end, bytes.end(), [](std::byte b) { return b != std::byte{0}; }))
      throwBroken("text.padding", place, "has bytes after the NUL that ends its text");
    const std::string text(reinterpret_cast<const char*>(bytes.data()), static_cast<std::size_t>(end - bytes.begin()));
    if (!isPlainText(text)) throwBroken("text.utf8", place, "is no plain text");
    return text;
  }

  FileStructure& structure_;
  Findings& findings_;
};

}  // namespace

FileStructure readStructure(FileBytes bytes, Findings& findings) {
  FileStructure structure;
  structure.bytes = std::move(bytes);
  try {
    Container container = readContainer(structure.bytes.span());
    StructureReader(structure, findings).read(container);
    structure.extents = std::move(container.extents);
  } catch (const Error& error) {
    findings.add(error);
  }
  return structure;
}

void addGroups(const std::string& path, std::set<std::string>& groups) {
  for (std::size_t end = path.find('/'); end != path.npos; end = path.find('/', end + 1)) groups.insert(path.substr(0, end));
}

}  // namespace glint::formats
