#pragma once

#include "glint/math/avx2.h"
#include "glint/query/detail/compressed/avx2_coefficients.h"
#include "glint/query/detail/compressed/avx2_pixels.h"
#include "glint/query/detail/compressed/avx2_prefixes.h"
#include "glint/query/detail/compressed/cluster_reader.h"

#ifdef GLINT_AVX2

namespace glint {

/// ClusterReader with vectors of eight. Each function that it replaces reads the same elements as the function of
/// ClusterReader, and returns the same bits unless the compiler fuses products and sums.
template <class Basis, class Coefficient>
class Avx2Reader : public ClusterReader<Basis, Coefficient> {
  using Base = ClusterReader<Basis, Coefficient>;
  using Coefficients = Avx2Coefficients<Coefficient>;

 public:
  using typename Base::Row;
  GLINT_AVX2 explicit Avx2Reader(const Base& reader) : Base(reader) {}

  GLINT_AVX2 void pixel(const NdfCluster& cluster, const ColumnLayout& layout, int x, int y, float* projection) const {
    avx2Pixel(this->basisOf(cluster), layout, x, y, projection);
  }

  GLINT_AVX2 float valueAlone(const NdfCluster& cluster, Row c, int x, int y) const {
    if constexpr (Basis::kIsQuickAlone) {
      const Avx2CpPixel values{this->basisOf(cluster).at(x, y)};
      const float* scales = this->scalesOf(cluster);
      Float4 sum = Float4::zero();
      int k = 0;
      for (; k + 8 <= cluster.columns; k += 8) {
        const __m256 eight = _mm256_mul_ps(_mm256_mul_ps(loadEight(scales + k), values.eight(k)), loadEight(c + k));
        sum = sum + lowFour(eight) + highFour(eight);
      }
      return Base::addRest(cluster, c, values, k, sum);
    } else {
      return 0;
    }
  }

  GLINT_AVX2 Float4 dots(const float* projection, const ColumnLayout& layout, const Row (&rows)[4]) const {
    return Coefficients::dots(projection, layout, rows);
  }

  GLINT_AVX2 void scaledCoefficients(const NdfCluster& cluster, Row c, float* scaled) const {
    Coefficients::scale(this->scalesOf(cluster), ColumnLayout(cluster), c, scaled);
  }
  GLINT_AVX2 void sliceWeights(const NdfCluster& cluster, Row c, float* weights) const {
    Base::sliceWeightsBy(*this, cluster, c, weights);
  }
  GLINT_AVX2 Float16 leastSums(const NdfCluster& cluster, const float* weights) const {
    return Base::leastSumsBy(Avx2Prefixes::Weigh(), cluster, weights);
  }
  GLINT_AVX2 Float16 rowPixels(const NdfCluster& cluster, const float* weights, int y) const {
    return Base::rowPixelsBy(Avx2Prefixes::Weigh(), cluster, weights, y);
  }
  GLINT_AVX2 void block(const NdfCluster& cluster, const float* weights, float* pixels) const {
    Base::blockBy(Avx2Prefixes::Weigh(), cluster, weights, pixels);
  }
};

}  // namespace glint

#endif
