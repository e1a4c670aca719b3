#include "core/lattice/contact.h"

#include <limits>

// compiled again for every target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/lattice/contact.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/contact/places-inl.h"

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {

// Values of T read and written as double.
template <class T>
struct Stored {
  static HWY_INLINE Reals load(const T* from) {
    const hn::Rebind<T, ContactTag> d;
    if constexpr (sizeof(T) == sizeof(double))
      return hn::Load(d, from);
    else
      return hn::PromoteTo(ContactTag(), hn::Load(d, from));
  }
  static HWY_INLINE void store(Reals v, T* to) {
    const hn::Rebind<T, ContactTag> d;
    if constexpr (sizeof(T) == sizeof(double))
      hn::Store(v, d, to);
    else
      hn::Store(hn::DemoteTo(d, v), d, to);
  }
};

template <class T>
Resolved resolve_row_as(const Contacts& contacts, const Vector3d& origin, bool compensated, int row,
                        std::span<KnownCells> known, SweepState<T>& state) {
  using State = SweepState<T>;
  using Of = Stored<T>;
  constexpr int kLanes = LatticeLayout<T>::kLanes, kGroup = KnownCells::kParticles,
                kGroups = kLanes / kGroup;
  const int step = static_cast<int>(hn::Lanes(ContactTag()));
  const Places from = everywhere(origin);
  const Reals far = real(std::numeric_limits<double>::infinity());
  ResolvedPlaces resolved{far, real(0), real(0)};
  for (int j = 0; j < state.vectors(); ++j) {
    for (int part = 0; part < kLanes; part += step) {
      T* const shared = state.shared(row) + j * State::kSharedStride + part;
      T* const local = state.local(row) + j * state.local_stride() + part;
      const auto at = [&](int plane) HWY_ATTR {
        return plane < State::kShared ? shared + plane * kLanes
                                      : local + (plane - State::kShared) * kLanes;
      };
      const auto exact = [&](int plane, int error) HWY_ATTR {
        Places v{Of::load(at(plane)), Of::load(at(plane + 1)), Of::load(at(plane + 2))};
        if (compensated)
          v = minus(v, {Of::load(at(error)), Of::load(at(error + 1)), Of::load(at(error + 2))});
        return v;
      };

      const auto free = hn::Gt(Of::load(at(State::kStep2)), real(0));
      Places x = plus(from, exact(State::kX, State::kXError));
      const int group = (row * state.vectors() + j) * kGroups + part / kGroup;
      const Gaps found =
          gaps(contacts, x, known.empty() ? nullptr : &known[static_cast<std::size_t>(group)],
               static_cast<std::size_t>(part % kGroup));
      const Reals gap = hn::IfThenElse(free, found.least, far);
      resolved.gap = hn::Min(resolved.gap, gap);
      const auto touching = hn::Lt(gap, real(0));
      if (hn::AllFalse(ContactTag(), touching)) continue;

      const Places place = minus(x, from), before = exact(State::kD, State::kDError);
      Places d = before;
      resolve_places(contacts, touching, found.first, x, d);

      const auto store = [&](int plane, Reals v) HWY_ATTR {
        Of::store(hn::IfThenElse(touching, v, Of::load(at(plane))), at(plane));
      };
      const auto set = [&](int plane, int error, Reals v) HWY_ATTR {
        store(plane, v);
        if (compensated) store(error, hn::Sub(rounded<T>(v), v));
      };
      const Places relative = minus(x, from);
      const auto kept = [&](const Places& v) HWY_ATTR { return compensated ? v : rounded<T>(v); };
      resolved.move(touching, minus(kept(relative), place), minus(kept(d), before));
      set(State::kX, State::kXError, relative.x);
      set(State::kX + 1, State::kXError + 1, relative.y);
      set(State::kX + 2, State::kXError + 2, relative.z);
      set(State::kD, State::kDError, d.x);
      set(State::kD + 1, State::kDError + 1, d.y);
      set(State::kD + 2, State::kDError + 2, d.z);
      const Places change = times(minus(d, before), real(double{state.lead()}));
      store(State::kW, hn::Add(Of::load(at(State::kW)), rounded<T>(change.x)));
      store(State::kW + 1, hn::Add(Of::load(at(State::kW + 1)), rounded<T>(change.y)));
      store(State::kW + 2, hn::Add(Of::load(at(State::kW + 2)), rounded<T>(change.z)));
    }
  }
  return resolved.result();
}

Resolved resolve_single(const Contacts& contacts, const Vector3d& origin, bool compensated, int row,
                        std::span<KnownCells> known, SweepState<float>& state) {
  return resolve_row_as(contacts, origin, compensated, row, known, state);
}
Resolved resolve_double(const Contacts& contacts, const Vector3d& origin, bool compensated, int row,
                        std::span<KnownCells> known, SweepState<double>& state) {
  return resolve_row_as(contacts, origin, compensated, row, known, state);
}

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace weft {

HWY_EXPORT(resolve_single);
HWY_EXPORT(resolve_double);

template <>
Resolved resolve_row(const Contacts& contacts, const Vector3d& origin, bool compensated, int row,
                     std::span<KnownCells> known, SweepState<float>& state) {
  return HWY_DYNAMIC_DISPATCH(resolve_single)(contacts, origin, compensated, row, known, state);
}
template <>
Resolved resolve_row(const Contacts& contacts, const Vector3d& origin, bool compensated, int row,
                     std::span<KnownCells> known, SweepState<double>& state) {
  return HWY_DYNAMIC_DISPATCH(resolve_double)(contacts, origin, compensated, row, known, state);
}

}  // namespace weft
#endif
