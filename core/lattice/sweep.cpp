#include "core/lattice/sweep.h"

#include <algorithm>
#include <cmath>

// compiled again for every target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/lattice/sweep.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/forces/wind-inl.h"
#include "core/lattice/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {

// The connections that are evaluated when row r is swept: those that lead down from r, and those
// along row r + 1, so that the forces on row r are then complete.
struct Connection {
  int from, to, right;  // rows from r on, columns to the right
  ColumnPlane exists;   // kShare: with that share
  bool bends;
};
inline constexpr Connection kConnections[] = {{1, 1, 1, kRight1, false}, {0, 1, 0, kShare, false},
                                              {0, 1, 1, kRight1, false}, {0, 1, -1, kLeft1, false},
                                              {1, 1, 2, kRight2, true},  {0, 2, 0, kShare, true},
                                              {0, 2, 2, kRight2, true},  {0, 2, -2, kLeft2, true}};
template <std::size_t... k>
using Connections = std::index_sequence<k...>;

// A sweep over a band, from the rows above it down.
template <class T, BendKind kBend, bool kShears, bool kBendsDiagonal>
class Sweep {
  using D = hn::ScalableTag<T>;
  using V = hn::Vec<D>;
  using State = SweepState<T>;
  using Layout = LatticeLayout<T>;

 public:
  // work: work_size() values
  Sweep(const SweepLaw<T>& law, SweepState<T>& state, SweepBand<T>& band, T* work)
      : law_(law),
        state_(state),
        band_(band),
        vectors_(law.layout.vectors()),
        fetches_(state.bytes() > (std::size_t{8} << 20)),
        planes_(law.damping > 0 || law.wind.blows ? State::kShared : State::kW),
        forces_(work + (kHalo + 1) * kForces),
        velocity_sums_(work + forces_size(law.layout)),
        largest_(hn::Zero(D())),
        largest_change_(largest_) {
    for (std::size_t k = 0; k < halo_.size(); ++k) {
      const int at = law.layout.halo(static_cast<int>(k));
      const int shift = law.layout.halo_shift(static_cast<int>(k));
      halo_[k] = {at, at - shift * vectors_, shift};
    }
  }

  static std::size_t work_size(const Layout& layout) {
    return static_cast<std::size_t>(forces_size(layout) + layout.vectors() * kVelocitySums);
  }

  void run() {
    std::fill_n(forces_ - kHalo * kForces, 3 * (vectors_ + 2 * kHalo) * kForces, T(0));
    std::fill_n(velocity_sums_, vectors_ * kVelocitySums, T(0));
    const int first = std::max(band_.first - 2, -1);
    for (int r = std::max(first, 0); r < first + 2; ++r) {
      prepare(r);
      if (law_.damping > 0) start_damping(r);
    }
    for (int r = first; r < band_.last; ++r) {
      prepare(r + 2);
      sweep_row(r);
      fold(r + 1);
    }
    const auto root = [](V square)
                          HWY_ATTR { return std::sqrt(hn::GetLane(hn::MaxOfLanes(D(), square))); };
    band_.largest = {root(largest_), root(largest_change_)};
  }

 private:
  static constexpr int kLanes = Layout::kLanes, kHalo = Layout::kHalo;
  static constexpr int kPart = static_cast<int>(hn::MaxLanes(D()));  // what this target takes
  static constexpr bool kIsometric = kBend == BendKind::kIsometric;
  static constexpr bool kInterlaced = !kIsometric && kBend != BendKind::kNone;
  // Whether connection 6 begins the sum of forces on its end, so that none has to be set to 0.
  static constexpr bool kStartsRows = kInterlaced && kBendsDiagonal;

