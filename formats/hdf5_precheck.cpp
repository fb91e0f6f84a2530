#include "glint/formats/hdf5_precheck.h"

#include <algorithm>
#include <cstring>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "glint/formats/findings.h"
#include "glint/formats/hdf5_checksum.h"
#include "glint/formats/plain_text.h"

namespace glint::formats {
namespace {

// Names and numbers are those of the HDF5 file format specification, version 3.0.
constexpr std::uint64_t kNowhere = ~std::uint64_t{0};
constexpr std::uint64_t kSuperblockBytes = 48;
constexpr std::uint64_t kRootAddress = 36;  // its place in the superblock
constexpr std::uint64_t kChecksumBytes = 4;
constexpr unsigned kMaxRank = 32;
constexpr unsigned kMaxMembers = 64;        // of a compound
constexpr int kMaxGroupDepth = 64;          // of the walk; rule group.depth is stricter
constexpr std::size_t kMaxParts = 256;      // of an object header
constexpr std::size_t kMaxNameBytes = 255;  // of a link

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

/// "an attribute", "a link".
std::string withArticle(std::string_view noun) { return (noun[0] == 'a' || noun[0] == 'o' ? "an " : "a ") + std::string(noun); }

/// Reads numbers one after the other; reading beyond the end throws.
class Cursor {
 public:
  Cursor(std::span<const std::byte> bytes, const std::string& object, const char* what)
      : bytes_(bytes), object_(object), what_(what) {}

  [[noreturn]] void fail(const std::string& fault) const {
    throwBroken("file.hdf5", object_, "has " + withArticle(what_) + " " + fault);
  }
  void require(bool holds, const char* fault) const {
    if (!holds) fail(fault);
  }

