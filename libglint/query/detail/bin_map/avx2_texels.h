#pragma once

#include <array>
#include <bit>

#include "glint/math/avx2.h"
#include "glint/query/detail/bin_map/texel_parts.h"

#ifdef GLINT_AVX2

namespace glint {

/// Reads lists eight texels at a time. Results have the same bits as SingleTexels, unless the compiler fuses products and sums.
struct Avx2Texels {
  /// PartRange for eight texels.
  struct Part {
    GLINT_AVX2 explicit Part(const PartRange& r)
        : mask(all(r.mask)),
          begin(all(r.begin)),
          span(all(r.span)),
          low(all(r.low)),
          high(all(r.high)),
          at_low(_mm256_set1_ps(r.at.low)),
          at_high(_mm256_set1_ps(r.at.high)) {}
    GLINT_AVX2 __m256 of(__m256i texels) const {
      const __m256i value = _mm256_and_si256(texels, mask);
      const __m256i inside = notAbove(_mm256_sub_epi32(value, begin), span);
      const __m256 is_low = _mm256_castsi256_ps(_mm256_cmpeq_epi32(value, low));
      const __m256 is_high = _mm256_castsi256_ps(_mm256_cmpeq_epi32(value, high));
      const __m256 upper = _mm256_blendv_ps(_mm256_set1_ps(1), at_high, is_high);
      return _mm256_and_ps(_mm256_blendv_ps(upper, at_low, is_low), _mm256_castsi256_ps(inside));
    }
    __m256i mask, begin, span, low, high;
    __m256 at_low, at_high;
  };

  /// TexelParts for eight texels.
  struct Parts {
    GLINT_AVX2 explicit Parts(const TexelParts& parts) : columns(parts.columns), rows(parts.rows) {}
    template <unsigned kCut>
    GLINT_AVX2 __m256 of(__m256i texels) const {
      if constexpr (kCut == TexelFilter::kPosition) return _mm256_mul_ps(columns.of(texels), rows.of(texels));
      if constexpr (kCut == TexelFilter::kColumn) return columns.of(texels);
      if constexpr (kCut == TexelFilter::kRow) return rows.of(texels);
      return _mm256_set1_ps(1);
    }
    Part columns, rows;
  };

  /// SingleTexels::find.
  template <unsigned kCut>
  GLINT_AVX2 static void find(const std::uint32_t* texels, int count, const Parts& parts, const SlotFields& fields,
                              FoundTexels& found) {
    const Slots slots(fields);
    int end = found.count, k = 0;
    for (; k + 8 <= count; k += 8) {
      const __m256i eight = load(texels + k);
      end = append(slots.of(eight), parts.of<kCut>(eight), found, end);
    }
    if (k < count) {
      const __m256i exist = firstLanes(count - k), some = load(texels + k, exist);
      Slots::Found some_slots = slots.of(some);
      some_slots.inside = _mm256_and_si256(some_slots.inside, exist);
      end = append(some_slots, parts.of<kCut>(some), found, end);
    }
    found.count = end;
  }

  /// SingleTexels::sum.
  template <unsigned kCut>
  GLINT_AVX2 static float sum(const std::uint32_t* texels, int count, const Parts& parts) {
    __m256 sums = _mm256_setzero_ps();
    int k = 0;
    for (; k + 8 <= count; k += 8) sums = _mm256_add_ps(sums, parts.of<kCut>(load(texels + k)));
    if (k < count) {
      const __m256i exist = firstLanes(count - k);
      sums = _mm256_add_ps(sums, _mm256_and_ps(parts.of<kCut>(load(texels + k, exist)), _mm256_castsi256_ps(exist)));
    }
    return total(sums);
  }

  /// SingleTexels::moments.
  template <unsigned kCut>
  GLINT_AVX2 static SubbinMoments moments(const std::uint32_t* texels, int count, const Parts& parts,
                                          const SubbinFields& fields) {
    Moments sums(fields);
    int k = 0;
    for (; k + 8 <= count; k += 8) {
      const __m256i eight = load(texels + k);
      sums.add(eight, parts.of<kCut>(eight));
    }
    if (k < count) {
      const __m256i exist = firstLanes(count - k), some = load(texels + k, exist);
      sums.add(some, _mm256_and_ps(parts.of<kCut>(some), _mm256_castsi256_ps(exist)));
    }
    return {total(sums.w), total(sums.x), total(sums.y), total(sums.xx), total(sums.xy), total(sums.yy)};
  }

  /// SingleTexels::lobes.
  template <unsigned kCut>
  GLINT_AVX2 static float lobes(const std::uint32_t* texels, int count, const Parts& parts, const SubbinFields& fields,
                                const SubbinLobe& lobe) {
    const Positions positions(fields);
    __m256 sums = _mm256_setzero_ps();
    int k = 0;
    for (; k + 8 <= count; k += 8) {
      const __m256i eight = load(texels + k);
      sums = _mm256_add_ps(sums, _mm256_mul_ps(parts.of<kCut>(eight), positions.lobes(eight, lobe)));
    }
    if (k < count) {
      const __m256i exist = firstLanes(count - k), some = load(texels + k, exist);
      const __m256 weights = _mm256_and_ps(parts.of<kCut>(some), _mm256_castsi256_ps(exist));
      sums = _mm256_add_ps(sums, _mm256_mul_ps(weights, positions.lobes(some, lobe)));
    }
    return total(sums);
  }

