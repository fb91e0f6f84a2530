#include "glint/formats/container/object_header.h"

#include <cstring>
#include <utility>

#include "glint/formats/container/checksum.h"
#include "glint/formats/container/cursor.h"
#include "glint/formats/plain_text.h"

namespace glint::formats {
namespace {

// Names and numbers are those of the HDF5 file format specification, version 3.0, section IV.A.
constexpr std::uint64_t kChecksumBytes = 4, kSignatureBytes = 4;

enum class Message : std::uint8_t {
  nil = 0,
  dataspace = 1,
  link_info = 2,
  datatype = 3,
  fill_value = 5,
  link = 6,
  external_files = 7,
  layout = 8,
  group_info = 10,
  filters = 11,
  attribute = 12,
  continuation = 16,
  attribute_info = 21,
  reference_count = 22,
};

using Bytes = std::span<const std::byte>;

std::uint64_t roundUp(std::uint64_t size) { return (size + 7) / 8 * 8; }

/// Reads one object header.
class HeaderReader {
 public:
  HeaderReader(Bytes file, const std::string& object, std::vector<Extent>& parts)
      : file_(file), object_(object), parts_(parts) {
    for (const Extent& part : parts) claimed_ += part.end - part.begin;
  }

  ObjectHeader read(std::uint64_t address) {
    readFirstPart(address);
    for (std::size_t part = 0; part < messages_.size(); ++part) readMessages(messages_[part]);
    const bool all = seen(Message::dataspace) && seen(Message::datatype) && seen(Message::layout);
    const bool some = seen(Message::dataspace) || seen(Message::datatype) || seen(Message::layout) || seen(Message::fill_value);
    header_.is_group = seen(Message::link_info);
    if (some == header_.is_group || some != all || (all && seen(Message::group_info)))
      throwBroken("object.type", object_, "is neither a group nor a dataset");
    if (all && !header_.links.empty()) throwBroken("object.type", object_, "is a dataset with links");
    return std::move(header_);
  }

 private:
  bool holds(std::uint64_t begin, std::uint64_t size) const { return begin <= file_.size() && size <= file_.size() - begin; }

  bool startsWith(std::uint64_t address, const char (&signature)[5]) const {
    return holds(address, kSignatureBytes) && std::memcmp(file_.data() + address, signature, kSignatureBytes) == 0;
  }

  Bytes at(Extent extent) const {
    return file_.subspan(static_cast<std::size_t>(extent.begin), static_cast<std::size_t>(extent.end - extent.begin));
  }

  /// Notes a part of the metadata. Parts that lie over each other would let a small file have endless ones.
  void claim(Extent part) {
    claimed_ += part.end - part.begin;
    if (claimed_ > file_.size()) throwBroken("file.hdf5", object_, "has object headers that lie over each other");
    parts_.push_back(part);
  }

  void readFirstPart(std::uint64_t address) {
    if (!startsWith(address, "OHDR")) throwBroken("file.hdf5", object_, "has no object header of version 2");
    Cursor cursor(file_.subspan(static_cast<std::size_t>(address + kSignatureBytes)), object_, "object header");
    cursor.require(cursor.number(1) == 2, "that is not of version 2");
    const std::uint64_t flags = cursor.number(1);
    constexpr std::uint64_t kCounted = 4, kPhases = 16, kTimes = 32, kKnown = 63;
    cursor.require((flags & ~kKnown) == 0, "with unknown flags");
    if ((flags & kTimes) != 0) cursor.take(16);
    if ((flags & kPhases) != 0) cursor.take(4);  // numbers of attributes at which they would move to a heap and back
    counted_ = (flags & kCounted) != 0;
    const std::uint64_t size = cursor.number(1u << (flags & 3));
    const std::uint64_t begin = file_.size() - cursor.left();
    cursor.require(size <= cursor.left() && cursor.left() - size >= kChecksumBytes, "that ends beyond the file");
    const Extent whole = {address, begin + size + kChecksumBytes};
    claim(whole);
    requireChecksum(at(whole), object_, "object header");
    messages_.push_back({begin, begin + size});
  }

  void readMessages(Extent part) {
    Cursor cursor(at(part), object_, "object header");
    const std::uint64_t head_bytes = counted_ ? 6 : 4;
    while (cursor.left() >= head_bytes) {
      const auto type = static_cast<unsigned>(cursor.number(1));
      const std::uint64_t size = cursor.number(2), flags = cursor.number(1);
      if (counted_) cursor.number(2);  // order in which attributes were made
      const Bytes body = cursor.take(size);
      constexpr std::uint64_t kConstant = 1, kShared = 2, kNotShareable = 4;
      if ((flags & kShared) != 0) {
        if (static_cast<Message>(type) == Message::datatype)
          throwBroken("dataset.type", object_, "has a committed element type");
        cursor.fail("with shared messages");
      }
      cursor.require((flags & ~(kConstant | kNotShareable)) == 0, "with messages of unknown flags");
      readMessage(type, body);
    }
    // What is left is a gap that no message fits into.
    for (const std::byte b : cursor.take(cursor.left())) cursor.require(b == std::byte{0}, "with a gap that is not 0");
  }

