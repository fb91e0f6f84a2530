#include <algorithm>
#include <bit>
#include <cmath>

#include "glint/formats/kinds/pyramid_shape.h"

namespace glint::formats {
namespace {

constexpr double kIntegralTolerance = 1e-3;
constexpr int kMaxCpRank = 256;
constexpr std::string_view kMethods[] = {"cp", "tucker", "pca"};
constexpr std::string_view kCoefficientTypes[] = {"i8", "f16", "f32"};

ElementType basisType(const CompressedNdf& ndf) {
  if (ndf.coefficient_type == CoefficientType::f32) return ElementType::f32;
  return ndf.method == CompressionMethod::pca ? ElementType::i32 : ElementType::i16;
}

ElementType coefficientElement(CoefficientType type) {
  switch (type) {
    case CoefficientType::i8:
      return ElementType::i8;
    case CoefficientType::f16:
      return ElementType::f16;
    default:
      return ElementType::f32;
  }
}

template <class Enum, std::size_t N>
Enum fromText(const std::string_view (&names)[N], const std::string& text) {
  return static_cast<Enum>(std::find(names, names + N, text) - names);
}

double element(ElementType type, const void* data, std::uint64_t index) {
  switch (type) {
    case ElementType::i8:
      return static_cast<const std::int8_t*>(data)[index];
    case ElementType::i16:
      return static_cast<const std::int16_t*>(data)[index];
    case ElementType::i32:
      return static_cast<const std::int32_t*>(data)[index];
    case ElementType::f16:
      return halfToFloat(static_cast<const std::uint16_t*>(data)[index]);
    default:
      return static_cast<const float*>(data)[index];
  }
}

std::uint64_t columnCount(const CompressedNdf& ndf, const NdfCluster& cluster) {
  return ndf.method == CompressionMethod::tucker ? std::uint64_t{cluster.rank_x} * cluster.rank_y : cluster.rank_x;
}

std::uint64_t basisSize(const CompressedNdf& ndf, const NdfCluster& cluster) {
  switch (ndf.method) {
    case CompressionMethod::cp:
      return std::uint64_t{2} * kBlockSize * cluster.rank_x;
    case CompressionMethod::tucker:
      return std::uint64_t{kBlockSize} * (cluster.rank_x + cluster.rank_y);
    default:
      return std::uint64_t{kBlockPixels} * cluster.rank_x;
  }
}

bool ranksHold(const CompressedNdf& ndf, const NdfCluster& cluster) {
  if (ndf.method == CompressionMethod::tucker) {
    return cluster.rank_x >= 1 && cluster.rank_x <= kBlockSize && cluster.rank_y >= 1 && cluster.rank_y <= kBlockSize;
  }
  const int most = ndf.method == CompressionMethod::pca ? kBlockPixels : kMaxCpRank;
  return cluster.rank_x >= 1 && cluster.rank_x <= most && cluster.rank_y == 0;
}

bool inside(std::uint64_t first, std::uint64_t count, std::uint64_t size) { return first <= size && count <= size - first; }

std::string clusterName(const CompressedNdf& ndf, std::size_t cluster) {
  const auto blocks = static_cast<std::size_t>(ndf.shape.blocksPerImage());
  return "cluster [" + std::to_string(cluster / blocks) + "][" + std::to_string(cluster % blocks) + "]";
}

/// Checks regions and slots of images. Returns the number of slots of each region; empty if they are wrong.
std::vector<std::uint32_t> checkImages(const CompressedNdf& ndf, Findings& findings) {
  const std::size_t images = imageCount(ndf.shape);
  if (ndf.image_slots.size() != images || images > UINT32_MAX) {
    findings.add("compressed.images", "/image_slots",
                 "holds " + std::to_string(ndf.image_slots.size()) + " images, the levels " + std::to_string(images));
    return {};
  }
  const auto regions = static_cast<std::size_t>(ndf.region_columns) * static_cast<std::size_t>(ndf.region_rows);
  std::vector<std::uint32_t> slots(regions);
  for (const std::uint16_t region : ndf.image_regions) {
    if (region >= regions) {
      findings.add("compressed.slots", "/image_regions",
                   "names region " + std::to_string(region) + " of " + std::to_string(regions));
      return {};
    }
    ++slots[region];
  }
  // In each region every slot below the number of images is used once: mark them in one list of all regions.
  std::vector<std::size_t> first(regions);
  for (std::size_t r = 1; r < regions; ++r) first[r] = first[r - 1] + slots[r - 1];
  std::vector<bool> used(images);
  for (std::size_t k = 0; k < images; ++k) {
    const std::uint16_t region = ndf.image_regions[k];
    const std::uint16_t slot = ndf.image_slots[k];
    if (slot >= slots[region] || slot >= std::uint64_t{64} * static_cast<std::uint64_t>(ndf.words_per_cluster) ||
        used[first[region] + slot]) {
      findings.add("compressed.slots", "/image_slots",
                   "image " + std::to_string(k) + " has an invalid or used slot " + std::to_string(slot));
      return {};
    }
    used[first[region] + slot] = true;
  }
  return slots;
}

void checkFirstBlock(const CompressedNdf& ndf, Findings& findings) {
  const auto words = static_cast<std::size_t>(ndf.shape.maskWords());
  const int tail_bits = ndf.shape.blocksPerImage() % 64;
  const std::uint64_t beyond = tail_bits == 0 ? 0 : ~std::uint64_t{0} << tail_bits;
  std::uint64_t count = 0;
  bool holds = true;
  for (std::size_t image = 0; image < ndf.image_slots.size(); ++image) {
    holds &= ndf.first_block[image] == count;
    const std::uint64_t* mask = &ndf.block_masks[image * words];
    for (std::size_t w = 0; w < words; ++w) count += static_cast<std::uint64_t>(std::popcount(mask[w]));
    holds &= (mask[words - 1] & beyond) == 0;
  }
  holds &= ndf.first_block[ndf.image_slots.size()] == count && count == ndf.block_masses.size();
  if (!holds) findings.add("compressed.first_block", "/first_block", "is not the running count of the bits in block_masks");
}

/// Checks the mask of one cluster. Returns the broken rule, or nothing.
std::string_view checkMask(const CompressedNdf& ndf, std::size_t cluster, std::uint32_t slots) {
  const auto words = static_cast<std::size_t>(ndf.words_per_cluster);
  std::uint32_t count = 0;
  for (std::size_t w = 0; w < words; ++w) {
    const std::uint64_t mask = ndf.masks[cluster * words + w];
    if (ndf.mask_ranks[cluster * words + w] != count) return "compressed.mask_ranks";
    const std::uint64_t valid = slots <= 64 * w        ? 0
                                : slots - 64 * w >= 64 ? ~std::uint64_t{0}
                                                       : (std::uint64_t{1} << (slots - 64 * w)) - 1;
    if ((mask & ~valid) != 0) return "compressed.masks";
    count += static_cast<std::uint32_t>(std::popcount(mask));
  }
  return count == ndf.clusters[cluster].slice_count ? std::string_view() : "compressed.masks";
}

/// Integral over its block of each column's basis image, in pixels: the last prefix sums.
double blockSum(const CompressedNdf& ndf, const NdfCluster& cluster, std::uint64_t column) {
  const auto at = [&](std::uint64_t index) { return element(basisType(ndf), ndf.basis, cluster.first_basis + index); };
  const std::uint64_t rank_x = cluster.rank_x;
  const std::uint64_t rank_y = cluster.rank_y;
  switch (ndf.method) {
    case CompressionMethod::cp:
      return at((kBlockSize - 1) * rank_x + column) * at((2 * kBlockSize - 1) * rank_x + column);
    case CompressionMethod::tucker:
      return at((kBlockSize - 1) * rank_x + column / rank_y) *
             at(kBlockSize * rank_x + (kBlockSize - 1) * rank_y + column % rank_y);
    default:
      return at((kBlockPixels - 1) * rank_x + column);
  }
}

/// Integral of every [region][slot] image before its image_scale, in the order of `first`.
std::vector<double> slotIntegrals(const CompressedNdf& ndf, const std::vector<std::size_t>& first) {
  std::vector<double> integrals(imageCount(ndf.shape));
  const auto blocks = static_cast<std::size_t>(ndf.shape.blocksPerImage());
  const auto words = static_cast<std::size_t>(ndf.words_per_cluster);
  const ElementType type = coefficientElement(ndf.coefficient_type);
  std::vector<double> weights;
  for (std::size_t c = 0; c < ndf.clusters.size(); ++c) {
    const NdfCluster& cluster = ndf.clusters[c];
    if (cluster.slice_count == 0) continue;
    const std::uint64_t columns = columnCount(ndf, cluster);
    weights.resize(columns);
    for (std::uint64_t k = 0; k < columns; ++k) weights[k] = ndf.scales[cluster.first_scale + k] * blockSum(ndf, cluster, k);
    std::uint64_t coefficient = cluster.first_coefficient;
    for (std::size_t w = 0; w < words; ++w) {
      for (std::uint64_t mask = ndf.masks[c * words + w]; mask != 0; mask &= mask - 1) {
        const std::size_t slot = 64 * w + static_cast<std::size_t>(std::countr_zero(mask));
        for (std::uint64_t k = 0; k < columns; ++k)
          integrals[first[c / blocks] + slot] += weights[k] * element(type, ndf.coefficients, coefficient++);
      }
    }
  }
  return integrals;
}

/// Number of the first slot of each region, in one list of the slots of all regions.
std::vector<std::size_t> firstSlots(const CompressedNdf& ndf) {
  const auto regions = static_cast<std::size_t>(ndf.region_columns) * static_cast<std::size_t>(ndf.region_rows);
  std::vector<std::size_t> first(regions + 1);
  for (const std::uint16_t region : ndf.image_regions) ++first[region + 1u];
  for (std::size_t r = 0; r < regions; ++r) first[r + 1] += first[r];
  return first;
}

/// Basis images of a cluster with their scales, [columns][256].
std::vector<float> basisImages(const CompressedNdf& ndf, const NdfCluster& cluster) {
  const auto at = [&](std::uint64_t index) { return element(basisType(ndf), ndf.basis, cluster.first_basis + index); };
  const std::uint64_t rx = cluster.rank_x, ry = ndf.method == CompressionMethod::tucker ? cluster.rank_y : rx;
  const auto along = [&](std::uint64_t first, std::uint64_t rank, std::uint64_t k, int t) {
    const auto row = [&](int r) { return at(first + static_cast<std::uint64_t>(r) * rank + k); };
    return t > 0 ? row(t) - row(t - 1) : row(0);
  };
  const std::uint64_t columns = columnCount(ndf, cluster);
  std::vector<float> images(columns * kBlockPixels);
  for (std::uint64_t k = 0; k < columns; ++k) {
    const bool tucker = ndf.method == CompressionMethod::tucker;
    const auto table = [&](int x, int y) {
      return x < 0 || y < 0 ? 0.0 : at(static_cast<std::uint64_t>(y * kBlockSize + x) * rx + k);
    };
    for (int p = 0; p < kBlockPixels; ++p) {
      const int x = p % kBlockSize, y = p / kBlockSize;
      const double value = ndf.method == CompressionMethod::pca
                               ? table(x, y) - table(x - 1, y) - table(x, y - 1) + table(x - 1, y - 1)
                               : along(0, rx, tucker ? k / ry : k, x) * along(kBlockSize * rx, ry, tucker ? k % ry : k, y);
      images[k * kBlockPixels + static_cast<std::size_t>(p)] = static_cast<float>(ndf.scales[cluster.first_scale + k] * value);
    }
  }
  return images;
}

/// The positive part of a slice: the sum of its pixels, negative ones taken as 0.
double positivePart(const CompressedNdf& ndf, const std::vector<float>& images, std::uint64_t first_coefficient) {
  float pixels[kBlockPixels] = {};
  for (std::size_t k = 0; k * kBlockPixels < images.size(); ++k) {
    const auto c =
        static_cast<float>(element(coefficientElement(ndf.coefficient_type), ndf.coefficients, first_coefficient + k));
    for (int p = 0; p < kBlockPixels; ++p) pixels[p] += c * images[k * kBlockPixels + static_cast<std::size_t>(p)];
  }
  double sum = 0;
  for (const float pixel : pixels) sum += std::max(0.0f, pixel);
  return sum;
}

/// Positive parts of all slices in the order of block_masses. Empty, with a finding, if block_masks contradict the clusters.
std::vector<double> positiveParts(const CompressedNdf& ndf, Findings& findings) {
  const std::vector<std::size_t> first = firstSlots(ndf);
  std::vector<std::size_t> image_of(ndf.image_slots.size());
  for (std::size_t i = 0; i < image_of.size(); ++i) image_of[first[ndf.image_regions[i]] + ndf.image_slots[i]] = i;
  const auto blocks = static_cast<std::size_t>(ndf.shape.blocksPerImage());
  const auto words = static_cast<std::size_t>(ndf.words_per_cluster),
             image_words = static_cast<std::size_t>(ndf.shape.maskWords());
  std::vector<double> parts(ndf.block_masses.size(), -1);
  for (std::size_t c = 0; c < ndf.clusters.size(); ++c) {
    const NdfCluster& cluster = ndf.clusters[c];
    if (cluster.slice_count == 0) continue;
    const std::vector<float> images = basisImages(ndf, cluster);
    const std::size_t block = c % blocks;
    std::uint64_t coefficient = cluster.first_coefficient;
    for (std::size_t slot = 0; slot < 64 * words; ++slot) {
      if ((ndf.masks[c * words + slot / 64] >> (slot % 64) & 1u) == 0) continue;
      const std::size_t image = image_of[first[c / blocks] + slot];
      const std::uint64_t* mask = &ndf.block_masks[image * image_words];
      std::size_t rank = ndf.first_block[image];
      for (std::size_t w = 0; w < block / 64; ++w) rank += static_cast<std::size_t>(std::popcount(mask[w]));
      const std::uint64_t bit = std::uint64_t{1} << (block % 64);
      rank += static_cast<std::size_t>(std::popcount(mask[block / 64] & (bit - 1)));
      if ((mask[block / 64] & bit) != 0) parts[rank] = positivePart(ndf, images, coefficient);
      coefficient += columnCount(ndf, cluster);
    }
  }
  std::uint64_t slices = 0;
  for (const NdfCluster& cluster : ndf.clusters) slices += cluster.slice_count;
  if (slices == parts.size() && std::find(parts.begin(), parts.end(), -1.0) == parts.end()) return parts;
  findings.add("compressed.block_masks", "/block_masks", "does not name the slices of the clusters");
  return {};
}

/// Checks what sampling and densities rest on: the scale of each image's positive part and the shares of its blocks.
void checkDensities(const CompressedNdf& ndf, Findings& findings) {
  constexpr double kRounding = 1e-3;  // of sums of float products
  const std::vector<double> parts = positiveParts(ndf, findings);
  if (parts.empty()) return;
  const double pixel_area = 4.0 / (static_cast<double>(ndf.shape.resolution) * ndf.shape.resolution);
  std::size_t bad_images = 0, bad_masses = 0;
  for (std::size_t i = 0; i < ndf.density_scales.size(); ++i) {
    const double scale = ndf.density_scales[i] * pixel_area;
    double integral = 0;
    for (std::uint32_t b = ndf.first_block[i]; b < ndf.first_block[i + 1]; ++b) {
      const double mass = parts[b] * scale, most = halfToFloat(static_cast<std::uint16_t>(ndf.block_masses[b] << 6));
      integral += mass;
      bad_masses += !(mass <= most * (1 + kRounding) && most <= mass * (1.0625 + kRounding) + 0x1p-17);
    }
    bad_images += !(std::abs(integral - 1) <= kIntegralTolerance) && !(scale == 0 && integral == 0);
  }
  if (bad_images > 0)
    findings.add("compressed.density_scales", "/density_scales",
                 std::to_string(bad_images) + " images do not integrate to 1 without their negative parts");
  if (bad_masses > 0)
    findings.add("compressed.block_masses", "/block_masses",
                 std::to_string(bad_masses) + " masses are not the slices' shares of their images, rounded up");
}

void checkIntegrals(const CompressedNdf& ndf, Findings& findings) {
  const std::vector<std::size_t> first = firstSlots(ndf);
  const std::vector<double> integrals = slotIntegrals(ndf, first);
  const double pixel_area = 4.0 / (static_cast<double>(ndf.shape.resolution) * ndf.shape.resolution);
  std::size_t bad = 0;
  double worst = 1;
  for (std::size_t k = 0; k < ndf.image_slots.size(); ++k) {
    const double integral = integrals[first[ndf.image_regions[k]] + ndf.image_slots[k]] * ndf.image_scales[k] * pixel_area;
    if (std::abs(integral - 1) <= kIntegralTolerance) continue;
    ++bad;
    if (!(std::abs(integral - 1) <= std::abs(worst - 1))) worst = integral;
  }
  if (bad > 0) {
    findings.add("compressed.integral", "/image_scales",
                 std::to_string(bad) + " images do not integrate to 1 (worst " + std::to_string(worst) + ")");
  }
}

template <class Condition>
void checkAll(std::uint64_t count, Condition holds, std::string_view rule, const char* object, const char* what,
              Findings& findings) {
  std::uint64_t bad = 0;
  std::uint64_t first = 0;
  for (std::uint64_t k = 0; k < count; ++k) {
    if (!holds(k) && bad++ == 0) first = k;
  }
  if (bad > 0)
    findings.add(rule, object, std::to_string(bad) + " values are " + what + " (first at " + std::to_string(first) + ")");
}

}  // namespace

PackedAsset pack(const CompressedNdf& ndf) {
  PackedAsset packed{"ndf-cp", {}, {}};
  packShape(ndf.shape, packed);
  std::uint32_t first_image = 0;
  for (int l = 0; l < ndf.shape.level_count; ++l) {
    if (ndf.first_image[l] != first_image) {
      throw Error(ErrorCode::usage, "compressed.images", {}, {}, "first_image does not count the images of the levels below");
    }
    first_image += static_cast<std::uint32_t>(ndf.shape.levels[l].imageCount());
  }
  packed.text("method", kMethods[static_cast<int>(ndf.method)]);
  packed.text("coefficient_type", kCoefficientTypes[static_cast<int>(ndf.coefficient_type)]);
  packed.integer("region_columns", ndf.region_columns);
  packed.integer("region_rows", ndf.region_rows);
  packed.integer("words_per_cluster", ndf.words_per_cluster);
  const std::uint64_t images = ndf.image_regions.size();
  const std::uint64_t regions = static_cast<std::uint64_t>(ndf.region_columns) * static_cast<std::uint64_t>(ndf.region_rows);
  const auto blocks = static_cast<std::uint64_t>(ndf.shape.blocksPerImage());
  const auto words = static_cast<std::uint64_t>(ndf.words_per_cluster);
  packed.array("image_regions", ElementType::u16, {images}, ndf.image_regions.data(), images);
  packed.array("image_slots", ElementType::u16, {images}, ndf.image_slots.data(), ndf.image_slots.size());
  packed.array("image_scales", ElementType::f32, {images}, ndf.image_scales.data(), ndf.image_scales.size());
  packed.array("density_scales", ElementType::f32, {images}, ndf.density_scales.data(), ndf.density_scales.size());
  packed.array("block_masks", ElementType::u64, {images, static_cast<std::uint64_t>(ndf.shape.maskWords())},
               ndf.block_masks.data(), ndf.block_masks.size());
  packed.array("first_block", ElementType::u32, {images + 1}, ndf.first_block.data(), ndf.first_block.size());
  packed.array("block_masses", ElementType::u8, {ndf.block_masses.size()}, ndf.block_masses.data(), ndf.block_masses.size());
  packed.array("clusters", ElementType::ndf_cluster, {regions, blocks}, ndf.clusters.data(), ndf.clusters.size());
  packed.array("masks", ElementType::u64, {regions, blocks, words}, ndf.masks.data(), ndf.masks.size());
  packed.array("mask_ranks", ElementType::u32, {regions, blocks, words}, ndf.mask_ranks.data(), ndf.mask_ranks.size());
  packed.array("basis", basisType(ndf), {ndf.basis_count}, ndf.basis, ndf.basis_count);
  packed.array("coefficients", coefficientElement(ndf.coefficient_type), {ndf.coefficient_count}, ndf.coefficients,
               ndf.coefficient_count);
  packed.array("scales", ElementType::f32, {ndf.scales.size()}, ndf.scales.data(), ndf.scales.size());
  return packed;
}

void unpack(const Content& content, CompressedNdf& ndf) {
  unpackShape(content, ndf.shape);
  ndf.method = fromText<CompressionMethod>(kMethods, content.text("method"));
  ndf.coefficient_type = fromText<CoefficientType>(kCoefficientTypes, content.text("coefficient_type"));
  ndf.region_columns = content.integer("region_columns");
  ndf.region_rows = content.integer("region_rows");
  ndf.words_per_cluster = content.integer("words_per_cluster");
  std::uint32_t first_image = 0;
  for (int l = 0; l < ndf.shape.level_count; ++l) {
    ndf.first_image[l] = first_image;
    first_image += static_cast<std::uint32_t>(ndf.shape.levels[l].imageCount());
  }
  ndf.image_regions = content.array<std::uint16_t>("image_regions");
  ndf.image_slots = content.array<std::uint16_t>("image_slots");
  ndf.image_scales = content.array<float>("image_scales");
  ndf.density_scales = content.array<float>("density_scales");
  ndf.block_masks = content.array<std::uint64_t>("block_masks");
  ndf.first_block = content.array<std::uint32_t>("first_block");
  ndf.block_masses = content.array<std::uint8_t>("block_masses");
  ndf.clusters = content.array<NdfCluster>("clusters");
  ndf.masks = content.array<std::uint64_t>("masks");
  ndf.mask_ranks = content.array<std::uint32_t>("mask_ranks");
  ndf.basis = content.dataset("basis").data;
  ndf.basis_count = content.dataset("basis").dims[0];
  ndf.coefficients = content.dataset("coefficients").data;
  ndf.coefficient_count = content.dataset("coefficients").dims[0];
  ndf.scales = content.array<float>("scales");
}

void checkIndex(const CompressedNdf& ndf, Findings& findings) {
  checkShape(ndf.shape, findings);
  const std::vector<std::uint32_t> slots = checkImages(ndf, findings);
  if (slots.empty()) return;
  checkFirstBlock(ndf, findings);
  const auto blocks = static_cast<std::size_t>(ndf.shape.blocksPerImage());
  for (std::size_t c = 0; c < ndf.clusters.size(); ++c) {
    const NdfCluster& cluster = ndf.clusters[c];
    if (const std::string_view rule = checkMask(ndf, c, slots[c / blocks]); !rule.empty()) {
      findings.add(rule, "/masks", clusterName(ndf, c) + " has a mask that does not agree with its counts");
    }
    if (cluster.slice_count == 0) continue;
    if (!ranksHold(ndf, cluster)) {
      findings.add(
          "compressed.ranks", "/clusters",
          clusterName(ndf, c) + " has ranks " + std::to_string(cluster.rank_x) + ", " + std::to_string(cluster.rank_y));
      continue;
    }
    const std::uint64_t columns = columnCount(ndf, cluster);
    if (!inside(cluster.first_basis, basisSize(ndf, cluster), ndf.basis_count) ||
        !inside(cluster.first_coefficient, cluster.slice_count * columns, ndf.coefficient_count) ||
        !inside(cluster.first_scale, columns, ndf.scales.size())) {
      findings.add("compressed.ranges", "/clusters", clusterName(ndf, c) + " reaches beyond basis, coefficients or scales");
    }
  }
}

void checkData(const CompressedNdf& ndf, Findings& findings) {
  checkAll(
      ndf.image_scales.size(), [&](std::uint64_t k) { return std::isfinite(ndf.image_scales[k]) && ndf.image_scales[k] > 0; },
      "compressed.image_scales", "/image_scales", "not finite and positive", findings);
  checkAll(
      ndf.scales.size(), [&](std::uint64_t k) { return std::isfinite(ndf.scales[k]); }, "compressed.scales", "/scales",
      "not finite", findings);
  if (ndf.coefficient_type != CoefficientType::i8) {
    const ElementType type = coefficientElement(ndf.coefficient_type);
    checkAll(
        ndf.coefficient_count, [&](std::uint64_t k) { return std::isfinite(element(type, ndf.coefficients, k)); },
        "compressed.factors", "/coefficients", "not finite", findings);
  }
  if (basisType(ndf) == ElementType::f32) {
    checkAll(
        ndf.basis_count, [&](std::uint64_t k) { return std::isfinite(element(ElementType::f32, ndf.basis, k)); },
        "compressed.factors", "/basis", "not finite", findings);
  }
  checkIntegrals(ndf, findings);
  checkDensities(ndf, findings);
}

}  // namespace glint::formats
