#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "glint/formats/kinds/description.h"
#include "glint/formats/kinds/near_fields.h"
#include "glint/formats/kinds/shared_fields.h"
#include "glint/formats/kinds/tally.h"
#include "glint/formats/kinds/wang_fields.h"
#include "glint/formats/kinds/wave_fields.h"
#include "glint/formats/number_text.h"
#include "glint/math/half.h"

namespace glint::formats {
namespace {

constexpr double kIntegralTolerance = 1e-3;

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

double element(ElementType type, const void* data, std::uint64_t index) {
  switch (type) {
    case ElementType::i8:
      return static_cast<const std::int8_t*>(data)[index];
    case ElementType::f16:
      return ieeeHalfToFloat(static_cast<const std::uint16_t*>(data)[index]);
    default:
      return static_cast<const float*>(data)[index];
  }
}

/// Whether the sizes of a cluster with slices fit its method and type.
bool ranksHold(const NdfCp& ndf, const NdfCluster& cluster) {
  const bool i8 = ndf.coefficient_type == CoefficientType::i8;
  if (cluster.columns == 0) return i8 && cluster.narrow_columns == 0 && !ndf.spot_sums.empty();
  if (cluster.columns > kBlockPixels || cluster.narrow_columns > (i8 ? cluster.columns : 0)) return false;
  if (ndf.method != CompressionMethod::tucker) return cluster.rank_x == 0 && cluster.rank_y == 0;
  return cluster.rank_x >= 1 && cluster.rank_x <= kBlockSize && cluster.rank_y >= 1 && cluster.rank_y <= kBlockSize;
}

bool inside(std::uint64_t first, std::uint64_t count, std::uint64_t size) { return first <= size && count <= size - first; }

std::string clusterName(const NdfCp& ndf, std::size_t cluster) {
  const auto places = static_cast<std::size_t>(ndf.places);
  return "cluster [" + std::to_string(cluster / places) + "][" + std::to_string(cluster % places) + "]";
}

/// Checks regions and slots of images. Returns the number of slots of each region; empty if they are wrong.
std::vector<std::uint32_t> checkImages(const NdfCp& ndf, Findings& findings) {
  const std::size_t images = imageCount(ndf.shape);
  if (ndf.image_slots.size() != images || images > UINT32_MAX) {
    findings.add("compressed.images", "/image_slots",
                 "holds " + std::to_string(ndf.image_slots.size()) + " images, the levels " + std::to_string(images));
    return {};
  }
  const auto regions = static_cast<std::size_t>(ndf.regions);
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
    if (slot >= slots[region] || used[first[region] + slot]) {
      findings.add("compressed.slots", "/image_slots",
                   "image " + std::to_string(k) + " has an invalid or used slot " + std::to_string(slot));
      return {};
    }
    used[first[region] + slot] = true;
  }
  return slots;
}

/// Checks that places and blocks name each other.
bool checkPlaces(const NdfCp& ndf, Findings& findings) {
  const auto blocks = static_cast<std::size_t>(ndf.shape.blocksPerImage());
  bool holds = true;
  std::size_t next = 0;
  for (std::size_t block = 0; block < blocks; ++block) {
    const std::uint16_t place = ndf.block_places[block];
    if (place == kNoBlockPlace) continue;
    holds = holds && place == next && next < ndf.place_blocks.size() && ndf.place_blocks[next] == block;
    ++next;
  }
  holds = holds && next == ndf.place_blocks.size();
  if (!holds) findings.add("compressed.places", "/block_places", "does not number the blocks of place_blocks");
  return holds;
}

void checkFirstBlock(const NdfCp& ndf, Findings& findings) {
  const auto words = static_cast<std::size_t>(ndf.placeWords());
  const int tail_bits = ndf.places % 64;
  const std::uint64_t beyond = tail_bits == 0 ? 0 : ~std::uint64_t{0} << tail_bits;
  std::uint64_t count = 0;
  bool holds = true;
  for (std::size_t image = 0; image < ndf.image_slots.size(); ++image) {
    holds &= ndf.first_block[image] == count;
    const std::uint64_t* mask = ndf.block_masks.data() + image * words;
    for (std::size_t w = 0; w < words; ++w) count += static_cast<std::uint64_t>(std::popcount(mask[w]));
    holds = holds && (words == 0 || (mask[words - 1] & beyond) == 0);
  }
  holds &= ndf.first_block[ndf.image_slots.size()] == count && count == ndf.block_masses.size();
  if (!holds) findings.add("compressed.first_block", "/first_block", "is not the running count of the bits in block_masks");
}

/// Checks the mask of one cluster, whose words are inside the array. Returns the broken rule, or nothing.
std::string_view checkMask(const NdfCp& ndf, const NdfCluster& cluster, std::uint32_t slots) {
  const std::size_t words = (slots + 63) / 64;
  std::uint32_t count = 0;
  for (std::size_t w = 0; w < words; ++w) {
    const std::uint64_t mask = ndf.masks[cluster.first_word + w];
    if (ndf.mask_ranks[cluster.first_word + w] != count) return "compressed.mask_ranks";
    const std::uint64_t valid = slots - 64 * w >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << (slots - 64 * w)) - 1;
    if ((mask & ~valid) != 0) return "compressed.masks";
    count += static_cast<std::uint32_t>(std::popcount(mask));
  }
  return count == cluster.slice_count ? std::string_view() : "compressed.masks";
}

