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

#if HWY_TARGET == HWY_SCALAR

// x, y and z of the particle that begins at p[at[0]].
template <class D>
HWY_INLINE Triple<hn::Vec<D>> pick(D d, const hn::TFromD<D>* p, const Offset* at) {
  return {hn::Load(d, p + at[0]), hn::Load(d, p + at[0] + 1), hn::Load(d, p + at[0] + 2)};
}

#else

// Runs of 128 bits at x + at[0], x + at[kApart], ..., side by side.
template <int kApart, class D>
HWY_INLINE hn::Vec<D> blocks(D d, const hn::TFromD<D>* x, const Offset* at) {
  constexpr std::size_t kBlocks = hn::MaxLanes(D()) * sizeof(hn::TFromD<D>) / 16;
  if constexpr (kBlocks == 1) {
    return hn::Load(d, x + at[0]);
  } else {
    const hn::Half<D> half;
    return hn::Combine(d, blocks<kApart>(half, x, at + kApart * (kBlocks / 2)),
                       blocks<kApart>(half, x, at));
  }
}

// x, y and z of the particles that begin at p[at[0]], p[at[1]], ...
template <class D>
HWY_INLINE Triple<hn::Vec<D>> pick(D d, const hn::TFromD<D>* p, const Offset* at) {
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

// Tensions, and what wind does, of the groups of triangles first ... last - 1.
template <bool kPushes, bool kBlows, class T>
void strain_groups(const TriangleLaw<T>& law, TriangleState<T>& state, int first, int last) {
  using D = hn::ScalableTag<T>;
  using V = hn::Vec<D>;
  const D d;
  constexpr int kLanes = TriangleLaw<T>::kLanes, kPart = static_cast<int>(hn::MaxLanes(D()));
  constexpr int kConstants = kPushes ? 9 : 15;
  const T* const x = state.x.data();
  for (int group = first; group < last; ++group) {
    for (int part = 0; part < kLanes; part += kPart) {
      const Offset* const at = law.corners.data() + group * 3 * kLanes + part;
      const T* const constants = law.stiffness.data() + group * kConstants * kLanes + part;
      T* const tensions = state.tension.data() + group * 3 * kLanes + part;
      if (part == 0) {
        fetch<kConstants>(constants, 2 * kConstants * 64);
        fetch<3>(at, 2 * 3 * 64);
      }
      const auto c = [&](int k) HWY_ATTR { return hn::Load(d, constants + k * kLanes); };
      const auto put = [&](int k, V v) HWY_ATTR { hn::Store(v, d, tensions + k * kLanes); };

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
        for (int k = 0; k < 3; ++k)
          put(k, hn::MulAdd(warp, c(k),
                            hn::MulAdd(weft, c(4 + k), hn::MulSub(shear, c(8 + k), c(12 + k)))));
      }

      if constexpr (kBlows) {
        const T* const w = state.w.data();
        const Triple<V> three_w =
            plus(plus(pick(d, w, at), pick(d, w, at + kLanes)), pick(d, w, at + 2 * kLanes));
        const Triple<V> cross = product(minus(b, a), minus(e, a));
        const V square = squared(cross);
        const Triple<V> push =
            blow(d, law.wind, cross, square, inverse_sqrt(d, Each<V, 1>{square})[0], three_w);
        hn::StoreInterleaved4(push.x, push.y, push.z, hn::Zero(d), d,
                              state.wind.data() + 4 * (group * kLanes + part));
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

// Sums the forces on the particles of a block.
template <bool kBends, bool kDamps, bool kBlows, class T>
HWY_INLINE void gather_block(const TriangleLaw<T>& law, const TriangleState<T>& state,
                             std::size_t block, T* HWY_RESTRICT force) {
  using Q = Quad<T>;
  constexpr std::size_t kBlock = TriangleLaw<T>::kBlock;
  const T *const x = state.x.data(), *const w = state.w.data();
  const T *const tension = state.tension.data(), *const wind = state.wind.data();
  const auto& from = law.blocks[block];
  const Gather<T>* gather = law.gathers.data() + block * kBlock;
  const Side* side = law.sides.data() + from.side;
  const Reach<T>* reach = law.reaches.data() + from.reach;
  const Offset* blown = law.blown.data() + from.blown;
  for (std::size_t i = 4 * block * kBlock; i < 4 * (block + 1) * kBlock; i += 4, ++gather) {
    fetch<2>(side, 1024);
    if constexpr (kBends) fetch<3>(reach, 2048);
    const Q here = Q::load(x + i);
    Q pull = Q::zero(), speed = Q::zero();

    // membrane along edges, and damping (eq. 7)
    for (std::uint32_t k = 0; k < gather->sides; ++k, ++side) {
      pull.add(tension[side->tension[0]] + tension[side->tension[1]],
               Q::apart(x + side->particle, here));
      if constexpr (kDamps) speed.add(Q::load(w + side->particle));
    }

    // bending by particles farther away: two sums, so that one need not wait for the other
    if constexpr (kBends) {
      Q even = Q::zero(), odd = Q::zero();
      for (std::uint32_t k = 0; k < gather->reaches; ++k, reach += 4) {
        even.subtract(reach[0].stiffness, Q::load(x + reach[0].particle));
        odd.subtract(reach[1].stiffness, Q::load(x + reach[1].particle));
        even.subtract(reach[2].stiffness, Q::load(x + reach[2].particle));
        odd.subtract(reach[3].stiffness, Q::load(x + reach[3].particle));
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
      for (std::uint32_t k = 0; k < gather->corners; ++k, ++blown) pull.add(Q::load(wind + *blown));
    pull.store(force + i - 4 * block * kBlock);
  }
}

// Eq. 7 and 8 for the particles of a block: drag centred, Verlet in summed form.
template <class T, class D, class V = hn::Vec<D>>
HWY_INLINE void move_block(D d, const TriangleLaw<T>& law, TriangleState<T>& state,
                           std::size_t block, const T* HWY_RESTRICT force, V drift, V air,
                           V& largest) {
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
    if (law.drags) {
      const V rate = hn::Load(d, state.drag.data() + i), one = hn::Set(d, T(1));
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
    hn::Store(hn::MulSub(hn::Set(d, T(3)), next, old), d, state.next_w.data() + i);
    hn::Store(next, d, state.d.data() + i);
    hn::Store(there, d, state.next_x.data() + i);
    if (law.measured) largest = hn::Max(largest, hn::Abs(next));
  }
}

template <bool kBends, bool kDamps, bool kBlows, class T>
void move_blocks(const TriangleLaw<T>& law, TriangleState<T>& state, int first, int last,
                 Farthest<T>& farthest) {
  using D = hn::ScalableTag<T>;
  const D d;
  constexpr std::size_t kMost = TriangleLaw<T>::kLanes;
  HWY_ALIGN T force[4 * TriangleLaw<T>::kBlock];
  HWY_ALIGN T drift[kMost], air[kMost], reached[kMost] = {};
  for (std::size_t k = 0; k < kMost; ++k) drift[k] = law.drift[k % 4], air[k] = law.air[k % 4];
  auto largest = hn::Zero(d);
  for (auto block = static_cast<std::size_t>(first); block < static_cast<std::size_t>(last);
       ++block) {
    gather_block<kBends, kDamps, kBlows>(law, state, block, force);
    move_block(d, law, state, block, force, hn::Load(d, drift), hn::Load(d, air), largest);
  }
  hn::Store(largest, d, reached);
  for (std::size_t k = 0; k < kMost; ++k) farthest[k % 4] = std::max(farthest[k % 4], reached[k]);
}

template <class T>
void strain_groups_of(const TriangleLaw<T>& law, TriangleState<T>& state, int first, int last) {
  const auto run = [&](auto pushes, auto blows) {
    strain_groups<decltype(pushes)::value, decltype(blows)::value>(law, state, first, last);
  };
  const std::true_type on;
  const std::false_type off;
  if (law.wind.blows)
    law.pushes ? run(on, on) : run(off, on);
  else
    law.pushes ? run(on, off) : run(off, off);
}

template <class T>
void move_blocks_of(const TriangleLaw<T>& law, TriangleState<T>& state, int first, int last,
                    Farthest<T>& farthest) {
  const auto with = [&](auto bends, auto damps, auto blows) {
    move_blocks<decltype(bends)::value, decltype(damps)::value, decltype(blows)::value>(
        law, state, first, last, farthest);
  };
  const std::true_type on;
  const std::false_type off;
  const auto damped = [&](auto bends, auto damps) {
    law.wind.blows ? with(bends, damps, on) : with(bends, damps, off);
  };
  const auto bent = [&](auto bends) { law.damping > 0 ? damped(bends, on) : damped(bends, off); };
  law.bends ? bent(on) : bent(off);
}

void strain_single(const TriangleLaw<float>& law, TriangleState<float>& state, int first,
                   int last) {
  strain_groups_of(law, state, first, last);
}
void strain_double(const TriangleLaw<double>& law, TriangleState<double>& state, int first,
                   int last) {
  strain_groups_of(law, state, first, last);
}
void move_single(const TriangleLaw<float>& law, TriangleState<float>& state, int first, int last,
                 Farthest<float>& farthest) {
  move_blocks_of(law, state, first, last, farthest);
}
void move_double(const TriangleLaw<double>& law, TriangleState<double>& state, int first, int last,
                 Farthest<double>& farthest) {
  move_blocks_of(law, state, first, last, farthest);
}

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace weft {

HWY_EXPORT(strain_single);
HWY_EXPORT(strain_double);
HWY_EXPORT(move_single);
HWY_EXPORT(move_double);

namespace {

template <class T>
void strain(const TriangleLaw<T>& law, TriangleState<T>& state, int first, int last) {
  if constexpr (sizeof(T) == 4)
    HWY_DYNAMIC_DISPATCH(strain_single)(law, state, first, last);
  else
    HWY_DYNAMIC_DISPATCH(strain_double)(law, state, first, last);
}
template <class T>
void move(const TriangleLaw<T>& law, TriangleState<T>& state, int first, int last,
          Farthest<T>& farthest) {
  if constexpr (sizeof(T) == 4)
    HWY_DYNAMIC_DISPATCH(move_single)(law, state, first, last, farthest);
  else
    HWY_DYNAMIC_DISPATCH(move_double)(law, state, first, last, farthest);
}

// Calls part(band, first, last) for so many shares of `count`.
template <class F>
void share(int count, int bands, ThreadPool& pool, const F& part) {
  const auto at = [&](int band) {
    return static_cast<int>(static_cast<std::int64_t>(count) * band / bands);
  };
  pool.run(bands, [&](int band) { part(band, at(band), at(band + 1)); });
}

}  // namespace

template <class T>
TriangleState<T>::TriangleState(int particles, bool compensated) {
  constexpr int kBlock = TriangleLaw<T>::kBlock;
  const auto size = 4 * static_cast<std::size_t>((particles + kBlock - 1) / kBlock * kBlock);
  for (auto* plane : {&x, &w, &d}) *plane = AlignedArray<T>(size);
  if (compensated)
    for (auto* plane : {&x_error, &d_error}) *plane = AlignedArray<T>(size);
}

template <class T>
void TriangleState<T>::release_memory() {
  for (auto* plane : {&step2, &drag, &next_x, &next_w, &tension, &wind}) *plane = {};
}

template <class T>
void TriangleState<T>::prepare(const TriangleLaw<T>& law) {
  if (next_x.size() > 0) return;
  const auto triangles = static_cast<std::size_t>(law.groups) * TriangleLaw<T>::kLanes;
  step2 = AlignedArray<T>(size());
  if (law.drags) drag = AlignedArray<T>(size());
  if (law.wind.blows) wind = AlignedArray<T>(4 * triangles);
  tension = AlignedArray<T>(3 * triangles + 1);
  next_w = AlignedArray<T>(size());
  next_x = AlignedArray<T>(size());
}

template <class T>
T sweep(const TriangleLaw<T>& law, TriangleState<T>& state, int bands, ThreadPool& pool) {
  const int blocks = static_cast<int>(law.blocks.size());
  std::vector<Farthest<T>> farthest(static_cast<std::size_t>(bands));
  if (bands == 1) {
    // no triangle comes before its first particle: what is strained is still in cache when it pulls
    constexpr int kRun = 16;
    for (int first = 0, strained = 0; first < blocks; first += kRun) {
      const int last = std::min(first + kRun, blocks);
      const int groups = law.blocks[static_cast<std::size_t>(last - 1)].groups;
      strain(law, state, std::exchange(strained, groups), groups);
      move(law, state, first, last, farthest.front());
    }
  } else {
    share(law.groups, bands, pool,
          [&](int, int first, int last) { strain(law, state, first, last); });
    share(blocks, bands, pool, [&](int band, int first, int last) {
      move(law, state, first, last, farthest[static_cast<std::size_t>(band)]);
    });
  }
  std::swap(state.x, state.next_x);
  std::swap(state.w, state.next_w);

  // by axis, so that it does not depend on the bands
  T square = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    T most = 0;
    for (const Farthest<T>& band : farthest) most = std::max(most, band[axis]);
    square += most * most;
  }
  return std::sqrt(square);
}

template struct TriangleState<float>;
template struct TriangleState<double>;
template float sweep(const TriangleLaw<float>&, TriangleState<float>&, int, ThreadPool&);
template double sweep(const TriangleLaw<double>&, TriangleState<double>&, int, ThreadPool&);

}  // namespace weft
#endif
