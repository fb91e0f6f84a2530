#include "glint/bake/ingest/checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "glint/model/error.h"
#include "glint/model/texel_name.h"

namespace glint::bake {
namespace {

/// Number of texels, evenly spread, of a sample.
constexpr std::size_t kSampleTexels = 65536;
/// A vector whose length is off by more than this, or that points down, is far from a normal.
constexpr double kFarFromUnit = 0.25;
/// Largest share of such vectors in a normal map. Filtered maps of flakes have up to an eighth of them; random colours would
/// have three quarters.
constexpr double kMostFar = 0.3;
/// Means of x and y beyond this show an sRGB conversion: 0.5 becomes 0.735 when encoded as sRGB (a component of +0.47) and
/// 0.214 when decoded (-0.57).
constexpr double kSrgbBias = 0.25;

/// Largest median of |length - 1| of a normal map. Filtered maps of flakes have up to .12.
constexpr double kMostMedianError = 0.15;
/// Smallest correlation of z and sqrt(1 - x^2 - y^2) of a normal map. Compression by JPEG at a quality of 50 leaves .16 or
/// more; where blue is occlusion there is none.
constexpr double kNoCorrelation = 0.1;
/// Filtering makes vectors shorter, never longer. So a share kMostTooLong of vectors longer than 1 + kTooLong shows that blue
/// is not z, unless x and y were scaled: then z still correlates with them.
constexpr double kTooLong = 0.03, kMostTooLong = 0.05;
/// Where sqrt(1 - x^2 - y^2) varies by more than kVisibleSpread, z correlates with it even on filtered maps. A blue that does
/// not, and is kFarBlue away, is not z.
constexpr double kVisibleSpread = 0.02, kFarBlue = 0.05;
/// Red within this distance of 0 or 1 would mean |x| > .98.
constexpr float kRedEnd = 0.01f;

double srgbToLinear(double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); }
double linearToSrgb(double v) { return v <= 0.0031308 ? v * 12.92 : 1.055 * std::pow(v, 1 / 2.4) - 0.055; }

[[noreturn]] void throwInvalid(const std::string& rule, const std::string& name, const std::string& object,
                               const std::string& what, const std::string& remedy) {
  throw Error(ErrorCode::invalid_input, rule, name, object, what, remedy);
}

std::size_t sampleStep(const PixelArray& image) {
  const std::size_t texels = static_cast<std::size_t>(image.width) * image.height;
  return std::max<std::size_t>(1, texels / kSampleTexels) | 1;  // odd: does not keep to some columns only
}

/// Whether holds(pixel, first pixel of the image) is true for every pixel.
template <class Holds>
bool everyTexel(const PixelArray& image, const Holds& holds) {
  return std::visit(
      [&](const auto& pixels) {
        for (std::size_t k = 0; k < pixels.size(); k += static_cast<std::size_t>(image.channels))
          if (!holds(pixels.data() + k, pixels.data())) return false;
        return true;
      },
      image.pixels);
}

/// A component of a vector. pixelValue scales integers to 0 .. 1, so the code for 0 of snorm is a little above a half.
double componentOf(const PixelArray& image, std::size_t texel, int channel, Encoding encoding) {
  const double value = pixelValue(image, texel, channel);
  if (encoding == Encoding::unorm) return 2 * value - 1;
  return std::visit(
      [&](const auto& pixels) {
        using T = typename std::decay_t<decltype(pixels)>::value_type;
        if constexpr (std::is_floating_point_v<T>) return value;
        constexpr double kMost = std::numeric_limits<T>::max(), kHalf = (kMost + 1) / 2;
        return std::max(-1.0, (kMost * value - kHalf) / (kHalf - 1));
      },
      image.pixels);
}

/// Sums over pairs of numbers (a, b), and statistics that follow from them.
class Covariances {
 public:
  void add(double a, double b) { n_ += 1, a_ += a, b_ += b, aa_ += a * a, ab_ += a * b, bb_ += b * b; }
  double spread() const { return n_ > 0 ? std::sqrt(std::max(0.0, bb_ / n_ - b_ / n_ * (b_ / n_))) : 0; }
  /// Standard deviation of a over that of b; 1 where b does not vary.
  double stretch() const {
    const double aa = aa_ * n_ - a_ * a_, bb = bb_ * n_ - b_ * b_;
    return bb > 0 ? std::sqrt(std::max(0.0, aa) / bb) : 1;
  }
  double distance() const { return n_ > 0 ? std::sqrt(std::max(0.0, aa_ - 2 * ab_ + bb_) / n_) : 0; }
  /// Correlation of a and b. 1 if all b are the same, 0 if all a are the same but not all b.
  double correlation() const {
    const double aa = aa_ * n_ - a_ * a_, bb = bb_ * n_ - b_ * b_;
    constexpr double kRounding = 1e-9;
    if (!(bb > kRounding * bb_ * n_)) return 1;
    return aa > kRounding * aa_ * n_ ? (ab_ * n_ - a_ * b_) / std::sqrt(aa * bb) : 0;
  }