/// Whether the counts of a cluster of spots agree and its spots are inside the array and near the block.
bool spotsHold(const NdfCp& ndf, const NdfCluster& cluster) {
  const std::uint64_t head = firstSpotOffset(cluster.slice_count);
  if (cluster.first_coefficient % sizeof(NdfSpot) != 0 || !inside(cluster.first_coefficient, head, ndf.coefficient_count))
    return false;
  const auto* first = static_cast<const std::uint8_t*>(ndf.coefficients) + cluster.first_coefficient;
  std::uint64_t total = 0;
  for (std::uint32_t s = 0; s < cluster.slice_count; ++s) {
    std::uint32_t before;
    std::memcpy(&before, first + 4 * (s / kSpotGroup), sizeof before);
    if (s % kSpotGroup == 0 && before != total) return false;
    total += first[spotCountsOffset(cluster.slice_count) + s];
  }
  if (!inside(cluster.first_coefficient, head + total * sizeof(NdfSpot) + kRowPadding, ndf.coefficient_count)) return false;
  const auto* spots = reinterpret_cast<const NdfSpot*>(first + head);
  return std::all_of(spots, spots + total, [](const NdfSpot& s) { return s.x <= kLastSpotPlace && s.y <= kLastSpotPlace; });
}

/// Whether the pairs of functions of a cluster's columns are below its ranks.
bool coreHolds(const NdfCp& ndf, const NdfCluster& cluster) {
  const auto* core = ndf.core.data() + cluster.first_scale;
  return std::all_of(core, core + cluster.columns, [&](std::uint8_t pair) {
    return pair % kBlockSize < cluster.rank_x && pair / kBlockSize < cluster.rank_y;
  });
}

/// Checks where the factors of a cluster with slices are. Returns the broken rule, or nothing.
std::string_view checkFactors(const NdfCp& ndf, const NdfCluster& cluster) {
  if (!ranksHold(ndf, cluster)) return "compressed.ranks";
  const std::uint64_t columns = cluster.columns == 0 ? 2 : cluster.columns;
  if (!inside(cluster.first_scale, columns, ndf.scales.size())) return "compressed.ranges";
  if (cluster.columns == 0) return spotsHold(ndf, cluster) ? std::string_view() : "compressed.spots";
  const bool tucker = ndf.method == CompressionMethod::tucker;
  if (!inside(cluster.first_basis, static_cast<std::uint64_t>(basisElements(ndf.method, cluster)), ndf.basis.size()) ||
      !inside(cluster.first_coefficient,
              static_cast<std::uint64_t>(cluster.slice_count) * static_cast<std::uint64_t>(rowElements(cluster)) + kRowPadding,
              ndf.coefficient_count) ||
      (tucker && !inside(cluster.first_scale, columns, ndf.core.size())))
    return "compressed.ranges";
  return !tucker || coreHolds(ndf, cluster) ? std::string_view() : "compressed.ranks";
}

