#include "glint/bake/displace/measured_brdf.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "glint/bake/common/simd.h"
#include "glint/query/brdf/base_brdf.h"

namespace glint::bake {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kMostGain = 2;  // beyond, light between facets would grow without end
constexpr float kLeastAlpha = 0.05f, kLeastShare = 0.05f, kMostShare = 0.95f;

/// Angles of a node of a table: half angle, azimuth of the difference, and the cosine of the half angle.
struct NodeAngles {
  double theta = 0, phi = 0, cosine = 1;
};

NodeAngles nodeAngles(double x, double y) {
  const double rho2 = x * x + y * y, cosine = std::max(-1.0, 1 - 2 * rho2 * rho2);
  return {std::acos(cosine), std::atan2(y, x), cosine};
}

double differenceAngle(int slice, int slices) {
  const double u = static_cast<double>(slice) / (slices - 1);
  return std::acos(std::clamp(1 - u * u, 0.0, 1.0));
}

/// Light and view of a slice in the frame of the half vector.
struct Slice {
  explicit Slice(int slice, int slices)
      : sine(static_cast<float>(std::sin(differenceAngle(slice, slices)))),
        cosine(static_cast<float>(std::cos(differenceAngle(slice, slices)))) {}
  Vec3 wi() const { return {sine, 0, cosine}; }
  Vec3 wo() const { return {-sine, 0, cosine}; }
  float sine, cosine;
};

/// Nodes of a quarter, of normals in the frame of the half vector.
struct QuarterNodes {
  std::vector<float> x, y, z;  ///< unit normals
  std::size_t front = 0;       ///< number of those that face the half vector, which come first
  std::vector<float> weights;  ///< solid angle of a node and of its mirror images, over their number of four
};

/// @param nodes  along each axis; nodes outside the unit circle are left out. Normals that face the half vector come first
/// @param index  receives j * nodes + i of each node that is kept
QuarterNodes quarterNodes(int nodes, std::vector<std::size_t>& index) {
  QuarterNodes out;
  const double step = 1.0 / (nodes - 1);
  for (const bool front : {true, false}) {
    for (int k = 0; k < nodes * nodes; ++k) {
      const int i = k % nodes, j = k / nodes;
      const double x = i * step, y = j * step, rho2 = x * x + y * y;
      const NodeAngles a = nodeAngles(x, y);
      if (i * i + j * j > (nodes - 1) * (nodes - 1) || (a.cosine > 0) != front) continue;
      const double sine = std::sin(a.theta);
      out.x.push_back(static_cast<float>(sine * std::cos(a.phi)));
      out.y.push_back(static_cast<float>(sine * std::sin(a.phi)));
      out.z.push_back(static_cast<float>(a.cosine));
      // d omega = 8 rho^2 dx dy; nodes on an axis are their own mirror images.
      out.weights.push_back(static_cast<float>(8 * rho2 * step * step * (i == 0 ? 0.5 : 1) * (j == 0 ? 0.5 : 1)));
      index.push_back(static_cast<std::size_t>(k));
    }
    if (front) out.front = out.x.size();
  }
  return out;
}

/// powers[image][n] = exp(dot(centre, image of node n) - 1).
void startPowers(const QuarterNodes& nodes, Vec3 centre, float* powers) {
  const std::size_t count = nodes.x.size();
  for (std::size_t image = 0; image < 4; ++image) {
    const float x = image % 2 == 0 ? centre.x : -centre.x, y = image < 2 ? centre.y : -centre.y;
    for (std::size_t n = 0; n < count; ++n)
      powers[image * count + n] = std::exp(x * nodes.x[n] + y * nodes.y[n] + centre.z * nodes.z[n] - 1);
  }
}

/// Square of a power; tiny ones are 0, since numbers below the normal ones are slow.
inline float squared(float power) { return power > 1e-18f ? power * power : 0.0f; }

/// row[n] = weight of node n in the mean over a lobe, its four images together; then squares the powers, which doubles the
/// lobe's bandwidth.
GLINT_MULTIVERSION void lobeRow(const QuarterNodes& nodes, float* powers, float* row) {
  const std::size_t count = nodes.x.size();
  float *p0 = powers, *p1 = p0 + count, *p2 = p1 + count, *p3 = p2 + count;
  const float* weights = nodes.weights.data();
  for (std::size_t n = 0; n < count; ++n) {
    row[n] = weights[n] * (p0[n] + p1[n] + p2[n] + p3[n]);
    p0[n] = squared(p0[n]), p1[n] = squared(p1[n]), p2[n] = squared(p2[n]), p3[n] = squared(p3[n]);
  }
  double sum = 0;
  for (std::size_t n = 0; n < count; ++n) sum += row[n];
  const float scale = sum > 0 ? static_cast<float>(1 / sum) : 0.0f;
  for (std::size_t n = 0; n < count; ++n) row[n] *= scale;
}

using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// A direction around (0, 0, 1), reflected from a view at the half vector with these angles.
struct Reflection {
  Vec3 half, direction;
  double solid_angle = 0;
};

/// Half vectors that see a view from their front, at even steps of MERL's half angles.
std::vector<Reflection> reflections(Vec3 view) {
  constexpr int kThetas = 64, kPhis = 32;
  std::vector<Reflection> out;
  for (int t = 0; t < kThetas; ++t) {
    const auto edge = [](double k) { return 0.5 * kPi * (k / kThetas) * (k / kThetas); };
    const double theta = edge(t + 0.5), ring = std::cos(edge(t)) - std::cos(edge(t + 1));
    for (int p = 0; p < kPhis; ++p) {
      const double phi = 2 * kPi * (p + 0.5) / kPhis;
      const Vec3 h = {static_cast<float>(std::sin(theta) * std::cos(phi)), static_cast<float>(std::sin(theta) * std::sin(phi)),
                      static_cast<float>(std::cos(theta))};
      const float c = dot(h, view);
      const Vec3 wi = 2 * c * h - view;
      if (c > 0 && wi.z > 0) out.push_back({h, wi, 4 * c * ring * 2 * kPi / kPhis});
    }
  }
  return out;
}

/// The table's brightness at the reflections of a few views.
struct SampleFit {
  Vec3 view;
  std::vector<Reflection> at;
  std::vector<double> light;  ///< f cos, times solid angle
  double total = 0, brightest = 0;

