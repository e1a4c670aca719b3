#include "core/triangles/sweep.h"

#include <algorithm>
#include <cmath>
#include <utility>

// compiled again for every target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/triangles/sweep.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/forces/wind-inl.h"
#include "core/motion/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {

template <class T>
HWY_INLINE const T* near(const T* p, Near at) {
  return p + at * (8 / sizeof(T));
}

#if HWY_TARGET == HWY_SCALAR

// x, y and z of the particle at p + at[0].
template <class D>
HWY_INLINE Triple<hn::Vec<D>> pick(D d, const hn::TFromD<D>* p, const Near* at) {
  const auto* from = near(p, at[0]);
  return {hn::Load(d, from), hn::Load(d, from + 1), hn::Load(d, from + 2)};
}

#else

// Runs of 128 bits at x + at[0], x + at[kApart], ..., side by side.
template <int kApart, class D>
HWY_INLINE hn::Vec<D> blocks(D d, const hn::TFromD<D>* x, const Near* at) {
  constexpr std::size_t kBlocks = hn::MaxLanes(D()) * sizeof(hn::TFromD<D>) / 16;
  if constexpr (kBlocks == 1) {
    return hn::Load(d, near(x, at[0]));
  } else {
    const hn::Half<D> half;
    return hn::Combine(d, blocks<kApart>(half, x, at + kApart * (kBlocks / 2)),
                       blocks<kApart>(half, x, at));
  }
}

// x, y and z of the particles at p + at[0], p + at[1], ...
template <class D>
HWY_INLINE Triple<hn::Vec<D>> pick(D d, const hn::TFromD<D>* p, const Near* at) {
  if constexpr (sizeof(hn::TFromD<D>) == 8) {  // two in 128 bits: x and y, z and 0
    const auto even = blocks<2>(d, p, at), odd = blocks<2>(d, p, at + 1);
    return {hn::InterleaveLower(d, even, odd), hn::InterleaveUpper(d, even, odd),
            hn::InterleaveLower(d, blocks<2>(d, p + 2, at), blocks<2>(d, p + 2, at + 1))};
  } else {
    const auto p0 = blocks<4>(d, p, at), p1 = blocks<4>(d, p, at + 1);
    const auto p2 = blocks<4>(d, p, at + 2), p3 = blocks<4>(d, p, at + 3);
    const auto even = hn::InterleaveLower(d, p0, p2), odd = hn::InterleaveLower(d, p1, p3);
    return {hn::InterleaveLower(d, even, odd), hn::InterleaveUpper(d, even, odd),
            hn::InterleaveLower(d, hn::InterleaveUpper(d, p0, p2), hn::InterleaveUpper(d, p1, p3))};
  }
}

#endif

// Asks for what is read so many bytes from here on, `lines` lines of the cache.
template <int kLines, class A>
HWY_INLINE void fetch(const A* from, std::ptrdiff_t ahead) {
  for (int k = 0; k < kLines; ++k)
    __builtin_prefetch(reinterpret_cast<const char*>(from) + ahead + 64 * k, 0, 2);
}