/// Number of the first slot of each region, in one list of the slots of all regions.
std::vector<std::size_t> firstSlots(const NdfCp& ndf) {
  std::vector<std::size_t> first(static_cast<std::size_t>(ndf.regions) + 1);
  for (const std::uint16_t region : ndf.image_regions) ++first[region + 1u];
  for (std::size_t r = 0; r < static_cast<std::size_t>(ndf.regions); ++r) first[r + 1] += first[r];
  return first;
}

/// Basis images of a cluster with their scales, [columns][256].
std::vector<float> basisImages(const NdfCp& ndf, const NdfCluster& cluster) {
  const auto at = [&](std::uint64_t index) { return static_cast<double>(ndf.basis[cluster.first_basis + index]); };
  const bool tucker = ndf.method == CompressionMethod::tucker;
  const std::uint64_t columns = cluster.columns, rx = tucker ? cluster.rank_x : columns, ry = tucker ? cluster.rank_y : columns;
  const auto along = [&](std::uint64_t first, std::uint64_t rank, std::uint64_t k, int t) {
    const auto row = [&](int r) { return at(first + static_cast<std::uint64_t>(r) * rank + k); };
    return t > 0 ? row(t) - row(t - 1) : row(0);
  };
  std::vector<float> images(columns * kBlockPixels);
  for (std::uint64_t k = 0; k < columns; ++k) {
    const std::uint64_t a = tucker ? ndf.core[cluster.first_scale + k] % kBlockSize : k;
    const std::uint64_t b = tucker ? ndf.core[cluster.first_scale + k] / kBlockSize : k;
    const auto table = [&](int x, int y) {
      return x < 0 || y < 0 ? 0.0 : at(static_cast<std::uint64_t>(y * kBlockSize + x) * columns + k);
    };
    for (int p = 0; p < kBlockPixels; ++p) {
      const int x = p % kBlockSize, y = p / kBlockSize;
      const double value = ndf.method == CompressionMethod::pca
                               ? table(x, y) - table(x - 1, y) - table(x, y - 1) + table(x - 1, y - 1)
                               : along(0, rx, a, x) * along(kBlockSize * rx, ry, b, y);
      images[k * kBlockPixels + static_cast<std::size_t>(p)] = static_cast<float>(ndf.scales[cluster.first_scale + k] * value);
    }
  }
  return images;
}

/// Coefficient k of a slice.
float coefficient(const NdfCp& ndf, const NdfCluster& cluster, std::uint64_t slice, int k) {
  const std::uint64_t row = cluster.first_coefficient + slice * static_cast<std::uint64_t>(rowElements(cluster));
  const int wide = cluster.columns - cluster.narrow_columns, half = (cluster.narrow_columns + 1) / 2, j = k - wide;
  if (j < 0)
    return static_cast<float>(
        element(coefficientElement(ndf.coefficient_type), ndf.coefficients, row + static_cast<std::uint64_t>(k)));
  const auto byte = static_cast<const std::uint8_t*>(ndf.coefficients)[row + static_cast<std::uint64_t>(wide + j % half)];
  const int bits = j < half ? byte & 15 : byte >> 4;
  return static_cast<float>(bits < 8 ? bits : bits - 16);
}

/// Sums over the pixels of a slice.
struct SliceSums {
  double sum = 0;
  double positive = 0;  ///< of pixels less their floors, negative ones taken as 0
};

