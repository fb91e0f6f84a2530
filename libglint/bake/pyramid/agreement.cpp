#include "glint/bake/pyramid/agreement.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

#include "glint/bake/common/stored_block.h"

namespace glint::bake {
namespace {

double squaredDistance(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += double{a[k] - b[k]} * (a[k] - b[k]);
  return sum;
}

double squaredNorm(const std::vector<float>& a) {
  double sum = 0;
  for (const float v : a) sum += double{v} * v;
  return sum;
}

/// The centre of a coarser level that is nearest to a centre of a finer level, along one axis.
int nearestAlong(int finer, float finer_gap, float gap, int count) {
  return std::min(static_cast<int>((static_cast<float>(finer) + 0.5f) * finer_gap / gap), count - 1);
}

}  // namespace

void decodeImage(const NdfPyramid& pyramid, int l, std::size_t image, std::vector<float>& pixels) {
  const PyramidLevel& level = pyramid.levels[l];
  const int words = pyramid.shape.maskWords();
  pixels.assign(static_cast<std::size_t>(pyramid.shape.blocksPerImage()) * kBlockPixels, 0.0f);
  std::size_t stored = level.mask_ranks[image * words];
  for (int w = 0; w < words; ++w) {
    for (std::uint64_t mask = level.masks[image * words + w]; mask; mask &= mask - 1) {
      float* block = pixels.data() + static_cast<std::size_t>(64 * w + std::countr_zero(mask)) * kBlockPixels;
      loadStoredBlock(pyramid, level, stored++, block);
    }
  }
}

int disagreeingLevels(const PyramidShape& shape, const DecodeFn& decode) {
  int kept = shape.footprintLevels();
  while (kept > 1 && levelDisagreement(shape, kept - 2, decode) < kAgreement) --kept;
  return kept;
}

void keepLevels(PyramidShape& shape, int kept) {
  for (int l = kept; l < shape.level_count; ++l) shape.levels[l] = {};
  shape.levels[kept] = {2 * shape.levels[kept - 1].stride, 1, 1};
  shape.level_count = kept + 1;
}

double levelDisagreement(const NdfPyramid& pyramid, int level) {
  return levelDisagreement(pyramid.shape, level, [&](int l, std::size_t image, std::vector<float>& pixels) {
    decodeImage(pyramid, l, image, pixels);
  });
}

double levelDisagreement(const PyramidShape& shape, int level, const DecodeFn& decode) {
  const PyramidGrid& fine = shape.levels[level];
  const PyramidGrid& coarse = shape.levels[level + 1];
  const Vec2 gap = shape.spacing(level), coarse_gap = shape.spacing(level + 1);
  struct Sums {
    double difference = 0, norm = 0;
  };
  std::vector<Sums> sums(coarse.imageCount());
  tbb::parallel_for(std::size_t{0}, sums.size(), [&](std::size_t image) {
    const int i = static_cast<int>(image) % coarse.columns, j = static_cast<int>(image) / coarse.columns;
    std::vector<float> parent, child;
    decode(level + 1, image, parent);
    const double norm = squaredNorm(parent);
    for (int y = 0; y < fine.rows; ++y) {
      if (nearestAlong(y, gap.y, coarse_gap.y, coarse.rows) != j) continue;
      for (int x = 0; x < fine.columns; ++x) {
        if (nearestAlong(x, gap.x, coarse_gap.x, coarse.columns) != i) continue;
        decode(level, static_cast<std::size_t>(y) * fine.columns + x, child);
        sums[image].difference += squaredDistance(child, parent);
        sums[image].norm += norm;
      }
    }
  });
  Sums total;
  for (const Sums& s : sums) total.difference += s.difference, total.norm += s.norm;
  return total.norm > 0 ? std::sqrt(total.difference / total.norm) : 0;
}

}  // namespace glint::bake
