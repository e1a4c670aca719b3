#include "core/triangles/contact.h"

#include <limits>

// compiled again for every target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/triangles/contact.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/contact/places-inl.h"

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {

// x, y and z of some particles, one after the other.
struct Lanes {
  static constexpr std::size_t kMost = hn::MaxLanes(ContactTag());
  HWY_ALIGN double axis[3][kMost];

  HWY_INLINE void store(const Places& places) {
    const ContactTag d;
    hn::Store(places.x, d, axis[0]);
    hn::Store(places.y, d, axis[1]);
    hn::Store(places.z, d, axis[2]);
  }
};

// Of vectors of four values each: the first three of every particle.
template <class T>
HWY_INLINE Places load_places(const T* from) {
  const hn::Rebind<T, ContactTag> stored;
  hn::Vec<decltype(stored)> x, y, z, rest;
  hn::LoadInterleaved4(stored, from, x, y, z, rest);
  if constexpr (sizeof(T) == sizeof(double))
    return {x, y, z};
  else
    return {hn::PromoteTo(ContactTag(), x), hn::PromoteTo(ContactTag(), y),
            hn::PromoteTo(ContactTag(), z)};
}

template <class T>
Resolved resolve_run_as(const Contacts& contacts, const Vector3d& origin, bool compensated, int run,
                        std::span<KnownCells> known, TriangleState<T>& state) {
  const ContactTag d;
  KnownCells* const cells = known.empty() ? nullptr : &known[static_cast<std::size_t>(run)];
  const Reals far = real(std::numeric_limits<double>::infinity());
  constexpr std::size_t kValues = 4;
  static_assert(kContactRun % Lanes::kMost == 0);
  const std::size_t begin = static_cast<std::size_t>(run) * kContactRun * kValues;
  ResolvedPlaces resolved{far, real(0), real(0)};
  for (std::size_t first = begin; first < begin + kContactRun * kValues;
       first += kValues * Lanes::kMost) {
    const auto exact = [&](const AlignedArray<T>& plane, const AlignedArray<T>& error) HWY_ATTR {
      const Places rounded = load_places(plane.data() + first);
      return compensated ? minus(rounded, load_places(error.data() + first)) : rounded;
    };
    const auto free = hn::Gt(load_places(state.step2.data() + first).x, real(0));
    Places x = plus(everywhere(origin), exact(state.x, state.x_error));
    const Gaps found = gaps(contacts, x, cells, (first - begin) / kValues);
    const Reals gap = hn::IfThenElse(free, found.least, far);
    resolved.gap = hn::Min(resolved.gap, gap);
    const auto touching = hn::Lt(gap, real(0));
    if (hn::AllFalse(d, touching)) continue;

    const Places at = x, before = exact(state.d, state.d_error);
    Places moved = before;
    resolve_places(contacts, touching, found.first, x, moved);
    const auto kept = [&](const Places& v) HWY_ATTR { return compensated ? v : rounded<T>(v); };
    const Places from = everywhere(origin);
    resolved.move(touching, minus(kept(minus(x, from)), minus(at, from)),
                  minus(kept(moved), before));

    HWY_ALIGN double touched[Lanes::kMost];
    hn::Store(hn::IfThenElseZero(touching, real(1)), d, touched);
    Lanes place, displacement, change;
    place.store(minus(x, from));
    displacement.store(moved);
    change.store(times(minus(moved, before), real(double{state.lead})));
    for (std::size_t k = 0; k < Lanes::kMost; ++k) {
      if (touched[k] == 0) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t i = first + k * kValues + axis;
        const auto set = [&](AlignedArray<T>& plane, AlignedArray<T>& error, double value) {
          const T rounded = plane.data()[i] = static_cast<T>(value);
          if (compensated) error.data()[i] = static_cast<T>(double{rounded} - value);
        };
        set(state.x, state.x_error, place.axis[axis][k]);
        set(state.d, state.d_error, displacement.axis[axis][k]);
        state.w.data()[i] += static_cast<T>(change.axis[axis][k]);
      }
    }
  }
  return resolved.result();
}

Resolved resolve_single(const Contacts& contacts, const Vector3d& origin, bool compensated, int run,
                        std::span<KnownCells> known, TriangleState<float>& state) {
  return resolve_run_as(contacts, origin, compensated, run, known, state);
}
Resolved resolve_double(const Contacts& contacts, const Vector3d& origin, bool compensated, int run,
                        std::span<KnownCells> known, TriangleState<double>& state) {
  return resolve_run_as(contacts, origin, compensated, run, known, state);
}

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace weft {

HWY_EXPORT(resolve_single);
HWY_EXPORT(resolve_double);

template <>
Resolved resolve_run(const Contacts& contacts, const Vector3d& origin, bool compensated, int run,
                     std::span<KnownCells> known, TriangleState<float>& state) {
  return HWY_DYNAMIC_DISPATCH(resolve_single)(contacts, origin, compensated, run, known, state);
}
template <>
Resolved resolve_run(const Contacts& contacts, const Vector3d& origin, bool compensated, int run,
                     std::span<KnownCells> known, TriangleState<double>& state) {
  return HWY_DYNAMIC_DISPATCH(resolve_double)(contacts, origin, compensated, run, known, state);
}

}  // namespace weft
#endif