  bool seen(Message message) const { return (seen_ >> static_cast<unsigned>(message) & 1) != 0; }

  void requireOnce(Message message) {
    if (seen(message)) throwBroken("file.hdf5", object_, "has a message twice in its object header");
    seen_ |= std::uint64_t{1} << static_cast<unsigned>(message);
  }

  void breach(std::string_view rule, std::string_view message) { header_.breaches.push_back({rule, message}); }

  Cursor cursor(Bytes body, const char* what) const { return Cursor(body, object_, what); }

  void readMessage(unsigned type, Bytes body) {
    const auto message = static_cast<Message>(type);
    switch (message) {
      case Message::nil:
        return;
      case Message::dataspace:
        requireOnce(message), header_.extents = body;
        return;
      case Message::datatype:
        requireOnce(message), header_.element = body;
        return;
      case Message::fill_value:
        return requireOnce(message), readFillValue(cursor(body, "fill value"));
      case Message::layout:
        return requireOnce(message), readLayout(cursor(body, "data layout"));
      case Message::external_files:
        return requireOnce(message), breach("dataset.external", "is stored in another file");
      case Message::filters:
        return requireOnce(message), breach("dataset.layout", "has filters");
      case Message::link_info:
        return requireOnce(message), readInfo(cursor(body, "link info"), 8);
      case Message::attribute_info:
        return requireOnce(message), readInfo(cursor(body, "attribute info"), 2);
      case Message::group_info:
        return requireOnce(message), readGroupInfo(cursor(body, "group info"));
      case Message::link:
        return readLink(cursor(body, "link"));
      case Message::attribute:
        return readAttribute(cursor(body, "attribute"));
      case Message::continuation:
        return readContinuation(cursor(body, "continuation of its object header"));
      case Message::reference_count:
        throwBroken("link.single", object_, "has several links");
    }
    throwBroken("file.hdf5", object_,
                "has an object header with a message of type " + std::to_string(type) + ", which no asset has");
  }

  void readFillValue(Cursor cursor) const {
    const std::uint64_t version = cursor.number(1);
    cursor.require(version == 2 || version == 3, "of an unknown version");
    bool given = false;
    if (version == 2) {
      const std::uint64_t allocation = cursor.number(1), writing = cursor.number(1), defined = cursor.number(1);
      cursor.require(allocation <= 3 && writing <= 2 && defined <= 1, "with unknown flags");
      given = defined == 1;
    } else {
      const std::uint64_t flags = cursor.number(1);
      cursor.require(flags < 64 && (flags >> 2 & 3) <= 2 && (flags & 48) != 48, "with unknown flags");
      given = (flags & 32) != 0;
    }
    if (given) cursor.take(cursor.number(4));
  }

  /// Link info or attribute info: where links or attributes are if they are not in the header.
  void readInfo(Cursor cursor, unsigned order_bytes) const {
    cursor.require(cursor.number(1) == 0, "of an unknown version");
    const std::uint64_t flags = cursor.number(1);
    cursor.require(flags <= 3, "with unknown flags");
    if ((flags & 1) != 0) cursor.number(order_bytes);
    const std::uint64_t heap = cursor.number(8), names = cursor.number(8);
    const std::uint64_t order = (flags & 2) != 0 ? cursor.number(8) : kNowhere;
    if (heap != kNowhere || names != kNowhere || order != kNowhere)
      throwBroken("object.heap", object_, "keeps links or attributes in a heap");
  }

  void readGroupInfo(Cursor cursor) const {
    cursor.require(cursor.number(1) == 0, "of an unknown version");
    const std::uint64_t flags = cursor.number(1);
    cursor.require(flags <= 3, "with unknown flags");
    if ((flags & 1) != 0) cursor.take(4);
    if ((flags & 2) != 0) cursor.take(4);
  }

