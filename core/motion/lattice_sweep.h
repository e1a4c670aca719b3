#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "core/motion/crew.h"

namespace weft {

// Zeroed values on a vector boundary.
template <class T>
class AlignedArray {
 public:
  AlignedArray() = default;
  explicit AlignedArray(std::size_t size);
  T* data() { return data_.get(); }
  const T* data() const { return data_.get(); }
  std::size_t size() const { return size_; }

 private:
  struct Free {
    void operator()(T* data) const;
  };
  std::unique_ptr<T[], Free> data_;
  std::size_t size_ = 0;
};

// How a row of a lattice lies in vectors: it is cut into as many runs of columns as a vector has
// lanes, and vector j holds column j of every run. The neighbours of a whole vector are then whole
// vectors, save that the ends of the runs meet in a neighbour's lane: there a halo stands in.
template <class T>
struct LatticeLayout {
  static constexpr int kLanes = 64 / sizeof(T);  // of the widest vector

  int rows = 0, columns = 0;

  // Vectors of a row, columns of a run.
  int vectors() const { return (columns + kLanes - 1) / kLanes; }
  int vector(int column) const { return column % vectors(); }
  int lane(int column) const { return column / vectors(); }
  int column(int vector, int lane) const { return lane * vectors() + vector; }

  // The halo: copies before the first and after the last vector, k = 0 ... 2 kHalo - 1. Where copy
  // k stands, and by how many lanes it is shifted against the vector that it continues.
  static constexpr int kHalo = 2;
  int halo(int k) const { return k < kHalo ? k - kHalo : vectors() + k - kHalo; }
  int halo_shift(int k) const {
    const int at = halo(k), n = vectors();
    return at < 0 ? -((n - 1 - at) / n) : at / n;
  }
};

// Tension k (l - L) of a family of connections, where it is taut (eq. 2).
template <class T>
struct StretchLaw {
  T stiffness = 0;  // k, N/m; 0: no force
  T rest = 0;       // k L, N
  T least = 0;      // N/m; negative: it pushes too
};

// max(f_b, c_b (l - L)) of a family of connections (eq. 3 to 5), as it depends on l.
template <class T>
struct BendLaw {
  T clamp = 0;       // c_b, N/m; 0: no force
  T clamp_rest = 0;  // c_b L, N
  // l (t0 + l (t1 + ...)): the segment that l lies in; or t0 = 2 / L of a polynomial in 2 r - 1
  std::array<T, 4> to_index{};
  T half_segment = 0;  // of equal ones, m
  T last = 0;          // the last segment
  // f_b = intercept + slope l of each segment (N, N/m), 32 at least, or the polynomial's
  // coefficients, highest power first (N)
  AlignedArray<T> intercepts, slopes;
};

// Moving air, as it presses on the two triangles of every cell.
template <class T>
struct WindLaw {
  bool blows = false;
  std::array<T, 3> velocity{};  // of the air, m/s
  T to_velocity = 0;            // 1 / (6 dt): what the sum of three w is multiplied by, 1/s
  T pressure = 0;               // rho / 12, kg/m^3
  T drag = 0;                   // c_t / 6, kg/(m^2 s)
};

enum class BendKind {
  kNone,
  kTable32,
  kOptimalTable32,  // at optimal breakpoints
  kTable,           // of more segments, at any
  kPolynomial,
  kIsometric
};

// What the columns of a vector differ in.
enum ColumnPlane {
  kShare,      // of connections along the column
  kNearCount,  // how many of the columns c - 1 ... c + 1 exist
  kFarCount,   // how many of c - 2, c, c + 2
  // all bits where the column and this neighbour exist, else none
  kHere,
  kRight1,
  kRight2,
  kLeft1,
  kLeft2,
  kColumnPlanes
};

// What one substep does to a lattice sheet.
template <class T>
struct SweepLaw {
  LatticeLayout<T> layout;
  StretchLaw<T> warp, weft, shear, warp_edge;  // warp_edge: along the first and the last row
  BendKind bend = BendKind::kNone;
  bool bend_diagonal = false;
  int terms = 0;  // segments, or coefficients of the polynomial
  BendLaw<T> along_warp, along_warp_edge, along_weft, diagonal;
  BendLaw<T> none;                                // no force, for rows that do not exist
  T isometric_warp = 0, isometric_warp_edge = 0;  // N/m
  T isometric_weft = 0, isometric_twist = 0;
  T damping = 0;                                     // k_d / (2 dt), kg/s^2
  bool damp_far = false, damp_far_diagonal = false;  // bend connections damp too
  T drag = 0;                                        // c dt / m
  WindLaw<T> wind;
  std::array<T, 3> drift{};  // (gravity + c / m air) dt^2, m
  bool compensated = true;   // the sums of d and x
  bool measured = false;     // whether sweep() says how far particles went

