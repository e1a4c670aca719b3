// Force of wind on vectors of triangles; included once for every target.
#if defined(WEFT_WIND_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef WEFT_WIND_INL_H
#undef WEFT_WIND_INL_H
#else
#define WEFT_WIND_INL_H
#endif

#include <hwy/highway.h>

#include "core/forces/wind_law.h"
#include "core/motion/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {

// On each corner of a triangle, N. cross: along its normal, twice its area long; square: its
// square, inverse: 1 / its length; three_w: the sum of w over the corners.
template <class D, class V = hn::Vec<D>>
HWY_INLINE Triple<V> blow(D d, const WindLaw<hn::TFromD<D>>& wind, const Triple<V>& cross, V square,
                          V inverse, const Triple<V>& three_w) {
  const Triple<V> air{hn::Set(d, wind.velocity[0]), hn::Set(d, wind.velocity[1]),
                      hn::Set(d, wind.velocity[2])};
  const Triple<V> relative = minus_times(air, three_w, hn::Set(d, wind.to_velocity));
  const V along = hn::Mul(dot(relative, cross), inverse), speed = hn::Abs(along);
  V pressure = hn::Set(d, wind.pressure);
  if (wind.lag > 0) {
    const V one = hn::Set(d, hn::TFromD<D>(1));
    const V share = hn::Div(one, hn::MulAdd(hn::Set(d, wind.lag), speed, one));
    pressure = hn::Mul(pressure, hn::Mul(share, share));
  }
  if (!(wind.drag > 0)) return times(cross, hn::Mul(along, hn::Mul(speed, pressure)));

  const V drag = hn::Set(d, wind.drag);
  const V push = hn::Mul(along, hn::MulSub(speed, pressure, drag));
  return plus_times(times(cross, push), relative, hn::Mul(hn::Mul(square, inverse), drag));
}

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
