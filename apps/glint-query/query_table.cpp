#include <csv.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <memory>

#include "common/files.h"
#include "glint-query/queries.h"

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

/// The columns that queries are made of, found by the names in the header.
class Columns {
 public:
  Columns(const std::string& path, const std::vector<std::string>& header) : path_(path), header_(header) {}

  template <std::size_t N>
  bool has(const std::array<const char*, N>& names) const {
    return std::all_of(names.begin(), names.end(), [&](const char* name) { return find(name) < header_.size(); });
  }

  template <std::size_t N>
  std::array<float, N> read(const std::array<const char*, N>& names, const std::vector<std::string>& row,
                            std::size_t line) const {
    std::array<float, N> values;
    for (std::size_t k = 0; k < N; ++k) values[k] = number(row[find(names[k])], names[k], line);
    return values;
  }

 private:
  std::size_t find(const std::string& name) const { return std::find(header_.begin(), header_.end(), name) - header_.begin(); }

  float number(const std::string& text, const char* column, std::size_t line) const {
    const std::size_t first = std::min(text.find_first_not_of(" \t"), text.size()), last = text.find_last_not_of(" \t") + 1;
    float value = 0;
    const auto [end, error] = std::from_chars(text.data() + first, text.data() + last, value);
    if (error != std::errc() || end != text.data() + last || !std::isfinite(value))
      throw Error(ErrorCode::invalid_input, "csv.number", path_, fmt::format("row {}, column {}", line, column),
                  "'" + text + "' is not a finite number", "correct it");
    return value;
  }

  const std::string& path_;
  const std::vector<std::string>& header_;
};

constexpr std::array kCentre = {"u", "v"};
constexpr std::array kSigma = {"sigma"};
constexpr std::array kCovariance = {"sxx", "sxy", "syy"};
constexpr std::array kBox = {"ax", "ay", "bx", "by"};
constexpr std::array kHalf = {"hx", "hy"};
constexpr std::array kRange = {"x0", "y0", "x1", "y1"};

void requireColumns(const std::string& path, const Columns& columns) {
  const int sizes = columns.has(kSigma) + columns.has(kCovariance) + columns.has(kBox);
  const int targets = columns.has(kHalf) + columns.has(kRange);
  if (columns.has(kCentre) && sizes == 1 && targets == 1) return;
  throw Error(ErrorCode::invalid_input, "csv.columns", path, "header", "the columns do not make one query",
              "name u,v; one of sigma or sxx,sxy,syy or ax,ay,bx,by; one of hx,hy or x0,y0,x1,y1");
}

Query readQuery(const Columns& columns, const std::vector<std::string>& row, std::size_t line) {
  Query query;
  const auto [u, v] = columns.read(kCentre, row, line);
  if (columns.has(kSigma)) {
    query.footprint = Footprint::isotropic({u, v}, columns.read(kSigma, row, line)[0]);
  } else if (columns.has(kCovariance)) {
    const auto [xx, xy, yy] = columns.read(kCovariance, row, line);
    query.footprint = Footprint::gaussian({u, v}, {xx, xy, yy});
  } else {
    const auto [ax, ay, bx, by] = columns.read(kBox, row, line);
    query.footprint = Footprint::box({u, v}, {ax, ay}, {bx, by});
  }
  if (columns.has(kHalf)) {
    const auto [x, y] = columns.read(kHalf, row, line);
    query.half = Vec2{x, y};
  } else {
    const auto [x0, y0, x1, y1] = columns.read(kRange, row, line);
    query.range = Box2{{x0, y0}, {x1, y1}};
  }
  return query;
}

}  // namespace

QueryTable QueryTable::read(const std::string& path) {
  QueryTable table;
  table.rows_ = parseCsv(path);
  const std::vector<std::string>& header = table.rows_.front();
  const Columns columns(path, header);
  requireColumns(path, columns);
  for (std::size_t r = 1; r < table.rows_.size(); ++r) {
    if (table.rows_[r].size() != header.size())
      throw Error(ErrorCode::invalid_input, "csv.row", path, fmt::format("row {}", r),
                  fmt::format("{} fields where the header has {}", table.rows_[r].size(), header.size()),
                  "give every row as many fields");
    table.queries_.push_back(readQuery(columns, table.rows_[r], r));
  }
  return table;
}

}  // namespace glint::apps
