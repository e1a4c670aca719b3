#include "core/motion/lattice_sweep.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

// compiled again for every target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/motion/lattice_sweep.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

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

// Of the four directions from a particle: along its row, down its column, and down to either side.
// Side by side, their long chains of operations fill the processor.
template <class V>
struct Four {
  V along, down, right, left;
};

// A step of third order towards 1 / sqrt(v).
template <class D, class V = hn::Vec<D>>
HWY_INLINE Four<V> closer(D d, const Four<V>& v, const Four<V>& y) {
  using T = hn::TFromD<D>;
  const V one = hn::Set(d, T(1)), half = hn::Set(d, T(0.5)), three_eighths = hn::Set(d, T(0.375));
  const Four<V> vy{hn::Mul(v.along, y.along), hn::Mul(v.down, y.down), hn::Mul(v.right, y.right),
                   hn::Mul(v.left, y.left)};
  const Four<V> h{hn::NegMulAdd(vy.along, y.along, one), hn::NegMulAdd(vy.down, y.down, one),
                  hn::NegMulAdd(vy.right, y.right, one), hn::NegMulAdd(vy.left, y.left, one)};
  const Four<V> p{hn::MulAdd(h.along, three_eighths, half), hn::MulAdd(h.down, three_eighths, half),
                  hn::MulAdd(h.right, three_eighths, half),
                  hn::MulAdd(h.left, three_eighths, half)};
  const Four<V> q{hn::Mul(y.along, h.along), hn::Mul(y.down, h.down), hn::Mul(y.right, h.right),
                  hn::Mul(y.left, h.left)};
  return {hn::MulAdd(q.along, p.along, y.along), hn::MulAdd(q.down, p.down, y.down),
          hn::MulAdd(q.right, p.right, y.right), hn::MulAdd(q.left, p.left, y.left)};
}

// 1 / sqrt(v) from an integer start, unlike the processors' own approximations with equal bits
// everywhere. Finite at 0.
template <class D, class V = hn::Vec<D>>
HWY_INLINE Four<V> inverse_sqrt(D d, const Four<V>& v) {
  using T = hn::TFromD<D>;
  const hn::RebindToUnsigned<D> du;
  using U = hn::TFromD<decltype(du)>;
  constexpr bool kSingle = sizeof(T) == 4;
  const auto magic = hn::Set(du, static_cast<U>(kSingle ? 0x5f375a86u : 0x5fe6eb50c7b537a9u));
  const auto start = [&](V u) HWY_ATTR {
    return hn::BitCast(d, hn::Sub(magic, hn::ShiftRight<1>(hn::BitCast(du, u))));
  };
  Four<V> y{start(v.along), start(v.down), start(v.right), start(v.left)};
  y = closer(d, v, y);
  y = closer(d, v, y);
  if constexpr (!kSingle) y = closer(d, v, y);
  return y;
}

// k (1 - L / l) where positive, N/m (eq. 2); y = 1 / l.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V stretch(D d, const StretchLaw<hn::TFromD<D>>& law, V y) {
  return hn::Max(hn::NegMulAdd(hn::Set(d, law.rest), y, hn::Set(d, law.stiffness)), hn::Zero(d));
}

