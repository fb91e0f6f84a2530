#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/gaussian.h"
#include "glint/model/histogram_sat.h"

namespace glint {

/// Area of the part of the triangle (origin, p, q) that lies within `radius` of the origin; negative if it turns clockwise.
inline GLINT_HD double triangleInDisk(double px, double py, double qx, double qy, double radius) {
  const auto sector = [&](double ax, double ay, double bx, double by) {
    return 0.5 * radius * radius * std::atan2(ax * by - ay * bx, ax * bx + ay * by);
  };
  const double dx = qx - px, dy = qy - py;
  const double a = dx * dx + dy * dy, b = px * dx + py * dy, c = px * px + py * py - radius * radius;
  const double discriminant = b * b - a * c;
  if (!(a > 0)) return 0;
  if (discriminant <= 0) return sector(px, py, qx, qy);
  const double root = std::sqrt(discriminant);
  const double t0 = std::clamp((-b - root) / a, 0.0, 1.0), t1 = std::clamp((-b + root) / a, 0.0, 1.0);
  if (t0 >= t1) return sector(px, py, qx, qy);
  // The edge is inside the circle from t0 to t1: the area is a triangle there, and sectors before and after.
  const double sx = px + t0 * dx, sy = py + t0 * dy, ex = px + t1 * dx, ey = py + t1 * dy;
  double area = 0.5 * (sx * ey - sy * ex);
  if (t0 > 0) area += sector(px, py, sx, sy);
  if (t1 < 1) area += sector(ex, ey, qx, qy);
  return area;
}

/// A convex polygon of the disk, at most a box cut by two lines.
struct DiskPolygon {
  double x[8], y[8];
  int count = 0;

  static GLINT_HD DiskPolygon fromBox(const Box2& box) {
    return {{box.low.x, box.high.x, box.high.x, box.low.x}, {box.low.y, box.low.y, box.high.y, box.high.y}, 4};
  }

  /// Cuts the polygon: keeps the part on the left of the line from the origin along (dx, dy).
  GLINT_HD void clip(double dx, double dy) {
    DiskPolygon kept;
    for (int k = 0; k < count; ++k) {
      const int next = k + 1 < count ? k + 1 : 0;
      const double here = dx * y[k] - dy * x[k], there = dx * y[next] - dy * x[next];
      if (here >= 0) kept.add(x[k], y[k]);
      if ((here >= 0) != (there >= 0)) {
        const double t = here / (here - there);
        kept.add(x[k] + t * (x[next] - x[k]), y[k] + t * (y[next] - y[k]));
      }
    }
    *this = kept;
  }

  GLINT_HD double areaWithin(double radius) const {
    double area = 0;
    for (int k = 0; k < count; ++k) {
      const int next = k + 1 < count ? k + 1 : 0;
      area += triangleInDisk(x[k], y[k], x[next], y[next], radius);
    }
    return area;
  }

 private:
  GLINT_HD void add(double px, double py) {
    if (count == 8) return;
    x[count] = px;
    y[count++] = py;
  }
};

/// Bins of the upper hemisphere with equal extents of elevation and azimuth (Gamboa 2018, section 4.1), seen as areas of the
/// disk: ring k lies between radii sin(k pi / (2 rings)), sector s between azimuths 2 pi s / sectors. Bin = ring * sectors +
/// sector.
class SphericalBins {
 public:
  /// @param theta_bins, phi_bins  within the limits of HistogramSat
  GLINT_HD SphericalBins(int theta_bins, int phi_bins) : rings_(theta_bins), sectors_(phi_bins) {
    for (int k = 0; k <= rings_; ++k) radii_[k] = static_cast<float>(std::sin(0.5 * kPiDouble * k / rings_));
    for (int s = 0; s <= sectors_; ++s) {
      const double phi = 2 * kPiDouble * (s % sectors_) / sectors_;
      directions_[s] = {static_cast<float>(std::cos(phi)), static_cast<float>(std::sin(phi))};
    }
  }