/// @param floors  [kBlockPixels]
SliceSums sumsOf(const float* pixels, const float* floors) {
  SliceSums sums;
  for (int p = 0; p < kBlockPixels; ++p) {
    sums.sum += pixels[p];
    sums.positive += std::max(0.0f, pixels[p] - floors[p]);
  }
  return sums;
}

/// Floors of the pixels of cluster c, [kBlockPixels].
std::vector<float> pixelFloors(const NdfCp& ndf, std::size_t c) {
  std::vector<float> floors(kBlockPixels);
  const float unit = ieeeHalfToFloat(ndf.clusters[c].floor_unit);
  for (int p = 0; p < kBlockPixels; ++p) {
    const auto cell = static_cast<std::size_t>(floorCell(p % kBlockSize, p / kBlockSize));
    floors[static_cast<std::size_t>(p)] =
        unit * ieeeHalfToFloat(static_cast<std::uint16_t>(ndf.floors[c * kFloorCells + cell] << 6));
  }
  return floors;
}

/// Adds the spots of a slice to its pixels.
/// @param first  number of the slice's first spot in the cluster
void addSpots(const NdfCp& ndf, const NdfCluster& cluster, std::uint64_t first, int count, float* pixels) {
  const auto* bytes = static_cast<const std::uint8_t*>(ndf.coefficients) + cluster.first_coefficient;
  const auto* spots = reinterpret_cast<const NdfSpot*>(bytes + firstSpotOffset(cluster.slice_count)) + first;
  const auto share = [&](int pixel, int place) {
    const float* edge = &ndf.spot_sums[static_cast<std::size_t>(kSpotSteps * pixel + kLastSpotPlace - place)];
    return edge[kSpotSteps] - edge[0];
  };
  for (int k = 0; k < count; ++k)
    for (int p = 0; p < kBlockPixels; ++p)
      pixels[p] += ndf.scales[cluster.first_scale] * static_cast<float>(spots[k].weight) * share(p % kBlockSize, spots[k].x) *
                   share(p / kBlockSize, spots[k].y);
}

/// Sums of all slices of a cluster.
std::vector<SliceSums> clusterSums(const NdfCp& ndf, std::size_t c) {
  const NdfCluster& cluster = ndf.clusters[c];
  const std::vector<float> floors = pixelFloors(ndf, c);
  std::vector<SliceSums> sums;
  const std::vector<float> images = basisImages(ndf, cluster);
  const std::uint8_t* counts =
      static_cast<const std::uint8_t*>(ndf.coefficients) + cluster.first_coefficient + spotCountsOffset(cluster.slice_count);
  std::uint64_t spots = 0;
  for (std::uint32_t s = 0; s < cluster.slice_count; ++s) {
    float pixels[kBlockPixels] = {};
    if (cluster.columns == 0) {
      const int count = counts[s];
      const float rest = ieeeHalfToFloat(static_cast<std::uint16_t>(counts[cluster.slice_count + s] << 6));
      std::fill_n(pixels, kBlockPixels, ndf.scales[cluster.first_scale + 1] * rest);
      addSpots(ndf, cluster, spots, count, pixels);
      spots += static_cast<std::uint64_t>(count);
    }
    for (int k = 0; k < cluster.columns; ++k) {
      const float weight = coefficient(ndf, cluster, s, k);
      const float* image = images.data() + k * kBlockPixels;
      for (int p = 0; p < kBlockPixels; ++p) pixels[p] += weight * image[p];
    }
    sums.push_back(sumsOf(pixels, floors.data()));
  }
  return sums;
}