// intercept + slope l of the segment that `at` lies in.
template <BendKind kKind, class D, class V = hn::Vec<D>>
HWY_INLINE V line(D d, const BendLaw<hn::TFromD<D>>& law, V at, V l) {
  using T = hn::TFromD<D>;
  const T* const a = law.intercepts.data();
  const T* const b = law.slopes.data();
#if HWY_TARGET == HWY_AVX3
  // the tables stand in registers; an index beyond them is a length that pulls at nothing
  if constexpr (kKind == BendKind::kTable32 && sizeof(T) == 4) {
    const __m512i i = _mm512_cvttps_epi32(at.raw);
    const auto pick = [&](const T* table) HWY_ATTR {
      return V{_mm512_permutex2var_ps(hn::Load(d, table).raw, i, hn::Load(d, table + 16).raw)};
    };
    return hn::MulAdd(pick(b), l, pick(a));
  }
  if constexpr (kKind == BendKind::kTable32 && sizeof(T) == 8) {
    const __m512i i = _mm512_cvttpd_epi64(at.raw);
    const __mmask8 upper = _mm512_test_epi64_mask(i, _mm512_set1_epi64(16));
    const auto pick = [&](const T* table) HWY_ATTR {
      const auto half = [&](const T* from) HWY_ATTR {
        return _mm512_permutex2var_pd(hn::Load(d, from).raw, i, hn::Load(d, from + 8).raw);
      };
      return V{_mm512_mask_blend_pd(upper, half(table), half(table + 16))};
    };
    return hn::MulAdd(pick(b), l, pick(a));
  }
#endif
  const hn::RebindToSigned<D> di;
  const V last = hn::Set(d, law.last);
  const auto i = hn::ConvertTo(di, hn::IfThenElse(hn::Lt(at, last), at, last));  // NaN: the last
  return hn::MulAdd(hn::GatherIndex(d, b, i), l, hn::GatherIndex(d, a, i));
}

// max(f_b, c_b (l - L)) / l where negative, N/m (eq. 3 to 5); y = 1 / l.
template <BendKind kKind, class D, class V = hn::Vec<D>>
HWY_INLINE V bend(D d, const BendLaw<hn::TFromD<D>>& law, int terms, V l, V y) {
  using T = hn::TFromD<D>;
  const V at = hn::Mul(l, hn::Set(d, law.to_index));
  V f = hn::Zero(d);
  if constexpr (kKind == BendKind::kPolynomial) {
    const V t = hn::Sub(at, hn::Set(d, T(1)));
    f = hn::Set(d, law.intercepts.data()[0]);
    for (int k = 1; k < terms; ++k) f = hn::MulAdd(f, t, hn::Set(d, law.intercepts.data()[k]));
  } else {
    f = line<kKind>(d, law, at, l);
  }
  const V clamp = hn::MulSub(hn::Set(d, law.clamp), l, hn::Set(d, law.clamp_rest));
  return hn::Mul(hn::Min(hn::Max(f, clamp), hn::Zero(d)), y);
}

// A sweep from the row above the first one down. In row r it evaluates the connections that lead
// down from r, and those along row r + 1, so that what it hands to the rows below is read back only
// a row later. Row r has then heard of all its connections, and moves.
template <class T, BendKind kBend>
class Sweep {
 public:
  Sweep(const SweepLaw<T>& law, SweepState<T>& state, T* work)
      : law_(law),
        state_(state),
        stride_(law.layout.stride()),
        work_(work + RowLayout::kLanes),
        largest_(hn::Zero(D())) {}

  static std::size_t work_size(const RowLayout& layout) {
    return static_cast<std::size_t>(3 * (kHands * kHandRows + kSums * kSumRows) * layout.stride() +
                                    2 * RowLayout::kLanes);
  }

  T run() {
    const int rows = law_.layout.rows;
    const bool damped = law_.damping > 0;
    if (damped) sum_row(0), sum_row(1);
    for (int r = -1; r < rows; ++r) {
      if (damped && r >= 0 && r + 2 < rows) sum_row(r + 2);
      sweep_row(r);
    }
    return std::sqrt(hn::GetLane(hn::MaxOfLanes(D(), largest_)));
  }

 private:
  using D = hn::ScalableTag<T>;
  using V = hn::Vec<D>;
  using M = hn::Mask<D>;
  using State = SweepState<T>;
  static constexpr bool kBends = kBend != BendKind::kNone;
  static constexpr bool kSprings = kBends && kBend != BendKind::kIsometric;

