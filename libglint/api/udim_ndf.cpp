#include "glint/api/udim_ndf.h"

#include <algorithm>
#include <cmath>

#include "glint/api/ndf_models.h"
#include "glint/query/detail/common/sampling.h"

namespace glint::api {
namespace {

/// A tile answers alone where less than this share of a footprint lies beyond its map.
constexpr double kLeastRest = 1e-3;
/// Tiles with less of the footprint than this, beside the part in the map of the own tile, are left out.
constexpr double kLeastShare = 1e-6;
/// Wider footprints weigh all tiles evenly, and differences of their integrals would lose digits.
constexpr double kWidest = 1e4;
/// Narrower footprints are widened by every model.
constexpr float kNarrowest_texels = 0.25f;

/// An interval along u or v, in tiles.
struct Interval {
  double low, high;
};

/// Share of a Gaussian in an interval.
/// @param centre  of the Gaussian
double shareOf(Interval interval, double centre, double sigma) {
  if (!(interval.low < interval.high)) return 0;
  const double scale = 1 / (std::sqrt(2.0) * sigma);
  return 0.5 * (std::erf((interval.high - centre) * scale) - std::erf((interval.low - centre) * scale));
}

/// What the map of tile `own` covers of a tile `steps` columns or rows further.
/// @param before, after  margins of the tile `own`, in tiles
Interval coveredOf(std::int64_t own, std::int64_t steps, double before, double after) {
  const auto low = static_cast<double>(own + steps);
  if (steps == 0) return {low, low + 1};
  if (steps == 1) return {low, low + std::min(after, 1.0)};
  if (steps == -1) return {low + 1 - std::min(before, 1.0), low + 1};
  return {low, low};
}

/// What is left of that tile, where the other tile answers.
Interval restOf(std::int64_t own, std::int64_t steps, Interval covered) {
  const auto low = static_cast<double>(own + steps);
  if (steps > 0) return {covered.high, low + 1};
  if (steps < 0) return {low, steps == -1 ? covered.low : low + 1};
  return {low, low + 1};
}

double deviation(float variance_texels2, int texels) {
  const float least = kNarrowest_texels * kNarrowest_texels;
  const double variance = variance_texels2 > least ? variance_texels2 : least;
  return std::min(std::sqrt(variance) / texels, kWidest);
}

/// The footprint in texels of a tile's map, with its centre at a place of the set.
/// @param u, v  place, in tiles; in the tile
Footprint placed(const Footprint& p, const UdimTiles& set, const UdimTile& tile, double u, double v) {
  const formats::UdimPlace& place = tile.place;
  const int width = place.tileWidth(tile.width), height = place.tileHeight(tile.height);
  const double x = std::clamp(u - place.column(), 0.0, 1.0) * width, y = std::clamp(v - place.row(), 0.0, 1.0) * height;
  const Vec2 centre = {std::min(static_cast<float>((place.margins[0] + x) / tile.width), float{kBelowOne}),
                       std::min(static_cast<float>((place.margins[1] + y) / tile.height), float{kBelowOne})};
  if (width == set.width() && height == set.height()) {
    Footprint same = p;
    same.centre = centre;
    return same;
  }
  const float sx = static_cast<float>(width) / static_cast<float>(set.width());
  const float sy = static_cast<float>(height) / static_cast<float>(set.height());
  if (p.kind == Footprint::Kind::box)
    return Footprint::box(centre, {sx * p.axis_a.x, sy * p.axis_a.y}, {sx * p.axis_b.x, sy * p.axis_b.y});
  return Footprint::gaussian(centre, {sx * sx * p.covariance.xx, sx * sy * p.covariance.xy, sy * sy * p.covariance.yy});
}

}  // namespace

UdimTiles::UdimTiles(std::vector<UdimTile> tiles) : tiles_(std::move(tiles)) {
  int rows = 0;
  for (const UdimTile& tile : tiles_) {
    rows = std::max(rows, tile.place.row() + 1);
    width_ = std::max(width_, tile.place.tileWidth(tile.width));
    height_ = std::max(height_, tile.place.tileHeight(tile.height));
  }
  places_.assign(static_cast<std::size_t>(rows) * formats::kUdimColumns, -1);
  for (std::size_t k = 0; k < tiles_.size(); ++k)
    places_[static_cast<std::size_t>(tiles_[k].place.tile - formats::kFirstUdim)] = static_cast<int>(k);
}

const UdimTile* UdimTiles::at(std::int64_t column, std::int64_t row) const {
  const auto rows = static_cast<std::int64_t>(places_.size()) / formats::kUdimColumns;
  if (column < 0 || column >= formats::kUdimColumns || row < 0 || row >= rows) return nullptr;
  const int index = places_[static_cast<std::size_t>(row * formats::kUdimColumns + column)];
  return index < 0 ? nullptr : &tiles_[static_cast<std::size_t>(index)];
}

/// The centre of a footprint, and its deviations, in tiles.
struct UdimNdf::Centre {
  std::int64_t column, row;
  double u, v;
  double sigma_u, sigma_v;
};

UdimNdf::Centre UdimNdf::centreOf(const Footprint& p) const {
  constexpr float kFarthest = 0x1p30f;  // beyond every tile
  const auto usable = [](float x) { return std::fabs(x) < kFarthest ? double{x} : 0.0; };
  const double u = usable(p.centre.x), v = usable(p.centre.y), cell_u = std::floor(u), cell_v = std::floor(v);
  // Sums of integers beyond every tile stay there.
  constexpr std::int64_t kMostCell = std::int64_t{1} << 40;
  const std::int64_t column = std::clamp(column_, -kMostCell, kMostCell) + static_cast<std::int64_t>(cell_u);
  const std::int64_t row = std::clamp(row_, -kMostCell, kMostCell) + static_cast<std::int64_t>(cell_v);
  return {column,
          row,
          static_cast<double>(column) + (u - cell_u),
          static_cast<double>(row) + (v - cell_v),
          deviation(p.covariance.xx, tiles_->width()),
          deviation(p.covariance.yy, tiles_->height())};
}

template <class Visit>
void UdimNdf::forEachPart(const Footprint& p, Visit&& visit) const {
  const Centre at = centreOf(p);
  const UdimTile* own = tiles_->at(at.column, at.row);
  if (own == nullptr) return;
  const double width = own->place.tileWidth(own->width), height = own->place.tileHeight(own->height);
  const double left = own->place.margins[0] / width, below = own->place.margins[1] / height;
  const double right = own->place.margins[2] / width, above = own->place.margins[3] / height;
  const auto column = static_cast<double>(at.column), row = static_cast<double>(at.row);
  const double inside = shareOf({column - left, column + 1 + right}, at.u, at.sigma_u) *
                        shareOf({row - below, row + 1 + above}, at.v, at.sigma_v);
  const Footprint here = placed(p, *tiles_, *own, at.u, at.v);
  if (inside >= 1 - kLeastRest || tiles_->tiles().size() == 1) return visit(*own->model, here, 1.0f);

  // Shares of the tiles, and of their parts that the own map covers.
  const auto eachTile = [&](auto&& take) {
    for (const UdimTile& tile : tiles_->tiles()) {
      const std::int64_t dx = tile.place.column() - at.column, dy = tile.place.row() - at.row;
      const Interval x = coveredOf(at.column, dx, left, right), y = coveredOf(at.row, dy, below, above);
      const Interval whole_x = {static_cast<double>(tile.place.column()), static_cast<double>(tile.place.column() + 1)};
      const Interval whole_y = {static_cast<double>(tile.place.row()), static_cast<double>(tile.place.row() + 1)};
      const double whole = shareOf(whole_x, at.u, at.sigma_u) * shareOf(whole_y, at.v, at.sigma_v);
      const double part = whole > 0 ? shareOf(x, at.u, at.sigma_u) * shareOf(y, at.v, at.sigma_v) : 0;
      if (&tile != own && whole <= kLeastShare * inside) continue;
      const Interval rest_x = restOf(at.column, dx, x), rest_y = restOf(at.row, dy, y);
      take(tile, whole, part, std::clamp(at.u, rest_x.low, rest_x.high), std::clamp(at.v, rest_y.low, rest_y.high));
    }
  };
  double all = 0, covered = 0, of_own = 0;
  eachTile([&](const UdimTile& tile, double whole, double part, double, double) {
    all += whole, covered += part;
    if (&tile == own) of_own = whole;
  });
  if (all - covered < kLeastRest * covered) return visit(*own->model, here, 1.0f);
  // The own map stands for the covered parts of other tiles as far as it covers what lies outside its own. A footprint much larger
  // than the margins so weighs all tiles by their own shares, from whichever tile it is asked.
  const double credit = all > of_own ? (covered - of_own) / (all - of_own) : 1;
  visit(*own->model, here, static_cast<float>((of_own + credit * (covered - of_own)) / all));
  eachTile([&](const UdimTile& tile, double whole, double part, double u, double v) {
    if (&tile != own) visit(*tile.model, placed(p, *tiles_, tile, u, v), static_cast<float>((whole - credit * part) / all));
  });
}

float UdimNdf::density(const Footprint& p, Vec2 h) const {
  float sum = 0;
  forEachPart(
      p, [&](const NdfModels::Any& model, const Footprint& part, float weight) { sum += weight * model.density(part, h); });
  return sum;
}

float UdimNdf::mean(const Footprint& p, const Box2& range) const {
  float sum = 0;
  forEachPart(
      p, [&](const NdfModels::Any& model, const Footprint& part, float weight) { sum += weight * model.mean(part, range); });
  return sum;
}

HalfVectorSample UdimNdf::sample(const Footprint& p, Vec2 xi) const {
  xi = clampUnit(xi);
  float below = 0, weight_drawn = 0;
  HalfVectorSample drawn;
  const NdfModels::Any* from = nullptr;
  forEachPart(p, [&](const NdfModels::Any& model, const Footprint& part, float weight) {
    const float above = below + weight;
    if (from == nullptr && weight > 0 && xi.x < above) {
      drawn = model.sample(part, {clampUnit((xi.x - below) / weight), xi.y});
      from = &model, weight_drawn = weight;
    }
    below = above;
  });
  if (from == nullptr || !(drawn.pdf > 0) || weight_drawn == 1) return drawn;
  float pdf = weight_drawn * drawn.pdf;
  forEachPart(p, [&](const NdfModels::Any& model, const Footprint& part, float weight) {
    if (&model != from) pdf += weight * model.density(part, drawn.h);
  });
  return {drawn.h, pdf};
}

}  // namespace glint::api
