#pragma once

// Private to formats/: what a file holds, read without trusting it.

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "glint/formats/container/file_bytes.h"
#include "glint/formats/container/object_header.h"
#include "glint/formats/findings.h"
#include "glint/formats/schema.h"

namespace glint::formats {

/// Value of an attribute. Numbers of every schema type are exact in a double.
struct AttributeValue {
  ElementType type = ElementType::i32;
  bool scalar = true;
  std::vector<double> numbers;
  std::vector<std::string> texts;

  std::size_t count() const { return type == ElementType::text ? texts.size() : numbers.size(); }
};

using Attributes = std::map<std::string, AttributeValue, std::less<>>;

/// One dataset of a file.
struct DatasetRecord {
  bool known_type = false;  ///< false: an element type that no schema uses
  ElementType type = ElementType::f32;
  std::vector<std::uint64_t> dims;
  std::uint64_t size_bytes = 0;
  std::uint64_t offset = 0;         ///< from the start of the file; 0 if empty
  const std::byte* data = nullptr;  ///< in the bytes of the file; not null unless empty
  Attributes attributes;
};

/// Everything that a file holds, apart from what it means. Paths are without the leading '/'.
struct FileStructure {
  FileBytes bytes;
  std::vector<Extent> extents;                            ///< all bytes that belong to an object, in order
  Attributes attributes;                                  ///< of the root
  std::map<std::string, Attributes, std::less<>> groups;  ///< of all groups but the root
  std::map<std::string, DatasetRecord> datasets;
};

/// Reads what a file holds. Broken rules are added to `findings`; what can still be read is returned.
///
/// Safe on untrusted input: see readContainer.
FileStructure readStructure(FileBytes bytes, Findings& findings);

/// Adds the groups on the path of a dataset, "a" and "a/b" of "a/b/c".
void addGroups(const std::string& path, std::set<std::string>& groups);

}  // namespace glint::formats