  // Forces handed to a row, by the column they go to: kept as they are for it, and with the sign
  // of the particle that they come from for the columns beside it.
  enum { kSame, kRight1, kLeft1, kRight2, kLeft2, kHands };
  static constexpr int kHandRows = 3;
  // Sums of w over the columns c - 1 ... c + 1, over c - 2, c, c + 2, and what rows two away see.
  enum { kNear, kFar, kFarSeen, kSums };
  static constexpr int kSumRows = 5;

  // Lanes whose column exists, and has these neighbours.
  struct Masks {
    M here, right1, right2, left1, left2;
  };

  // What the vectors of a row share.
  struct Row {
    bool moves, twists;        // r exists; r + 1 and r + 2 do
    T *here, *below, *below2;  // planes of r, r + 1, r + 2
    T *hands, *hands1, *hands2;
    const T *near_above, *near, *near_below, *far_above, *far, *far_below;
    StretchLaw<T> warp, weft, shear;
    const BendLaw<T>*along_warp, *along_weft, *diagonal;
    T isometric_warp, isometric_weft;
    T row_share;            // of connections along row r + 1
    T near_rows, far_rows;  // rows among r - 1 ... r + 1, and among r - 2, r, r + 2
  };

  T* hands(int r) const { return work_ + 3 * kHands * ((r + kHandRows) % kHandRows) * stride_; }
  T* sums(int which, int r) const {
    const int place = kHands * kHandRows + which * kSumRows + (r + kSumRows) % kSumRows;
    return work_ + 3 * place * stride_;
  }

  HWY_INLINE Triple<V> fetch(const T* p) const {
    const D d;
    return {hn::LoadU(d, p), hn::LoadU(d, p + stride_), hn::LoadU(d, p + 2 * stride_)};
  }
  HWY_INLINE void store(const Triple<V>& f, T* p) const {
    const D d;
    hn::StoreU(f.x, d, p);
    hn::StoreU(f.y, d, p + stride_);
    hn::StoreU(f.z, d, p + 2 * stride_);
  }
  template <bool kBorder>
  static HWY_INLINE V only(M valid, V v) {
    return kBorder ? hn::IfThenElseZero(valid, v) : v;
  }
  template <bool kBorder>
  HWY_INLINE Triple<V> load(const T* p, M valid) const {
    const Triple<V> v = fetch(p);
    return {only<kBorder>(valid, v.x), only<kBorder>(valid, v.y), only<kBorder>(valid, v.z)};
  }
  HWY_INLINE V load_column(const AlignedArray<T>& values, int c) const {
    return hn::LoadU(D(), values.data() + RowLayout::kLanes + c);
  }

  HWY_INLINE Masks masks(int c) const {
    const auto first = [](int n) HWY_ATTR {
      return hn::FirstN(D(), static_cast<std::size_t>(std::max(0, n)));
    };
    const int n = law_.layout.columns - c;
    const M here = first(n);
    return {here, first(n - 1), first(n - 2), hn::AndNot(first(1 - c), here),
            hn::AndNot(first(2 - c), here)};
  }

  template <bool kBorder>
  HWY_INLINE void sum_vector(const T* w, T* near, T* far, T* far_seen, const Masks& valid) const {
    const D d;
    const V here = only<kBorder>(valid.here, hn::LoadU(d, w));
    const V left1 = only<kBorder>(valid.left1, hn::LoadU(d, w - 1));
    const V right1 = only<kBorder>(valid.right1, hn::LoadU(d, w + 1));
    hn::StoreU(hn::Add(hn::Add(left1, here), right1), d, near);
    if (!law_.damp_far) return;
    const V left2 = only<kBorder>(valid.left2, hn::LoadU(d, w - 2));
    const V right2 = only<kBorder>(valid.right2, hn::LoadU(d, w + 2));
    hn::StoreU(hn::Add(hn::Add(left2, here), right2), d, far);
    if (!law_.damp_far_diagonal) hn::StoreU(here, d, far_seen);
  }