// Tensions, and what wind does, of the triangles of a patch.
template <bool kPushes, bool kBlows, class T>
void strain_patch(const TriangleLaw<T>& law, const typename TriangleLaw<T>::Patch& patch,
                  typename TriangleState<T>::PatchCopy& copy) {
  using D = hn::ScalableTag<T>;
  using V = hn::Vec<D>;
  const D d;
  constexpr std::size_t kLanes = TriangleLaw<T>::kLanes, kPart = hn::MaxLanes(D());
  constexpr std::size_t kConstants = kPushes ? 9 : 15;
  const T *const x = copy.x.data(), *const w = copy.w.data();
  for (std::size_t group = 0; group < patch.group_count; ++group) {
    for (std::size_t part = 0; part < kLanes; part += kPart) {
      const std::size_t from = patch.group + group;
      const Near* const at = law.corners.data() + from * 3 * kLanes + part;
      const T* const constants = law.stiffness.data() + from * kConstants * kLanes + part;
      T* const tensions = copy.tension.data() + (group * 3 + 1) * kLanes + part;
      if (part == 0) {
        fetch<kConstants>(constants, 2 * kConstants * 64);
        fetch<2>(at, 2 * 3 * 32);
      }
      const auto c = [&](std::size_t k) HWY_ATTR { return hn::Load(d, constants + k * kLanes); };
      const auto put = [&](std::size_t k, V v) HWY_ATTR { hn::Store(v, d, tensions + k * kLanes); };

      const Triple<V> a = pick(d, x, at), b = pick(d, x, at + kLanes);
      const Triple<V> e = pick(d, x, at + 2 * kLanes);
      const V l0 = squared(minus(b, e)), l1 = squared(minus(e, a)), l2 = squared(minus(a, b));
      const auto sum = [&](V s0, V s1, V s2, V rest) HWY_ATTR {
        return hn::MulAdd(s0, l0, hn::MulAdd(s1, l1, hn::MulSub(s2, l2, rest)));
      };
      if constexpr (kPushes) {
        const V s01 = c(3), s12 = c(4), s02 = c(5);
        put(0, sum(c(0), s01, s02, c(6)));
        put(1, sum(s01, c(1), s12, c(7)));
        put(2, sum(s02, s12, c(2), c(8)));
      } else {
        const V warp = hn::Max(hn::Zero(d), sum(c(0), c(1), c(2), c(3)));
        const V weft = hn::Max(hn::Zero(d), sum(c(4), c(5), c(6), c(7)));
        const V shear = sum(c(8), c(9), c(10), c(11));
        for (std::size_t k = 0; k < 3; ++k)
          put(k, hn::MulAdd(warp, c(k),
                            hn::MulAdd(weft, c(4 + k), hn::MulSub(shear, c(8 + k), c(12 + k)))));
      }

      if constexpr (kBlows) {
        const Triple<V> three_w =
            plus(plus(pick(d, w, at), pick(d, w, at + kLanes)), pick(d, w, at + 2 * kLanes));
        const Triple<V> cross = product(minus(b, a), minus(e, a));
        const V square = squared(cross);
        const Triple<V> push =
            blow(d, law.wind, cross, square, inverse_sqrt(d, Each<V, 1>{square})[0], three_w);
        hn::StoreInterleaved4(push.x, push.y, push.z, hn::Zero(d), d,
                              copy.wind.data() + 4 * (group * kLanes + part));
      }
    }
  }
}

// The four values of a particle; where vectors hold fewer, in two of them.
template <class T>
struct Quad {
  using D = hn::CappedTag<T, 4>;
  static constexpr std::size_t kLanes = hn::MaxLanes(D()), kParts = 4 / kLanes;
  using V = hn::Vec<D>;
  std::array<V, kParts> part;

  static HWY_INLINE Quad zero() {
    Quad q;
    for (V& v : q.part) v = hn::Zero(D());
    return q;
  }
  static HWY_INLINE Quad load(const T* from) {
    Quad q;
    for (std::size_t k = 0; k < kParts; ++k) q.part[k] = hn::Load(D(), from + k * kLanes);
    return q;
  }
  HWY_INLINE void store(T* to) const {
    for (std::size_t k = 0; k < kParts; ++k) hn::Store(part[k], D(), to + k * kLanes);
  }
  HWY_INLINE void add(const Quad& q) {
    for (std::size_t k = 0; k < kParts; ++k) part[k] = hn::Add(part[k], q.part[k]);
  }
  HWY_INLINE void add(T s, const Quad& q) {
    for (std::size_t k = 0; k < kParts; ++k)
      part[k] = hn::MulAdd(hn::Set(D(), s), q.part[k], part[k]);
  }
  HWY_INLINE void subtract(T s, const Quad& q) {
    for (std::size_t k = 0; k < kParts; ++k)
      part[k] = hn::NegMulAdd(hn::Set(D(), s), q.part[k], part[k]);
  }
  // From `other` to what lies at p.
  static HWY_INLINE Quad apart(const T* p, const Quad& other) {
    Quad q = load(p);
    for (std::size_t k = 0; k < kParts; ++k) q.part[k] = hn::Sub(q.part[k], other.part[k]);
    return q;
  }
};

// Where the next particle finds what it gathers.
template <class T>
struct Gathering {
  const Side* side;
  const Reaches<T>* reach;
  const Near* blown;
};