  AlignedArray<T> columns;   // (vectors x kColumnPlanes x lanes)
  std::vector<char> border;  // of each vector: whether some column lacks a neighbour
  std::vector<int> padded;   // vectors where lanes without a column follow the last column
  // all bits, else none: where a column of the halo exists, and which lanes of the vector that it
  // continues it holds
  AlignedArray<T> halo_exists, halo_folds;  // (2 kHalo x lanes)
};

// Rows first ... last - 1, which are swept on their own: with copies of what was seen, before the
// sweep, of the two rows before and the two after them.
template <class T>
struct SweepBand {
  int first = 0, last = 0;
  AlignedArray<T> before, after;
  T farthest = 0;  // largest displacement, m
};

// A lattice sheet in motion. Of every vector, its planes one after the other: those that neighbours
// see, with a halo, and those of its own.
template <class T>
class SweepState {
 public:
  enum Plane {
    kX = 0,  // position, m
    kW = 3,  // 3 d - d_previous: velocity x 2 dt, m
    kSeen = 6,
    kD = kSeen,    // displacement of the last step, m
    kStep2 = 9,    // dt^2 / mass, s^2/kg; 0 holds a particle
    kXError = 10,  // what rounding has added to x, m; with compensation only, as the next one
    kDError = 13,  // what rounding has added to d, m
  };

  SweepState(const LatticeLayout<T>& layout, bool compensated);

  int planes() const { return planes_; }
  int vectors() const { return layout_.vectors(); }
  // Values from one vector of a row to the next.
  static constexpr std::ptrdiff_t kSeenStride = kSeen * LatticeLayout<T>::kLanes;
  std::ptrdiff_t own_stride() const { return (planes_ - kSeen) * LatticeLayout<T>::kLanes; }
  // Vector 0 of a row.
  T* seen(int r) { return seen_.data() + kMargin + r * seen_row(); }
  T* own(int r) { return own_.data() + r * own_row(); }

  // A particle's values, by plane.
  template <class Value>
  struct PlaceOf {
    Value *seen, *own;
    Value& operator[](int plane) const {
      return (plane < kSeen ? seen : own)[plane * LatticeLayout<T>::kLanes];
    }
  };
  using Place = PlaceOf<T>;
  using ConstPlace = PlaceOf<const T>;
  // Column c of row r; also columns beyond the last, as far as vectors reach.
  Place place(int r, int c) {
    const Column& column = columns_[static_cast<std::size_t>(c)];
    return {seen(r) + column.seen, own(r) + column.own};
  }
  ConstPlace place(int r, int c) const {
    const Place place = const_cast<SweepState*>(this)->place(r, c);
    return {place.seen, place.own};
  }

  // Divides the sheet as it is now into so many bands, which may be swept at the same time.
  std::vector<SweepBand<T>>& divide(int bands);
  // What a band sees of row r, first - 2 <= r < last + 2.
  T* seen(SweepBand<T>& band, int r) {
    if (r < band.first) return band.before.data() + kMargin + (r - band.first + 2) * seen_row();
    if (r >= band.last) return band.after.data() + kMargin + (r - band.last) * seen_row();
    return seen(r);
  }

 private:
  static constexpr std::ptrdiff_t kMargin = (LatticeLayout<T>::kHalo + 1) * kSeenStride;
  std::ptrdiff_t seen_row() const {
    return (layout_.vectors() + 2 * LatticeLayout<T>::kHalo) * kSeenStride;
  }
  std::ptrdiff_t own_row() const { return layout_.vectors() * own_stride(); }

  struct Column {
    std::ptrdiff_t seen, own;  // where it is in the row, for plane 0
  };
  LatticeLayout<T> layout_;
  int planes_;
  std::vector<Column> columns_;
  AlignedArray<T> seen_, own_;
  std::vector<SweepBand<T>> bands_;
};

// One substep of eq. 2 to 8 over the whole lattice, in one sweep over its rows: every connection
// once, forces and motion while they are in cache. Equal bits on every processor with FMA, and for
// every number of bands. Returns the largest displacement where law.measured, m.
template <class T>
T sweep(const SweepLaw<T>& law, SweepState<T>& state, int bands, Crew& crew);

}  // namespace weft