  void sum_row(int r) const {
    const int lanes = static_cast<int>(hn::Lanes(D())), columns = law_.layout.columns;
    const T* const w = state_.row(State::kW, r);
    T *const near = sums(kNear, r), *const far = sums(kFar, r), *const seen = sums(kFarSeen, r);
    for (int c = 0; c < columns; c += lanes) {
      const bool border = c == 0 || c + lanes + 2 > columns;
      const Masks valid = border ? masks(c) : Masks{};
      for (int axis = 0; axis < 3; ++axis) {
        const std::ptrdiff_t at = axis * stride_ + c;
        if (border)
          sum_vector<true>(w + at, near + at, far + at, seen + at, valid);
        else
          sum_vector<false>(w + at, near + at, far + at, seen + at, valid);
      }
    }
  }

  Row describe(int r) const {
    const int rows = law_.layout.rows;
    const bool moves = r >= 0, next = r + 1 < rows, after = r + 2 < rows;
    const bool damps_diagonal = law_.damp_far_diagonal;
    Row row{};
    row.moves = moves;
    row.twists = after;
    row.here = state_.row(0, std::max(r, 0));
    row.below = state_.row(0, std::min(r + 1, rows - 1));
    row.below2 = state_.row(0, std::min(r + 2, rows - 1));
    row.hands = hands(r);
    row.hands1 = hands(r + 1);
    row.hands2 = hands(r + 2);
    row.near_above = sums(kNear, r - 1);
    row.near = sums(kNear, r);
    row.near_below = sums(kNear, r + 1);
    row.far = sums(kFar, r);
    row.far_above = sums(damps_diagonal ? kFar : kFarSeen, r - 2);
    row.far_below = sums(damps_diagonal ? kFar : kFarSeen, r + 2);
    row.row_share = r + 1 == 0 || r + 1 == rows - 1 ? law_.edge_share : T(1);
    if (next) row.warp = {law_.warp.stiffness * row.row_share, law_.warp.rest * row.row_share};
    if (moves && next) row.weft = law_.weft, row.shear = law_.shear;
    row.along_warp = next ? &law_.along_warp : &law_.none;
    row.along_weft = moves && after ? &law_.along_weft : &law_.none;
    row.diagonal = moves && after ? &law_.diagonal : &law_.none;
    row.isometric_warp = next ? law_.isometric_warp * row.row_share : T(0);
    row.isometric_weft = moves && after ? law_.isometric_weft : T(0);
    row.near_rows = static_cast<T>((r > 0) + 1 + next);
    row.far_rows = static_cast<T>((r > 1) + 1 + after);
    // rows that do not exist are not summed: their slots hold what is long gone
    if (moves && r + 1 >= rows) clear(kNear, r + 1);
    if (moves && r + 2 >= rows) clear(kFar, r + 2), clear(kFarSeen, r + 2);
    return row;
  }
  void clear(int which, int r) const {
    std::memset(sums(which, r), 0, static_cast<std::size_t>(3 * stride_) * sizeof(T));
  }

  void sweep_row(int r) {
    const int lanes = static_cast<int>(hn::Lanes(D())), columns = law_.layout.columns;
    const Row row = describe(r);
    int c = 0;
    sweep_vector<true>(row, c);
    for (c = lanes; c + lanes + 2 <= columns; c += lanes) sweep_vector<false>(row, c);
    for (; c < columns; c += lanes) sweep_vector<true>(row, c);
  }

