#include "core/lattice/tethers.h"

#include <algorithm>
#include <cmath>
#include <limits>

// compiled again for every target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/lattice/tethers.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/motion/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {

// Some lanes of the particles of a row.
template <class T>
class TetheredVector {
  using D = hn::ScalableTag<T>;
  using V = hn::Vec<D>;
  using State = SweepState<T>;
  static constexpr int kLanes = LatticeLayout<T>::kLanes;

 public:
  TetheredVector(T* shared, T* local)
      : shared_(shared),
        local_(local),
        x_(load(at(State::kX))),
        d_(load(at(State::kD))),
        by_(zero()),
        moved_(hn::FirstN(D(), 0)) {}

  // Those that are beyond come back; how far.
  HWY_INLINE V pull_back(const Triple<V>& end, const Triple<V>& end_d, V length, V inward) {
    const D d;
    const Triple<V> apart = minus(x_, end);
    const V distance2 = squared(apart);
    const auto beyond = hn::Gt(distance2, hn::Mul(length, length));
    if (hn::AllFalse(d, beyond)) return hn::Zero(d);
    const V inverse = inverse_sqrt(d, Each<V, 1>{distance2})[0];
    const Triple<V> out = times(apart, inverse);
    const V most = hn::Add(dot(minus(d_, end_d), out), inward);
    const V excess = hn::MulSub(distance2, inverse, length);
    const V back = hn::IfThenElseZero(beyond, hn::Max(hn::Zero(d), hn::Min(excess, most)));
    x_ = minus_times(x_, out, back);
    d_ = minus_times(d_, out, back);
    by_ = minus_times(by_, out, back);
    moved_ = hn::Or(moved_, beyond);
    return back;
  }

  HWY_INLINE void store(bool compensated, T lead) const {
    if (hn::AllFalse(D(), moved_)) return;
    store_axis(compensated, lead, 0, by_.x);
    store_axis(compensated, lead, 1, by_.y);
    store_axis(compensated, lead, 2, by_.z);
  }

 private:
  static HWY_INLINE Triple<V> zero() {
    const V v = hn::Zero(D());
    return {v, v, v};
  }
  static HWY_INLINE Triple<V> load(const T* p) {
    const D d;
    return {hn::Load(d, p), hn::Load(d, p + kLanes), hn::Load(d, p + 2 * kLanes)};
  }
  T* at(int plane) const {
    return plane < State::kShared ? shared_ + plane * kLanes
                                  : local_ + (plane - State::kShared) * kLanes;
  }

  HWY_INLINE void store_axis(bool compensated, T lead, int axis, V by) const {
    const D d;
    add(compensated, at(State::kX + axis), at(State::kXError + axis), by);
    add(compensated, at(State::kD + axis), at(State::kDError + axis), by);
    T* const w = at(State::kW + axis);
    put(hn::MulAdd(by, hn::Set(d, lead), hn::Load(d, w)), w);
  }
  HWY_INLINE void add(bool compensated, T* value, T* error, V by) const {
    const D d;
    const V old = hn::Load(d, value);
    if (compensated) by = hn::Sub(by, hn::Load(d, error));
    const V sum = hn::Add(old, by);
    put(sum, value);
    if (compensated) put(hn::Sub(hn::Sub(sum, old), by), error);
  }
  // To the lanes that have moved: masked stores are slower.
  HWY_INLINE void put(V v, T* to) const {
    const D d;
    hn::Store(hn::IfThenElse(moved_, v, hn::Load(d, to)), d, to);
  }

  T *const shared_, *const local_;
  Triple<V> x_, d_, by_;  // by_: what both change by
  hn::Mask<D> moved_;
};

template <class T>
T pull_back_as(const LatticeTethers<T>& tethers, T inward, bool compensated, int first, int last,
               SweepState<T>& state) {
  using State = SweepState<T>;
  using D = hn::ScalableTag<T>;
  using V = hn::Vec<D>;
  const D d;
  constexpr int kLanes = LatticeLayout<T>::kLanes;
  const int step = static_cast<int>(hn::Lanes(d));
  const V most = hn::Set(d, inward);
  V farthest = hn::Zero(d);
  for (int row = first; row < last; ++row)
    for (int j = 0; j < state.vectors(); ++j)
      for (int part = 0; part < kLanes; part += step) {
        TetheredVector<T> particles(state.shared(row) + j * State::kSharedStride + part,
                                    state.local(row) + j * state.local_stride() + part);
        const int vector = row * state.vectors() + j;
        for (const LatticeAttachment<T>& attachment : tethers.attachments()) {
          const T* const end =
              attachment.end.data() + (attachment.single ? 0 : 6 * kLanes * vector) + part;
          const auto of = [&](int value) HWY_ATTR { return hn::Load(d, end + value * kLanes); };
          const V length = hn::Load(d, attachment.length.data() + kLanes * vector + part);
          const V back =
              particles.pull_back({of(0), of(1), of(2)}, {of(3), of(4), of(5)}, length, most);
          farthest = hn::Max(farthest, back);
        }
        particles.store(compensated, state.lead());
      }
  return hn::GetLane(hn::MaxOfLanes(d, farthest));
}