 private:
  /// SlotFields for eight texels.
  struct Slots {
    struct Found {
      __m256i slots, inside;
    };
    GLINT_AVX2 explicit Slots(const SlotFields& f)
        : shift_x(_mm_cvtsi32_si128(f.shift_x)),
          shift_y(_mm_cvtsi32_si128(f.shift_y)),
          mask(all(f.mask)),
          first_x(all(f.first_x)),
          first_y(all(f.first_y)) {}
    GLINT_AVX2 Found of(__m256i texels) const {
      const __m256i x = _mm256_add_epi32(_mm256_and_si256(_mm256_srl_epi32(texels, shift_x), mask), first_x);
      const __m256i y = _mm256_add_epi32(_mm256_and_si256(_mm256_srl_epi32(texels, shift_y), mask), first_y);
      const __m256i last = all(SlotFields::kSide - 1);
      static_assert(SlotFields::kSide == 4 + 1);
      return {_mm256_add_epi32(_mm256_add_epi32(_mm256_slli_epi32(y, 2), y), x),
              _mm256_and_si256(notAbove(x, last), notAbove(y, last))};
    }
    __m128i shift_x, shift_y;
    __m256i mask, first_x, first_y;
  };

  /// SubbinFields for eight texels.
  struct Positions {
    GLINT_AVX2 explicit Positions(const SubbinFields& f)
        : shift_x(_mm_cvtsi32_si128(f.shift_x)),
          shift_y(_mm_cvtsi32_si128(f.shift_y)),
          mask(all(static_cast<std::uint32_t>(f.mask))),
          middle(_mm256_set1_ps(f.middle)) {}
    GLINT_AVX2 __m256 x(__m256i texels) const { return position(texels, shift_x); }
    GLINT_AVX2 __m256 y(__m256i texels) const { return position(texels, shift_y); }
    GLINT_AVX2 __m256 lobes(__m256i texels, const SubbinLobe& lobe) const {
      return reinterpret_cast<__m256>(lobe.at(lanes(x(texels)), lanes(y(texels))).v);
    }

   private:
    GLINT_AVX2 static Lanes8 lanes(__m256 v) { return {reinterpret_cast<Lanes8::Floats>(v)}; }
    GLINT_AVX2 __m256 position(__m256i texels, __m128i shift) const {
      return _mm256_sub_ps(_mm256_cvtepi32_ps(_mm256_and_si256(_mm256_srl_epi32(texels, shift), mask)), middle);
    }
    __m128i shift_x, shift_y;
    __m256i mask;
    __m256 middle;
  };

  /// SubbinMoments, eight sums each.
  struct Moments {
    GLINT_AVX2 explicit Moments(const SubbinFields& f) : positions(f) {}
    GLINT_AVX2 void add(__m256i texels, __m256 weights) {
      const __m256 px = positions.x(texels), py = positions.y(texels);
      const __m256 wx = _mm256_mul_ps(weights, px), wy = _mm256_mul_ps(weights, py);
      w = _mm256_add_ps(w, weights), x = _mm256_add_ps(x, wx), y = _mm256_add_ps(y, wy);
      xx = _mm256_add_ps(xx, _mm256_mul_ps(wx, px));
      xy = _mm256_add_ps(xy, _mm256_mul_ps(wx, py));
      yy = _mm256_add_ps(yy, _mm256_mul_ps(wy, py));
    }
    Positions positions;
    __m256 w = _mm256_setzero_ps(), x = w, y = w, xx = w, xy = w, yy = w;
  };

  GLINT_AVX2 static float total(__m256 sums) {
    const __m128 four = _mm_add_ps(_mm256_castps256_ps128(sums), _mm256_extractf128_ps(sums, 1));
    const __m128 two = _mm_add_ps(four, _mm_movehl_ps(four, four));
    return _mm_cvtss_f32(_mm_add_ss(two, _mm_shuffle_ps(two, two, 1)));
  }

  /// For each set of lanes (a mask of 8 bits): the numbers of the lanes in rising order, one per byte.
  static constexpr std::array<std::uint64_t, 256> kLanesOf = [] {
    std::array<std::uint64_t, 256> table{};
    for (unsigned set = 0; set < 256; ++set)
      for (unsigned lane = 8; lane-- > 0;)
        if ((set >> lane & 1) != 0) table[set] = table[set] << 8 | lane;
    return table;
  }();

  GLINT_AVX2 static int append(const Slots::Found& eight, __m256 parts, FoundTexels& found, int end) {
    const auto set = static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(eight.inside)));
    const __m256i lanes = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<long long>(kLanesOf[set])));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(found.slots + end), _mm256_permutevar8x32_epi32(eight.slots, lanes));
    _mm256_storeu_ps(found.parts + end, _mm256_permutevar8x32_ps(parts, lanes));
    return end + std::popcount(set);
  }

  GLINT_AVX2 static __m256i all(std::uint32_t x) { return _mm256_set1_epi32(static_cast<int>(x)); }
  /// In each lane: all ones if a <= most, compared as unsigned numbers.
  GLINT_AVX2 static __m256i notAbove(__m256i a, __m256i most) { return _mm256_cmpeq_epi32(_mm256_min_epu32(a, most), a); }
  GLINT_AVX2 static __m256i firstLanes(int count) {
    return _mm256_cmpgt_epi32(_mm256_set1_epi32(count), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
  }
  GLINT_AVX2 static __m256i load(const std::uint32_t* texels) {
    return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(texels));
  }
  GLINT_AVX2 static __m256i load(const std::uint32_t* texels, __m256i lanes) {
    return _mm256_maskload_epi32(reinterpret_cast<const int*>(texels), lanes);
  }
};

}  // namespace glint

#endif
