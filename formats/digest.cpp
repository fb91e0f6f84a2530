#include "glint/formats/digest.h"

#include <cstring>
#include <map>

#include "glint/formats/hash.h"

namespace glint::formats {
namespace {

constexpr std::uint64_t kScalar = ~std::uint64_t{0};

/// The bytes that are hashed.
class Stream {
 public:
  void text(std::string_view text) { (bytes_ += text) += '\0'; }
  void number(double value) { append(value); }
  void size(std::uint64_t value) { append(value); }
  std::string hash() const { return hashBytes(bytes_.data(), bytes_.size()); }

 private:
  template <class T>
  void append(T value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    bytes_.append(bytes, sizeof value);
  }

  std::string bytes_;
};

void addAttributes(Stream& stream, const Attributes& attributes, bool root) {
  stream.size(attributes.size() - (root && attributes.contains(kDigestAttribute) ? 1 : 0));
  for (const auto& [attribute, value] : attributes) {
    if (root && attribute == kDigestAttribute) continue;
    stream.text(attribute);
    stream.text(name(value.type));
    stream.size(value.scalar ? kScalar : value.count());
    for (const double number : value.numbers) stream.number(number);
    for (const std::string& text : value.texts) stream.text(text);
  }
}

}  // namespace

std::string digestOf(const FileStructure& structure) {
  Stream stream;
  stream.text("/");
  stream.text("group");
  addAttributes(stream, structure.attributes, true);
  // Groups have no record.
  std::map<std::string_view, const DatasetRecord*> objects;
  for (const auto& [path, attributes] : structure.groups) objects.emplace(path, nullptr);
  for (const auto& [path, record] : structure.datasets) objects.emplace(path, &record);
  for (const auto& [path, record] : objects) {
    stream.text("/" + std::string(path));
    stream.text(record == nullptr ? "group" : "dataset");
    if (record != nullptr) {
      stream.text(record->known_type ? name(record->type) : "unknown");
      stream.size(record->dims.size());
      for (const std::uint64_t size : record->dims) stream.size(size);
    }
    addAttributes(stream, record == nullptr ? structure.groups.find(path)->second : record->attributes, false);
  }
  return stream.hash();
}

}  // namespace glint::formats