 private:
  double n_ = 0, a_ = 0, b_ = 0, aa_ = 0, ab_ = 0, bb_ = 0;
};

double lengthError(double x, double y, double z) { return std::abs(std::sqrt(x * x + y * y + z * z) - 1); }

bool isFinite(float v) { return std::isfinite(v); }
bool isFinite(Vec2 v) { return std::isfinite(v.x) && std::isfinite(v.y); }

/// Calls visit(texel) for a texel and its eight neighbours.
template <class Visit>
void visitNeighbours(int width, int height, Boundary boundary, std::size_t texel, const Visit& visit) {
  const int i = static_cast<int>(texel % static_cast<std::size_t>(width));
  const int j = static_cast<int>(texel / static_cast<std::size_t>(width));
  for (int y = j - 1; y <= j + 1; ++y) {
    for (int x = i - 1; x <= i + 1; ++x) {
      if (boundary == Boundary::clamp && (x < 0 || y < 0 || x >= width || y >= height)) continue;
      const int column = (x + width) % width, row = (y + height) % height;
      visit(static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column));
    }
  }
}

template <class T>
std::size_t fillHolesOf(int width, int height, std::span<T> values, Boundary boundary, const std::string& name) {
  // Find the rim: holes that have a finite neighbour.
  std::vector<std::size_t> rim;
  std::size_t count = 0;
  const auto touchesValue = [&](std::size_t t) {
    bool touches = false;
    visitNeighbours(width, height, boundary, t, [&](std::size_t n) { touches |= isFinite(values[n]); });
    return touches;
  };
  for (std::size_t t = 0; t < values.size(); ++t) {
    if (isFinite(values[t])) continue;
    ++count;
    if (touchesValue(t)) rim.push_back(t);
  }
  if (2 * count > values.size()) {
    throwInvalid("map.repairable", name, "",
                 std::to_string(count) + " of " + std::to_string(values.size()) + " texels are unusable",
                 "more than half cannot be repaired; export the map again");
  }
  // Fill the rim of all holes; the new rim is their neighbours that are still holes.
  std::vector<T> filled;
  while (!rim.empty()) {
    filled.clear();
    for (const std::size_t t : rim) {
      T sum{};
      int usable = 0;
      visitNeighbours(width, height, boundary, t, [&](std::size_t n) {
        if (!isFinite(values[n])) return;
        sum = sum + values[n];
        ++usable;
      });
      filled.push_back((1.0f / static_cast<float>(usable)) * sum);
    }
    for (std::size_t k = 0; k < rim.size(); ++k) values[rim[k]] = filled[k];
    std::vector<std::size_t> next;
    for (const std::size_t t : rim)
      visitNeighbours(width, height, boundary, t, [&](std::size_t n) {
        if (!isFinite(values[n])) next.push_back(n);
      });
    std::sort(next.begin(), next.end());
    next.erase(std::unique(next.begin(), next.end()), next.end());
    rim = std::move(next);
  }
  return count;
}

}  // namespace

std::string texelName(const PixelArray& image, std::size_t texel) { return glint::texelName(image.width, image.height, texel); }

void checkShape(const PixelArray& image, const std::string& name) {
  const auto count = std::visit([](const auto& pixels) { return pixels.size(); }, image.pixels);
  const bool fits = image.width > 0 && image.height > 0 && image.channels > 0 &&
                    count == static_cast<std::size_t>(image.width) * image.height * image.channels;
  if (!fits)
    throwInvalid("image.shape", name, "", "the image has no pixels or not as many as its size says", "export it again");
}

void checkNotConstant(const PixelArray& image, const std::vector<int>& channels, const std::string& name) {
  const bool constant = everyTexel(image, [&](const auto* pixel, const auto* first) {
    return std::all_of(channels.begin(), channels.end(), [&](int c) { return pixel[c] == first[c]; });
  });
  if (constant) {
    throwInvalid("map.varies", name, "", "every texel has the same value",
                 "check the image, or pass --allow-constant if it is meant");
  }
}

float pixelValue(const PixelArray& image, std::size_t texel, int channel) {
  const std::size_t index = texel * static_cast<std::size_t>(image.channels) + static_cast<std::size_t>(channel);
  return std::visit(
      [&](const auto& pixels) {
        using T = typename std::decay_t<decltype(pixels)>::value_type;
        if constexpr (std::is_floating_point_v<T>) return pixels[index];
        return static_cast<float>(pixels[index]) / static_cast<float>(std::numeric_limits<T>::max());
      },
      image.pixels);
}