  std::span<const std::byte> take(std::uint64_t size) {
    require(size <= bytes_.size(), "that ends too early");
    const auto taken = bytes_.first(static_cast<std::size_t>(size));
    bytes_ = bytes_.subspan(static_cast<std::size_t>(size));
    return taken;
  }
  /// An unsigned integer of up to 8 bytes.
  std::uint64_t number(unsigned size_bytes) {
    std::uint64_t value = 0;
    std::memcpy(&value, take(size_bytes).data(), size_bytes);
    return value;
  }
  std::string_view text(std::uint64_t size) {
    const auto bytes = take(size);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  std::uint64_t left() const { return bytes_.size(); }
  const std::string& object() const { return object_; }

 private:
  std::span<const std::byte> bytes_;
  const std::string& object_;
  const char* what_;
};

/// What the messages of one object header say together.
struct Header {
  bool dataspace = false, datatype = false, layout = false, fill_value = false;
  bool link_info = false, group_info = false, attribute_info = false;
  std::vector<std::pair<std::string, std::uint64_t>> links;  // name, address
  std::set<std::string, std::less<>> attributes;
};

struct Datatype {
  std::uint64_t size = 0;  ///< bytes of an element
  bool variable = false;   ///< variable length or a reference, or a member of these
  bool usable = true;      ///< numbers, texts, and compounds of these
};

std::uint64_t roundUp(std::uint64_t size) { return (size + 7) / 8 * 8; }

/// Skips the rest of a fixed-point or floating-point type; checks that its bits are in the element.
void checkNumber(Cursor& cursor, bool floating, std::uint64_t flags, std::uint64_t size) {
  const std::uint64_t offset = cursor.number(2), precision = cursor.number(2), bits = 8 * size;
  cursor.require(size <= 16 && precision > 0 && offset + precision <= bits, "whose bits are not in the element");
  if (!floating) return;
  const std::uint64_t exponent = cursor.number(1), exponent_bits = cursor.number(1);
  const std::uint64_t mantissa = cursor.number(1), mantissa_bits = cursor.number(1);
  cursor.number(4);  // bias
  const std::uint64_t sign = flags >> 8 & 0xff, end = offset + precision;
  const bool inside = exponent >= offset && mantissa >= offset && sign >= offset && exponent_bits > 0 && mantissa_bits > 0 &&
                      exponent + exponent_bits <= end && mantissa + mantissa_bits <= end && sign < end;
  const bool apart = mantissa + mantissa_bits <= exponent || exponent + exponent_bits <= mantissa;
  cursor.require(inside && apart, "whose fields are not in the element");
  cursor.require((flags >> 4 & 3) <= 2 && (flags & 0x40) == 0, "that is normalised or ordered in an unknown way");
}

Datatype readDatatype(Cursor& cursor, bool member);

void readMembers(Cursor& cursor, unsigned version, std::uint64_t flags, Datatype& type) {
  const std::uint64_t count = flags & 0xffff;
  cursor.require(count > 0 && count <= kMaxMembers, "with too many members, or none");
  unsigned offset_bytes = 1;
  while (offset_bytes < 4 && type.size >> (8 * offset_bytes) != 0) ++offset_bytes;
  std::set<std::string, std::less<>> names;
  for (std::uint64_t k = 0; k < count; ++k) {
    std::string name;
    while (const auto c = static_cast<char>(cursor.number(1))) name += c;
    cursor.require(!name.empty() && names.insert(name).second, "whose members have no names of their own");
    if (version < 3) cursor.take(roundUp(name.size() + 1) - (name.size() + 1));
    const std::uint64_t offset = cursor.number(version < 3 ? 4 : offset_bytes);
    // Version 1 has sizes of arrays here: a dimensionality of 0, a permutation and four sizes.
    if (version == 1) cursor.require(cursor.number(1) == 0, "with members that are arrays"), cursor.take(27);
    const Datatype inner = readDatatype(cursor, true);
    cursor.require(offset <= type.size && inner.size <= type.size - offset, "whose members are not in the element");
    type.variable |= inner.variable;
    type.usable &= inner.usable;
  }
}

/// Reads a datatype. The rest of a datatype that no schema uses is left unread.
Datatype readDatatype(Cursor& cursor, bool member) {
  enum : unsigned { fixed = 0, floating = 1, text = 3, reference = 7, compound = 6, variable = 9, last = 10 };
  const auto head = static_cast<unsigned>(cursor.number(1));
  const unsigned version = head >> 4, type_class = head & 15;
  cursor.require(version >= 1 && version <= 3 && type_class <= last, "of an unknown version");
  const std::uint64_t flags = cursor.number(3);
  Datatype type;
  type.size = cursor.number(4);
  cursor.require(type.size > 0, "of no bytes");
  if (type_class == fixed || type_class == floating) {
    checkNumber(cursor, type_class == floating, flags, type.size);
  } else if (type_class == compound && !member) {
    readMembers(cursor, version, flags, type);
  } else if (type_class == text) {
    cursor.require((flags & 15) <= 2 && (flags >> 4 & 15) <= 1, "of texts that are padded or coded in an unknown way");
  } else {
    type.usable = false;
    type.variable = type_class == variable || type_class == reference;
  }
  return type;
}

/// Reads a dataspace. @return its elements; nothing (an empty dataspace) counts as 0
std::uint64_t readDataspace(Cursor& cursor) {
  const std::uint64_t version = cursor.number(1), rank = cursor.number(1), flags = cursor.number(1), kind = cursor.number(1);
  cursor.require((version == 1 || version == 2) && rank <= kMaxRank && flags <= 1, "of an unknown version");
  if (version == 1) cursor.take(4);
  if (version == 2) cursor.require(kind <= 2 && (kind == 1 || rank == 0), "of an unknown kind");
  std::uint64_t count = version == 2 && kind == 2 ? 0 : 1;
  std::vector<std::uint64_t> sizes;
  for (std::uint64_t d = 0; d < rank; ++d) sizes.push_back(cursor.number(8));
  for (const std::uint64_t n : sizes) {
    if (__builtin_mul_overflow(count, n, &count))
      throwBroken("dataset.storage", cursor.object(), "has sizes whose product overflows");
  }
  for (std::uint64_t d = 0; flags == 1 && d < rank; ++d) {
    cursor.require(cursor.number(8) >= sizes[static_cast<std::size_t>(d)], "that is larger than it may grow");
  }
  return count;
}

/// Walks a file from its root.
class HeaderWalk {
 public:
  explicit HeaderWalk(std::span<const std::byte> file) : file_(file) {}

  ObjectPlaces walk() {
    checkSum({0, kSuperblockBytes}, "/", "superblock");
    places_.extents.push_back({0, kSuperblockBytes});
    places_.complete = true;
    std::uint64_t root = 0;
    std::memcpy(&root, file_.data() + kRootAddress, sizeof root);
    readObject(root, "/", 0);
    std::sort(places_.extents.begin(), places_.extents.end(), [](Extent a, Extent b) { return a.begin < b.begin; });
    return std::move(places_);
  }

