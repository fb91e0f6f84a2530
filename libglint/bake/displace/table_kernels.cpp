#include "glint/bake/displace/table_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "glint/query/brdf/vmf_lobe.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "glint/bake/displace/table_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef GLINT_BAKE_DISPLACE_TABLE_PLACES
#define GLINT_BAKE_DISPLACE_TABLE_PLACES
namespace glint::bake {

/// Lookups side by side: the first group of each, the weights of the four corners of its slices, and the second slice's weight.
struct TablePlaces {
  HWY_ALIGN std::int32_t group[kMostTableFacets];
  HWY_ALIGN float corners[4 * kMostTableFacets];  ///< [lookups][4]
  HWY_ALIGN float slice[kMostTableFacets];
  HWY_ALIGN float light[kMostTableFacets];
};

}  // namespace glint::bake
#endif

HWY_BEFORE_NAMESPACE();
namespace glint::bake::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// No vector is wider than eight lanes, so that sums are the same on every processor with fused products and sums.
using Floats = hn::CappedTag<float, 8>;
using Ints = hn::RebindToSigned<Floats>;
using Group = hn::FixedTag<float, 4>;
constexpr std::size_t kLanes = hn::MaxLanes(Floats());
using Vector = hn::Vec<Floats>;

/// Splits coordinates in [0, 1] into the lower one of two nodes, and the part between them.
HWY_INLINE Vector lowerNode(Vector value, int count, Vector& part) {
  const Floats d;
  const Vector last = hn::Set(d, static_cast<float>(count - 1)), lowest = hn::Set(d, static_cast<float>(count - 2));
  const Vector at = hn::Min(hn::Max(hn::Mul(value, last), hn::Zero(d)), last);
  const Vector low = hn::Min(hn::Floor(at), lowest);
  part = hn::Sub(at, low);
  return low;
}

/// Sets lookups k to k + kLanes - 1, for a table with kept slice coordinates.
/// @param p, q  projections of normals on the plane across the half vector; cosine: to the half vector
HWY_INLINE void place(const TableNodes& table, Vector difference, Vector cosine, Vector p, Vector q, Vector light,
                      std::size_t k, TablePlaces& out) {
  const Floats d;
  const Vector one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f);
  const Vector sine2 = hn::Max(hn::MulAdd(p, p, hn::Mul(q, q)), hn::Set(d, 1e-30f));
  // rho^4 = (1 - cos) / 2, which is sin^2 / (2 (1 + cos)) without the loss of digits.
  const auto front = hn::Gt(cosine, hn::Zero(d));
  const Vector rho4 = hn::Mul(half, hn::IfThenElse(front, hn::Div(sine2, hn::Add(one, cosine)), hn::Sub(one, cosine)));
  const Vector scale = hn::Sqrt(hn::Div(hn::Sqrt(hn::Max(rho4, hn::Zero(d))), sine2));
  Vector x, y, z;
  const Vector i = lowerNode(hn::Mul(scale, p), table.nodes(), x), j = lowerNode(hn::Mul(scale, q), table.nodes(), y);
  const Vector s = lowerNode(difference, table.slices(), z);
  const Vector nodes = hn::Set(d, static_cast<float>(table.nodes()));
  // Below 2^24, so exact in float.
  const Vector group = hn::MulAdd(hn::MulAdd(s, nodes, j), nodes, i);
  const Ints di;
  hn::Store(hn::ConvertTo(di, group), di, out.group + k);
  hn::Store(z, d, out.slice + k);
  hn::Store(light, d, out.light + k);
  const Vector rest_x = hn::Sub(one, x), rest_y = hn::Sub(one, y);
  hn::StoreInterleaved4(hn::Mul(rest_x, rest_y), hn::Mul(x, rest_y), hn::Mul(rest_x, y), hn::Mul(x, y), d, out.corners + 4 * k);
}

/// The four terms of a grey value, whose sum it is: the corners, each between two slices.
HWY_INLINE hn::Vec<Group> greyTerms(const float* groups, std::size_t slice, const TablePlaces& at, std::size_t k) {
  const Group d;
  const float* first = groups + 4 * static_cast<std::size_t>(at.group[k]);
  const auto low = hn::LoadU(d, first), high = hn::LoadU(d, first + 4 * slice);
  return hn::Mul(hn::MulAdd(hn::Set(d, at.slice[k]), hn::Sub(high, low), low), hn::Load(d, at.corners + 4 * k));
}

