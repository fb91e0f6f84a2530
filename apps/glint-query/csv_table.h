#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "glint/model/footprint.h"

namespace glint::apps {

/// A CSV table (RFC 4180) whose header names columns of numbers. Further columns are kept as they are. A byte-order mark is
/// skipped. Names of columns match in any case and with blanks around them; parseNumber reads the numbers.
class CsvTable {
 public:
  /// @param check_columns  throws unless the header names what is needed; it is judged before the rows
  /// @throws Error io; invalid_input that names the row
  static CsvTable read(const std::string& path, const std::function<void(const CsvTable&)>& check_columns);

  const std::string& path() const { return path_; }
  /// Rows below the header.
  std::size_t count() const { return rows_.size() - 1; }

  template <std::size_t N>
  bool has(const std::array<const char*, N>& names) const {
    return std::all_of(names.begin(), names.end(), [&](const char* name) { return find(name) < keys_.size(); });
  }

  /// Whether some of the columns are there and others are not.
  template <std::size_t N>
  bool hasPart(const std::array<const char*, N>& names) const {
    return !has(names) && std::any_of(names.begin(), names.end(), [&](const char* name) { return find(name) < keys_.size(); });
  }
  /// @throws Error invalid_input if some of the columns are there and others are not
  template <std::size_t N>
  void requireWhole(const std::array<const char*, N>& names) const {
    if (hasPart(names)) failPart(names);
  }

  /// Numbers of one row, 0 being the first below the header.
  /// @throws Error invalid_input that names the row and the column
  template <std::size_t N>
  std::array<float, N> numbers(const std::array<const char*, N>& names, std::size_t row) const {
    std::array<float, N> values;
    for (std::size_t k = 0; k < N; ++k) values[k] = number<float>(names[k], row);
    return values;
  }
  /// The position of one row, modulo the map. Its numbers are read as doubles.
  /// @throws as numbers
  Vec2 position(const std::array<const char*, 2>& names, std::size_t row) const {
    return wrappedUv(number<double>(names[0], row), number<double>(names[1], row));
  }
  /// The position as it stands in the row.
  /// @throws as numbers
  std::array<double, 2> wholePosition(const std::array<const char*, 2>& names, std::size_t row) const {
    return {number<double>(names[0], row), number<double>(names[1], row)};
  }
  /// A whole number of one row.
  /// @throws as numbers
  int wholeNumber(const char* column, std::size_t row) const { return number<int>(column, row); }

  /// The names of the columns, for messages.
  std::string header() const;
  /// Throws Error invalid_input that names a row, 0 being the first below the header.
  [[noreturn]] void fail(const std::string& rule, std::size_t row, const std::string& what, const std::string& remedy) const;

  /// The table with more columns.
  /// @param values  [rows][names]
  std::string withColumns(std::span<const std::string> names, std::span<const float> values) const;

 private:
  std::size_t find(const std::string& name) const;
  [[noreturn]] void failPart(std::span<const char* const> names) const;
  void checkHeader() const;
  void checkRows() const;
  template <class T>
  T number(const char* column, std::size_t row) const;

  std::string path_;
  std::vector<std::vector<std::string>> rows_;  // the header first
  std::vector<std::string> keys_;               // columnKey of each name of the header
};

}  // namespace glint::apps
