#include "common/answer_columns.h"
#include "common/footprint_rules.h"
#include "glint-query/queries.h"

namespace glint::apps {
namespace {

void requireColumns(const CsvTable& columns) {
  columns.requireWhole(kSpread);
  columns.requireWhole(kCovariance);
  columns.requireWhole(kBox);
  columns.requireWhole(kHalf);
  columns.requireWhole(kRange);
  const int sizes = columns.has(kSigma) + columns.has(kCovariance) + columns.has(kBox);
  const int targets = columns.has(kHalf) + columns.has(kRange);
  if (columns.has(kCentre) && sizes == 1 && targets == 1) return;
  throw Error(ErrorCode::invalid_input, "csv.columns", columns.path(), "header",
              "the columns " + columns.header() + " do not make one query",
              "name u,v; one of sigma or sxx,sxy,syy or ax,ay,bx,by; one of hx,hy or x0,y0,x1,y1");
}

Query readQuery(const CsvTable& columns, std::size_t row) {
  const auto refuse = [&](const std::optional<FootprintFault>& fault) {
    if (fault) columns.fail("csv.footprint", row, "the footprint " + fault->what, fault->remedy);
  };
  Query query;
  const Vec2 centre = columns.position(kCentre, row);
  const auto [u, v] = columns.wholePosition(kCentre, row);
  query.u = u, query.v = v;
  if (columns.has(kSigma)) {
    const auto [sigma] = columns.numbers(kSigma, row);
    refuse(sigmaFault(sigma));
    query.footprint = Footprint::isotropic(centre, sigma);
  } else if (columns.has(kCovariance)) {
    const auto [xx, xy, yy] = columns.numbers(kCovariance, row);
    query.footprint = Footprint::gaussian(centre, {xx, xy, yy});
  } else {
    const auto [ax, ay, bx, by] = columns.numbers(kBox, row);
    query.footprint = Footprint::box(centre, {ax, ay}, {bx, by});
  }
  if (!columns.has(kSigma)) refuse(footprintFault(query.footprint));
  if (columns.has(kHalf)) {
    const auto [x, y] = columns.numbers(kHalf, row);
    query.half = Vec2{x, y};
  } else {
    const auto [x0, y0, x1, y1] = columns.numbers(kRange, row);
    query.range = Box2{{x0, y0}, {x1, y1}};
    if (const auto fault = rangeFault(*query.range)) columns.fail("csv.range", row, "the range " + fault->what, fault->remedy);
  }
  if (columns.has(kSpread)) {
    const auto [x, y] = columns.numbers(kSpread, row);
    query.spread = {x, y};
    if (const auto fault = spreadFault(query.spread))
      columns.fail("csv.spread", row, "the spread " + fault->what, fault->remedy);
  }
  return query;
}

}  // namespace

QueryTable QueryTable::read(const std::string& path) {
  QueryTable table{CsvTable::read(path, requireColumns)};
  for (std::size_t r = 0; r < table.table_.count(); ++r) table.queries_.push_back(readQuery(table.table_, r));
  return table;
}

std::string QueryTable::withAnswers(std::span<const float> answers) const {
  const std::string name = table_.has(kRange) ? kMean : kDensity;
  return table_.withColumns({&name, 1}, answers);
}

}  // namespace glint::apps
