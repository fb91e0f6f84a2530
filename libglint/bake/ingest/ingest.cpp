#include "glint/bake/ingest/ingest.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "glint/bake/common/counter_random.h"
#include "glint/bake/common/slopes.h"
#include "glint/bake/ingest/checks.h"
#include "glint/bake/ingest/pixel_codes.h"
#include "glint/model/counted.h"
#include "glint/model/error.h"
#include "glint/model/slope_sums.h"

namespace glint::bake {
namespace {

constexpr std::uint64_t kDitherStream = 5;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kDegreesPerRadian = 180 / std::numbers::pi_v<float>;
/// Scanned and JPEG maps have a few texels that point down. Up to one texel in so many is repaired even without fix_invalid.
constexpr std::size_t kTexelsPerDownward = 1000;
constexpr std::size_t kNoTexel = std::numeric_limits<std::size_t>::max();

/// Counts of faulty texels, and the first texels at fault.
struct Faults {
  std::size_t non_finite = 0;
  std::size_t downward = 0;
  std::size_t clipped = 0;
  std::size_t non_unit = 0;
  std::size_t no_data = 0;
  std::size_t first_non_finite = kNoTexel;
  std::size_t first_downward = kNoTexel;

  void add(const Faults& o) {
    non_finite += o.non_finite;
    downward += o.downward;
    clipped += o.clipped;
    non_unit += o.non_unit;
    no_data += o.no_data;
    first_non_finite = std::min(first_non_finite, o.first_non_finite);
    first_downward = std::min(first_downward, o.first_downward);
  }
};

/// Draws two independent values of triangular density on (-1, 1), one for x and one for y.
Vec2 triangularNoise(std::uint64_t seed, std::size_t texel) {
  constexpr float kScale = 1.0f / 65536;
  const std::uint64_t bits = randomBits(seed, kDitherStream, texel);
  const auto part = [&](int shift) { return static_cast<float>((bits >> shift) & 0xffff) * kScale; };
  return {part(0) - part(16), part(32) - part(48)};
}

/// Pixel value that stands for 1.
template <class T>
constexpr float kCodes = std::is_floating_point_v<T> ? 1.0f : static_cast<float>(std::numeric_limits<T>::max());

/// Decodes pixel values to components of a vector: n = scale * value + offset. Neighbouring codes differ by `scale`. Components
/// are doubles, so that squares of the largest and the smallest floats are numbers, too.
struct Decoder {
  float scale = 2;
  float offset = -1;
  double floor = -HUGE_VAL;  ///< smallest component: the lowest code of snorm means -1, as in graphics APIs