/// Sums of all slices in the order of block_masses. Empty, with a finding, if block_masks contradict the clusters.
std::vector<SliceSums> sliceSums(const NdfCp& ndf, Findings& findings) {
  const std::vector<std::size_t> first = firstSlots(ndf);
  std::vector<std::size_t> image_of(ndf.image_slots.size());
  for (std::size_t i = 0; i < image_of.size(); ++i) image_of[first[ndf.image_regions[i]] + ndf.image_slots[i]] = i;
  const auto places = static_cast<std::size_t>(ndf.places), image_words = static_cast<std::size_t>(ndf.placeWords());
  std::vector<SliceSums> all(ndf.block_masses.size());
  std::uint64_t slices = 0, named = 0;
  for (std::size_t c = 0; c < ndf.clusters.size(); ++c) {
    const NdfCluster& cluster = ndf.clusters[c];
    if (cluster.slice_count == 0) continue;
    const std::vector<SliceSums> sums = clusterSums(ndf, c);
    const std::size_t place = c % places, region = c / places;
    const std::uint64_t bit = std::uint64_t{1} << (place % 64);
    std::size_t slice = 0;
    for (std::size_t slot = 0; slot < first[region + 1] - first[region]; ++slot) {
      if ((ndf.masks[cluster.first_word + slot / 64] >> (slot % 64) & 1u) == 0) continue;
      const std::size_t image = image_of[first[region] + slot];
      const std::uint64_t* mask = &ndf.block_masks[image * image_words];
      std::size_t rank = ndf.first_block[image];
      for (std::size_t w = 0; w < place / 64; ++w) rank += static_cast<std::size_t>(std::popcount(mask[w]));
      rank += static_cast<std::size_t>(std::popcount(mask[place / 64] & (bit - 1)));
      if ((mask[place / 64] & bit) != 0) {
        all[rank] = sums[slice];
        ++named;
      }
      ++slice;
    }
    slices += cluster.slice_count;
  }
  if (slices == all.size() && named == slices) return all;
  findings.add("compressed.block_masks", "/block_masks", "does not name the slices of the clusters");
  return {};
}

/// Checks what means, densities and sampling rest on: the scales of each image and the shares of its blocks.
void checkDensities(const NdfCp& ndf, Findings& findings) {
  constexpr double kRounding = 1e-3;  // of sums of float products
  const std::vector<SliceSums> sums = sliceSums(ndf, findings);
  if (sums.size() != ndf.block_masses.size()) return;
  const double pixel_area = 4.0 / (static_cast<double>(ndf.shape.resolution) * ndf.shape.resolution);
  std::size_t bad_integrals = 0, bad_images = 0, bad_masses = 0;
  double worst = 1;
  for (std::size_t i = 0; i < ndf.density_scales.size(); ++i) {
    const double scale = ndf.density_scales[i] * pixel_area;
    double integral = 0, signed_integral = 0;
    for (std::uint32_t b = ndf.first_block[i]; b < ndf.first_block[i + 1]; ++b) {
      const double mass = sums[b].positive * scale,
                   most = ieeeHalfToFloat(static_cast<std::uint16_t>(ndf.block_masses[b] << 6));
      integral += mass;
      signed_integral += sums[b].sum * ndf.image_scales[i] * pixel_area;
      bad_masses += !(mass <= most * (1 + kRounding) && most <= mass * (1.0625 + kRounding) + 0x1p-17);
    }
    bad_images += !(std::abs(integral - 1) <= kIntegralTolerance) && !(scale == 0 && integral == 0);
    if (std::abs(signed_integral - 1) <= kIntegralTolerance) continue;
    ++bad_integrals;
    if (!(std::abs(signed_integral - 1) <= std::abs(worst - 1))) worst = signed_integral;
  }
  if (bad_integrals > 0)
    findings.add("compressed.integral", "/image_scales",
                 counted(bad_integrals, {"image does", "images do"}) + " not integrate to 1 (worst " + numberText(worst) + ")");
  if (bad_images > 0)
    findings.add("compressed.density_scales", "/density_scales",
                 counted(bad_images, {"image does", "images do"}) + " not integrate to 1 above the floors");
  if (bad_masses > 0)
    findings.add("compressed.block_masses", "/block_masses",
                 counted(bad_masses, {"mass is", "masses are"}) + " not a slice's share of its image, rounded up");
}