  /// Second moment of the weights of samples, over their squared mean.
  double secondMoment(float alpha, float share) const {
    double sum = 0;
    for (std::size_t k = 0; k < at.size(); ++k)
      sum += light[k] * light[k] / (at[k].solid_angle * std::max(1e-12f, tableSamplePdf(alpha, share, view, at[k].direction)));
    return total > 0 ? sum / (total * total) : 0;
  }
};

std::vector<SampleFit> sampleFits(const MeasuredBrdf& brdf) {
  std::vector<SampleFit> fits;
  for (const double degrees : {10.0, 40.0, 65.0}) {
    SampleFit fit;
    fit.view = {static_cast<float>(std::sin(degrees * kPi / 180)), 0, static_cast<float>(std::cos(degrees * kPi / 180))};
    fit.at = reflections(fit.view);
    double totals[3] = {};
    for (const Reflection& r : fit.at) {
      const Rgb f = brdf.value(tablePair(r.direction, fit.view), {0, 0, 1});
      const double part = r.direction.z * r.solid_angle;
      totals[0] += part * f.r, totals[1] += part * f.g, totals[2] += part * f.b;
      fit.light.push_back(part * (f.r + f.g + f.b) / 3);
      fit.total += fit.light.back();
    }
    fit.brightest = *std::max_element(totals, totals + 3);
    fits.push_back(std::move(fit));
  }
  return fits;
}

/// The tables of an asset.
struct AssetTables {
  explicit AssetTables(std::size_t of_channels) : channels(of_channels), values(kBaseTables * kBaseTableNodes * of_channels) {}

  /// @param node  of the slice: row * kBaseTableHalf + column
  float* at(int table, int slice, std::size_t node) {
    constexpr std::size_t kSlice = static_cast<std::size_t>(kBaseTableHalf) * kBaseTableHalf;
    const std::size_t first = static_cast<std::size_t>(table) * kBaseTableDifference + static_cast<std::size_t>(slice);
    return &values[(first * kSlice + node) * channels];
  }