  template <bool kBorder>
  HWY_INLINE void sweep_vector(const Row& row, int c) {
    const D d;
    const Masks valid = kBorder ? masks(c) : Masks{};
    const Triple<V> here = load<kBorder>(row.here + c, valid.here);
    const Triple<V> below = load<kBorder>(row.below + c, valid.here);

    // what connections from above and beside have handed to row r, and so far to r + 1
    const std::ptrdiff_t hand = 3 * stride_;
    Triple<V> own = fetch(row.hands + c);
    own = minus(own, fetch(row.hands + kRight1 * hand + c - 1));
    if (law_.shear.stiffness > 0) own = minus(own, fetch(row.hands + kLeft1 * hand + c + 1));
    if (kBends) own = minus(own, fetch(row.hands + kRight2 * hand + c - 2));
    if (kSprings && law_.bend_diagonal) own = minus(own, fetch(row.hands + kLeft2 * hand + c + 2));
    Triple<V> next{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    if (kBends) next = fetch(row.hands1 + c);

    add_stretch<kBorder>(row, c, valid, here, below, own, next);
    if constexpr (kSprings) add_bend<kBorder>(row, c, valid, here, below, own, next);
    if constexpr (kBend == BendKind::kIsometric)
      add_isometric<kBorder>(row, c, valid, here, below, own, next);
    store(next, row.hands1 + c);

    if (row.moves) move<kBorder>(row, c, valid, own);
  }

  // Stretch and shear (eq. 2).
  template <bool kBorder>
  HWY_INLINE void add_stretch(const Row& row, int c, const Masks& valid, const Triple<V>& here,
                              const Triple<V>& below, Triple<V>& own, Triple<V>& next) {
    const D d;
    const std::ptrdiff_t hand = 3 * stride_;
    const Triple<V> below_right = load<kBorder>(row.below + c + 1, valid.right1);
    const Triple<V> along = minus(below_right, below), down = minus(below, here);
    Triple<V> to_right = kBend == BendKind::kIsometric
                             ? fetch(row.hands1 + kRight1 * hand + c)
                             : Triple<V>{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    if (law_.shear.stiffness > 0) {
      const Triple<V> right = minus(below_right, here);
      const Triple<V> left = minus(load<kBorder>(row.below + c - 1, valid.left1), here);
      const Four<V> y =
          inverse_sqrt(d, Four<V>{squared(along), squared(down), squared(right), squared(left)});
      const V s_along = only<kBorder>(valid.right1, stretch(d, row.warp, y.along));
      V s_down = stretch(d, row.weft, y.down);
      if (kBorder) s_down = hn::Mul(s_down, load_column(law_.column_share, c));
      const V s_right = only<kBorder>(valid.right1, stretch(d, row.shear, y.right));
      const V s_left = only<kBorder>(valid.left1, stretch(d, row.shear, y.left));
      own = plus_times(plus_times(plus_times(own, down, s_down), right, s_right), left, s_left);
      next = plus_times(minus_times(next, down, s_down), along, s_along);
      to_right = plus_times(plus_times(to_right, along, s_along), right, s_right);
      store(times(left, s_left), row.hands1 + kLeft1 * hand + c);
    } else {
      const V a = squared(along), b = squared(down);
      const Four<V> y = inverse_sqrt(d, Four<V>{a, b, a, b});
      const V s_along = only<kBorder>(valid.right1, stretch(d, row.warp, y.along));
      V s_down = stretch(d, row.weft, y.down);
      if (kBorder) s_down = hn::Mul(s_down, load_column(law_.column_share, c));
      own = plus_times(own, down, s_down);
      next = plus_times(minus_times(next, down, s_down), along, s_along);
      to_right = plus_times(to_right, along, s_along);
    }
    store(to_right, row.hands1 + kRight1 * hand + c);
  }

  // Interlaced connections (eq. 3 to 5).
  template <bool kBorder>
  HWY_INLINE void add_bend(const Row& row, int c, const Masks& valid, const Triple<V>& here,
                           const Triple<V>& below, Triple<V>& own, Triple<V>& next) {
    const D d;
    const std::ptrdiff_t hand = 3 * stride_;
    const int terms = law_.terms;
    const Triple<V> along = minus(load<kBorder>(row.below + c + 2, valid.right2), below);
    const Triple<V> down = minus(load<kBorder>(row.below2 + c, valid.here), here);
    T* const to_right = row.hands1 + kRight2 * hand + c;
    const Triple<V> none{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    if (law_.bend_diagonal) {
      const Triple<V> right = minus(load<kBorder>(row.below2 + c + 2, valid.right2), here);
      const Triple<V> left = minus(load<kBorder>(row.below2 + c - 2, valid.left2), here);
      const Four<V> l2{squared(along), squared(down), squared(right), squared(left)};
      const Four<V> y = inverse_sqrt(d, l2);
      const Four<V> l{hn::Mul(l2.along, y.along), hn::Mul(l2.down, y.down),
                      hn::Mul(l2.right, y.right), hn::Mul(l2.left, y.left)};
      V s_along = bend<kBend>(d, *row.along_warp, terms, l.along, y.along);
      V s_down = bend<kBend>(d, *row.along_weft, terms, l.down, y.down);
      V s_right = bend<kBend>(d, *row.diagonal, terms, l.right, y.right);
      V s_left = bend<kBend>(d, *row.diagonal, terms, l.left, y.left);
      s_along = only<kBorder>(valid.right2, hn::Mul(s_along, hn::Set(d, row.row_share)));
      if (kBorder) s_down = hn::Mul(s_down, load_column(law_.column_share, c));
      s_right = only<kBorder>(valid.right2, s_right);
      s_left = only<kBorder>(valid.left2, s_left);
      own = plus_times(plus_times(plus_times(own, down, s_down), right, s_right), left, s_left);
      next = plus_times(next, along, s_along);
      store(plus_times(fetch(to_right), along, s_along), to_right);
      store(minus_times(none, down, s_down), row.hands2 + c);
      store(times(right, s_right), row.hands2 + kRight2 * hand + c);
      store(times(left, s_left), row.hands2 + kLeft2 * hand + c);
    } else {
      const V a = squared(along), b = squared(down);
      const Four<V> y = inverse_sqrt(d, Four<V>{a, b, a, b});
      V s_along = bend<kBend>(d, *row.along_warp, terms, hn::Mul(a, y.along), y.along);
      V s_down = bend<kBend>(d, *row.along_weft, terms, hn::Mul(b, y.down), y.down);
      s_along = only<kBorder>(valid.right2, hn::Mul(s_along, hn::Set(d, row.row_share)));
      if (kBorder) s_down = hn::Mul(s_down, load_column(law_.column_share, c));
      own = plus_times(own, down, s_down);
      next = plus_times(next, along, s_along);
      store(times(along, s_along), to_right);
      store(minus_times(none, down, s_down), row.hands2 + c);
    }
  }

  // Stencils 1, -2, 1 along row r + 1 and down the column, and 1, -1, -1, 1 over the cell between
  // rows r + 1 and r + 2 (Bergou et al. 2006).
  template <bool kBorder>
  HWY_INLINE void add_isometric(const Row& row, int c, const Masks& valid, const Triple<V>& here,
                                const Triple<V>& below, Triple<V>& own, Triple<V>& next) {
    const D d;
    const std::ptrdiff_t hand = 3 * stride_;
    const V two = hn::Set(d, T(2)), one = hn::Set(d, T(1));
    const Triple<V> none{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    const Triple<V> right1 = load<kBorder>(row.below + c + 1, valid.right1);
    const Triple<V> right2 = load<kBorder>(row.below + c + 2, valid.right2);
    const Triple<V> below2 = load<kBorder>(row.below2 + c, valid.here);
    const Triple<V> below2_right = load<kBorder>(row.below2 + c + 1, valid.right1);
    T* const to_right = row.hands1 + kRight1 * hand + c;

    const V k_along = only<kBorder>(valid.right2, hn::Set(d, row.isometric_warp));
    const Triple<V> along = times(minus_times(plus(below, right2), right1, two), k_along);
    next = minus(next, along);
    Triple<V> right = minus_times(fetch(to_right), along, two);
    store(along, row.hands1 + kRight2 * hand + c);

    V k_down = hn::Set(d, row.isometric_weft);
    if (kBorder) k_down = hn::Mul(k_down, load_column(law_.column_share, c));
    const Triple<V> down = times(minus_times(plus(here, below2), below, two), k_down);
    own = minus(own, down);
    next = plus_times(next, down, two);
    Triple<V> after = minus(none, down);

    const V k_twist =
        only<kBorder>(valid.right1, hn::Set(d, row.twists ? law_.isometric_twist : T(0)));
    const Triple<V> twist = times(minus(plus(below, below2_right), plus(right1, below2)), k_twist);
    next = minus(next, twist);
    right = minus(right, twist);
    after = plus_times(after, twist, one);
    store(right, to_right);
    store(after, row.hands2 + c);
    store(twist, row.hands2 + kRight1 * hand + c);
  }

  // Eq. 7 and 8: damping as sums of w over the neighbours, drag centred, Verlet in summed form.
  template <bool kBorder>
  HWY_INLINE void move(const Row& row, int c, const Masks& valid, const Triple<V>& force) {
    const D d;
    const V step2 = only<kBorder>(valid.here, hn::LoadU(d, row.here + State::kStep2 * stride_ + c));
    V count = hn::Zero(d);
    if (law_.damping > 0) count = neighbours<kBorder>(row, c);
    const V x = move_axis<kBorder>(row, 0, c, valid, force.x, step2, count);
    const V y = move_axis<kBorder>(row, 1, c, valid, force.y, step2, count);
    const V z = move_axis<kBorder>(row, 2, c, valid, force.z, step2, count);
    if (law_.measured) largest_ = hn::Max(largest_, squared(Triple<V>{x, y, z}));
  }

  // How many values the sums of w hold, the particle's own included.
  template <bool kBorder>
  HWY_INLINE V neighbours(const Row& row, int c) const {
    const D d;
    const V near = kBorder ? load_column(law_.near_columns, c) : hn::Set(d, T(3));
    const V far = kBorder ? load_column(law_.far_columns, c) : hn::Set(d, T(3));
    V count = hn::Mul(near, hn::Set(d, row.near_rows));
    if (law_.damp_far_diagonal)
      count = hn::MulAdd(far, hn::Set(d, row.far_rows), count);
    else if (law_.damp_far)
      count = hn::Add(hn::Add(far, hn::Set(d, row.far_rows - 1)), count);
    return count;
  }

  template <bool kBorder>
  HWY_INLINE V move_axis(const Row& row, int axis, int c, const Masks& valid, V force, V step2,
                         V count) {
    const D d;
    const std::ptrdiff_t in_plane = axis * stride_ + c;
    const auto plane = [&](int which) HWY_ATTR { return row.here + which * stride_ + in_plane; };
    const V old = only<kBorder>(valid.here, hn::LoadU(d, plane(State::kD)));
    const V at = only<kBorder>(valid.here, hn::LoadU(d, plane(State::kX)));

    if (law_.damping > 0) {
      const auto part = [&](const T* sum) HWY_ATTR { return hn::LoadU(d, sum + in_plane); };
      V sum = hn::Add(hn::Add(part(row.near_above), part(row.near)), part(row.near_below));
      if (law_.damp_far) {
        sum = hn::Add(sum, part(row.far));
        sum = hn::Add(sum, hn::Add(part(row.far_above), part(row.far_below)));
      }
      const V w = only<kBorder>(valid.here, hn::LoadU(d, plane(State::kW)));
      force = hn::MulAdd(hn::Set(d, law_.damping), hn::NegMulAdd(count, w, sum), force);
    }
    const V drift = hn::Set(d, law_.drift[static_cast<std::size_t>(axis)]);
    V change = hn::MulAdd(force, step2, hn::IfThenElseZero(hn::Gt(step2, hn::Zero(d)), drift));
    if (law_.drag > 0) {
      change = hn::Mul(hn::NegMulAdd(hn::Set(d, law_.drag), old, change),
                       hn::Set(d, T(1) / (T(1) + law_.drag / 2)));
      change = hn::IfThenElseZero(hn::Gt(step2, hn::Zero(d)), change);
    }

    V next = hn::Zero(d), there = hn::Zero(d);
    if (law_.compensated) {
      const V add = hn::Sub(change, only<kBorder>(valid.here, hn::LoadU(d, plane(State::kDError))));
      next = hn::Add(old, add);
      hn::StoreU(hn::Sub(hn::Sub(next, old), add), d, plane(State::kDError));
      const V by = hn::Sub(next, only<kBorder>(valid.here, hn::LoadU(d, plane(State::kXError))));
      there = hn::Add(at, by);
      hn::StoreU(hn::Sub(hn::Sub(there, at), by), d, plane(State::kXError));
    } else {
      next = hn::Add(old, change);
      there = hn::Add(at, next);
    }
    hn::StoreU(hn::MulSub(hn::Set(d, T(3)), next, old), d, plane(State::kW));
    hn::StoreU(next, d, plane(State::kD));
    hn::StoreU(there, d, plane(State::kX));
    return next;
  }

  const SweepLaw<T>& law_;
  SweepState<T>& state_;
  const std::ptrdiff_t stride_;
  T* const work_;
  V largest_;  // |d|^2, m^2
};

template <class T>
T sweep_lattice(const SweepLaw<T>& law, SweepState<T>& state) {
  static thread_local AlignedArray<T> work;
  const std::size_t size = Sweep<T, BendKind::kNone>::work_size(law.layout);
  if (work.size() < size) work = AlignedArray<T>(size);
  std::memset(work.data(), 0, size * sizeof(T));
  switch (law.bend) {
    case BendKind::kNone:
      return Sweep<T, BendKind::kNone>(law, state, work.data()).run();
    case BendKind::kTable32:
      return Sweep<T, BendKind::kTable32>(law, state, work.data()).run();
    case BendKind::kTable:
      return Sweep<T, BendKind::kTable>(law, state, work.data()).run();
    case BendKind::kPolynomial:
      return Sweep<T, BendKind::kPolynomial>(law, state, work.data()).run();
    case BendKind::kIsometric:
      break;
  }
  return Sweep<T, BendKind::kIsometric>(law, state, work.data()).run();
}

float sweep_single(const SweepLaw<float>& law, SweepState<float>& state) {
  return sweep_lattice(law, state);
}
double sweep_double(const SweepLaw<double>& law, SweepState<double>& state) {
  return sweep_lattice(law, state);
}

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace weft {

HWY_EXPORT(sweep_single);
HWY_EXPORT(sweep_double);

float sweep(const SweepLaw<float>& law, SweepState<float>& state) {
  return HWY_DYNAMIC_DISPATCH(sweep_single)(law, state);
}
double sweep(const SweepLaw<double>& law, SweepState<double>& state) {
  return HWY_DYNAMIC_DISPATCH(sweep_double)(law, state);
}

bool sweeps_with_fma() { return (hwy::SupportedTargets() & (HWY_AVX2 | HWY_AVX3 | HWY_NEON)) != 0; }

template <class T>
AlignedArray<T>::AlignedArray(std::size_t size)
    : data_(static_cast<T*>(std::aligned_alloc(64, (size * sizeof(T) + 63) / 64 * 64))),
      size_(size) {
  if (data_ == nullptr) throw std::bad_alloc();
  std::memset(data_.get(), 0, size * sizeof(T));
}

template <class T>
void AlignedArray<T>::Free::operator()(T* data) const {
  std::free(data);
}

template <class T>
SweepState<T>::SweepState(const RowLayout& layout)
    : stride_(layout.stride()),
      values_(static_cast<std::size_t>(layout.rows * kPlanes * stride_ + 2 * RowLayout::kLanes)) {}

template class AlignedArray<float>;
template class AlignedArray<double>;
template class SweepState<float>;
template class SweepState<double>;

}  // namespace weft
#endif