  void readLink(Cursor cursor) {
    cursor.require(cursor.number(1) == 1, "of an unknown version");
    const std::uint64_t flags = cursor.number(1);
    cursor.require(flags < 32, "with unknown flags");
    const std::uint64_t kind = (flags & 8) != 0 ? cursor.number(1) : 0;
    if ((flags & 4) != 0) cursor.number(8);  // order in which links were made
    if ((flags & 16) != 0) cursor.require(cursor.number(1) <= 1, "in an unknown character set");
    const std::string_view name = cursor.text(cursor.number(1u << (flags & 3)));
    if (name.size() > kMaxNameBytes || header_.links.size() == kMaxLinks)
      throwBroken("group.size", object_, "has more than 1024 links, or one with a name over 255 bytes");
    if (!isPlainText(name)) throwBroken("text.utf8", object_, "has a link whose name is no plain text");
    cursor.require(!name.empty() && name != "." && name.find('/') == name.npos, "without a name");
    if (kind != 0) {
      const std::string path = (object_ == "/" ? object_ : object_ + "/") + std::string(name);
      throwBroken("link.hard", path, "is a soft, external or user-defined link");
    }
    header_.links.push_back({name, cursor.number(8)});
  }

  void readLayout(Cursor cursor) {
    const std::uint64_t version = cursor.number(1), kind = cursor.number(1);
    cursor.require(version == 3 || version == 4, "of an unknown version");
    constexpr std::uint64_t kContiguous = 1, kVirtual = 3;
    if (kind == kVirtual) return breach("dataset.virtual", "is a virtual dataset");
    if (kind != kContiguous) return breach("dataset.layout", "is chunked or compact, not contiguous");
    header_.place = cursor.number(8);
    header_.size_bytes = cursor.number(8);
    if (header_.place == kNowhere || header_.size_bytes == 0 || holds(header_.place, header_.size_bytes)) return;
    throwBroken("dataset.storage", object_,
                "needs " + std::to_string(header_.size_bytes) + " bytes at offset " + std::to_string(header_.place) +
                    " of a file of " + std::to_string(file_.size()));
  }

  void readAttribute(Cursor cursor) {
    if (header_.attributes.size() == kMaxAttributes) throwBroken("object.attributes", object_, "has over 64 attributes");
    const std::uint64_t version = cursor.number(1), flags = cursor.number(1);
    cursor.require(version >= 1 && version <= 3, "of an unknown version");
    const std::uint64_t name_bytes = cursor.number(2), element_bytes = cursor.number(2), extents_bytes = cursor.number(2);
    if (version == 3) cursor.require(cursor.number(1) <= 1, "in an unknown character set");
    const auto padded = [&](std::uint64_t size) { return version == 1 ? roundUp(size) : size; };
    const std::string_view name = cursor.text(padded(name_bytes)).substr(0, name_bytes);
    cursor.require(name.size() > 1 && name.find('\0') == name.size() - 1, "without a name");
    RawAttribute attribute;
    attribute.name = name.substr(0, name.size() - 1);
    if (attribute.name.size() > kMaxNameBytes || !isPlainText(attribute.name))
      throwBroken("text.utf8", object_, "has an attribute whose name is no plain text, or over 255 bytes");
    attribute.committed = version > 1 && flags != 0;
    attribute.element = cursor.take(padded(element_bytes));
    attribute.extents = cursor.take(padded(extents_bytes));
    attribute.value = cursor.take(cursor.left());
    for (const RawAttribute& other : header_.attributes)
      cursor.require(other.name != attribute.name, "with the name of another attribute");
    header_.attributes.push_back(attribute);
  }

  void readContinuation(Cursor cursor) {
    const std::uint64_t place = cursor.number(8), size = cursor.number(8);
    cursor.require(startsWith(place, "OCHK") && holds(place, size) && size >= kSignatureBytes + kChecksumBytes,
                   "where none is");
    cursor.require(messages_.size() < kMaxParts, "too often");
    const Extent whole = {place, place + size};
    claim(whole);
    requireChecksum(at(whole), object_, "continuation of its object header");
    messages_.push_back({whole.begin + kSignatureBytes, whole.end - kChecksumBytes});
  }

  Bytes file_;
  const std::string& object_;
  std::vector<Extent>& parts_;
  std::uint64_t claimed_ = 0;     // bytes of all parts
  bool counted_ = false;          // messages carry the order in which they were made
  std::vector<Extent> messages_;  // of each part
  std::uint64_t seen_ = 0;        // a bit for each kind of message
  ObjectHeader header_;
};

}  // namespace

ObjectHeader readObjectHeader(Bytes file, std::uint64_t address, const std::string& object, std::vector<Extent>& parts) {
  return HeaderReader(file, object, parts).read(address);
}

void requireChecksum(Bytes part, const std::string& object, const char* what) {
  std::uint32_t stored = 0;
  const Bytes sum = part.last(kChecksumBytes);
  std::memcpy(&stored, sum.data(), kChecksumBytes);
  if (stored == hdf5Checksum(part.first(part.size() - kChecksumBytes))) return;
  throwBroken("file.hdf5", object, "has " + withArticle(what) + " with a wrong checksum");
}

}  // namespace glint::formats
