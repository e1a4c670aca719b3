// Forces of connections on vectors of them; included once for every target.
#if defined(WEFT_LATTICE_VECTORS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef WEFT_LATTICE_VECTORS_INL_H
#undef WEFT_LATTICE_VECTORS_INL_H
#else
#define WEFT_LATTICE_VECTORS_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>

#include "core/lattice/sweep.h"
#include "core/motion/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {
// k (1 - L / l), N/m, but not below law.least (eq. 2); y = 1 / l. NaN stays NaN, so that it is
// found.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V stretch(D d, const StretchLaw<hn::TFromD<D>>& law, V y) {
  return hn::Max(hn::Set(d, law.least),
                 hn::NegMulAdd(hn::Set(d, law.rest), y, hn::Set(d, law.stiffness)));
}

// table[i]: loads one by one, for gathers are slower.
template <class D, class I, class V = hn::Vec<D>>
HWY_INLINE V look_up(D d, const hn::TFromD<D>* table, I i) {
  using T = hn::TFromD<D>;
  const hn::RebindToSigned<D> di;
  HWY_ALIGN hn::TFromD<decltype(di)> at[hn::MaxLanes(D())];
  HWY_ALIGN T values[hn::MaxLanes(D())];
  hn::Store(i, di, at);
  for (std::size_t k = 0; k < hn::Lanes(d); ++k) values[k] = table[at[k]];
  return hn::Load(d, values);
}

// Where in its table or polynomial a length lies. Of 32 equal segments, the number of that whose
// middle is nearest: in the lowest bits of a value so large that it holds no fraction.
template <BendKind kKind, class D, class V = hn::Vec<D>>
HWY_INLINE V place(D d, const BendLaw<hn::TFromD<D>>& law, V l) {
  using T = hn::TFromD<D>;
  constexpr T kWhole = sizeof(T) == 4 ? T(0x1.8p23) : T(0x1.8p52);
  const auto& t = law.to_index;
  if constexpr (kKind == BendKind::kTable32)
    return hn::MulAdd(hn::Sub(l, hn::Set(d, law.half_segment)), hn::Set(d, t[0]),
                      hn::Set(d, kWhole));
  if constexpr (kKind == BendKind::kPolynomial) return hn::Mul(l, hn::Set(d, t[0]));
  V sum = hn::MulAdd(l, hn::Set(d, t[3]), hn::Set(d, t[2]));
  sum = hn::MulAdd(l, sum, hn::Set(d, t[1]));
  return hn::Mul(l, hn::MulAdd(l, sum, hn::Set(d, t[0])));
}
// intercept / l + slope of the segment that `at` lies in. A table of 32 repeats itself: a length
// beyond it pulls at nothing. Where registers hold it, it is looked up there.
template <BendKind kKind, class D, class V = hn::Vec<D>>
HWY_INLINE V line(D d, const BendLaw<hn::TFromD<D>>& law, V at, V y) {
  using T = hn::TFromD<D>;
  const T* const a = law.intercepts.data();
  const T* const b = law.slopes.data();
  constexpr bool kEqual = kKind == BendKind::kTable32;
  constexpr bool k32 = kEqual || kKind == BendKind::kOptimalTable32;
#if HWY_TARGET == HWY_AVX3
  if constexpr (k32 && sizeof(T) == 4) {
    const __m512i i = kEqual ? _mm512_castps_si512(at.raw) : _mm512_cvttps_epi32(at.raw);
    const auto pick = [&](const T* table) HWY_ATTR {
      return V{_mm512_permutex2var_ps(hn::Load(d, table).raw, i, hn::Load(d, table + 16).raw)};
    };
    return hn::MulAdd(pick(a), y, pick(b));
  }
  if constexpr (k32 && sizeof(T) == 8) {
    const __m512i i = kEqual ? _mm512_castpd_si512(at.raw) : _mm512_cvttpd_epi64(at.raw);
    const __mmask8 upper = _mm512_test_epi64_mask(i, _mm512_set1_epi64(16));
    const auto pick = [&](const T* table) HWY_ATTR {
      const auto half = [&](const T* from) HWY_ATTR {
        return _mm512_permutex2var_pd(hn::Load(d, from).raw, i, hn::Load(d, from + 8).raw);
      };
      return V{_mm512_mask_blend_pd(upper, half(table), half(table + 16))};
    };
    return hn::MulAdd(pick(a), y, pick(b));
  }
#endif
#if HWY_TARGET == HWY_AVX2
  if constexpr (k32 && sizeof(T) == 4) {
    const __m256i i = kEqual ? _mm256_castps_si256(at.raw) : _mm256_cvttps_epi32(at.raw);
    const __m256 bit3 = _mm256_castsi256_ps(_mm256_slli_epi32(i, 28));
    const __m256 bit4 = _mm256_castsi256_ps(_mm256_slli_epi32(i, 27));
    const auto pick = [&](const T* table) HWY_ATTR {
      const auto eighth = [&](int k) HWY_ATTR {
        return _mm256_permutevar8x32_ps(hn::Load(d, table + 8 * k).raw, i);
      };
      const __m256 low = _mm256_blendv_ps(eighth(0), eighth(1), bit3);
      const __m256 high = _mm256_blendv_ps(eighth(2), eighth(3), bit3);
      return V{_mm256_blendv_ps(low, high, bit4)};
    };
    return hn::MulAdd(pick(a), y, pick(b));
  }
#endif
  const hn::RebindToSigned<D> di;
  auto i = hn::Zero(di);
  if constexpr (k32) {
    i = hn::And(kEqual ? hn::BitCast(di, at) : hn::ConvertTo(di, at), hn::Set(di, 31));
  } else {
    const V last = hn::Set(d, law.last);
    at = hn::IfThenElse(hn::Lt(at, last), at, last);  // NaN: the last
    i = hn::ConvertTo(di, hn::Max(at, hn::Zero(d)));
  }
  return hn::MulAdd(look_up(d, a, i), y, look_up(d, b, i));
}

// The polynomial, `at` = 2 l / L.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V polynomial(D d, const BendLaw<hn::TFromD<D>>& law, int terms, V at) {
  const auto* const coefficients = law.intercepts.data();
  const V t = hn::Sub(at, hn::Set(d, 1));
  V f = hn::Set(d, coefficients[0]);
  for (int k = 1; k < terms; ++k) f = hn::MulAdd(f, t, hn::Set(d, coefficients[k]));
  return f;
}

// max(f_b, c_b (l - L)) / l where negative, N/m (eq. 3 to 5); y = 1 / l.
template <BendKind kKind, class D, class V = hn::Vec<D>>
HWY_INLINE V bend(D d, const BendLaw<hn::TFromD<D>>& law, int terms, V l, V y) {
  const V at = place<kKind>(d, law, l);
  V f = hn::Zero(d);
  if constexpr (kKind == BendKind::kPolynomial)
    f = hn::Mul(polynomial(d, law, terms, at), y);
  else
    f = line<kKind>(d, law, at, y);
  const V clamp = hn::NegMulAdd(hn::Set(d, law.clamp_rest), y, hn::Set(d, law.clamp));
  return hn::Min(hn::Zero(d), hn::Max(f, clamp));
}

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