  // From one vector to the next, of forces on the rows r, r + 1, r + 2, with a halo; of what rows
  // r + 3 and row r + 4 sum up of their neighbours' velocities; of shared planes.
  static constexpr std::ptrdiff_t kForces = 3 * kLanes, kVelocitySums = 6 * kLanes;
  static constexpr std::ptrdiff_t kShared = State::kSharedStride;
  static std::ptrdiff_t forces_size(const Layout& layout) {
    return (3 * (layout.vectors() + 2 * kHalo) + 2) * kForces;
  }

  // What the vectors of a row share.
  struct Row {
    bool moves, after;  // r is of the band; r + 2 exists
    StretchLaw<T> along, down, diagonal;
    const BendLaw<T>*bend_along, *bend_down, *bend_diagonal;
    T isometric_along, isometric_down, isometric_twist;
    T near_rows, far_rows;  // how many of r + 1, r + 2, r + 3 and of r, r + 2, r + 4 exist
  };

  // One vector: the shared planes of rows r, r + 1, r + 2, the forces on them, its local planes.
  struct Place {
    T *shared, *shared1, *shared2;
    T *force, *force1, *force2;
    T *sums, *local;
    const T* columns;
  };

  // On one vector of each of the rows r, r + 1, r + 2.
  struct Forces {
    Triple<V> row0, row1, row2;
    Triple<V> right1{};  // right of row1, until all that goes there is added
  };

  // A vector of the halo, that which it continues, and by how many lanes it is shifted against
  // that.
  struct Halo {
    int at, vector, shift;
  };

  T* forces(int r) const { return forces_ + (r + 3) % 3 * ((vectors_ + 2 * kHalo) * kForces); }

  static HWY_INLINE Triple<V> load(const T* p) {
    const D d;
    return {hn::Load(d, p), hn::Load(d, p + kLanes), hn::Load(d, p + 2 * kLanes)};
  }
  // From `shift` lanes on, which lanes has the numbers of; what is of no run there is anything.
  // Vectors are read as they were stored: the processor waits where a load takes of two stores.
  static HWY_INLINE Triple<V> load_shifted(const T* p, int shift, const LaneNumber<T>* lanes) {
    const D d;
    if constexpr (kPart == kLanes) {
      const auto from = hn::SetTableIndices(d, lanes);
      const Triple<V> v = load(p);
      return {hn::TableLookupLanes(v.x, from), hn::TableLookupLanes(v.y, from),
              hn::TableLookupLanes(v.z, from)};
    }
    p += shift;
    return {hn::LoadU(d, p), hn::LoadU(d, p + kLanes), hn::LoadU(d, p + 2 * kLanes)};
  }
  static HWY_INLINE void store(const Triple<V>& v, T* p) {
    const D d;
    hn::Store(v.x, d, p);
    hn::Store(v.y, d, p + kLanes);
    hn::Store(v.z, d, p + 2 * kLanes);
  }
  static HWY_INLINE Triple<V> zero() {
    const V v = hn::Zero(D());
    return {v, v, v};
  }
  static HWY_INLINE V column(const Place& p, ColumnPlane plane) {
    return hn::Load(D(), p.columns + plane * kLanes);
  }

  // Completes the shared planes of row r by their halo.
  void prepare(int r) const {
    const D d;
    if (r >= law_.layout.rows) return;
    T* const row = state_.shared(band_, r);
    for (std::size_t k = 0; k < halo_.size(); ++k) {
      const LaneNumber<T>* const lanes = law_.halo_from.data() + k * kLanes;
      const T* const from = row + halo_[k].vector * kShared;
      T* const to = row + halo_[k].at * kShared;
      for (int part = 0; part < kLanes; part += kPart) {
        const V exists = hn::Load(d, law_.halo_exists.data() + k * kLanes + part);
        for (int plane = 0; plane < planes_; plane += 3) {
          const int at = plane * kLanes + part;
          store(only(load_shifted(from + at, halo_[k].shift, lanes), exists), to + at);
        }
      }
    }
  }

