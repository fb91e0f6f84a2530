#pragma once

#include "glint/model/near_normals.h"
#include "glint/query/detail/manifold/triangle_lanes.h"

namespace glint {

/// Loads the bounds of nodes side by side.
template <class V>
struct NodeBounds {
  V low_x, low_y, high_x, high_y;
};
inline GLINT_HD void loadNodes(const NormalBounds* p, NodeBounds<Lanes1>& out) {
  out = {{p->low_x}, {p->low_y}, {p->high_x}, {p->high_y}};
}
#ifdef GLINT_LANES
GLINT_LANE void loadNodes(const NormalBounds* p, NodeBounds<Lanes8>& out) {
  // Rows hold nodes k and k + 4; a transposition of 4x4 numbers in each half puts lanes in order.
  using Floats = Lanes8::Floats;
  Floats row[4];
  for (int k = 0; k < 4; ++k) {
    __builtin_memcpy(&row[k], p + k, 16);
    __builtin_memcpy(reinterpret_cast<char*>(&row[k]) + 16, p + k + 4, 16);
  }
  const Floats a = __builtin_shufflevector(row[0], row[1], 0, 8, 1, 9, 4, 12, 5, 13);
  const Floats b = __builtin_shufflevector(row[2], row[3], 0, 8, 1, 9, 4, 12, 5, 13);
  const Floats c = __builtin_shufflevector(row[0], row[1], 2, 10, 3, 11, 6, 14, 7, 15);
  const Floats d = __builtin_shufflevector(row[2], row[3], 2, 10, 3, 11, 6, 14, 7, 15);
  out.low_x.v = __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13);
  out.low_y.v = __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
  out.high_x.v = __builtin_shufflevector(c, d, 0, 1, 8, 9, 4, 5, 12, 13);
  out.high_y.v = __builtin_shufflevector(c, d, 2, 3, 10, 11, 6, 7, 14, 15);
}
GLINT_LANE void loadNodes(const NormalBounds* p, NodeBounds<Lanes4x2>& out) {
  using Floats = Lanes4x2::Floats;
  const auto transpose = [](const NormalBounds* four, Floats& low_x, Floats& low_y, Floats& high_x, Floats& high_y) {
    Floats row[4];
    __builtin_memcpy(row, four, sizeof row);
    const Floats a = __builtin_shufflevector(row[0], row[1], 0, 4, 1, 5),
                 b = __builtin_shufflevector(row[2], row[3], 0, 4, 1, 5);
    const Floats c = __builtin_shufflevector(row[0], row[1], 2, 6, 3, 7),
                 d = __builtin_shufflevector(row[2], row[3], 2, 6, 3, 7);
    low_x = __builtin_shufflevector(a, b, 0, 1, 4, 5);
    low_y = __builtin_shufflevector(a, b, 2, 3, 6, 7);
    high_x = __builtin_shufflevector(c, d, 0, 1, 4, 5);
    high_y = __builtin_shufflevector(c, d, 2, 3, 6, 7);
  };
  transpose(p, out.low_x.low, out.low_y.low, out.high_x.low, out.high_y.low);
  transpose(p + 4, out.low_x.high, out.low_y.high, out.high_x.high, out.high_y.high);
}
#endif

/// Decodes nodes, four numbers each. The products are exact.
/// @param out  [count]
GLINT_LANE void decodeNodes(const CodeBounds* p, int count, float step, NormalBounds* out) {
  const auto* codes = reinterpret_cast<const std::int16_t*>(p);
  auto* numbers = reinterpret_cast<float*>(out);
  for (int k = 0; k < 4 * count; ++k) numbers[k] = step * static_cast<float>(codes[k]);
}
/// Decodes four normals.
GLINT_LANE void decodeFour(const NormalCode* p, float step, Vec2* out) {
  const auto* codes = reinterpret_cast<const std::int16_t*>(p);
  auto* numbers = reinterpret_cast<float*>(out);
  for (int k = 0; k < 8; ++k) numbers[k] = step * static_cast<float>(codes[k]);
}