/// Numbers the images of all levels.
void describeImages(Fields auto& fields, auto& ndf) {
  std::uint32_t first_image = 0;
  for (int l = 0; l < ndf.shape.level_count; ++l) {
    fields.set(ndf.first_image[l], first_image);
    if (ndf.first_image[l] != first_image)
      throw Error(ErrorCode::usage, "compressed.images", {}, {}, "first_image does not count the images of the levels below");
    first_image += static_cast<std::uint32_t>(ndf.shape.levels[l].imageCount());
  }
  fields.array("image_regions", ndf.image_regions, {"images"}, "1", "region that an image belongs to");
  fields.array("image_slots", ndf.image_slots, {"images"}, "1", "slot of an image in its region");
  fields.array("image_scales", ndf.image_scales, {"images"}, "1", "factor that makes an image integrate to 1");
  fields.array("density_scales", ndf.density_scales, {"images"}, "1",
               "factor that makes an image, less its floors and without negative parts, integrate to 1");
  fields.array("block_places", ndf.block_places, {"blocks_per_image"}, "1", "place of a block; 65535: it occurs in no image");
  fields.array("place_blocks", ndf.place_blocks, {"places"}, "1", "block of a place");
  fields.array("block_masks", ndf.block_masks, {"images", "place_words"}, "1",
               "bit b of word w: the block of place 64 w + b of the image has a slice");
  fields.array("first_block", ndf.first_block, {"images + 1"}, "1",
               "slices of all images before this one; the last value is their total");
  fields.array("block_masses", ndf.block_masses, {"slice_total"}, "1",
               "share of each slice in its image, rounded up: bits 6 to 13 of a half-precision number");
}

/// The factors of the clusters.
void describeClusters(Fields auto& fields, auto& ndf) {
  using enum ElementType;
  fields.array("clusters", ndf.clusters, {"regions", "places"}, "1", "place and size of each cluster's factors");
  fields.array("masks", ndf.masks, {"word_count"}, "1", "bit b of word w of a cluster: slot 64 w + b has a slice in it");
  fields.array("mask_ranks", ndf.mask_ranks, {"word_count"}, "1", "set bits of the cluster before this word");
  fields.array("basis", ndf.basis, {"basis_count"}, "1", "inclusive prefix sums of each cluster's basis, columns fastest");
  fields.data("coefficients", ndf.coefficients, ndf.coefficient_count,
              {{"coefficient_type=i8", i8}, {"coefficient_type=f16", f16}, {"coefficient_type=f32", f32}},
              {"coefficient_count"}, "1", "coefficients of each cluster, a row for each slice; or its spots");
  fields.array("scales", ndf.scales, {"scale_count"}, "1", "scale of each column of each cluster");
  fields.array("core", ndf.core, {"core_count"}, "1", "tucker: a + 16 b of each column of each cluster");
  fields.array("floors", ndf.floors, {"regions", "places", "16"}, "1",
               "floor of each cell over the floor_unit of the cluster: bits 6 to 13 of a half-precision number");
  fields.array("spot_sums", ndf.spot_sums, {"spot_sum_count"}, "1", "share of a spot up to edges of pixels, or nothing");
}

}  // namespace

template <>
struct KindDescription<NdfCp> {
  static constexpr std::string_view kTitle = "Compressed pyramid of NDF images";