  std::size_t channels;
  std::vector<float> values;
};

void setChannels(Rgb color, float scale, std::size_t channels, float* out) {
  const float each[3] = {color.r, color.g, color.b};
  for (std::size_t c = 0; c < channels; ++c) out[c] = scale * each[c];
}

/// f cos(wi) cos(wo) of every normal that faces the half vector, in every slice: [nodes][slices * channels]. Others have none.
Matrix lightOfNormals(const MeasuredBrdf& brdf, const QuarterNodes& nodes, std::size_t channels) {
  Matrix light(static_cast<Eigen::Index>(nodes.front), static_cast<Eigen::Index>(kBaseTableDifference * channels));
  tbb::parallel_for(std::size_t{0}, nodes.front, [&](std::size_t n) {
    const Vec3 normal = {nodes.x[n], nodes.y[n], nodes.z[n]};
    for (int s = 0; s < kBaseTableDifference; ++s) {
      const Slice slice(s, kBaseTableDifference);
      const float cosines = std::max(0.0f, dot(normal, slice.wi())) * std::max(0.0f, dot(normal, slice.wo()));
      setChannels(brdf.value(tablePair(slice.wi(), slice.wo()), normal), cosines, channels,
                  &light(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(static_cast<std::size_t>(s) * channels)));
    }
  });
  return light;
}

/// Fills the tables of means over lobes. Which normals a lobe has does not depend on the slice: so all slices and channels are
/// a matrix product of the weights of normals, for a few centres at a time.
void averageTables(const MeasuredBrdf& brdf, AssetTables& tables) {
  constexpr int kFine = 2 * kBaseTableHalf - 1;  // nodes of the quadrature: those of the tables and their middles
  constexpr std::size_t kCentres = 16;
  std::vector<std::size_t> fine_index, index;
  const QuarterNodes fine = quarterNodes(kFine, fine_index), nodes = quarterNodes(kBaseTableHalf, index);
  const Matrix light = lightOfNormals(brdf, fine, tables.channels);
  const std::size_t tasks = (nodes.x.size() + kCentres - 1) / kCentres, size = fine.x.size();
  tbb::parallel_for(std::size_t{0}, tasks, [&](std::size_t task) {
    const std::size_t first = task * kCentres, count = std::min(kCentres, nodes.x.size() - first);
    std::vector<float> powers(count * 4 * size);
    for (std::size_t m = 0; m < count; ++m)
      startPowers(fine, {nodes.x[first + m], nodes.y[first + m], nodes.z[first + m]}, &powers[m * 4 * size]);
    Matrix rows(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(size)), means;
    for (int t = 0; t < kBaseTables - 1; ++t) {
      for (std::size_t m = 0; m < count; ++m) lobeRow(fine, &powers[m * 4 * size], &rows(static_cast<Eigen::Index>(m), 0));
      means.noalias() = rows.leftCols(light.rows()) * light;
      for (std::size_t m = 0; m < count; ++m)
        for (int s = 0; s < kBaseTableDifference; ++s)
          std::copy_n(
              &means(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(static_cast<std::size_t>(s) * tables.channels)),
              tables.channels, tables.at(t, s, index[first + m]));
    }
  });
}

/// Fills a slice of the last table, f itself.
void copyTable(const MeasuredBrdf& brdf, int s, AssetTables& tables) {
  const Slice slice(s, kBaseTableDifference);
  const float difference = tablePair(slice.wi(), slice.wo()).difference;
  for (int j = 0; j < kBaseTableHalf; ++j) {
    for (int i = 0; i < kBaseTableHalf; ++i) {
      const Vec2 point = {static_cast<float>(i) / (kBaseTableHalf - 1), static_cast<float>(j) / (kBaseTableHalf - 1)};
      setChannels(brdf.value(difference, point), 1, tables.channels,
                  tables.at(kBaseTables - 1, s, static_cast<std::size_t>(j) * kBaseTableHalf + static_cast<std::size_t>(i)));
    }
  }
}

/// Gives nodes outside the circle the value of a node inside: lookups near the circle touch them.
void extendTables(AssetTables& tables) {
  constexpr int kLast = kBaseTableHalf - 1;
  for (int j = 0; j <= kLast; ++j) {
    for (int i = 0; i <= kLast; ++i) {
      if (i * i + j * j <= kLast * kLast) continue;
      const double rho = std::hypot(i, j) / kLast;
      const auto node = [](int column, int row) {
        return static_cast<std::size_t>(row) * kBaseTableHalf + static_cast<std::size_t>(column);
      };
      const std::size_t inside = node(static_cast<int>(i / rho), static_cast<int>(j / rho));
      for (int t = 0; t < kBaseTables - 1; ++t)
        for (int s = 0; s < kBaseTableDifference; ++s)
          std::copy_n(tables.at(t, s, inside), tables.channels, tables.at(t, s, node(i, j)));
    }
  }
}

}  // namespace

