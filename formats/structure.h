#pragma once

// Private to formats/: what a file holds, read without trusting it.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "glint/formats/findings.h"
#include "glint/formats/hdf5_precheck.h"
#include "glint/formats/schema.h"

namespace glint::formats {

/// A read-only view of a whole file.
class Mapping {
 public:
  Mapping() = default;
  /// Maps `size` bytes of an open file. Throws Error (io).
  Mapping(int file, std::size_t size);
  Mapping(Mapping&& other) noexcept { swap(other); }
  Mapping& operator=(Mapping&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Mapping();

  const std::byte* data() const { return data_; }
  std::size_t size() const { return size_; }

 private:
  void swap(Mapping& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
  }
  const std::byte* data_ = nullptr;
  std::size_t size_ = 0;
};

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
  const std::byte* data = nullptr;  ///< in the mapping; not null unless empty
  Attributes attributes;
};

/// Everything that a file holds, apart from what it means.
struct FileStructure {
  Mapping mapping;
  ObjectPlaces places;
  Attributes attributes;                          ///< of the root
  std::map<std::string, DatasetRecord> datasets;  ///< by path without the leading '/'
};

/// Reads a file's structure. Broken rules are added to `findings`; what can still be read is returned.
///
/// Safe on untrusted input: follows hard links only, opens no other file, loads no plugin, and checks the place of every
/// dataset. Nothing of HDF5 stays open.
FileStructure readStructure(const std::filesystem::path& path, Findings& findings);

}  // namespace glint::formats