  // Moves the forces on row r's halo to the particles meant.
  void fold(int r) const {
    const D d;
    T* const row = forces(r);
    for (std::size_t k = 0; k < halo_.size(); ++k) {
      const LaneNumber<T>* const lanes = law_.halo_to.data() + k * kLanes;
      for (int part = 0; part < kLanes; part += kPart) {
        const V mask = hn::Load(d, law_.halo_folds.data() + k * kLanes + part);
        const T* const from = row + halo_[k].at * kForces + part;
        T* const to = row + halo_[k].vector * kForces + part;
        store(plus(load(to), only(load_shifted(from, -halo_[k].shift, lanes), mask)), to);
      }
    }
    // for row r + 3; to the right of it, too, nothing is left of these
    for (std::size_t k = 0; k < (kStartsRows ? kHalo : halo_.size()); ++k)
      for (int part = 0; part < kLanes; part += kPart)
        store(zero(), row + halo_[k].at * kForces + part);
  }

  Row describe(int r) const {
    const int rows = law_.layout.rows;
    const bool here = r >= 0, next = r + 1 < rows, after = r + 2 < rows;
    const bool edge = r + 1 == 0 || r + 1 == rows - 1;
    Row row{};
    row.moves = r >= band_.first;
    row.after = after;
    if (next) row.along = edge ? law_.warp_edge : law_.warp;
    if (here && next) row.down = law_.weft, row.diagonal = law_.shear;
    row.bend_along = !next ? &law_.none : edge ? &law_.along_warp_edge : &law_.along_warp;
    row.bend_down = here && after ? &law_.along_weft : &law_.none;
    row.bend_diagonal = here && after && law_.bend_diagonal ? &law_.diagonal : &law_.none;
    if (next)
      row.isometric_along = law_.slow * (edge ? law_.isometric_warp_edge : law_.isometric_warp);
    if (here && after) row.isometric_down = law_.slow * law_.isometric_weft;
    if (after) row.isometric_twist = law_.slow * law_.isometric_twist;
    row.near_rows = static_cast<T>((r + 1 >= 0) + 1 + (r + 3 < rows));
    row.far_rows = static_cast<T>(here + 1 + (r + 4 < rows));
    return row;
  }

  void sweep_row(int r) {
    const int last = law_.layout.rows - 1;
    const Row row = describe(r);
    T* shared = state_.shared(band_, std::max(r, 0));
    T* shared1 = state_.shared(band_, std::min(r + 1, last));
    T* shared2 = state_.shared(band_, std::min(r + 2, last));
    T *force = forces(r), *force1 = forces(r + 1), *force2 = forces(r + 2), *sums = velocity_sums_;
    T* local = state_.local(std::max(r, band_.first));
    const T* columns = law_.columns.data();
    if constexpr (kStartsRows) std::fill_n(force2, 2 * kForces, T(0));  // nothing is left of these
    for (int j = 0; j < vectors_; ++j) {
#pragma GCC unroll 1
      for (int part = 0; part < kLanes; part += kPart) {
        const Place p{shared + part, shared1 + part, shared2 + part, force + part,  force1 + part,
                      force2 + part, sums + part,    local + part,   columns + part};
        if (fetches_ && part == 0) fetch(shared2, local);
        if (law_.border[static_cast<std::size_t>(j)])
          sweep_vector<true>(row, p);
        else
          sweep_vector<false>(row, p);
      }
      shared += kShared, shared1 += kShared, shared2 += kShared;
      force += kForces, force1 += kForces, force2 += kForces, sums += kVelocitySums;
      local += state_.local_stride(), columns += kColumnPlanes * kLanes;
    }
  }

  // Of sheets that fit no cache, what the sweep comes to next.
  HWY_INLINE void fetch(const T* shared, const T* local) const {
    constexpr int kAhead = 16;  // vectors
    const std::ptrdiff_t local_stride = state_.local_stride();
    for (std::ptrdiff_t at = 0; at < kShared; at += kLanes)
      __builtin_prefetch(shared + kAhead * kShared + at, 1, 2);
    for (std::ptrdiff_t at = 0; at < local_stride; at += kLanes)
      __builtin_prefetch(local + kAhead * local_stride + at, 1, 2);
  }