bool isConstant(const PixelArray& image, int channel) {
  return everyTexel(image, [channel](const auto* pixel, const auto* first) { return pixel[channel] == first[channel]; });
}

bool areSame(const PixelArray& image, int a, int b) {
  return everyTexel(image, [=](const auto* pixel, const auto*) { return pixel[a] == pixel[b]; });
}

NormalLayout findLayout(const PixelArray& image, const IngestOptions& p) {
  NormalLayout layout;
  if (image.channels == 2) layout = {NormalChannels::rg, 0, 1, -1};
  if ((image.channels < 3 && !image.grey_alpha) || p.trust_channels) return layout;
  const int last = image.grey_alpha ? 1 : 3;
  const bool alpha = image.channels > last && !isConstant(image, last);
  const bool grey = image.grey_alpha || (!isConstant(image, 0) && areSame(image, 0, 1) && areSame(image, 0, 2));
  const std::string what = image.grey_alpha ? "there is no colour but grey" : "red, green and blue are the same";
  if (grey && !alpha) {
    throwInvalid("normals.channels", p.name, "", what + ": this is no normal map", "read heights with --kind height");
  }
  if (grey) {
    throwInvalid("normals.channels", p.name, "", what + ", so x and y are among grey and alpha",
                 "say which is x and which is y: --channels ag or --channels ra");
  }
  // DXT5nm has x in alpha, and red constant at 0 or 1. As x, such a red would leave no room for y and z.
  if (!alpha || !isConstant(image, 0) || isConstant(image, 1)) return layout;
  const float red = pixelValue(image, 0, 0);
  if (red > kRedEnd && red < 1 - kRedEnd) {
    // Grooves along x have such a red, but their z changes.
    if (!isConstant(image, 2)) return layout;
    throwInvalid("normals.channels", p.name, "", "red and blue are constant, and alpha is not: x may be in red or in alpha",
                 "say which channels are x and y: --channels ag, or --channels rg if alpha is something else");
  }
  if (!isConstant(image, 2) && !areSame(image, 1, 2)) {
    throwInvalid("normals.channels", p.name, "", "red is constant, so x is in alpha; blue may be z or something else",
                 "say which channels are x, y and z: --channels agb, or --channels ag if blue is not z");
  }
  return {NormalChannels::ag, 3, 1, -1};
}

bool looksSigned(const EncodingEvidence& e) {
  // A unorm map that was converted from sRGB is also nearer to unit length as snorm, but not as near as this.
  constexpr double kNearUnit = 0.01;
  return e.snorm < e.unorm && (e.negative || e.snorm < kNearUnit);
}

EncodingEvidence weighEncoding(const PixelArray& image, const NormalLayout& layout) {
  const std::size_t texels = static_cast<std::size_t>(image.width) * image.height;
  const std::size_t step = sampleStep(image);
  EncodingEvidence e;
  double count = 0, far_unorm = 0, far_snorm = 0;
  for (std::size_t t = 0; t < texels; t += step) {
    const double v[3] = {pixelValue(image, t, layout.x), pixelValue(image, t, layout.y),
                         layout.hasZ() ? pixelValue(image, t, layout.z) : 1.0};
    if (!std::isfinite(v[0] + v[1] + v[2])) continue;
    const auto error = [&](const auto& decode) { return lengthError(decode(v[0]), decode(v[1]), decode(v[2])); };
    const double unorm = error([](double c) { return 2 * c - 1; });
    const double snorm = error([](double c) { return c; });
    e.negative |= std::min({v[0], v[1], v[2]}) < 0;
    e.unorm += unorm;
    e.snorm += snorm;
    e.srgb_undone += error([](double c) { return 2 * srgbToLinear(c) - 1; });
    e.srgb_redone += error([](double c) { return 2 * linearToSrgb(c) - 1; });
    e.mean_x += 2 * v[0] - 1;
    e.mean_y += 2 * v[1] - 1;
    far_unorm += unorm > kFarFromUnit || 2 * v[2] - 1 <= 0 ? 1 : 0;
    far_snorm += snorm > kFarFromUnit || v[2] <= 0 ? 1 : 0;
    count += 1;
  }
  if (count == 0) return e;
  for (double* mean : {&e.unorm, &e.snorm, &e.srgb_undone, &e.srgb_redone, &e.mean_x, &e.mean_y}) *mean /= count;
  e.far_unorm = far_unorm / count;
  e.far_snorm = far_snorm / count;
  return e;
}

