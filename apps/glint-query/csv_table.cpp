#include "glint-query/csv_table.h"

#include <csv.h>
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <memory>

#include "common/files.h"

namespace glint::apps {
namespace {

using Rows = std::vector<std::vector<std::string>>;

Rows parseCsv(const std::string& path) {
  const std::vector<std::byte> bytes = readFile(path);
  csv_parser parser;
  if (csv_init(&parser, CSV_STRICT | CSV_STRICT_FINI) != 0) throw std::bad_alloc();
  const std::unique_ptr<csv_parser, void (*)(csv_parser*)> guard(&parser, csv_free);
  csv_set_space_func(&parser, [](unsigned char) { return 0; });  // keeps fields as they are
  struct State {
    Rows rows;
    std::vector<std::string> row;
  } state;
  const auto onField = [](void* field, std::size_t size, void* s) {
    static_cast<State*>(s)->row.emplace_back(static_cast<const char*>(field), size);
  };
  const auto onRow = [](int, void* s) {
    auto* st = static_cast<State*>(s);
    st->rows.push_back(std::move(st->row));
    st->row.clear();
  };
  const bool ok = csv_parse(&parser, bytes.data(), bytes.size(), onField, onRow, &state) == bytes.size() &&
                  csv_fini(&parser, onField, onRow, &state) == 0;
  if (!ok)
    throw Error(ErrorCode::invalid_input, "csv.syntax", path, fmt::format("row {}", state.rows.size() + 1),
                csv_strerror(csv_error(&parser)), "quote fields as RFC 4180 says");
  if (state.rows.empty())
    throw Error(ErrorCode::invalid_input, "csv.empty", path, "", "the table is empty",
                "give a header and a row for each query");
  return std::move(state.rows);
}

/// A field of a CSV table, quoted where RFC 4180 asks for it.
std::string csvField(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

}  // namespace

CsvTable CsvTable::read(const std::string& path) {
  CsvTable table;
  table.path_ = path;
  table.rows_ = parseCsv(path);
  for (std::size_t r = 1; r < table.rows_.size(); ++r) {
    if (table.rows_[r].size() == table.rows_.front().size()) continue;
    throw Error(ErrorCode::invalid_input, "csv.row", path, fmt::format("row {}", r),
                fmt::format("{} fields where the header has {}", table.rows_[r].size(), table.rows_.front().size()),
                "give every row as many fields");
  }
  return table;
}

std::size_t CsvTable::find(const std::string& name) const {
  return static_cast<std::size_t>(std::find(rows_.front().begin(), rows_.front().end(), name) - rows_.front().begin());
}

float CsvTable::number(const char* column, std::size_t row) const {
  const std::string& text = rows_[row + 1][find(column)];
  const std::size_t first = std::min(text.find_first_not_of(" \t"), text.size()), last = text.find_last_not_of(" \t") + 1;
  float value = 0;
  const auto [end, error] = std::from_chars(text.data() + first, text.data() + last, value);
  if (error != std::errc() || end != text.data() + last || !std::isfinite(value))
    throw Error(ErrorCode::invalid_input, "csv.number", path_, fmt::format("row {}, column {}", row + 1, column),
                "'" + text + "' is not a finite number", "correct it");
  return value;
}

std::string CsvTable::withColumns(std::span<const std::string> names, std::span<const float> values) const {
  std::string text;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    for (const std::string& field : rows_[r]) text += csvField(field) + ",";
    for (std::size_t c = 0; c < names.size(); ++c)
      text +=
          (r == 0 ? names[c] : fmt::format("{:.9g}", values[(r - 1) * names.size() + c])) + (c + 1 < names.size() ? "," : "\n");
  }
  return text;
}

}  // namespace glint::apps