  // Damps row r by the rows above and adds it to its neighbours' sums, as is done with row r + 2
  // while row r is swept.
  void start_damping(int r) {
    const Row row = describe(r - 2);
    for (int j = 0; j < vectors_; ++j)
      for (int part = 0; part < kLanes; part += kPart) {
        T* const shared = state_.shared(band_, r) + j * kShared + part;
        T* const force = forces(r) + j * kForces + part;
        const Place p{shared,
                      shared,
                      shared,
                      force,
                      force,
                      force,
                      velocity_sums_ + j * kVelocitySums + part,
                      nullptr,
                      law_.columns.data() + j * kColumnPlanes * kLanes + part};
        Forces f{zero(), zero(), load(force)};
        damp<true>(row, p, f);
        store(f.row2, force);
      }
  }

  template <bool kBorder>
  HWY_INLINE void sweep_vector(const Row& row, const Place& p) {
    const auto pulls = pull<kBorder>(row, p, springs(), bends());
    Forces f{load(p.force), load(p.force1), load(p.force2)};
    if constexpr (!kStartsRows) store(zero(), p.force);  // for row r + 3
    if (law_.damping > 0 && row.after) damp<kBorder>(row, p, f);
    add_pulls(p, pulls, f, springs(), bends());
    if constexpr (kIsometric) add_isometric<kBorder>(row, p, f);
    if (law_.wind.blows && row.after) add_wind<kBorder>(p, f);
    store(f.row1, p.force1);
    store(f.row2, p.force2);
    if (row.moves) move(p, f.row0);
  }

  template <std::size_t k>
  static HWY_INLINE Triple<V> ends(const T* shared, const T* shared1, const T* shared2) {
    constexpr Connection c = kConnections[k];
    const Triple<V> from = load(c.from == 0 ? shared : shared1);
    return minus(from, load((c.to == 1 ? shared1 : shared2) + c.right * kShared));
  }

  // A force over its length, N/m, where the connection exists.
  template <bool kBorder, std::size_t k>
  HWY_INLINE V existing(const Place& p, V pull) const {
    constexpr Connection c = kConnections[k];
    if constexpr (!kBorder) return pull;
    return c.exists == kShare ? hn::Mul(pull, column(p, kShare))
                              : hn::And(pull, column(p, c.exists));
  }
  template <std::size_t k>
  HWY_INLINE V stretch_pull(const Row& row, V y) const {
    constexpr Connection c = kConnections[k];
    return stretch(D(), c.from == 1 ? row.along : c.right == 0 ? row.down : row.diagonal, y);
  }
  template <std::size_t k>
  HWY_INLINE V bend_pull(const Row& row, V l) const {
    const D d;
    constexpr Connection c = kConnections[k];
    const BendLaw<T>& law = c.from == 1    ? *row.bend_along
                            : c.right == 0 ? *row.bend_down
                                           : *row.bend_diagonal;
    return bend<kBend>(d, law, law_.terms, l, hn::Div(hn::Set(d, T(1)), l));
  }

  template <std::size_t k>
  static HWY_INLINE void add(const Place& p, const Triple<V>& apart, V pull, Forces& f) {
    constexpr Connection c = kConnections[k];
    Triple<V>& from = c.from == 0 ? f.row0 : f.row1;
    from = minus_times(from, apart, pull);
    if constexpr (c.right == 0) {
      Triple<V>& end = c.to == 1 ? f.row1 : f.row2;
      end = plus_times(end, apart, pull);
    } else {
      T* const end = (c.to == 1 ? p.force1 : p.force2) + c.right * kForces;
      if constexpr (k == 0 && kShears)  // connection 2 has the same end
        f.right1 = plus_times(load(end), apart, pull);
      else if constexpr (k == 2)
        store(plus_times(f.right1, apart, pull), end);
      else if constexpr (k == 6 && kStartsRows)
        store(times(apart, pull), end);
      else
        store(plus_times(load(end), apart, pull), end);
    }
  }