void checkEncoding(const EncodingEvidence& e, Encoding encoding, bool three, const std::string& name) {
  if (encoding == Encoding::unorm) {
    if (std::min(e.mean_x, e.mean_y) > kSrgbBias && (!three || e.srgb_undone < 0.5 * e.unorm)) {
      throwInvalid("normals.linear", name, "", "the colours are sRGB-encoded: flat texels are near 0.735 instead of 0.5",
                   "export the map as non-colour (raw, linear) data");
    }
    if (std::max(e.mean_x, e.mean_y) < -kSrgbBias && (!three || e.srgb_redone < 0.5 * e.unorm)) {
      throwInvalid("normals.linear", name, "",
                   "the colours were converted from sRGB to linear: flat texels are near 0.214 instead of 0.5",
                   "export the map as non-colour (raw) data");
    }
  }
  const double far = encoding == Encoding::unorm ? e.far_unorm : e.far_snorm;
  if (three && far > kMostFar) {
    throwInvalid("normals.unit", name, "",
                 std::to_string(std::lround(100 * far)) +
                     " % of the vectors point down or are far from unit length: this is no tangent-space normal map",
                 "give the normal map rather than the colour map or an object-space map, or set --encoding; if blue is not z, "
                 "--channels rg takes z from x and y");
  }
}

VectorEvidence measureVectors(const PixelArray& image, const NormalLayout& layout, Encoding encoding, double rounding) {
  const std::size_t texels = static_cast<std::size_t>(image.width) * image.height;
  const double tolerance = kUnitTolerance + std::numbers::sqrt3 * rounding;
  std::vector<double> errors;
  VectorEvidence e;
  Covariances z, positive;
  for (std::size_t t = 0; t < texels; t += sampleStep(image)) {
    const auto component = [&](int channel) { return componentOf(image, t, channel, encoding); };
    const double x = component(layout.x), y = component(layout.y), file_z = component(layout.z);
    if (!std::isfinite(x + y + file_z)) continue;
    const double length = std::sqrt(x * x + y * y + file_z * file_z);
    errors.push_back(std::abs(length - 1));
    e.off += std::abs(length - 1) > tolerance ? 1 : 0;
    e.too_long += length - 1 > kTooLong + std::numbers::sqrt3 * rounding ? 1 : 0;
    if (const double r2 = x * x + y * y; r2 < 1) {
      const double w = std::sqrt(1 - r2);
      z.add(file_z, w);
      positive.add(file_z, 2 * w - 1);
    }
  }
  if (errors.empty()) return e;
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  e.median_error = *middle;
  e.off /= static_cast<double>(errors.size());
  e.too_long /= static_cast<double>(errors.size());
  e.correlation = z.correlation();
  e.spread = z.spread();
  e.distance = z.distance();
  e.stretch = z.stretch();
  e.distance_if_positive = positive.distance();
  return e;
}

bool holdsPositiveZ(const VectorEvidence& e, double rounding) {
  // z = 2 w - 1 but for rounding. Filtering makes z smaller as well, but neither in step with w nor by this much.
  constexpr double kOftenOff = 0.02, kInStep = 0.98, kStretch = 2, kMostDeviation = 0.1;
  return e.off > kOftenOff && e.correlation > kInStep && std::abs(e.stretch - kStretch) < kMostDeviation &&
         e.distance_if_positive < 2 * rounding + kUnitTolerance;
}

void checkVectors(const VectorEvidence& e, const std::string& name) {
  if (e.median_error > kMostMedianError) {
    throwInvalid(
        "normals.unit", name, "",
        "half of the vectors are off unit length by more than " + fmt::format("{:.2f}", e.median_error) +
            ": this is no tangent-space normal map, or in another encoding",
        "give the normal map, or set --encoding; --channels rg takes z from x and y, --channels rgb takes vectors of any "
        "length");
  }
  const bool longer = e.too_long > kMostTooLong && e.correlation < kNoCorrelation;
  const bool unrelated = e.spread > kVisibleSpread && e.correlation < kNoCorrelation && e.distance > kFarBlue;
  if (longer || unrelated) {
    throwInvalid("normals.blue", name, "",
                 "blue is not the z that belongs to red and green: it holds something else, such as occlusion",
                 "--channels rg takes z from x and y, --channels rgb takes blue for z as it is");
  }
}

std::size_t fillHoles(int width, int height, std::span<Vec2> values, Boundary boundary, const std::string& name) {
  return fillHolesOf(width, height, values, boundary, name);
}
std::size_t fillHoles(int width, int height, std::span<float> values, Boundary boundary, const std::string& name) {
  return fillHolesOf(width, height, values, boundary, name);
}

}  // namespace glint::bake