/// A coloured value.
HWY_INLINE hn::Vec<Group> colorValue(const float* groups, std::size_t row, const TablePlaces& at, std::size_t k) {
  const Group d;
  const std::size_t slice = row * row;
  const float* first = groups + 4 * static_cast<std::size_t>(at.group[k]);
  const float* corners = at.corners + 4 * k;
  const auto corner = [&](std::size_t node) {
    const auto low = hn::LoadU(d, first + 4 * node), high = hn::LoadU(d, first + 4 * (node + slice));
    return hn::MulAdd(hn::Set(d, at.slice[k]), hn::Sub(high, low), low);
  };
  auto sum = hn::Mul(hn::Set(d, corners[0]), corner(0));
  sum = hn::MulAdd(hn::Set(d, corners[1]), corner(1), sum);
  sum = hn::MulAdd(hn::Set(d, corners[2]), corner(row), sum);
  return hn::MulAdd(hn::Set(d, corners[3]), corner(row + 1), sum);
}

HWY_INLINE float sumOf(hn::Vec<Group> terms) {
  const Group d;
  HWY_ALIGN float lanes[4];
  hn::Store(terms, d, lanes);
  return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
}

/// Sums light times f over facets; each channel of f has the facet's colour as a factor.
HWY_INLINE void sumFacets(const TableNodes& table, const TableFacets& facets, const TablePlaces& at, float* totals) {
  const Group d;
  const auto row = static_cast<std::size_t>(table.nodes());
  const float* groups = table.groups();
  if (table.grey() && facets.colors == nullptr) {
    auto even = hn::Zero(d), odd = hn::Zero(d);
    for (std::size_t k = 0; k < facets.count; k += 2) {
      even = hn::MulAdd(hn::Set(d, at.light[k]), greyTerms(groups, row * row, at, k), even);
      odd = hn::MulAdd(hn::Set(d, at.light[k + 1]), greyTerms(groups, row * row, at, k + 1), odd);
    }
    totals[0] = sumOf(hn::Add(even, odd));
    return;
  }
  auto sum = hn::Zero(d);
  for (std::size_t k = 0; k < facets.count; ++k) {
    auto f = table.grey() ? hn::Set(d, sumOf(greyTerms(groups, row * row, at, k))) : colorValue(groups, row, at, k);
    if (facets.colors != nullptr) f = hn::Mul(f, hn::LoadU(d, facets.colors + 4 * k));
    sum = hn::MulAdd(hn::Set(d, at.light[k]), f, sum);
  }
  hn::StoreU(sum, d, totals);
}

void AddTablePairs(const TableNodes& table, const TableFacets& facets, std::span<const TablePair> pairs, std::size_t directions,
                   std::size_t channels, std::size_t stride, float* c) {
  const Floats d;
  TablePlaces at;
  const auto onto = [&](Vec3 v, std::size_t k) {
    const Vector in_plane =
        hn::MulAdd(hn::LoadU(d, facets.x + k), hn::Set(d, v.x), hn::Mul(hn::LoadU(d, facets.y + k), hn::Set(d, v.y)));
    return hn::MulAdd(hn::LoadU(d, facets.z + k), hn::Set(d, v.z), in_plane);
  };
  for (std::size_t i = 0; i < directions; ++i) {
    const float* row_i = facets.masked + i * facets.count;
    for (std::size_t o = i; o < directions; ++o) {
      const float* row_o = facets.masked + o * facets.count;
      const TablePair& pair = pairs[i * directions + o];
      const Vector difference = hn::Set(d, pair.difference);
      for (std::size_t k = 0; k < facets.count; k += kLanes)
        place(table, difference, onto(pair.half, k), hn::Abs(onto(pair.along, k)), hn::Abs(onto(pair.across, k)),
              hn::Mul(hn::LoadU(d, row_i + k), hn::LoadU(d, row_o + k)), k, at);
      float totals[4];
      sumFacets(table, facets, at, totals);
      for (std::size_t channel = 0; channel < channels; ++channel) c[(channel * stride + i) * stride + o] += totals[channel];
    }
  }
}