  static constexpr auto springs() {
    if constexpr (kShears) return Connections<0, 1, 2, 3>();
    if constexpr (!kShears) return Connections<0, 1>();
  }
  static constexpr auto bends() {
    if constexpr (!kInterlaced) return Connections<>();
    if constexpr (kInterlaced && kBendsDiagonal) return Connections<4, 5, 6, 7>();
    if constexpr (kInterlaced && !kBendsDiagonal) return Connections<4, 5>();
  }

  // Keeps the compiler from keeping what it has read through p.
  static HWY_INLINE void forget(const T*& p) { asm("" : "+r"(p)); }

  // Of connections that stretch or bend (eq. 2 to 5), by their numbers. Those that bend take their
  // roots from the processor's divider, which works beside its multipliers: faster than either
  // alone.
  using Pulls = Each<V, std::size(kConnections)>;
  template <bool kBorder, std::size_t... s, std::size_t... b>
  HWY_INLINE Pulls pull(const Row& row, const Place& p, Connections<s...>,
                        Connections<b...>) const {
    const D d;
    const Each<V, sizeof...(s)> l2{squared(ends<s>(p.shared, p.shared1, p.shared2))...};
    [[maybe_unused]] const Each<V, sizeof...(b)> l{
        length(ends<b>(p.shared, p.shared1, p.shared2))...};
    const Each<V, sizeof...(s)> y = inverse_sqrt(d, l2);
    [[maybe_unused]] std::size_t i = 0, j = 0;
    Pulls pulls{};
    ((pulls[s] = existing<kBorder, s>(p, stretch_pull<s>(row, y[i++]))), ...);
    ((pulls[b] = existing<kBorder, b>(p, bend_pull<b>(row, l[j++]))), ...);
    return pulls;
  }

  // Vectors are formed again: to keep them would take more registers than there are.
  template <std::size_t... s, std::size_t... b>
  static HWY_INLINE void add_pulls(const Place& p, const Pulls& pulls, Forces& f, Connections<s...>,
                                   Connections<b...>) {
    const T *shared = p.shared, *shared1 = p.shared1, *shared2 = p.shared2;
    forget(shared);
    forget(shared1);
    forget(shared2);
    (add<s>(p, ends<s>(shared, shared1, shared2), pulls[s], f), ...);
    (add<b>(p, ends<b>(shared, shared1, shared2), pulls[b], f), ...);
  }

  // Stencils 1, -2, 1 along row r + 1 and down the column, and 1, -1, -1, 1 over the cell between
  // rows r + 1 and r + 2 (Bergou et al. 2006).
  template <bool kBorder>
  HWY_INLINE void add_isometric(const Row& row, const Place& p, Forces& f) const {
    const D d;
    const V two = hn::Set(d, T(2));
    const auto only = [&](ColumnPlane plane, T k) HWY_ATTR {
      return kBorder ? hn::And(hn::Set(d, k), column(p, plane)) : hn::Set(d, k);
    };
    const Triple<V> here = load(p.shared), below = load(p.shared1),
                    right1 = load(p.shared1 + kShared);
    const Triple<V> right2 = load(p.shared1 + 2 * kShared), below2 = load(p.shared2);

    const Triple<V> along =
        times(minus_times(plus(below, right2), right1, two), only(kRight2, row.isometric_along));
    V k_down = hn::Set(d, row.isometric_down);
    if constexpr (kBorder) k_down = hn::Mul(k_down, column(p, kShare));
    const Triple<V> down = times(minus_times(plus(here, below2), below, two), k_down);
    const Triple<V> twist =
        times(minus(plus(below, load(p.shared2 + kShared)), plus(right1, below2)),
              only(kRight1, row.isometric_twist));

    f.row0 = minus(f.row0, down);
    f.row1 = minus(plus_times(minus(f.row1, along), down, two), twist);
    f.row2 = plus(minus(f.row2, down), twist);
    T *const next1 = p.force1 + kForces, *const next2 = next1 + kForces;
    T* const after1 = p.force2 + kForces;
    store(plus(plus_times(load(next1), along, two), twist), next1);
    store(minus(load(next2), along), next2);
    store(minus(load(after1), twist), after1);
  }

