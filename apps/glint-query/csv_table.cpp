#include "glint-query/csv_table.h"

#include <csv.h>
#include <fmt/format.h>

#include <memory>

#include "common/answer_columns.h"
#include "common/files.h"
#include "common/numbers.h"

namespace glint::apps {
namespace {

using Rows = std::vector<std::vector<std::string>>;

std::span<const std::byte> withoutByteOrderMark(std::span<const std::byte> bytes) {
  constexpr std::array kMark = {std::byte{0xEF}, std::byte{0xBB}, std::byte{0xBF}};
  const bool marked = bytes.size() >= kMark.size() && std::equal(kMark.begin(), kMark.end(), bytes.begin());
  return marked ? bytes.subspan(kMark.size()) : bytes;
}

/// Throws if a text is of 16-bit characters: with a byte-order mark or without, it has bytes of 0.
void checkEncoding(const std::string& path, std::span<const std::byte> text) {
  constexpr std::array kMarks = {std::array{std::byte{0xFF}, std::byte{0xFE}}, std::array{std::byte{0xFE}, std::byte{0xFF}}};
  const bool marked = std::any_of(kMarks.begin(), kMarks.end(), [&](const auto& mark) {
    return text.size() >= mark.size() && std::equal(mark.begin(), mark.end(), text.begin());
  });
  if (!marked && std::find(text.begin(), text.end(), std::byte{0}) == text.end()) return;
  throw Error(ErrorCode::invalid_input, "csv.encoding", path, "", "the text is not UTF-8",
              "save the table as CSV UTF-8 with commas between columns");
}

Rows parseCsv(const std::string& path) {
  const std::vector<std::byte> bytes = readFile(path);
  const std::span<const std::byte> text = withoutByteOrderMark(bytes);
  checkEncoding(path, text);
  csv_parser parser;
  if (csv_init(&parser, CSV_STRICT | CSV_STRICT_FINI) != 0) throw std::bad_alloc();
  const std::unique_ptr<csv_parser, void (*)(csv_parser*)> guard(&parser, csv_free);
  csv_set_space_func(&parser, [](unsigned char) { return 0; });  // no sign is a blank: fields keep theirs
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
  const bool ok = csv_parse(&parser, text.data(), text.size(), onField, onRow, &state) == text.size() &&
                  csv_fini(&parser, onField, onRow, &state) == 0;
  if (!ok)
    throw Error(ErrorCode::invalid_input, "csv.syntax", path,
                state.rows.empty() ? "header" : fmt::format("row {}", state.rows.size()), csv_strerror(csv_error(&parser)),
                "quote fields as RFC 4180 says");
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

CsvTable CsvTable::read(const std::string& path, const std::function<void(const CsvTable&)>& check_columns) {
  CsvTable table;
  table.path_ = path;
  table.rows_ = parseCsv(path);
  for (const std::string& name : table.rows_.front()) table.keys_.push_back(columnKey(name));
  table.checkHeader();
  check_columns(table);
  table.checkRows();
  return table;
}

void CsvTable::checkHeader() const {
  const auto refuse = [&](const std::string& what, const std::string& remedy) {
    throw Error(ErrorCode::invalid_input, "csv.columns", path_, "header", what, remedy);
  };
  const std::string& first = rows_.front().front();
  if (first.starts_with('#')) refuse("the first line is a comment", "begin the table with its header; leave comments out");
  if (rows_.front().size() > 1) return;
  for (const auto& [sign, name] : {std::pair(';', "semicolons"), std::pair('\t', "tabs")}) {
    if (first.find(sign) != std::string::npos)
      refuse(fmt::format("the columns {} are separated by {}", header(), name),
             "separate columns by commas, and write numbers with a decimal point");
  }
}

void CsvTable::checkRows() const {
  const std::size_t columns = rows_.front().size();
  for (std::size_t r = 1; r < rows_.size(); ++r) {
    if (rows_[r].size() == columns) continue;
    const bool comment = !rows_[r].empty() && rows_[r].front().starts_with('#');
    fail("csv.row", r - 1,
         comment ? "is a comment" : fmt::format("{} fields where the header has {}", rows_[r].size(), columns),
         comment ? "leave comments out" : "give every row as many fields");
  }
}

void CsvTable::failPart(std::span<const char* const> names) const {
  throw Error(ErrorCode::invalid_input, "csv.columns", path_, "header",
              fmt::format("the columns {} name a part of {}", header(), fmt::join(names, ",")),
              fmt::format("name all of {}, or none", fmt::join(names, ",")));
}

std::size_t CsvTable::find(const std::string& name) const {
  const auto found = std::find(keys_.begin(), keys_.end(), name);
  if (found != keys_.end() && std::find(found + 1, keys_.end(), name) != keys_.end())
    throw Error(ErrorCode::invalid_input, "csv.columns", path_, "header", "two columns are named " + name, "rename one");
  return static_cast<std::size_t>(found - keys_.begin());
}

template <class T>
T CsvTable::number(const char* column, std::size_t row) const {
  T value = 0;
  const std::string complaint = parseNumber(rows_[row + 1][find(column)], value);
  if (!complaint.empty()) fail("csv.number", row, fmt::format("column {}: {}", column, complaint), "correct it");
  return value;
}
template float CsvTable::number(const char*, std::size_t) const;
template double CsvTable::number(const char*, std::size_t) const;
template int CsvTable::number(const char*, std::size_t) const;

std::string CsvTable::header() const { return fmt::format("{}", fmt::join(rows_.front(), ",")); }

void CsvTable::fail(const std::string& rule, std::size_t row, const std::string& what, const std::string& remedy) const {
  throw Error(ErrorCode::invalid_input, rule, path_, fmt::format("row {}", row + 1), what, remedy);
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