/// Loads the corners of triangles of 2x2 cells in units of the lobe's deviation: cells in reading order, for each the lower right
/// triangle and the upper left one.
/// @param row    three rows of four normals, of which the first three count
/// @param first  of the eight triangles, the one that goes into lane 0
inline GLINT_HD void loadCorners(const Vec2* const* row, int first, Vec2 origin, float inverse_sigma, Corners<Lanes1>& out) {
  const int x = first >> 1 & 1, y = first >> 2, half = first & 1;
  const auto relative = [&](const Vec2& n) { return inverse_sigma * (n - origin); };
  const Vec2 a = relative(row[y][x]), b = relative(half == 0 ? row[y][x + 1] : row[y + 1][x]), c = relative(row[y + 1][x + 1]);
  out = {{a.x}, {a.y}, {b.x}, {b.y}, {c.x}, {c.y}};
}
#ifdef GLINT_LANES
GLINT_LANE void loadCorners(const Vec2* const* row, int, Vec2 origin, float inverse_sigma, Corners<Lanes8>& out) {
  using Floats = Lanes8::Floats;
  const Floats centre = {origin.x, origin.y, origin.x, origin.y, origin.x, origin.y, origin.x, origin.y};
  Floats r[3];
  for (int y = 0; y < 3; ++y) {
    __builtin_memcpy(&r[y], row[y], sizeof r[y]);
    r[y] = (r[y] - centre) * inverse_sigma;
  }
  out.ax.v = __builtin_shufflevector(r[0], r[1], 0, 0, 2, 2, 8, 8, 10, 10);
  out.ay.v = __builtin_shufflevector(r[0], r[1], 1, 1, 3, 3, 9, 9, 11, 11);
  out.cx.v = __builtin_shufflevector(r[1], r[2], 2, 2, 4, 4, 10, 10, 12, 12);
  out.cy.v = __builtin_shufflevector(r[1], r[2], 3, 3, 5, 5, 11, 11, 13, 13);
  const Floats low = __builtin_shufflevector(r[0], r[1], 2, 3, 8, 9, 4, 5, 10, 11);   // of the lower cells: x and y by turns
  const Floats high = __builtin_shufflevector(r[1], r[2], 2, 3, 8, 9, 4, 5, 10, 11);  // of the upper cells
  out.bx.v = __builtin_shufflevector(low, high, 0, 2, 4, 6, 8, 10, 12, 14);
  out.by.v = __builtin_shufflevector(low, high, 1, 3, 5, 7, 9, 11, 13, 15);
}
GLINT_LANE void loadCorners(const Vec2* const* row, int, Vec2 origin, float inverse_sigma, Corners<Lanes4x2>& out) {
  using Floats = Lanes4x2::Floats;
  const Floats centre = {origin.x, origin.y, origin.x, origin.y};
  Floats left[3], right[3];  // the first two normals of each row, the next two
  for (int y = 0; y < 3; ++y) {
    __builtin_memcpy(&left[y], row[y], sizeof left[y]);
    __builtin_memcpy(&right[y], row[y] + 2, sizeof right[y]);
    left[y] = (left[y] - centre) * inverse_sigma;
    right[y] = (right[y] - centre) * inverse_sigma;
  }
  out.ax = {__builtin_shufflevector(left[0], left[0], 0, 0, 2, 2), __builtin_shufflevector(left[1], left[1], 0, 0, 2, 2)};
  out.ay = {__builtin_shufflevector(left[0], left[0], 1, 1, 3, 3), __builtin_shufflevector(left[1], left[1], 1, 1, 3, 3)};
  out.cx = {__builtin_shufflevector(left[1], right[1], 2, 2, 4, 4), __builtin_shufflevector(left[2], right[2], 2, 2, 4, 4)};
  out.cy = {__builtin_shufflevector(left[1], right[1], 3, 3, 5, 5), __builtin_shufflevector(left[2], right[2], 3, 3, 5, 5)};
  const Floats low = __builtin_shufflevector(left[0], right[0], 2, 3, 4, 5);   // the second and the third normal of row 0
  const Floats high = __builtin_shufflevector(left[1], right[1], 2, 3, 4, 5);  // of row 1
  out.bx = {__builtin_shufflevector(low, left[1], 0, 4, 2, 6), __builtin_shufflevector(high, left[2], 0, 4, 2, 6)};
  out.by = {__builtin_shufflevector(low, left[1], 1, 5, 3, 7), __builtin_shufflevector(high, left[2], 1, 5, 3, 7)};
}
#endif

}  // namespace glint