  template <class T>
  static Decoder of(Encoding encoding) {
    if (encoding == Encoding::unorm) return {2 / kCodes<T>, -1};
    if constexpr (std::is_floating_point_v<T>) return {1, 0};
    const float half = static_cast<float>((std::numeric_limits<T>::max() + 1) / 2);
    return {1 / (half - 1), -half / (half - 1), -1};
  }
  double operator()(float value) const {
    const double n = double{scale} * value + offset;
    return n < floor ? floor : n;  // unlike std::max, keeps NaN
  }
};

/// Largest rounding error of a component.
float roundingOf(const Decoder& decode, const PixelCodes& codes) {
  constexpr float kFloatRounding = 1e-6f;
  return codes.step > 0 ? decode.scale * codes.step : kFloatRounding;
}

/// Width of the noise that hides the steps of codes, in pixel values; 0: no noise.
float noiseOf(const PixelCodes& codes, Dequantize wanted) {
  const bool noisy = wanted == Dequantize::tpdf || (wanted == Dequantize::automatic && codes.coarse);
  return noisy ? codes.step : 0;
}

/// The meaning of the pixels of a normal map, as findMeaning found it.
struct MapMeaning {
  NormalLayout layout;
  Encoding encoding = Encoding::unorm;
  PixelCodes codes;
  VectorEvidence vectors;      ///< measures of x, y and z as the map has them
  bool positive_blue = false;  ///< blue holds z from 0 to 1
};

/// Finds channels, encoding and codes of a normal map.
/// @throws Error invalid_input if the pixels are no normals
MapMeaning findMeaning(const PixelArray& image, const IngestOptions& p) {
  const bool floating = std::holds_alternative<std::span<const float>>(image.pixels);
  MapMeaning meaning;
  meaning.layout = findLayout(image, p);
  EncodingEvidence evidence;
  const auto weigh = [&] {
    evidence = weighEncoding(image, meaning.layout);
    meaning.encoding = p.encoding;
    if (p.encoding == Encoding::automatic)
      meaning.encoding = floating && looksSigned(evidence) ? Encoding::snorm : Encoding::unorm;
  };
  weigh();
  // x and y alone: z may be computed from them, and then is no code.
  meaning.codes = findCodes(image, std::array{meaning.layout.x, meaning.layout.y});
  if (meaning.layout.hasZ()) {
    const float rounding = std::visit(
        [&](const auto& pixels) {
          using T = std::remove_const_t<typename std::decay_t<decltype(pixels)>::element_type>;
          return roundingOf(Decoder::of<T>(meaning.encoding), meaning.codes);
        },
        image.pixels);
    meaning.vectors = measureVectors(image, meaning.layout, meaning.encoding, rounding);
    // A constant blue with which vectors are off unit length is not z, and blue may hold z from 0 to 1: compute z from x and y.
    meaning.positive_blue = meaning.encoding == Encoding::unorm && holdsPositiveZ(meaning.vectors, rounding);
    if (!p.trust_channels && ((meaning.vectors.off > 0 && isConstant(image, 2)) || meaning.positive_blue)) {
      meaning.layout = {NormalChannels::rg, 0, 1, -1};
      meaning.vectors = {};
      weigh();
    }
  }
  checkEncoding(evidence, meaning.encoding, meaning.layout.hasZ(), p.name);
  if (!p.trust_channels) checkVectors(meaning.vectors, p.name);
  return meaning;
}

/// Decodes pixels to normals. Unusable texels become NaN, and are counted.
template <class T>
struct NormalDecoder {
  const PixelArray& image;
  const IngestOptions& options;
  NormalLayout layout;
  std::span<const T> pixels;
  Decoder decode;
  NoDataTest holds_nothing;
  float dither = 0;     ///< width of the noise of a component
  float rounding = 0;   ///< largest error of a component
  float tolerance = 0;  ///< largest |length - 1| that rounding explains

  NormalDecoder(const PixelArray& array, const IngestOptions& p, const MapMeaning& meaning)
      : image(array),
        options(p),
        layout(meaning.layout),
        pixels(std::get<std::span<const T>>(array.pixels)),
        decode(Decoder::of<T>(meaning.encoding)),
        holds_nothing(array, p.no_data),
        dither(decode.scale * noiseOf(meaning.codes, p.dequantize)),
        rounding(roundingOf(decode, meaning.codes)),
        tolerance(static_cast<float>(kUnitTolerance) + 1.7320508f * rounding) {}

  Vec2 texel(std::size_t t, Faults& faults) const {
    const T* pixel = pixels.data() + t * static_cast<std::size_t>(image.channels);
    const bool three = layout.hasZ();
    const auto value = [pixel](int channel) { return static_cast<float>(pixel[channel]); };
    if (holds_nothing(value(layout.x)) && holds_nothing(value(layout.y)) && (!three || holds_nothing(value(layout.z)))) {
      ++faults.no_data;
      return {kNaN, kNaN};
    }
    // Decode the components.
    double x = decode(value(layout.x));
    double y = decode(value(layout.y));
    const double z = three ? decode(value(layout.z)) : 0;
    if (!std::isfinite(x + y + z)) {
      if (faults.non_finite++ == 0) faults.first_non_finite = t;
      return {kNaN, kNaN};
    }
    // Sort out vectors that do not point up: by rounding alone onto the rim, others as unusable.
    if (three) {
      const double length = std::sqrt(x * x + y * y + z * z);
      if (std::abs(length - 1) > tolerance) ++faults.non_unit;
      if (z <= 0 && z >= -rounding && length > 0.5) return onRim(x, y, faults);
      if (z <= 0) return downward(t, faults);
    } else if (const double r2 = x * x + y * y; r2 >= 1) {
      const double limit = 1.0 + rounding;
      return r2 <= limit * limit ? onRim(x, y, faults) : downward(t, faults);
    }
    // Add noise, and project on the disk.
    if (dither > 0) {
      const Vec2 noise = dither * triangularNoise(options.seed, t);
      const double moved_x = x + noise.x, moved_y = y + noise.y;
      if (three || moved_x * moved_x + moved_y * moved_y < 1) x = moved_x, y = moved_y;
    }
    if (three) {
      const double scale = 1 / std::sqrt(x * x + y * y + z * z);
      x *= scale;
      y *= scale;
    }
    const Vec2 n = {static_cast<float>(x), static_cast<float>(y)};
    return dot(n, n) >= 1 ? onRim(x, y, faults) : n;
  }