 private:
  using Bytes = std::span<const std::byte>;

  Bytes at(Extent extent) const {
    return file_.subspan(static_cast<std::size_t>(extent.begin), static_cast<std::size_t>(extent.end - extent.begin));
  }

  bool holds(std::uint64_t begin, std::uint64_t size) const { return begin <= file_.size() && size <= file_.size() - begin; }

  bool startsWith(std::uint64_t address, const char (&signature)[5]) const {
    return holds(address, 4) && std::memcmp(file_.data() + address, signature, 4) == 0;
  }

  void checkSum(Extent extent, const std::string& object, const char* what) const {
    const Bytes bytes = at(extent);
    std::uint32_t stored = 0;
    std::memcpy(&stored, bytes.data() + bytes.size() - kChecksumBytes, kChecksumBytes);
    if (stored == hdf5Checksum(bytes.first(bytes.size() - kChecksumBytes))) return;
    throwBroken("file.hdf5", object, "has " + withArticle(what) + " with a wrong checksum");
  }

  /// Notes a part of the metadata. Parts that lie over each other would let a small file have endless ones.
  void claim(Extent extent, const std::string& object) {
    claimed_ += extent.end - extent.begin;
    if (claimed_ > file_.size()) throwBroken("file.hdf5", object, "has object headers that lie over each other");
    places_.extents.push_back(extent);
  }

  void readObject(std::uint64_t address, const std::string& object, int depth) {
    if (depth > kMaxGroupDepth) throwBroken("group.depth", object, "is nested too deep");
    if (!seen_.insert(address).second) throwBroken("link.single", object, "has several links");
    const Header header = readHeader(address, object);
    const bool dataset = header.dataspace && header.datatype && header.layout;
    const bool some = header.dataspace || header.datatype || header.layout || header.fill_value;
    if (some == header.link_info || some != dataset || (dataset && header.group_info)) {
      throwBroken("object.type", object, "is neither a group nor a dataset");
    }
    if (dataset && !header.links.empty()) throwBroken("object.type", object, "is a dataset with links");
    std::set<std::string_view> names;
    for (const auto& [name, place] : header.links) {
      const std::string path = (object == "/" ? object : object + "/") + name;
      if (!names.insert(name).second) throwBroken("file.hdf5", path, "has a name that another object has");
      readObject(place, path, depth + 1);
    }
  }

  Header readHeader(std::uint64_t address, const std::string& object) {
    if (!startsWith(address, "OHDR")) throwBroken("file.hdf5", object, "has no object header of version 2");
    Cursor cursor(file_.subspan(static_cast<std::size_t>(address) + 4), object, "object header");
    cursor.require(cursor.number(1) == 2, "that is not of version 2");
    const std::uint64_t flags = cursor.number(1);
    cursor.require(flags < 64, "with unknown flags");
    if ((flags & 32) != 0) cursor.take(16);  // times
    if ((flags & 16) != 0) cursor.take(4);   // when attributes would move to a heap
    const std::uint64_t size = cursor.number(1u << (flags & 3));
    const std::uint64_t begin = file_.size() - cursor.left();
    cursor.require(size <= cursor.left() && cursor.left() - size >= kChecksumBytes, "that ends beyond the file");
    const Extent first = {address, begin + size + kChecksumBytes};
    checkSum(first, object, "object header");
    claim(first, object);
    Header header;
    std::vector<Extent> messages = {{begin, begin + size}};
    const bool counted = (flags & 4) != 0;  // attributes carry the order in which they were made
    for (std::size_t part = 0; part < messages.size(); ++part) readMessages(messages[part], counted, object, header, messages);
    return header;
  }

  void readMessages(Extent part, bool counted, const std::string& object, Header& header, std::vector<Extent>& messages) {
    Cursor cursor(at(part), object, "object header");
    const std::uint64_t head_bytes = counted ? 6 : 4;
    while (cursor.left() >= head_bytes) {
      const auto type = static_cast<unsigned>(cursor.number(1));
      const std::uint64_t size = cursor.number(2), flags = cursor.number(1);
      if (counted) cursor.number(2);
      const Bytes body = cursor.take(size);
      constexpr std::uint64_t kConstant = 1, kShared = 2, kNotShareable = 4;
      if ((flags & kShared) != 0) {
        if (static_cast<Message>(type) == Message::datatype)
          throwBroken("dataset.type", object, "has a committed element type");
        cursor.fail("with shared messages");
      }
      cursor.require((flags & ~(kConstant | kNotShareable)) == 0, "with messages of unknown flags");
      readMessage(type, body, object, header, messages);
    }
  }

