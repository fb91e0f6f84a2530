#include "common/footprint_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "glint/query/detail/common/footprint_weights.h"

namespace glint::apps {
namespace {

bool isSize(double sigma) { return sigma >= kLeastSigma && sigma <= kMostSigma; }

std::string sizeRemedy() { return fmt::format("give deviations of {:g} to {:g} texels", kLeastSigma, kMostSigma); }

double largestDeviation(const Covariance& c) {
  const double mean = 0.5 * (double{c.xx} + c.yy), half = 0.5 * (double{c.xx} - c.yy);
  return std::sqrt(mean + std::sqrt(half * half + double{c.xy} * c.xy));
}

std::optional<FootprintFault> covarianceFault(const Covariance& c) {
  constexpr double kRounding = 1e-5;  // of the determinant of a line, which is 0
  const double xx = c.xx, xy = c.xy, yy = c.yy;
  const std::string values = fmt::format("{:g} {:g} {:g}", xx, xy, yy);
  if (!(xx >= 0 && yy >= 0 && xy * xy <= (1 + kRounding) * xx * yy))
    return FootprintFault{values + " is no covariance", "give variances SXX, SYY >= 0, and SXY with SXY^2 <= SXX SYY"};
  if (!isSize(largestDeviation(c))) return FootprintFault{values + " is a covariance of no size, or too large", sizeRemedy()};
  return {};
}

std::optional<FootprintFault> boxFault(Vec2 a, Vec2 b) {
  const std::string values = fmt::format("{:g} {:g} {:g} {:g}", a.x, a.y, b.x, b.y);
  const double ax = a.x, ay = a.y, bx = b.x, by = b.y;
  const double longer = std::max(std::hypot(ax, ay), std::hypot(bx, by));
  if (!(longer <= kMostSigma)) return FootprintFault{values + " is too large a box", sizeRemedy()};
  if (!(std::fabs(ax * by - ay * bx) > kMinBoxThickness * longer))
    return FootprintFault{
        values + " is a box without an area",
        fmt::format("give half axes AX AY and BX BY of two directions, {:g} texels thick at least", kMinBoxThickness)};
  return {};
}

}  // namespace

std::optional<FootprintFault> footprintFault(const Footprint& footprint) {
  return footprint.kind == Footprint::Kind::box ? boxFault(footprint.axis_a, footprint.axis_b)
                                                : covarianceFault(footprint.covariance);
}

std::optional<FootprintFault> sigmaFault(float sigma_texels) {
  if (isSize(sigma_texels)) return {};
  return FootprintFault{fmt::format("{:g} is not in the range {:g} to {:g}", sigma_texels, kLeastSigma, kMostSigma),
                        sizeRemedy()};
}

std::optional<FootprintFault> spreadFault(Vec2 spread) {
  const auto holds = [](double x) { return x >= 0 && x <= kMostSpread; };
  if (holds(spread.x) && holds(spread.y)) return {};
  return FootprintFault{fmt::format("{:g} {:g} is not in the range 0 to {:g}", spread.x, spread.y, kMostSpread),
                        "give half widths of the box of half vectors that a pixel sees"};
}

std::optional<FootprintFault> rangeFault(const Box2& range) {
  if (range.width() > 0 && range.height() > 0) return {};
  return FootprintFault{
      fmt::format("{:g} {:g} {:g} {:g} is an empty box", range.low.x, range.low.y, range.high.x, range.high.y),
      "give X0 Y0 X1 Y1 with X0 < X1 and Y0 < Y1"};
}

}  // namespace glint::apps