  static std::vector<Rule> indexRules() {
    return {errorRule("compressed.images", "there is one record for each image of each level"),
            errorRule("compressed.slots", "images have valid regions, and slots 0..n-1 in each region"),
            errorRule("compressed.places", "block_places number the blocks of place_blocks in turn"),
            errorRule("compressed.masks", "mask bits are slots of the region and their number is slice_count"),
            errorRule("compressed.mask_ranks", "mask_ranks is the running count of mask bits"),
            errorRule("compressed.first_block", "first_block is the running count of the bits of block_masks"),
            errorRule("compressed.ranks", "cluster ranks are valid for the method"),
            errorRule("compressed.ranges", "every cluster's factors lie inside their arrays"),
            errorRule("compressed.spots", "spots are near their block, and their counts agree")};
  }
  static std::vector<Rule> valueRules() {
    return {errorRule("compressed.image_scales", "image_scales are finite and positive"),
            errorRule("compressed.density_scales", "density_scales make the parts of images above their floors integrate to 1"),
            errorRule("compressed.block_masks", "block_masks name the slices of the clusters"),
            errorRule("compressed.block_masses", "block_masses are the shares of the slices, rounded up"),
            errorRule("compressed.scales", "scales are finite"),
            errorRule("compressed.floors", "units of floors are finite and not negative, and 0 for clusters of spots"),
            errorRule("compressed.factors", "coefficients are finite, and sums of spots between 0 and 1"),
            warningRule("compressed.integral", "every image integrates to 1 within 1e-3")};
  }

  static void describe(Fields auto& fields, auto& ndf) {
    describeShape(fields, ndf.shape);
    describeNearNormals(fields, ndf);
    describeCompression(fields, ndf);
    describeNearArrays(fields, ndf);
  }
  /// Everything but the shape.
  static void describeCompression(Fields auto& fields, auto& ndf) {
    fields.choice("method", ndf.method, "cp|tucker|pca", "how the basis images of a cluster are made");
    fields.choice("coefficient_type", ndf.coefficient_type, "i8|f16|f32", "type of the stored coefficients");
    fields.integer("regions", ndf.regions, {1, 65535}, "1", "regions of images, by place on the map or by level");
    fields.integer("places", ndf.places, {0, 4096}, "1", "angular blocks that occur in any image");
    fields.derived("blocks_per_image", "ceil_div(resolution * resolution, 256)", "angular blocks of an image");
    fields.derived("place_words", "ceil_div(places, 64)", "64-bit words of occupancy bits of an image");
    describeImages(fields, ndf);
    describeClusters(fields, ndf);
  }

  static void checkIndex(const NdfCp& ndf, Findings& findings) {
    checkShape(ndf.shape, findings);
    checkNearIndex(ndf.near_normals, findings);
    checkFactorIndex(ndf, findings);
  }
  /// Everything but the shape.
  static void checkFactorIndex(const NdfCp& ndf, Findings& findings) {
    const std::vector<std::uint32_t> slots = checkImages(ndf, findings);
    if (slots.empty()) return;
    if (!checkPlaces(ndf, findings)) return;
    checkFirstBlock(ndf, findings);
    if (!ndf.spot_sums.empty() && ndf.spot_sums.size() != static_cast<std::size_t>(kSpotSums)) {
      findings.add("compressed.spots", "/spot_sums", "does not have " + std::to_string(kSpotSums) + " values");
      return;
    }
    const auto places = static_cast<std::size_t>(ndf.places);
    for (std::size_t c = 0; c < ndf.clusters.size(); ++c) {
      const NdfCluster& cluster = ndf.clusters[c];
      const std::uint32_t region_slots = slots[c / places];
      if (!inside(cluster.first_word, (region_slots + 63) / 64, ndf.masks.size())) {
        findings.add("compressed.ranges", "/clusters", clusterName(ndf, c) + " reaches beyond the masks");
        continue;
      }
      if (const std::string_view rule = checkMask(ndf, cluster, region_slots); !rule.empty())
        findings.add(rule, "/masks", clusterName(ndf, c) + " has a mask that does not agree with its counts");
      if (cluster.slice_count == 0) continue;
      if (const std::string_view rule = checkFactors(ndf, cluster); !rule.empty())
        findings.add(rule, "/clusters",
                     clusterName(ndf, c) + ", " + std::to_string(cluster.columns) + " columns, has factors that do not fit");
    }
  }