  // The cell below row r + 1: its triangles as add_wind_forces() has them.
  template <bool kBorder>
  HWY_INLINE void add_wind(const Place& p, Forces& f) const {
    const D d;
    constexpr std::ptrdiff_t kW = State::kW * kLanes;
    const T *const shared1 = p.shared1, *const shared2 = p.shared2;
    const Triple<V> here = load(shared1), right = load(shared1 + kShared), below = load(shared2);
    const Triple<V> opposite = load(shared2 + kShared);
    const Triple<V> slow = plus(load(shared1 + kShared + kW), load(shared2 + kW));  // of both
    const Each<Triple<V>, 2> cross{product(minus(below, here), minus(right, here)),
                                   product(minus(right, opposite), minus(below, opposite))};
    const Each<V, 2> area2{squared(cross[0]), squared(cross[1])};
    const Each<V, 2> inverse = inverse_sqrt(d, area2);
    const WindLaw<T>& wind = law_.wind;
    Triple<V> upper = blow(d, wind, cross[0], area2[0], inverse[0], plus(slow, load(shared1 + kW)));
    Triple<V> lower =
        blow(d, wind, cross[1], area2[1], inverse[1], plus(slow, load(shared2 + kShared + kW)));
    if constexpr (kBorder) {
      upper = only(upper, column(p, kRight1));
      lower = only(lower, column(p, kRight1));
    }
    const Triple<V> both = plus(upper, lower);
    f.row1 = plus(f.row1, upper);
    f.row2 = plus(f.row2, both);
    T *const next1 = p.force1 + kForces, *const after1 = p.force2 + kForces;
    store(plus(load(next1), both), next1);
    store(plus(load(after1), lower), after1);
  }

  static HWY_INLINE Triple<V> only(const Triple<V>& v, V mask) {
    return {hn::And(v.x, mask), hn::And(v.y, mask), hn::And(v.z, mask)};
  }

  // Damping (eq. 7), as the sum of w over all neighbours less as many times its own. Row r + 2
  // has the sums of the rows above, and is added to those of the rows around it.
  template <bool kBorder>
  HWY_INLINE void damp(const Row& row, const Place& p, Forces& f) const {
    const D d;
    V count =
        hn::Mul(kBorder ? column(p, kNearCount) : hn::Set(d, T(3)), hn::Set(d, row.near_rows));
    if (law_.damp_far) {
      const V columns = kBorder ? column(p, kFarCount) : hn::Set(d, T(3));
      count = law_.damp_far_diagonal
                  ? hn::MulAdd(columns, hn::Set(d, row.far_rows), count)
                  : hn::Add(hn::Add(columns, hn::Set(d, row.far_rows - 1)), count);
    }
    // one after the other: together they would take more registers than there are
    damp_axis<0>(p, count, f.row0.x, f.row1.x, f.row2.x);
    damp_axis<1>(p, count, f.row0.y, f.row1.y, f.row2.y);
    damp_axis<2>(p, count, f.row0.z, f.row1.z, f.row2.z);
  }
  template <int kAxis>
  HWY_INLINE void damp_axis(const Place& p, V count, V& row0, V& row1, V& row2) const {
    const D d;
    const V damping = hn::Set(d, law_.damping);
    const auto w = [&](int right) HWY_ATTR {
      return hn::Load(d, p.shared2 + right * kShared + (State::kW + kAxis) * kLanes);
    };
    T* const sums = p.sums + kAxis * kLanes;
    const V here = w(0);
    const V near = hn::Add(hn::Add(w(-1), here), w(1));
    V sum = hn::Add(near, hn::Load(d, sums));
    if (law_.damp_far) {
      const V beside = hn::Add(hn::Add(w(-2), here), w(2));
      const V far = law_.damp_far_diagonal ? beside : here;
      sum = hn::Add(sum, beside);
      hn::Store(hn::Add(near, hn::Load(d, sums + 3 * kLanes)), d, sums);
      hn::Store(far, d, sums + 3 * kLanes);
      row0 = hn::MulAdd(far, damping, row0);
    } else {
      hn::Store(near, d, sums);
    }
    row1 = hn::MulAdd(near, damping, row1);
    row2 = hn::MulAdd(hn::NegMulAdd(here, count, sum), damping, row2);
  }