// Sums the forces on the particles of a block, which is so many after the first of its patch.
template <bool kBends, bool kDamps, bool kBlows, class T>
HWY_INLINE void gather_block(const TriangleLaw<T>& law,
                             const typename TriangleState<T>::PatchCopy& copy, std::size_t block,
                             std::size_t after, Gathering<T>& next, T* HWY_RESTRICT force) {
  using Q = Quad<T>;
  constexpr std::size_t kBlock = TriangleLaw<T>::kBlock;
  const T *const x = copy.x.data(), *const w = copy.w.data();
  const T *const tension = copy.tension.data(), *const wind = copy.wind.data();
  const Gather<T>* gather = law.gathers.data() + block * kBlock;
  const Side* side = next.side;
  const Reaches<T>* reach = next.reach;
  const Near* blown = next.blown;
  const std::size_t first = 4 * after * kBlock;
  for (std::size_t i = first; i < first + 4 * kBlock; i += 4, ++gather) {
    fetch<1>(side, 1024);
    if constexpr (kBends) fetch<2>(reach, 2048);
    const Q here = Q::load(x + i);
    Q pull = Q::zero(), speed = Q::zero();

    // membrane along edges, and damping (eq. 7)
    for (int k = 0; k < gather->sides; ++k, ++side) {
      pull.add(tension[side->tension[0]] + tension[side->tension[1]],
               Q::apart(near(x, side->particle), here));
      if constexpr (kDamps) speed.add(Q::load(near(w, side->particle)));
    }

    // bending by particles farther away: two sums, so that one need not wait for the other
    if constexpr (kBends) {
      Q even = Q::zero(), odd = Q::zero();
      for (int k = 0; k < gather->reaches; ++k, ++reach) {
        even.subtract(reach->stiffness[0], Q::load(near(x, reach->particle[0])));
        odd.subtract(reach->stiffness[1], Q::load(near(x, reach->particle[1])));
        even.subtract(reach->stiffness[2], Q::load(near(x, reach->particle[2])));
        odd.subtract(reach->stiffness[3], Q::load(near(x, reach->particle[3])));
      }
      even.add(gather->reach_sum, here);
      odd.subtract(gather->reach_error, here);
      even.add(odd);
      pull.add(even);
    }
    if constexpr (kDamps) {
      speed.subtract(static_cast<T>(gather->sides), Q::load(w + i));
      pull.add(law.damping, speed);
    }
    if constexpr (kBlows)
      for (int k = 0; k < gather->corners; ++k, ++blown) pull.add(Q::load(near(wind, *blown)));
    pull.store(force + i - first);
  }
  next = {side, reach, blown};
}

// Eq. 7 and 8 for the particles of a block: drag centred, Verlet in summed form.
template <class T, class D, class V = hn::Vec<D>>
HWY_INLINE void move_block(D d, const TriangleLaw<T>& law, TriangleState<T>& state,
                           std::size_t block, const T* HWY_RESTRICT force, V drift, V air,
                           V& largest, V& largest_change) {
  constexpr std::size_t kValues = 4 * TriangleLaw<T>::kBlock;
  const auto sum = [&](V old, V change, T* error) HWY_ATTR {
    const V add = hn::Sub(change, hn::Load(d, error));
    const V next = hn::Add(old, add);
    hn::Store(hn::Sub(hn::Sub(next, old), add), d, error);
    return next;
  };
  for (std::size_t k = 0; k < kValues; k += hn::Lanes(d)) {
    const std::size_t i = block * kValues + k;
    const V step2 = hn::Load(d, state.step2.data() + i), old = hn::Load(d, state.d.data() + i);
    const V at = hn::Load(d, state.x.data() + i);
    V change = hn::MulAdd(hn::Load(d, force + k), step2,
                          hn::IfThenElseZero(hn::Gt(step2, hn::Zero(d)), drift));
    if (law.drags && law.slow > 0) {
      const V rate = hn::Mul(hn::Set(d, law.slow), hn::Load(d, state.drag.data() + i));
      const V one = hn::Set(d, T(1));
      change = hn::Div(hn::MulAdd(rate, hn::Sub(air, old), change),
                       hn::MulAdd(rate, hn::Set(d, T(0.5)), one));
    }
    V next = hn::Zero(d), there = hn::Zero(d);
    if (law.compensated) {
      next = sum(old, change, state.d_error.data() + i);
      there = sum(at, next, state.x_error.data() + i);
    } else {
      next = hn::Add(old, change);
      there = hn::Add(at, next);
    }
    const V lagged = hn::Mul(hn::Set(d, state.lead - 2), old);
    hn::Store(hn::MulSub(hn::Set(d, state.lead), next, lagged), d, state.next_w.data() + i);
    hn::Store(next, d, state.d.data() + i);
    hn::Store(there, d, state.next_x.data() + i);
    if (law.measured) largest = hn::Max(largest, hn::Abs(next));
    if (law.changes) largest_change = hn::Max(largest_change, hn::Abs(hn::Sub(next, old)));
  }
}