  static void checkValues(const NdfCp& ndf, Findings& findings) {
    const Subject values = {"value is", "values are"};
    reportUnless(
        ndf.image_scales.size(), [&](std::size_t k) { return std::isfinite(ndf.image_scales[k]) && ndf.image_scales[k] > 0; },
        "compressed.image_scales", "/image_scales", values, "not finite and positive", findings);
    reportUnless(
        ndf.scales.size(), [&](std::size_t k) { return std::isfinite(ndf.scales[k]); }, "compressed.scales", "/scales", values,
        "not finite", findings);
    if (ndf.coefficient_type != CoefficientType::i8) {
      const ElementType type = coefficientElement(ndf.coefficient_type);
      reportUnless(
          ndf.coefficient_count, [&](std::size_t k) { return std::isfinite(element(type, ndf.coefficients, k)); },
          "compressed.factors", "/coefficients", values, "not finite", findings);
    }
    reportUnless(
        ndf.spot_sums.size(), [&](std::size_t k) { return ndf.spot_sums[k] >= 0 && ndf.spot_sums[k] <= 1; },
        "compressed.factors", "/spot_sums", values, "not between 0 and 1", findings);
    reportUnless(
        ndf.clusters.size(),
        [&](std::size_t k) {
          const NdfCluster& cluster = ndf.clusters[k];
          return cluster.slice_count == 0 || cluster.floor_unit <= (cluster.columns > 0 ? kLargestHalf : 0);
        },
        "compressed.floors", "/clusters", {"unit of floors is", "units of floors are"},
        "negative or not finite, or not 0 for a cluster of spots", findings);
    checkDensities(ndf, findings);
    checkNearValues(ndf.near_normals, findings);
  }
};

template const Kind& kindOf<NdfCp>();

template <>
struct KindDescription<WangCp> {
  static constexpr std::string_view kTitle = "Compressed pyramid of NDF images of Wang tiles";

  static std::vector<Rule> indexRules() { return {}; }
  static std::vector<Rule> valueRules() { return {}; }

  static void describe(Fields auto& fields, auto& ndf) {
    describeTileImages(fields, ndf.plane, ndf.images.shape);
    KindDescription<NdfCp>::describeCompression(fields, ndf.images);
    describeTileMasses(fields, ndf.plane, ndf.images.shape);
  }

  static void checkIndex(const WangCp& ndf, Findings& findings) {
    checkTileImages(ndf.plane, ndf.images.shape, findings);
    KindDescription<NdfCp>::checkFactorIndex(ndf.images, findings);
  }

  static void checkValues(const WangCp& ndf, Findings& findings) {
    checkTileMasses(ndf.plane, ndf.images.shape, findings);
    KindDescription<NdfCp>::checkValues(ndf.images, findings);
  }
};

template const Kind& kindOf<WangCp>();

template <>
struct KindDescription<WaveCp> {
  static constexpr std::string_view kTitle = "Compressed pyramid of NDF images under wave optics";

  static std::vector<Rule> indexRules() { return {}; }
  static std::vector<Rule> valueRules() { return {}; }

  static void describe(Fields auto& fields, auto& wave) {
    describeShape(fields, wave.shape);
    describeChannels(fields, wave);
    fields.set(wave.images.shape, channelShape(wave.shape, wave.channels));
    KindDescription<NdfCp>::describeCompression(fields, wave.images);
  }

  static void checkIndex(const WaveCp& wave, Findings& findings) {
    checkShape(wave.shape, findings);
    checkChannels(wave.meaning, wave.channels, wave.wavelengths_um, wave.channel_rgb, findings);
    KindDescription<NdfCp>::checkFactorIndex(wave.images, findings);
  }

  static void checkValues(const WaveCp& wave, Findings& findings) {
    KindDescription<NdfCp>::checkValues(wave.images, findings);
  }
};

template const Kind& kindOf<WaveCp>();

}  // namespace glint::formats