  // Eq. 7 and 8: drag centred, Verlet in summed form.
  HWY_INLINE void move(const Place& p, const Triple<V>& force) {
    const D d;
    const V step2 = hn::Load(d, p.local + (State::kStep2 - State::kShared) * kLanes);
    const Triple<V> old = load(p.local + (State::kD - State::kShared) * kLanes);
    const Triple<V> next{move_axis<0>(p, force.x, step2), move_axis<1>(p, force.y, step2),
                         move_axis<2>(p, force.z, step2)};
    if (law_.measured) largest_ = hn::Max(largest_, squared(next));
    if (law_.changes) largest_change_ = hn::Max(largest_change_, squared(minus(next, old)));
  }

  template <int kAxis>
  HWY_INLINE V move_axis(const Place& p, V force, V step2) const {
    const D d;
    const auto shared = [&](int plane) HWY_ATTR { return p.shared + (plane + kAxis) * kLanes; };
    const auto local = [&](int plane)
                           HWY_ATTR { return p.local + (plane - State::kShared + kAxis) * kLanes; };
    const V old = hn::Load(d, local(State::kD)), at = hn::Load(d, shared(State::kX));
    const V drift = hn::Set(d, law_.drift[kAxis]);
    const auto moves = hn::Gt(step2, hn::Zero(d));
    V change = hn::IfThenElseZero(moves, hn::MulAdd(force, step2, drift));
    if (law_.drag > 0) {
      const V slowed = hn::NegMulAdd(hn::Set(d, law_.drag), old, change);
      change = hn::IfThenElseZero(moves, hn::Mul(slowed, hn::Set(d, law_.drag_share)));
    }

    V next = hn::Zero(d), there = hn::Zero(d);
    if (law_.compensated) {
      const V add = hn::Sub(change, hn::Load(d, local(State::kDError)));
      next = hn::Add(old, add);
      hn::Store(hn::Sub(hn::Sub(next, old), add), d, local(State::kDError));
      const V by = hn::Sub(next, hn::Load(d, local(State::kXError)));
      there = hn::Add(at, by);
      hn::Store(hn::Sub(hn::Sub(there, at), by), d, local(State::kXError));
    } else {
      next = hn::Add(old, change);
      there = hn::Add(at, next);
    }
    const V lagged = hn::Mul(hn::Set(d, state_.lead() - 2), old);
    hn::Store(hn::MulSub(hn::Set(d, state_.lead()), next, lagged), d, shared(State::kW));
    hn::Store(next, d, local(State::kD));
    hn::Store(there, d, shared(State::kX));
    return next;
  }

  const SweepLaw<T>& law_;
  SweepState<T>& state_;
  SweepBand<T>& band_;
  const int vectors_;
  const bool fetches_;
  const int planes_;  // of the shared ones, those that are used
  T *const forces_, *const velocity_sums_;
  std::array<Halo, 2 * kHalo> halo_;
  V largest_, largest_change_;  // squared, m^2
};