// Copies the particles of a patch, and those around them, to where they are near.
template <class T>
void bring(const TriangleLaw<T>& law, const typename TriangleLaw<T>::Patch& patch,
           std::size_t around_count, const AlignedArray<T>& plane, AlignedArray<T>& copy) {
  constexpr std::size_t kValues = 4 * TriangleLaw<T>::kBlock;
  const hn::ScalableTag<T> d;
  const T* const from = plane.data() + static_cast<std::size_t>(patch.block) * kValues;
  const std::size_t own = static_cast<std::size_t>(patch.blocks) * kValues;
  for (std::size_t i = 0; i < own; i += hn::Lanes(d))
    hn::Store(hn::Load(d, from + i), d, copy.data() + i);
  T* to = copy.data() + own;
  const Offset* const around = law.around.data() + patch.around;
  for (std::size_t k = 0; k < around_count; ++k, to += 4)
    Quad<T>::load(plane.data() + around[k]).store(to);
}

template <bool kBends, bool kDamps, bool kBlows, class T>
void move_patch(const TriangleLaw<T>& law, TriangleState<T>& state,
                const typename TriangleLaw<T>::Patch& patch,
                const typename TriangleState<T>::PatchCopy& copy, Farthest<T>& farthest) {
  using D = hn::ScalableTag<T>;
  const D d;
  constexpr std::size_t kMost = TriangleLaw<T>::kLanes;
  HWY_ALIGN T force[4 * TriangleLaw<T>::kBlock];
  HWY_ALIGN T drift[kMost], air[kMost], reached[kMost] = {}, changed[kMost] = {};
  for (std::size_t k = 0; k < kMost; ++k) drift[k] = law.drift[k % 4], air[k] = law.air[k % 4];
  auto largest = hn::Zero(d), largest_change = largest;
  Gathering<T> next{law.sides.data() + patch.side, law.reaches.data() + patch.reach,
                    law.blown.data() + patch.blown};
  for (std::size_t k = 0; k < static_cast<std::size_t>(patch.blocks); ++k) {
    const std::size_t block = static_cast<std::size_t>(patch.block) + k;
    gather_block<kBends, kDamps, kBlows>(law, copy, block, k, next, force);
    if (state.turn.size() > 0) {
      const T* const turn = state.turn.data() + block * 4 * TriangleLaw<T>::kBlock;
      for (std::size_t i = 0; i < 4 * TriangleLaw<T>::kBlock; i += hn::Lanes(d))
        hn::Store(hn::Add(hn::Load(d, force + i), hn::Load(d, turn + i)), d, force + i);
    }
    move_block(d, law, state, block, force, hn::Load(d, drift), hn::Load(d, air), largest,
               largest_change);
  }
  hn::Store(largest, d, reached);
  hn::Store(largest_change, d, changed);
  for (std::size_t k = 0; k < kMost; ++k) {
    farthest.moved[k % 4] = std::max(farthest.moved[k % 4], reached[k]);
    farthest.changed[k % 4] = std::max(farthest.changed[k % 4], changed[k]);
  }
}

// One substep of the patches first ... last - 1.
template <bool kPushes, bool kBends, bool kDamps, bool kBlows, class T>
void step_patches(const TriangleLaw<T>& law, TriangleState<T>& state, std::size_t first,
                  std::size_t last, typename TriangleState<T>::PatchCopy& copy,
                  Farthest<T>& farthest) {
  for (std::size_t p = first; p < last; ++p) {
    const auto& patch = law.patches[p];
    bring(law, patch, patch.around_count, state.x, copy.x);
    if constexpr (kDamps || kBlows) bring(law, patch, patch.beside_count, state.w, copy.w);
    strain_patch<kPushes, kBlows>(law, patch, copy);
    move_patch<kBends, kDamps, kBlows>(law, state, patch, copy, farthest);
  }
}

template <class T>
void step(const TriangleLaw<T>& law, TriangleState<T>& state, std::size_t first, std::size_t last,
          typename TriangleState<T>::PatchCopy& copy, Farthest<T>& farthest) {
  const std::true_type on;
  const std::false_type off;
  const auto with = [&](auto pushes, auto bends, auto damps, auto blows) {
    step_patches<decltype(pushes)::value, decltype(bends)::value, decltype(damps)::value,
                 decltype(blows)::value>(law, state, first, last, copy, farthest);
  };
  const auto damped = [&](auto pushes, auto bends, auto damps) {
    const bool blows = law.wind.blows && law.slow > 0;
    blows ? with(pushes, bends, damps, on) : with(pushes, bends, damps, off);
  };
  const auto bent = [&](auto pushes, auto bends) {
    law.damping > 0 ? damped(pushes, bends, on) : damped(pushes, bends, off);
  };
  const auto pushed = [&](auto pushes) { law.bends ? bent(pushes, on) : bent(pushes, off); };
  law.pushes ? pushed(on) : pushed(off);
}