MeasuredBrdf::MeasuredBrdf(const MerlTable& table) {
  const std::size_t plane = table.values.size() / 3;
  for (std::size_t k = 0; k < plane && channels_ == 1; ++k) {
    // Grey but for the rounding of scales.
    const float r = table.values[k], g = table.values[plane + k], b = table.values[2 * plane + k];
    if (std::max({r, g, b}) - std::min({r, g, b}) > 1e-5f * r) channels_ = 3;
  }
  const auto each = static_cast<std::size_t>(channels_);
  std::vector<float> values(static_cast<std::size_t>(kSlices) * kNodes * kNodes * each);
  tbb::parallel_for(0, kSlices, [&](int slice) {
    const double difference = differenceAngle(slice, kSlices);
    for (int j = 0; j < kNodes; ++j) {
      for (int i = 0; i < kNodes; ++i) {
        const NodeAngles a = nodeAngles(static_cast<double>(i) / (kNodes - 1), static_cast<double>(j) / (kNodes - 1));
        const auto one = table.at(a.theta, difference, a.phi), other = table.at(a.theta, difference, -a.phi);
        const std::size_t node =
            (static_cast<std::size_t>(slice) * kNodes + static_cast<std::size_t>(j)) * kNodes + static_cast<std::size_t>(i);
        for (std::size_t c = 0; c < each; ++c) values[node * each + c] = 0.5f * (one[c] + other[c]);
      }
    }
  });
  nodes_ = TableNodes(values, kSlices, kNodes, channels_);
  fitSamples();
}

Rgb MeasuredBrdf::value(const TablePair& pair, Vec3 normal) const { return value(pair.difference, tablePoint(pair, normal)); }

Rgb MeasuredBrdf::value(float difference, Vec2 point) const {
  return nodes_.value(tablePlace(difference, point, kSlices, kNodes));
}

float tableSamplePdf(float alpha, float share, Vec3 view, Vec3 direction) {
  if (direction.z <= 0 || view.z <= 0) return 0;
  const Vec3 sum = view + direction;
  const float cosine = sum.z / std::sqrt(dot(sum, sum));
  const float glossy = ggxMasking(view.z, alpha) * ggxDensity(cosine, alpha) / (4 * view.z);
  return share * kInversePi * direction.z + (1 - share) * glossy;
}

/// Finds the mixture of a cosine and a GGX lobe whose samples have the least variance, over the views together.
void MeasuredBrdf::fitSamples() {
  base_.kind = BaseBrdf::Kind::table;
  const std::vector<SampleFit> fits = sampleFits(*this);
  for (const SampleFit& fit : fits) albedo_ = std::max(albedo_, fit.brightest);
  if (!(albedo_ <= kMostGain))
    throw Error(ErrorCode::invalid_input, "merl.gain", {}, {},
                fmt::format("the table reflects {:.3g} times the light that arrives", albedo_),
                "give 1 / sr in MERL's form: red is divided by 1500, green by 1304 and blue by 904");
  constexpr int kAlphas = 24, kShares = 10;
  double least = std::numeric_limits<double>::infinity();
  for (int a = 0; a < kAlphas; ++a) {
    const float alpha = kLeastAlpha * std::pow(1 / kLeastAlpha, static_cast<float>(a) / (kAlphas - 1));
    for (int k = 0; k < kShares; ++k) {
      const float share = kLeastShare + (kMostShare - kLeastShare) * static_cast<float>(k) / (kShares - 1);
      double second = 0;
      for (const SampleFit& fit : fits) second += fit.secondMoment(alpha, share);
      if (second < least) least = second, base_.alpha = alpha, diffuse_share_ = share;
    }
  }
}

std::vector<float> MeasuredBrdf::assetTables(int channels) const {
  AssetTables tables(static_cast<std::size_t>(channels));
  averageTables(*this, tables);
  for (int s = 0; s < kBaseTableDifference; ++s) copyTable(*this, s, tables);
  extendTables(tables);
  return std::move(tables.values);
}

}  // namespace glint::bake