  void readMessage(unsigned type, Bytes body, const std::string& object, Header& header, std::vector<Extent>& messages) {
    const auto cursor = [&](const char* what) { return Cursor(body, object, what); };
    const auto once = [&](bool& seen) {
      if (std::exchange(seen, true)) throwBroken("file.hdf5", object, "has a message twice in its object header");
    };
    switch (static_cast<Message>(type)) {
      case Message::nil:
        return;
      case Message::dataspace:
        return once(header.dataspace), readSizes(cursor("dataspace"));
      case Message::link_info:
        return once(header.link_info), readInfo(cursor("link info"), 8);
      case Message::datatype:
        return once(header.datatype), readElement(cursor("datatype"));
      case Message::fill_value:
        return once(header.fill_value), readFillValue(cursor("fill value"));
      case Message::link:
        return readLink(cursor("link"), header);
      case Message::external_files:
        throwBroken("dataset.external", object, "is stored in another file");
      case Message::layout:
        return once(header.layout), readLayout(cursor("data layout"));
      case Message::group_info:
        return once(header.group_info), readGroupInfo(cursor("group info"));
      case Message::filters:
        throwBroken("dataset.layout", object, "has filters");
      case Message::attribute:
        return readAttribute(cursor("attribute"), header);
      case Message::continuation:
        return readContinuation(cursor("continuation of its object header"), messages);
      case Message::attribute_info:
        return once(header.attribute_info), readInfo(cursor("attribute info"), 2);
      case Message::reference_count:
        throwBroken("link.single", object, "has several links");
    }
    throwBroken("file.hdf5", object,
                "has an object header with a message of type " + std::to_string(type) + ", which no asset has");
  }

  void readSizes(Cursor cursor) { readDataspace(cursor); }

  void readElement(Cursor cursor) {
    const Datatype type = readDatatype(cursor, false);
    if (type.variable) throwBroken("dataset.vlen", cursor.object(), "has elements of variable length or references");
    if (!type.usable) throwBroken("dataset.type", cursor.object(), "has elements of a type that no schema uses");
  }