float pull_back_single(const LatticeTethers<float>& tethers, float inward, bool compensated,
                       int first, int last, SweepState<float>& state) {
  return pull_back_as(tethers, inward, compensated, first, last, state);
}
double pull_back_double(const LatticeTethers<double>& tethers, double inward, bool compensated,
                        int first, int last, SweepState<double>& state) {
  return pull_back_as(tethers, inward, compensated, first, last, state);
}

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace weft {

HWY_EXPORT(pull_back_single);
HWY_EXPORT(pull_back_double);

template <>
float pull_back_rows(const LatticeTethers<float>& tethers, float inward, bool compensated,
                     int first, int last, SweepState<float>& state) {
  return HWY_DYNAMIC_DISPATCH(pull_back_single)(tethers, inward, compensated, first, last, state);
}
template <>
double pull_back_rows(const LatticeTethers<double>& tethers, double inward, bool compensated,
                      int first, int last, SweepState<double>& state) {
  return HWY_DYNAMIC_DISPATCH(pull_back_double)(tethers, inward, compensated, first, last, state);
}

template <class T>
LatticeTethers<T>::LatticeTethers(const Tethers& tethers, const LatticeLayout<T>& layout)
    : tethers_(&tethers), layout_(layout) {
  constexpr int kLanes = LatticeLayout<T>::kLanes;
  const auto size = static_cast<std::size_t>(layout.rows * layout.vectors() * kLanes);
  for (const Attachment& attachment : tethers) {
    LatticeAttachment<T>& made = attachments_.emplace_back();
    made.single = attachment.held.size() == 1;
    made.end = AlignedArray<T>(6 * (made.single ? kLanes : size));
    made.length = AlignedArray<T>(size);
    std::fill_n(made.length.data(), size, std::numeric_limits<T>::infinity());
    for (std::size_t i = 0; i < attachment.length.size(); ++i) {
      const auto [vector, lane] = place(static_cast<int>(i));
      made.length.data()[vector * kLanes + lane] = static_cast<T>(attachment.length[i]);
    }
  }
}

template <class T>
void LatticeTethers<T>::read_ends(const SweepState<T>& state) {
  using State = SweepState<T>;
  constexpr int kLanes = LatticeLayout<T>::kLanes;
  for (std::size_t k = 0; k < attachments_.size(); ++k) {
    const Attachment& attachment = (*tethers_)[k];
    T* const end = attachments_[k].end.data();
    const auto put = [&](int held, T* to) {
      const auto from = state.place(held / layout_.columns, held % layout_.columns);
      for (int axis = 0; axis < 3; ++axis) {
        to[axis * kLanes] = from[State::kX + axis];
        to[(3 + axis) * kLanes] = from[State::kD + axis];
      }
    };
    if (attachments_[k].single) {
      for (int lane = 0; lane < kLanes; ++lane) put(attachment.held[0], end + lane);
      continue;
    }
    for (std::size_t i = 0; i < attachment.nearest.size(); ++i) {
      const auto at = place(static_cast<int>(i));
      put(attachment.held[static_cast<std::size_t>(attachment.nearest[i])],
          end + at.vector * 6 * kLanes + at.lane);
    }
  }
}

template class LatticeTethers<float>;
template class LatticeTethers<double>;

namespace {

void measure_tethers(const Grid& grid, Attachment& attachment) {
  for (std::size_t i = 0; i < attachment.length.size(); ++i) {
    const int row = static_cast<int>(i) / grid.columns, column = static_cast<int>(i) % grid.columns;
    int least = std::numeric_limits<int>::max();  // spacings squared
    for (std::size_t k = 0; k < attachment.held.size(); ++k) {
      const int down = attachment.held[k] / grid.columns - row;
      const int along = attachment.held[k] % grid.columns - column;
      const int squared = down * down + along * along;
      if (squared >= least) continue;
      least = squared;
      attachment.nearest[i] = static_cast<int>(k);
    }
    attachment.length[i] = grid.spacing * std::sqrt(least);
  }
}

}  // namespace

void measure_tethers(const Grid& grid, Tethers& tethers) {
  for (Attachment& attachment : tethers) measure_tethers(grid, attachment);
}

}  // namespace weft
#endif