void step_single(const TriangleLaw<float>& law, TriangleState<float>& state, std::size_t first,
                 std::size_t last, TriangleState<float>::PatchCopy& copy,
                 Farthest<float>& farthest) {
  step(law, state, first, last, copy, farthest);
}
void step_double(const TriangleLaw<double>& law, TriangleState<double>& state, std::size_t first,
                 std::size_t last, TriangleState<double>::PatchCopy& copy,
                 Farthest<double>& farthest) {
  step(law, state, first, last, copy, farthest);
}

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace weft {

HWY_EXPORT(step_single);
HWY_EXPORT(step_double);

namespace {

template <class T>
void step(const TriangleLaw<T>& law, TriangleState<T>& state, std::size_t first, std::size_t last,
          typename TriangleState<T>::PatchCopy& copy, Farthest<T>& farthest) {
  if constexpr (sizeof(T) == 4)
    HWY_DYNAMIC_DISPATCH(step_single)(law, state, first, last, copy, farthest);
  else
    HWY_DYNAMIC_DISPATCH(step_double)(law, state, first, last, copy, farthest);
}

}  // namespace

template <class T>
TriangleState<T>::TriangleState(int particles, bool compensated, T velocity_lead)
    : lead(velocity_lead) {
  constexpr int kBlock = TriangleLaw<T>::kBlock;
  const auto size = 4 * static_cast<std::size_t>((particles + kBlock - 1) / kBlock * kBlock);
  for (auto* plane : {&x, &w, &d}) *plane = AlignedArray<T>(size);
  if (compensated)
    for (auto* plane : {&x_error, &d_error}) *plane = AlignedArray<T>(size);
}

template <class T>
void TriangleState<T>::release_memory() {
  for (auto* plane : {&step2, &drag, &next_x, &next_w}) *plane = {};
  copies.clear();
}

template <class T>
void TriangleState<T>::prepare(const TriangleLaw<T>& law) {
  if (next_x.size() > 0) return;
  step2 = AlignedArray<T>(size());
  if (law.drags) drag = AlignedArray<T>(size());
  next_w = AlignedArray<T>(size());
  next_x = AlignedArray<T>(size());
  prepare(law, 1);
}

template <class T>
void TriangleState<T>::prepare(const TriangleLaw<T>& law, std::size_t bands) {
  while (copies.size() < bands) {
    const std::size_t particles = 4 * law.most_particles;
    const std::size_t triangles = law.most_groups * TriangleLaw<T>::kLanes;
    copies.push_back({AlignedArray<T>(particles), AlignedArray<T>(particles),
                      AlignedArray<T>(3 * triangles + TriangleLaw<T>::kLanes),
                      AlignedArray<T>(law.wind.blows ? 4 * triangles : 0)});
  }
}

template <class T>
Largest<T> sweep(const TriangleLaw<T>& law, TriangleState<T>& state, int bands, ThreadPool& pool) {
  const auto count = static_cast<std::size_t>(bands);
  state.prepare(law, count);
  std::vector<Farthest<T>> farthest(count);
  const auto share = [&](int band) {
    const auto k = static_cast<std::size_t>(band);
    const auto at = [&](std::size_t n) { return law.patches.size() * n / count; };
    step(law, state, at(k), at(k + 1), state.copies[k], farthest[k]);
  };
  if (bands == 1)
    share(0);
  else
    pool.run(bands, share);
  std::swap(state.x, state.next_x);
  std::swap(state.w, state.next_w);

  // by axis, so that it does not depend on the bands
  const auto norm = [&](std::array<T, 4> Farthest<T>::*along) {
    T square = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      T most = 0;
      for (const Farthest<T>& band : farthest) most = std::max(most, (band.*along)[axis]);
      square += most * most;
    }
    return std::sqrt(square);
  };
  return {norm(&Farthest<T>::moved), norm(&Farthest<T>::changed)};
}

template struct TriangleState<float>;
template struct TriangleState<double>;
template Largest<float> sweep(const TriangleLaw<float>&, TriangleState<float>&, int, ThreadPool&);
template Largest<double> sweep(const TriangleLaw<double>&, TriangleState<double>&, int,
                               ThreadPool&);

}  // namespace weft
#endif
