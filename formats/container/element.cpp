#include "glint/formats/container/element.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "glint/formats/container/cursor.h"
#include "glint/model/ndf_cp.h"

namespace glint::formats {
namespace {

// Names and numbers are those of the HDF5 file format specification, version 3.0, section IV.A.2.
enum Class : unsigned {
  fixed_point = 0,
  floating_point = 1,
  string = 3,
  compound = 6,
  reference = 7,
  variable_length = 9,
  array = 10
};

using Type = ElementType;

constexpr unsigned kMaxMembers = 64;  // of a compound; SPEC.md, section 2
constexpr unsigned kMaxNumberBytes = 16;

/// First part of a datatype message, which all classes share.
struct Head {
  unsigned type_class = 0, version = 0;
  std::uint64_t flags = 0, size = 0;
};

Head readHead(Cursor& cursor) {
  const auto first = static_cast<unsigned>(cursor.number(1));
  Head head{first & 15, first >> 4, cursor.number(3), cursor.number(4)};
  cursor.require(head.version >= 1 && head.version <= 3 && head.type_class <= array, "of an unknown version");
  cursor.require(head.size > 0, "of no bytes");
  return head;
}

/// The integer type of a size in bytes, little-endian and without unused bits.
std::optional<ElementType> integerType(std::uint64_t size, bool is_signed) {
  switch (size) {
    case 1:
      return is_signed ? Type::i8 : Type::u8;
    case 2:
      return is_signed ? Type::i16 : Type::u16;
    case 4:
      return is_signed ? Type::i32 : Type::u32;
    case 8:
      return is_signed ? std::nullopt : std::optional(Type::u64);
    default:
      return std::nullopt;
  }
}

std::optional<ElementType> readInteger(Cursor& cursor, const Head& head) {
  const std::uint64_t offset = cursor.number(2), precision = cursor.number(2);
  cursor.require(head.size <= kMaxNumberBytes && precision > 0 && offset + precision <= 8 * head.size,
                 "whose bits are not in the element");
  constexpr std::uint64_t kOrderAndPadding = 7, kSigned = 8;
  if ((head.flags & kOrderAndPadding) != 0 || offset != 0 || precision != 8 * head.size) return std::nullopt;
  return integerType(head.size, (head.flags & kSigned) != 0);
}

/// Fields of a floating-point type, in bits.
struct FloatFields {
  std::uint64_t sign, exponent, exponent_bits, mantissa, mantissa_bits, bias;
  friend bool operator==(const FloatFields&, const FloatFields&) = default;
};
constexpr FloatFields kBinary16 = {15, 10, 5, 0, 10, 15};
constexpr FloatFields kBinary32 = {31, 23, 8, 0, 23, 127};

std::optional<ElementType> readFloat(Cursor& cursor, const Head& head) {
  const std::uint64_t offset = cursor.number(2), precision = cursor.number(2);
  FloatFields f{};
  f.sign = head.flags >> 8 & 0xff;
  f.exponent = cursor.number(1), f.exponent_bits = cursor.number(1);
  f.mantissa = cursor.number(1), f.mantissa_bits = cursor.number(1);
  f.bias = cursor.number(4);
  cursor.require(head.size <= kMaxNumberBytes && precision > 0 && offset + precision <= 8 * head.size,
                 "whose bits are not in the element");
  // Little-endian, no padding, and a leading bit of 1 that is not stored.
  constexpr std::uint64_t kOrderPaddingAndNorm = 0x7f, kImplied = 0x20;
  if ((head.flags & kOrderPaddingAndNorm) != kImplied || offset != 0 || precision != 8 * head.size) return std::nullopt;
  if (head.size == 2 && f == kBinary16) return ElementType::f16;
  if (head.size == 4 && f == kBinary32) return ElementType::f32;
  return std::nullopt;
}

/// Texts that end at a NUL, or are padded with NUL, in ASCII or UTF-8.
std::optional<ElementType> readText(Cursor& cursor, const Head& head) {
  const std::uint64_t padding = head.flags & 15, characters = head.flags >> 4 & 15;
  cursor.require(padding <= 2 && characters <= 1, "of texts that are padded or coded in an unknown way");
  constexpr std::uint64_t kSpaces = 2;
  return padding == kSpaces ? std::nullopt : std::optional(ElementType::text);
}

/// A member of ndf_cluster.
struct Member {
  std::string_view name;
  std::uint64_t offset;
  ElementType type;
};
constexpr std::array kClusterMembers = {
    Member{"first_coefficient", offsetof(NdfCluster, first_coefficient), Type::u64},
    Member{"first_basis", offsetof(NdfCluster, first_basis), Type::u32},
    Member{"first_scale", offsetof(NdfCluster, first_scale), Type::u32},
    Member{"first_word", offsetof(NdfCluster, first_word), Type::u32},
    Member{"slice_count", offsetof(NdfCluster, slice_count), Type::u32},
    Member{"columns", offsetof(NdfCluster, columns), Type::u16},
    Member{"narrow_columns", offsetof(NdfCluster, narrow_columns), Type::u16},
    Member{"rank_x", offsetof(NdfCluster, rank_x), Type::u8},
    Member{"rank_y", offsetof(NdfCluster, rank_y), Type::u8},
    Member{"floor_unit", offsetof(NdfCluster, floor_unit), Type::f16},
};

/// Name of a member, which a NUL ends, and in versions 1 and 2 NULs up to a multiple of 8 bytes.
std::string readMemberName(Cursor& cursor, unsigned version) {
  std::string name;
  while (const auto c = static_cast<char>(cursor.number(1))) name += c;
  const std::uint64_t size = name.size() + 1;
  if (version < 3) cursor.take((size + 7) / 8 * 8 - size);
  return name;
}

/// Reads one number of a compound. None: a member that is no number, after which a datatype cannot be read on.
std::optional<Element> readMemberElement(Cursor& cursor) {
  const Head head = readHead(cursor);
  Element element{std::nullopt, head.size, head.type_class == reference || head.type_class == variable_length};
  if (head.type_class == fixed_point) {
    element.type = readInteger(cursor, head);
  } else if (head.type_class == floating_point) {
    element.type = readFloat(cursor, head);
  } else if (head.type_class != string && !element.variable) {
    return std::nullopt;
  }
  return element;
}

/// Reads a compound of numbers. `ndf_cluster` is the only one that a schema uses.
Element readCompound(Cursor& cursor, const Head& head) {
  Element element{std::nullopt, head.size, false};
  const std::uint64_t count = head.flags & 0xffff;
  cursor.require(count > 0 && count <= kMaxMembers, "with too many members, or none");
  unsigned offset_bytes = 1;
  while (offset_bytes < 4 && head.size >> (8 * offset_bytes) != 0) ++offset_bytes;
  std::uint64_t same = 0;
  for (std::uint64_t k = 0; k < count; ++k) {
    const std::string name = readMemberName(cursor, head.version);
    const std::uint64_t offset = cursor.number(head.version < 3 ? 4 : offset_bytes);
    // Version 1 has sizes of arrays here: a dimensionality of 0, a permutation and four sizes.
    if (head.version == 1) cursor.require(cursor.number(1) == 0, "with members that are arrays"), cursor.take(27);
    const std::optional<Element> inner = readMemberElement(cursor);
    if (!inner) return element;
    element.variable |= inner->variable;
    if (element.variable) return element;
    cursor.require(offset <= head.size && inner->size <= head.size - offset, "whose members are not in the element");
    same += k < kClusterMembers.size() && name == kClusterMembers[k].name && offset == kClusterMembers[k].offset &&
            inner->type == kClusterMembers[k].type;
  }
  if (same == count && count == kClusterMembers.size() && head.size == sizeof(NdfCluster))
    element.type = ElementType::ndf_cluster;
  return element;
}

}  // namespace

Element readElement(std::span<const std::byte> message, const std::string& object) {
  Cursor cursor(message, object, "datatype");
  const Head head = readHead(cursor);
  switch (head.type_class) {
    case fixed_point:
      return {readInteger(cursor, head), head.size, false};
    case floating_point:
      return {readFloat(cursor, head), head.size, false};
    case string:
      return {readText(cursor, head), head.size, false};
    case compound:
      return readCompound(cursor, head);
    default:
      return {std::nullopt, head.size, head.type_class == reference || head.type_class == variable_length};
  }
}

Extents readExtents(std::span<const std::byte> message, const std::string& object) {
  Cursor cursor(message, object, "dataspace");
  const std::uint64_t version = cursor.number(1), rank = cursor.number(1), flags = cursor.number(1), kind = cursor.number(1);
  cursor.require((version == 1 || version == 2) && flags <= 1, "of an unknown version");
  if (version == 1) cursor.take(4);
  constexpr std::uint64_t kSimple = 1, kNull = 2;
  if (version == 2) cursor.require(kind <= kNull && (kind == kSimple || rank == 0), "of an unknown kind");
  if (rank > kMaxDims) throwBroken("dataset.dims", object, "has more than 8 sizes");
  Extents extents;
  extents.null = version == 2 && kind == kNull;
  for (std::uint64_t d = 0; d < rank; ++d) extents.dims.push_back(cursor.number(8));
  for (const std::uint64_t n : extents.dims) {
    if (__builtin_mul_overflow(extents.count, n, &extents.count))
      throwBroken("dataset.storage", object, "has sizes whose product overflows");
  }
  for (std::size_t d = 0; flags == 1 && d < extents.dims.size(); ++d) {
    cursor.require(cursor.number(8) >= extents.dims[d], "that is larger than it may grow");
  }
  return extents;
}

}  // namespace glint::formats