  void readFillValue(Cursor cursor) {
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

  /// Where links or attributes are if they are not in the header.
  void readInfo(Cursor cursor, unsigned order_bytes) {
    cursor.require(cursor.number(1) == 0, "of an unknown version");
    const std::uint64_t flags = cursor.number(1);
    cursor.require(flags <= 3, "with unknown flags");
    if ((flags & 1) != 0) cursor.number(order_bytes);
    const std::uint64_t heap = cursor.number(8), names = cursor.number(8);
    const std::uint64_t order = (flags & 2) != 0 ? cursor.number(8) : kNowhere;
    if (heap == kNowhere && names == kNowhere && order == kNowhere) return;
    const bool ordered = order == kNowhere || startsWith(order, "BTHD");
    cursor.require(startsWith(heap, "FRHP") && startsWith(names, "BTHD") && ordered, "that names a heap where none is");
    places_.complete = false;
  }

  void readGroupInfo(Cursor cursor) {
    cursor.require(cursor.number(1) == 0, "of an unknown version");
    const std::uint64_t flags = cursor.number(1);
    cursor.require(flags <= 3, "with unknown flags");
    if ((flags & 1) != 0) cursor.take(4);
    if ((flags & 2) != 0) cursor.take(4);
  }

  void readLink(Cursor cursor, Header& header) {
    cursor.require(cursor.number(1) == 1, "of an unknown version");
    const std::uint64_t flags = cursor.number(1);
    cursor.require(flags < 32, "with unknown flags");
    const std::uint64_t kind = (flags & 8) != 0 ? cursor.number(1) : 0;
    if ((flags & 4) != 0) cursor.number(8);  // order
    if ((flags & 16) != 0) cursor.require(cursor.number(1) <= 1, "in an unknown character set");
    const std::string_view name = cursor.text(cursor.number(1u << (flags & 3)));
    const std::string& object = cursor.object();
    if (!isPlainText(name)) throwBroken("text.utf8", object, "has a link whose name is no plain text");
    cursor.require(!name.empty() && name != "." && name.find('/') == name.npos, "without a name");
    const std::string path = (object == "/" ? object : object + "/") + std::string(name);
    if (name.size() > kMaxNameBytes)
      throwBroken("group.size", object, "has more than 1024 links, or one with a name over 255 bytes");
    if (kind != 0) throwBroken("link.hard", path, "is a soft, external or user-defined link");
    header.links.emplace_back(name, cursor.number(8));
  }

  void readLayout(Cursor cursor) {
    const std::uint64_t version = cursor.number(1), kind = cursor.number(1);
    cursor.require(version == 3 || version == 4, "of an unknown version");
    const std::string& object = cursor.object();
    if (kind == 3) throwBroken("dataset.virtual", object, "is a virtual dataset");
    if (kind != 1) throwBroken("dataset.layout", object, "is chunked or compact, not contiguous");
    const std::uint64_t place = cursor.number(8), size = cursor.number(8);
    if (place == kNowhere || size == 0) return;
    if (!holds(place, size)) {
      throwBroken("dataset.storage", object,
                  "needs " + std::to_string(size) + " bytes at offset " + std::to_string(place) + " of a file of " +
                      std::to_string(file_.size()));
    }
    places_.extents.push_back({place, place + size});
  }

  void readAttribute(Cursor cursor, Header& header) {
    const std::uint64_t version = cursor.number(1), flags = cursor.number(1);
    cursor.require(version >= 1 && version <= 3, "of an unknown version");
    const std::uint64_t name_bytes = cursor.number(2), type_bytes = cursor.number(2), space_bytes = cursor.number(2);
    if (version == 3) cursor.require(cursor.number(1) <= 1, "in an unknown character set");
    const auto padded = [&](std::uint64_t size) { return version == 1 ? roundUp(size) : size; };
    std::string_view name = cursor.text(padded(name_bytes)).substr(0, name_bytes);
    name = name.substr(0, name.find('\0'));
    cursor.require(!name.empty() && name.size() + 1 == name_bytes, "without a name");
    if (!isPlainText(name)) throwBroken("text.utf8", cursor.object(), "has an attribute whose name is no plain text");
    const std::string place = cursor.object() + "@" + std::string(name);
    if (version > 1 && flags != 0) throwBroken("attribute.fixed", place, "has variable length or a committed type");
    if (!header.attributes.emplace(name).second) throwBroken("file.hdf5", place, "is there twice");
    Cursor type_cursor(cursor.take(padded(type_bytes)), place, "datatype");
    const Datatype type = readDatatype(type_cursor, false);
    if (type.variable) throwBroken("attribute.fixed", place, "has variable length or a committed type");
    if (!type.usable) throwBroken("attribute.type", place, "has a type that no schema uses");
    Cursor space_cursor(cursor.take(padded(space_bytes)), place, "dataspace");
    std::uint64_t size = 0;
    if (__builtin_mul_overflow(readDataspace(space_cursor), type.size, &size) || size > cursor.left()) {
      throwBroken("file.hdf5", place, "has fewer bytes than its size says");
    }
  }

  void readContinuation(Cursor cursor, std::vector<Extent>& messages) {
    const std::uint64_t place = cursor.number(8), size = cursor.number(8);
    constexpr std::uint64_t kSignatureBytes = 4;
    cursor.require(startsWith(place, "OCHK") && holds(place, size) && size >= kSignatureBytes + kChecksumBytes,
                   "where none is");
    cursor.require(messages.size() < kMaxParts, "too often");
    const Extent whole = {place, place + size};
    checkSum(whole, cursor.object(), "continuation of its object header");
    claim(whole, cursor.object());
    messages.push_back({whole.begin + kSignatureBytes, whole.end - kChecksumBytes});
  }

  Bytes file_;
  ObjectPlaces places_;
  std::uint64_t claimed_ = 0;
  std::set<std::uint64_t> seen_;  // addresses of object headers
};

}  // namespace

ObjectPlaces checkObjectHeaders(std::span<const std::byte> file) { return HeaderWalk(file).walk(); }

}  // namespace glint::formats