  GLINT_HD int count() const { return rings_ * sectors_; }

  /// Bin of a direction, |h| <= 1. O(rings).
  GLINT_HD int find(Vec2 h) const {
    const float radius = std::sqrt(dot(h, h));
    int ring = 0;
    for (int k = 1; k < rings_; ++k) ring += radius >= radii_[k];
    const float phi = std::atan2(h.y, h.x);
    const float turn = (phi < 0 ? phi + 2 * kPi : phi) * (0.5f / kPi);
    return ring * sectors_ + std::min(static_cast<int>(turn * static_cast<float>(sectors_)), sectors_ - 1);
  }

  /// Area of a bin on the disk.
  GLINT_HD double area(int bin) const {
    const double inner = radii_[bin / sectors_], outer = radii_[bin / sectors_ + 1];
    return kPiDouble / sectors_ * (outer * outer - inner * inner);
  }

  /// Area of the part of a bin that lies in a box of the disk.
  GLINT_HD double areaInside(int bin, const Box2& box) const {
    const int sector = bin % sectors_;
    const double inner = radii_[bin / sectors_], outer = radii_[bin / sectors_ + 1];
    const double nearest_x = std::max({0.0, double{box.low.x}, -double{box.high.x}});
    const double nearest_y = std::max({0.0, double{box.low.y}, -double{box.high.y}});
    if (nearest_x * nearest_x + nearest_y * nearest_y >= outer * outer) return 0;
    const double farthest_x = std::max(std::fabs(box.low.x), std::fabs(box.high.x));
    const double farthest_y = std::max(std::fabs(box.low.y), std::fabs(box.high.y));
    if (farthest_x * farthest_x + farthest_y * farthest_y <= inner * inner) return 0;
    DiskPolygon polygon = DiskPolygon::fromBox(box);
    if (sectors_ > 1) {
      polygon.clip(directions_[sector].x, directions_[sector].y);
      polygon.clip(-double{directions_[sector + 1].x}, -double{directions_[sector + 1].y});
    }
    if (polygon.count < 3) return 0;
    return std::max(0.0, polygon.areaWithin(outer) - (inner > 0 ? polygon.areaWithin(inner) : 0.0));
  }

  /// Point of a bin, uniform over its area for uniform `xi` in [0, 1)^2: xi.x turns, xi.y goes outwards.
  GLINT_HD Vec2 point(int bin, Vec2 xi) const {
    const Vec2 h = place(bin, xi);
    // Rounding may move a point on the border into the next bin. The point is then drawn a little nearer the bin's middle.
    return find(h) == bin ? h : place(bin, {0.5f + 0.9999f * (xi.x - 0.5f), 0.5f + 0.9999f * (xi.y - 0.5f)});
  }

  /// Middle of a bin in elevation and azimuth: its central direction.
  GLINT_HD Vec2 centre(int bin) const {
    const float theta = 0.5f * kPi * (static_cast<float>(bin / sectors_) + 0.5f) / static_cast<float>(rings_);
    const float phi = 2 * kPi * (static_cast<float>(bin % sectors_) + 0.5f) / static_cast<float>(sectors_);
    return std::sin(theta) * Vec2{std::cos(phi), std::sin(phi)};
  }

 private:
  static constexpr double kPiDouble = 3.14159265358979323846;

  GLINT_HD Vec2 place(int bin, Vec2 xi) const {
    const float inner = radii_[bin / sectors_], outer = radii_[bin / sectors_ + 1];
    const float radius = std::sqrt(inner * inner + xi.y * (outer * outer - inner * inner));
    const float phi = 2 * kPi * (static_cast<float>(bin % sectors_) + xi.x) / static_cast<float>(sectors_);
    return std::min(radius, 0.9999999f) * Vec2{std::cos(phi), std::sin(phi)};
  }

  int rings_, sectors_;
  float radii_[HistogramSat::kMaxThetaBins + 1] = {};
  Vec2 directions_[HistogramSat::kMaxPhiBins + 1] = {};
};

}  // namespace glint