 private:
  static Vec2 onRim(double x, double y, Faults& faults) {
    ++faults.clipped;
    const double scale = kRimRadius / std::sqrt(x * x + y * y);
    return {static_cast<float>(scale * x), static_cast<float>(scale * y)};
  }
  static Vec2 downward(std::size_t t, Faults& faults) {
    if (faults.downward++ == 0) faults.first_downward = t;
    return {kNaN, kNaN};
  }
};

/// Decodes all texels of a map, and adds up their faults.
template <class T>
std::pmr::vector<Vec2> decodeNormals(const PixelArray& image, const IngestOptions& p, const NormalDecoder<T>& decoder,
                                     Faults& faults) {
  const float green = p.convention == Convention::directx ? -1.0f : 1.0f;
  std::pmr::vector<Vec2> normals(static_cast<std::size_t>(image.width) * image.height);
  std::vector<Faults> rows(static_cast<std::size_t>(image.height));
  tbb::parallel_for(0, image.height, [&](int j) {
    const std::size_t first = static_cast<std::size_t>(j) * image.width;
    Faults found;
    for (std::size_t t = first; t < first + static_cast<std::size_t>(image.width); ++t) {
      const Vec2 n = decoder.texel(t, found);
      normals[t] = {n.x, green * n.y};
    }
    rows[static_cast<std::size_t>(j)] = found;
  });
  // Image viewers count rows from the top, so the first texel at fault is in the last row with a fault.
  for (auto row = rows.rbegin(); row != rows.rend(); ++row) {
    if (faults.first_non_finite != kNoTexel) row->first_non_finite = kNoTexel;
    if (faults.first_downward != kNoTexel) row->first_downward = kNoTexel;
    faults.add(*row);
  }
  return normals;
}

/// Refuses a map with faults that are repaired with fix_invalid only.
/// @throws Error invalid_input
void checkFaults(const PixelArray& image, const IngestOptions& p, bool three, const Faults& faults) {
  if (p.fix_invalid) return;
  const Subject texels_are = {"texel is", "texels are"};
  if (faults.non_finite > 0) {
    throw Error(ErrorCode::invalid_input, "map.finite", p.name, texelName(image, faults.first_non_finite),
                counted(faults.non_finite, texels_are) + " not finite, this is the first",
                "repair them with glint-ingest --fix-invalid");
  }
  const std::size_t texels = static_cast<std::size_t>(image.width) * image.height;
  if (faults.downward * kTexelsPerDownward > texels) {
    throw Error(
        ErrorCode::invalid_input, three ? "normals.upward" : "normals.disk", p.name, texelName(image, faults.first_downward),
        counted(faults.downward, texels_are) +
            (three ? " not above the surface (z <= 0)" : " outside the unit disk (x^2 + y^2 > 1)") + ", this is the first",
        three ? "export a tangent-space map or set --encoding, or repair them with glint-ingest --fix-invalid"
              : "set --encoding, or repair them with glint-ingest --fix-invalid");
  }
}

/// Refuses heights among which one number seems to mark texels without data.
void refuseSentinel(const PixelArray& image, const std::optional<double>& no_data, const std::string& name) {
  const std::optional<double> number = findSentinel(image, NoDataTest(image, no_data));
  if (!number) return;
  const std::string text = fmt::format("{:.9g}", *number);
  throw Error(ErrorCode::invalid_input, "heights.no_data", name, "",
              text + " is far from all other heights: it seems to stand for no data",
              "fill such texels with --nodata " + text + ", or take it for a height with --nodata none");
}

/// Decodes the heights of all texels, and counts faults. Unusable texels become NaN.
template <class T>
std::pmr::vector<float> decodeHeights(const PixelArray& image, const IngestOptions& p, float noise_width, Faults& faults) {
  const auto pixels = std::get<std::span<const T>>(image.pixels);
  const float scale = p.height_scale / kCodes<T>;
  const NoDataTest holds_nothing(image, p.no_data);
  std::vector<std::size_t> no_data(static_cast<std::size_t>(image.height));
  std::pmr::vector<float> heights(static_cast<std::size_t>(image.width) * image.height);
  tbb::parallel_for(0, image.height, [&](int j) {
    const std::size_t first = static_cast<std::size_t>(j) * image.width;
    for (std::size_t t = first; t < first + static_cast<std::size_t>(image.width); ++t) {
      const auto value = static_cast<float>(pixels[t * static_cast<std::size_t>(image.channels)]);
      const float noise = noise_width > 0 ? noise_width * triangularNoise(p.seed, t).x : 0;
      heights[t] = scale * (value + noise);
      if (!holds_nothing(value)) continue;
      heights[t] = kNaN;
      ++no_data[static_cast<std::size_t>(j)];
    }
  });
  for (const std::size_t count : no_data) faults.no_data += count;
  for (int j = image.height - 1; j >= 0; --j) {
    for (int i = 0; i < image.width; ++i) {
      const std::size_t t = static_cast<std::size_t>(j) * image.width + static_cast<std::size_t>(i);
      if (std::isfinite(heights[t])) continue;
      if (holds_nothing(static_cast<float>(pixels[t * static_cast<std::size_t>(image.channels)]))) continue;
      if (faults.non_finite++ == 0) faults.first_non_finite = t;
    }
  }
  return heights;
}

/// Refuses an image whose colour channels differ, as in a photograph or a normal map.
/// @throws Error invalid_input
void checkGrey(const PixelArray& image, const IngestOptions& p) {
  if (image.channels < 3) return;
  const std::size_t texels = static_cast<std::size_t>(image.width) * image.height;
  for (std::size_t t = 0; t < texels; ++t) {
    const float first = pixelValue(image, t, 0);
    for (int c = 1; c < 3; ++c) {
      const float other = pixelValue(image, t, c);
      if (first == other || (std::isnan(first) && std::isnan(other))) continue;
      throw Error(ErrorCode::invalid_input, "heights.grey", p.name, texelName(image, t),
                  "red, green and blue differ: this is no height field",
                  "read normal maps with --kind normal; export heights as one channel");
    }
  }
}

/// Sums over normals: over each row, and then over rows in order.
struct Moments {
  double n[2] = {};
  double tilt = 0;
  SlopeSums slopes;
  float lowest_z = 1;
};

Moments rowMoments(std::span<const Vec2> normals) {
  Moments m;
  m.slopes = slopeSums(normals.data(), normals.size());
  for (const Vec2 n : normals) {
    const float z = std::sqrt(std::max(1e-12f, 1 - dot(n, n)));
    m.n[0] += n.x;
    m.n[1] += n.y;
    m.tilt += std::acos(z);
    m.lowest_z = std::min(m.lowest_z, z);
  }
  return m;
}

}  // namespace

IngestReport describeNormals(int width, int height, std::span<const Vec2> normals) {
  std::vector<Moments> rows(static_cast<std::size_t>(height));
  tbb::parallel_for(0, height, [&](int j) {
    rows[static_cast<std::size_t>(j)] =
        rowMoments(normals.subspan(static_cast<std::size_t>(j) * width, static_cast<std::size_t>(width)));
  });
  Moments sum;
  for (const Moments& row : rows) {
    for (int k = 0; k < 2; ++k) sum.n[k] += row.n[k];
    sum.slopes.add(row.slopes);
    sum.tilt += row.tilt;
    sum.lowest_z = std::min(sum.lowest_z, row.lowest_z);
  }
  const auto count = static_cast<double>(normals.size());
  IngestReport report;
  report.texels = normals.size();
  report.mean_normal = {static_cast<float>(sum.n[0] / count), static_cast<float>(sum.n[1] / count)};
  report.mean_tilt_deg = kDegreesPerRadian * sum.tilt / count;
  report.steepest_tilt_deg = kDegreesPerRadian * std::acos(sum.lowest_z);
  report.slopes = sum.slopes.moments(count);
  return report;
}

IngestedNormals ingestNormals(const PixelArray& image, const IngestOptions& p) {
  checkShape(image, p.name);
  if (image.channels < 2) {
    throw Error(ErrorCode::invalid_input, "normals.channels", p.name, "", "has one channel, and normals need three (or two)",
                "read heights with --kind height");
  }
  const MapMeaning meaning = findMeaning(image, p);
  Faults faults;
  IngestedNormals result;
  result.normals = std::visit(
      [&](const auto& pixels) {
        using T = std::remove_const_t<typename std::decay_t<decltype(pixels)>::element_type>;
        const NormalDecoder<T> decoder(image, p, meaning);
        return decodeNormals<T>(image, p, decoder, faults);
      },
      image.pixels);
  checkFaults(image, p, meaning.layout.hasZ(), faults);
  std::size_t repaired = 0;
  if (faults.non_finite + faults.downward + faults.no_data > 0)
    repaired = fillHoles(image.width, image.height, result.normals, p.boundary, p.name);
  if (!p.allow_constant) checkNotConstant(image, meaning.layout.used(), p.name);

  result.report = describeNormals(image.width, image.height, result.normals);
  result.report.encoding = meaning.encoding;
  result.report.channels = meaning.layout.channels;
  result.report.blue_ignored = meaning.layout.channels == NormalChannels::rg && image.channels > 2;
  result.report.positive_blue = result.report.blue_ignored && meaning.positive_blue;
  result.report.median_length_error = meaning.vectors.median_error;
  result.report.coarse_codes = meaning.codes.coarse;
  result.report.dequantized = noiseOf(meaning.codes, p.dequantize) > 0;
  result.report.non_finite = faults.non_finite;
  result.report.no_data = faults.no_data;
  result.report.downward = faults.downward;
  result.report.clipped = faults.clipped;
  result.report.non_unit = faults.non_unit;
  result.report.repaired = repaired;
  return result;
}

IngestedHeights ingestHeights(const PixelArray& image, const IngestOptions& p) {
  checkShape(image, p.name);
  checkGrey(image, p);
  if (!p.allow_constant) checkNotConstant(image, {0}, p.name);
  if (p.refuse_sentinels) refuseSentinel(image, p.no_data, p.name);
  const std::array<int, 1> channel = {0};
  const PixelCodes codes = findCodes(image, channel);
  const float noise = noiseOf(codes, p.dequantize);
  Faults faults;
  IngestedHeights result;
  result.heights = std::visit(
      [&](const auto& pixels) {
        using T = std::remove_const_t<typename std::decay_t<decltype(pixels)>::element_type>;
        return decodeHeights<T>(image, p, noise, faults);
      },
      image.pixels);
  checkFaults(image, p, false, faults);
  std::size_t repaired = 0;
  if (faults.non_finite + faults.no_data > 0)
    repaired = fillHoles(image.width, image.height, result.heights, p.boundary, p.name);
  // A constant map with holes is found constant once its holes are filled.
  if (repaired > 0 && !p.allow_constant)
    checkNotConstant({image.width, image.height, 1, std::span<const float>(result.heights)}, {0}, p.name);
  std::size_t cliffs = 0;
  std::pmr::vector<Vec2> normals(result.heights.size());
  normalsFromHeights(image.width, image.height, result.heights, normals, p.boundary, &cliffs);
  result.report = describeNormals(image.width, image.height, normals);
  result.report.coarse_codes = codes.coarse;
  result.report.dequantized = noise > 0;
  result.report.non_finite = faults.non_finite;
  result.report.no_data = faults.no_data;
  result.report.repaired = repaired;
  result.report.cliffs = cliffs;
  result.report.seam = seamRoughness(image.width, image.height, result.heights);
  return result;
}

}  // namespace glint::bake