template <BendKind kBend, bool kShears, bool kBendsDiagonal, class T>
void sweep_as(const SweepLaw<T>& law, SweepState<T>& state, SweepBand<T>& band) {
  using Sweeper = Sweep<T, kBend, kShears, kBendsDiagonal>;
  static thread_local AlignedArray<T> work;
  const std::size_t size = Sweeper::work_size(law.layout);
  if (work.size() < size) work = AlignedArray<T>(size);
  Sweeper(law, state, band, work.data()).run();
}

// Features are left out of the code where that is measured to pay: all of the default law's, and
// shear elsewhere.
template <class T>
void sweep_lattice(const SweepLaw<T>& law, SweepState<T>& state, SweepBand<T>& band) {
  const bool shears = law.shear.stiffness > 0;
  const bool idle = law.bend == BendKind::kIsometric && law.slow == 0;
  switch (idle ? BendKind::kNone : law.bend) {
    case BendKind::kNone:
      return shears ? sweep_as<BendKind::kNone, true, false>(law, state, band)
                    : sweep_as<BendKind::kNone, false, false>(law, state, band);
    case BendKind::kTable32:
      if (law.bend_diagonal)
        return shears ? sweep_as<BendKind::kTable32, true, true>(law, state, band)
                      : sweep_as<BendKind::kTable32, false, true>(law, state, band);
      return shears ? sweep_as<BendKind::kTable32, true, false>(law, state, band)
                    : sweep_as<BendKind::kTable32, false, false>(law, state, band);
    case BendKind::kOptimalTable32:
      return sweep_as<BendKind::kOptimalTable32, true, true>(law, state, band);
    case BendKind::kTable:
      return sweep_as<BendKind::kTable, true, true>(law, state, band);
    case BendKind::kPolynomial:
      return sweep_as<BendKind::kPolynomial, true, true>(law, state, band);
    case BendKind::kIsometric:
      break;
  }
  return shears ? sweep_as<BendKind::kIsometric, true, false>(law, state, band)
                : sweep_as<BendKind::kIsometric, false, false>(law, state, band);
}

void sweep_single(const SweepLaw<float>& law, SweepState<float>& state, SweepBand<float>& band) {
  sweep_lattice(law, state, band);
}
void sweep_double(const SweepLaw<double>& law, SweepState<double>& state, SweepBand<double>& band) {
  sweep_lattice(law, state, band);
}

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace weft {

HWY_EXPORT(sweep_single);
HWY_EXPORT(sweep_double);

namespace {

void sweep_band(const SweepLaw<float>& law, SweepState<float>& state, SweepBand<float>& band) {
  HWY_DYNAMIC_DISPATCH(sweep_single)(law, state, band);
}
void sweep_band(const SweepLaw<double>& law, SweepState<double>& state, SweepBand<double>& band) {
  HWY_DYNAMIC_DISPATCH(sweep_double)(law, state, band);
}

}  // namespace

template <class T>
Largest<T> sweep(const SweepLaw<T>& law, SweepState<T>& state, int bands, ThreadPool& pool) {
  std::vector<SweepBand<T>>& divided = state.divide(bands);
  const auto share = [&](int i) { sweep_band(law, state, divided[static_cast<std::size_t>(i)]); };
  if (bands == 1)
    share(0);
  else
    pool.run(bands, share);
  Largest<T> largest;
  for (const SweepBand<T>& band : divided)
    largest = {std::max(largest.moved, band.largest.moved),
               std::max(largest.changed, band.largest.changed)};
  return largest;
}

template Largest<float> sweep(const SweepLaw<float>&, SweepState<float>&, int, ThreadPool&);
template Largest<double> sweep(const SweepLaw<double>&, SweepState<double>&, int, ThreadPool&);

}  // namespace weft
#endif