/// Places light from directions `first` to first + count - 1.
HWY_INLINE void placeLights(const TableNodes& table, const DirectionTable& directions, const float* visible, Vec3 normal,
                            Vec3 view, float scale, std::size_t first, std::size_t count, TablePlaces& at) {
  const Floats d;
  const float view_cosine = normal.x * view.x + normal.y * view.y + normal.z * view.z;
  const Vector tiny = hn::Set(d, 1e-14f), one = hn::Set(d, 1.0f), zero = hn::Zero(d);
  for (std::size_t k = 0; k < count; k += kLanes) {
    const Vector x = hn::LoadU(d, &directions.x[first + k]), y = hn::LoadU(d, &directions.y[first + k]),
                 z = hn::LoadU(d, &directions.z[first + k]);
    const Vector ci =
        hn::MulAdd(x, hn::Set(d, normal.x), hn::MulAdd(y, hn::Set(d, normal.y), hn::Mul(z, hn::Set(d, normal.z))));
    const Vector gx = hn::Sub(x, hn::Set(d, view.x)), gy = hn::Sub(y, hn::Set(d, view.y)), gz = hn::Sub(z, hn::Set(d, view.z));
    const Vector gap2 = hn::Max(hn::MulAdd(gx, gx, hn::MulAdd(gy, gy, hn::Mul(gz, gz))), tiny);
    const Vector length = hn::Sqrt(hn::Max(hn::Sub(hn::Set(d, 4.0f), gap2), tiny));
    // Cosines of the normal to the half vector and to the vector along; what is left is across.
    const Vector cosine = hn::Min(hn::Max(zero, hn::Div(hn::Add(ci, hn::Set(d, view_cosine)), length)), one);
    const Vector p = hn::Min(hn::Div(hn::Abs(hn::Sub(ci, hn::Set(d, view_cosine))), hn::Sqrt(gap2)), one);
    const Vector q2 = hn::Sub(hn::Sub(one, hn::Mul(cosine, cosine)), hn::Mul(p, p));
    const Vector difference = hn::Sqrt(hn::Div(hn::Mul(hn::Set(d, 0.25f), gap2), hn::MulAdd(hn::Set(d, 0.5f), length, one)));
    const Vector light = hn::Mul(hn::Mul(hn::Set(d, scale), hn::LoadU(d, visible + first + k)), hn::Max(zero, ci));
    place(table, difference, cosine, p, hn::Sqrt(hn::Max(zero, q2)), light, k, at);
  }
}

void AddTableLights(const TableNodes& table, const DirectionTable& directions, const float* visible, Vec3 normal, Vec3 view,
                    std::size_t channels, float scale, float* out) {
  const Group d;
  const auto row = static_cast<std::size_t>(table.nodes());
  TablePlaces at;
  for (std::size_t first = 0; first < directions.padded; first += kMostTableFacets) {
    const std::size_t count = std::min(kMostTableFacets, directions.padded - first);
    placeLights(table, directions, visible, normal, view, scale, first, count, at);
    for (std::size_t k = 0; k < count; ++k) {
      if (at.light[k] == 0) continue;
      HWY_ALIGN float f[4];
      if (table.grey())
        f[0] = f[1] = f[2] = sumOf(greyTerms(table.groups(), row * row, at, k));
      else
        hn::Store(colorValue(table.groups(), row, at, k), d, f);
      for (std::size_t c = 0; c < channels; ++c) out[c * directions.padded + first + k] += at.light[k] * f[c];
    }
  }
}

/// The two tables that a lobe is between, and their weights. Where the second is f itself, its weight needs the cosines.
struct LobeTables {
  const float *first, *second;
  float low, high;
  bool cosines;
};

/// Adds `count` views from `first` on to a row of a light direction.
HWY_INLINE void addLobeRow(const TableNodes& tables, const LobeTables& of, const TablePlaces& at, std::size_t count,
                           std::span<const float> weights, std::size_t plane, float* out) {
  const Group d;
  const auto row = static_cast<std::size_t>(tables.nodes());
  for (std::size_t k = 0; k < count; ++k) {
    const auto low = hn::Set(d, of.low), high = hn::Set(d, of.cosines ? of.high * at.light[k] : of.high);
    if (tables.grey()) {
      const auto terms =
          hn::MulAdd(low, greyTerms(of.first, row * row, at, k), hn::Mul(high, greyTerms(of.second, row * row, at, k)));
      const float value = sumOf(terms);
      for (std::size_t c = 0; c < weights.size(); ++c) out[c * plane + k] += weights[c] * value;
      continue;
    }
    HWY_ALIGN float value[4];
    hn::Store(hn::MulAdd(low, colorValue(of.first, row, at, k), hn::Mul(high, colorValue(of.second, row, at, k))), d, value);
    for (std::size_t c = 0; c < weights.size(); ++c) out[c * plane + k] += weights[c] * value[c];
  }
}

