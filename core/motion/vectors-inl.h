// Vectors of three-dimensional vectors; included once for every target.
#if defined(WEFT_VECTORS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef WEFT_VECTORS_INL_H
#undef WEFT_VECTORS_INL_H
#else
#define WEFT_VECTORS_INL_H
#endif

#include <hwy/highway.h>

#include <array>
#include <cstddef>
#include <utility>

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET != HWY_SCALAR
// As many values from each of several places as fill 128 bits: place(k) is where lane k, the first
// of these, and what follows it are read.
template <class D, class F>
HWY_INLINE hn::Vec<D> load_parts(D d, const F& place, std::size_t first = 0) {
  if constexpr (hn::MaxLanes(D()) * sizeof(hn::TFromD<D>) <= 16) {
    return hn::LoadU(d, place(first));
  } else {
    const hn::Half<D> half;
    return hn::Combine(d, load_parts(half, place, first + hn::MaxLanes(half)),
                       load_parts(half, place, first));
  }
}
#endif

template <class V>
struct Triple {
  V x, y, z;
};
template <class V>
HWY_INLINE Triple<V> minus(const Triple<V>& a, const Triple<V>& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
template <class V>
HWY_INLINE Triple<V> plus(const Triple<V>& a, const Triple<V>& b) {
  return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
template <class V>
HWY_INLINE Triple<V> times(const Triple<V>& a, V s) {
  return {hn::Mul(a.x, s), hn::Mul(a.y, s), hn::Mul(a.z, s)};
}
// b + a s
template <class V>
HWY_INLINE Triple<V> plus_times(const Triple<V>& b, const Triple<V>& a, V s) {
  return {hn::MulAdd(a.x, s, b.x), hn::MulAdd(a.y, s, b.y), hn::MulAdd(a.z, s, b.z)};
}
// b - a s
template <class V>
HWY_INLINE Triple<V> minus_times(const Triple<V>& b, const Triple<V>& a, V s) {
  return {hn::NegMulAdd(a.x, s, b.x), hn::NegMulAdd(a.y, s, b.y), hn::NegMulAdd(a.z, s, b.z)};
}
template <class V>
HWY_INLINE V squared(const Triple<V>& a) {
  return hn::MulAdd(a.z, a.z, hn::MulAdd(a.y, a.y, hn::Mul(a.x, a.x)));
}

// |a|, not below 1e-15 m: 1 / |a| is finite.
template <class V>
HWY_INLINE V length(const Triple<V>& a) {
  const hn::DFromV<V> d;
  const V least = hn::Set(d, static_cast<hn::TFromD<decltype(d)>>(1e-30));
  return hn::Sqrt(hn::MulAdd(a.z, a.z, hn::MulAdd(a.y, a.y, hn::MulAdd(a.x, a.x, least))));
}

template <class V>
HWY_INLINE V dot(const Triple<V>& a, const Triple<V>& b) {
  return hn::MulAdd(a.z, b.z, hn::MulAdd(a.y, b.y, hn::Mul(a.x, b.x)));
}
// a x b
template <class V>
HWY_INLINE Triple<V> product(const Triple<V>& a, const Triple<V>& b) {
  return {hn::NegMulAdd(a.z, b.y, hn::Mul(a.y, b.z)), hn::NegMulAdd(a.x, b.z, hn::Mul(a.z, b.x)),
          hn::NegMulAdd(a.y, b.x, hn::Mul(a.x, b.y))};
}

// Of N connections that are evaluated side by side: their long chains of operations then fill the
// processor.
template <class A, std::size_t N>
using Each = std::array<A, N>;

template <class F, std::size_t... k, class... A>
HWY_INLINE auto each_of(const F& f, std::index_sequence<k...>, const A&... a) {
  const auto at = [&](auto i) HWY_ATTR { return f(a[i]...); };
  return std::array{at(std::integral_constant<std::size_t, k>())...};
}
template <class F, class A, std::size_t N, class... B>
HWY_INLINE auto each(const F& f, const Each<A, N>& a, const B&... b) {
  return each_of(f, std::make_index_sequence<N>(), a, b...);
}

// 1 / sqrt(v s^2) where the start s leaves v s^2 within 3/4 ... 27/32: minimax in kCentre - v s^2,
// highest power first, right to 1.2e-8 in single and 2.9e-10 in double precision.
template <class T>
struct InverseSqrt {
  static constexpr double kCentre = 0.796875;
  static constexpr std::array kPolynomial = {0.86232574451111188, 0.76289427998580939,
                                             0.69180123460826881, 0.66153677950956102,
                                             0.70288569050604333, 1.1202240675512909};
};
// The centre is one where the last coefficient is a float: rounded, it would make every connection
// longer by the same 5e-8.
template <>
struct InverseSqrt<float> {
  static constexpr double kCentre = 0.79674553871154785;
  static constexpr std::array kPolynomial = {0.76284469835884662, 0.69456468875051158,
                                             0.66180656944165694, 0.70305571127320876,
                                             1.120315074929102};
};

// 1 / sqrt(v) from an integer start s, unlike the processors' own approximations with equal bits
// everywhere; then a polynomial, and in double a Newton step. Finite at 0.
template <class D, std::size_t N, class V = hn::Vec<D>>
HWY_INLINE Each<V, N> inverse_sqrt(D d, const Each<V, N>& v) {
  using T = hn::TFromD<D>;
  const hn::RebindToUnsigned<D> du;
  using U = hn::TFromD<decltype(du)>;
  constexpr bool kSingle = sizeof(T) == 4;
  constexpr auto kPolynomial = InverseSqrt<T>::kPolynomial;
  const auto set = [&](double value) HWY_ATTR { return hn::Set(d, static_cast<T>(value)); };
  const auto magic = hn::Set(du, static_cast<U>(kSingle ? 0x5f200000u : 0x5fe4000000000000u));
  const auto mul = [](V a, V b) HWY_ATTR { return hn::Mul(a, b); };

  const auto start = each(
      [&](V a) HWY_ATTR {
        return hn::BitCast(d, hn::Sub(magic, hn::ShiftRight<1>(hn::BitCast(du, a))));
      },
      v);
  const V centre = set(InverseSqrt<T>::kCentre);
  const auto vs = each(mul, v, start);
  const auto e = each([&](V a, V s) HWY_ATTR { return hn::NegMulAdd(a, s, centre); }, vs, start);
  const V first = set(kPolynomial[0]), second = set(kPolynomial[1]);
  auto p = each([&](V a) HWY_ATTR { return hn::MulAdd(a, first, second); }, e);
  for (std::size_t k = 2; k < kPolynomial.size(); ++k) {
    const V next = set(kPolynomial[k]);
    p = each([&](V a, V b) HWY_ATTR { return hn::MulAdd(a, b, next); }, e, p);
  }
  auto y = each(mul, start, p);
  if constexpr (!kSingle) {
    const V one = set(1), half = set(0.5);
    const auto vy = each(mul, v, y);
    const auto rest = each([&](V a, V b) HWY_ATTR { return hn::NegMulAdd(a, b, one); }, vy, y);
    p = each([&](V a) HWY_ATTR { return hn::Mul(a, half); }, y);
    y = each([](V a, V b, V c) HWY_ATTR { return hn::MulAdd(a, b, c); }, p, rest, y);
  }
  return y;
}

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