void AddTableLobe(const DirectionTable& directions, const PairFrames& frames, const TableNodes& tables, const VmfLobe& lobe,
                  std::span<const float> weights, float* out) {
  const Floats d;
  const TableBlend blend = tableBlend(lobe.kappa);
  const float* first = tables.groups() + 4 * static_cast<std::size_t>(blend.first) * tables.size();
  const LobeTables of{first, first + 4 * tables.size(), 1 - blend.weight, blend.weight, blend.second == kBaseTables - 1};
  const Vec3 centre = lobeCentre(lobe);
  const std::size_t padded = directions.padded;
  const auto onto = [&](const std::vector<float>(&v)[3], std::size_t k) {
    return hn::MulAdd(
        hn::LoadU(d, &v[0][k]), hn::Set(d, centre.x),
        hn::MulAdd(hn::LoadU(d, &v[1][k]), hn::Set(d, centre.y), hn::Mul(hn::LoadU(d, &v[2][k]), hn::Set(d, centre.z))));
  };
  TablePlaces at;
  for (std::size_t i = 0; i < directions.count; ++i) {
    const float ci = std::max(0.0f, dot(centre, directions.at(i)));
    for (std::size_t o = i / 8 * 8; o < padded; o += kMostTableFacets) {
      const std::size_t count = std::min(kMostTableFacets, padded - o), begin = i * padded + o;
      for (std::size_t k = 0; k < count; k += kLanes) {
        const Vector co = hn::MulAdd(hn::LoadU(d, &directions.x[o + k]), hn::Set(d, centre.x),
                                     hn::MulAdd(hn::LoadU(d, &directions.y[o + k]), hn::Set(d, centre.y),
                                                hn::Mul(hn::LoadU(d, &directions.z[o + k]), hn::Set(d, centre.z))));
        place(tables, hn::LoadU(d, &frames.difference[begin + k]), onto(frames.half, begin + k),
              hn::Abs(onto(frames.along, begin + k)), hn::Abs(onto(frames.across, begin + k)),
              hn::Mul(hn::Set(d, ci), hn::Max(hn::Zero(d), co)), k, at);
      }
      addLobeRow(tables, of, at, count, weights, padded * padded, out + begin);
    }
  }
}

}  // namespace glint::bake::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace glint::bake {

HWY_EXPORT(AddTablePairs);
HWY_EXPORT(AddTableLights);
HWY_EXPORT(AddTableLobe);

TableNodes::TableNodes(std::span<const float> values, int slices, int nodes, int channels)
    : slices_(slices), nodes_(nodes), channels_(channels) {
  const auto each = static_cast<std::size_t>(channels), row = static_cast<std::size_t>(nodes), count = values.size() / each;
  groups_.resize(4 * count);
  for (std::size_t node = 0; node < count; ++node) {
    if (channels == 1) {
      // Neighbours beyond the last node are never the first of a lookup.
      const std::size_t offsets[4] = {0, 1, row, row + 1};
      for (std::size_t c = 0; c < 4; ++c) groups_[4 * node + c] = values[std::min(node + offsets[c], count - 1)];
    } else {
      for (std::size_t c = 0; c < 3; ++c) groups_[4 * node + c] = values[3 * node + c];
    }
  }
}

Rgb TableNodes::value(const TablePlace& place) const {
  float out[4] = {};
  const auto row = static_cast<std::size_t>(nodes_);
  if (!grey()) {
    addTableValue<4>(groups_.data(), place, nodes_, 1, out);
    return {out[0], out[1], out[2]};
  }
  const float corners[4] = {(1 - place.x) * (1 - place.y), place.x * (1 - place.y), (1 - place.x) * place.y, place.x * place.y};
  const float *low = &groups_[4 * place.node], *high = low + 4 * row * row;
  for (std::size_t c = 0; c < 4; ++c) out[c] = corners[c] * (low[c] + place.z * (high[c] - low[c]));
  return Rgb::grey((out[0] + out[1]) + (out[2] + out[3]));
}

PairFrames::PairFrames(const DirectionTable& directions) : difference(directions.count * directions.padded) {
  for (std::vector<float>* of : {half, along, across})
    for (int c = 0; c < 3; ++c) of[c].resize(difference.size());
  for (std::size_t i = 0; i < directions.count; ++i) {
    for (std::size_t o = i; o < directions.count; ++o) {
      const TablePair pair = tablePair(directions.at(i), directions.at(o));
      const std::size_t k = i * directions.padded + o;
      const auto set = [k](std::vector<float>(&to)[3], Vec3 v) { to[0][k] = v.x, to[1][k] = v.y, to[2][k] = v.z; };
      set(half, pair.half), set(along, pair.along), set(across, pair.across);
      difference[k] = pair.difference;
    }
  }
}

void addTablePairs(const TableNodes& table, const TableFacets& facets, std::span<const TablePair> pairs, std::size_t directions,
                   std::size_t channels, std::size_t stride, float* c) {
  HWY_DYNAMIC_DISPATCH(AddTablePairs)(table, facets, pairs, directions, channels, stride, c);
}

void addTableLights(const TableNodes& table, const DirectionTable& directions, const float* visible, Vec3 normal, Vec3 view,
                    std::size_t channels, float scale, float* out) {
  HWY_DYNAMIC_DISPATCH(AddTableLights)(table, directions, visible, normal, view, channels, scale, out);
}

void addTableLobe(const DirectionTable& directions, const PairFrames& frames, const TableNodes& tables, const VmfLobe& lobe,
                  std::span<const float> weights, float* out) {
  HWY_DYNAMIC_DISPATCH(AddTableLobe)(directions, frames, tables, lobe, weights, out);
}

}  // namespace glint::bake
#endif
