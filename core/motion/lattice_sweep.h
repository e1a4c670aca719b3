#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

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

// Rows of a lattice. Values of a row are padded to whole vectors, and by one vector more.
struct RowLayout {
  static constexpr int kLanes = 16;  // values of the widest vector

  int rows = 0, columns = 0;

  int width() const { return (columns + kLanes - 1) / kLanes * kLanes; }
  std::ptrdiff_t stride() const { return width() + kLanes; }
};

// Tension k (l - L) of a family of connections, where it is taut (eq. 2).
template <class T>
struct StretchLaw {
  T stiffness = 0;  // k, N/m; 0: no force
  T rest = 0;       // k L, N
};

// max(f_b, c_b (l - L)) of a family of connections (eq. 3 to 5), as it depends on l.
template <class T>
struct BendLaw {
  T clamp = 0;       // c_b, N/m; 0: no force
  T clamp_rest = 0;  // c_b L, N
  T to_index = 0;    // segments / L, or 2 / L of a polynomial in 2 r - 1, 1/m
  T last = 0;        // the last segment
  // f_b = intercept + slope l of each segment (N, N/m), or the polynomial's coefficients, highest
  // power first (N)
  AlignedArray<T> intercepts, slopes;
};

enum class BendKind { kNone, kTable32, kTable, kPolynomial, kIsometric };

// What one substep does to a lattice sheet.
template <class T>
struct SweepLaw {
  RowLayout layout;
  StretchLaw<T> warp, weft, shear;
  T edge_share = 1;  // of connections that lie along an edge
  BendKind bend = BendKind::kNone;
  bool bend_diagonal = false;
  int terms = 0;                                      // segments, or coefficients of the polynomial
  BendLaw<T> along_warp, along_weft, diagonal, none;  // none: no force, for rows that do not exist
  T isometric_warp = 0, isometric_weft = 0, isometric_twist = 0;  // N/m
  T damping = 0;                                                  // k_d / (2 dt), kg/s^2
  bool damp_far = false, damp_far_diagonal = false;               // bend connections damp too
  T drag = 0;                                                     // c dt / m
  std::array<T, 3> drift{};                                       // (gravity + c / m air) dt^2, m
  bool compensated = true;                                        // the sums of d and x
  bool measured = false;  // whether sweep() says how far particles went
  // per column, from kLanes before the first: its share of connections along it, and how many of
  // the columns c - 1 ... c + 1, and c - 2, c, c + 2, exist
  AlignedArray<T> column_share, near_columns, far_columns;
};

// A lattice sheet in motion: for every row its planes, one after the other.
template <class T>
class SweepState {
 public:
  enum Plane {
    kX = 0,        // position, m
    kD = 3,        // displacement of the last step, m
    kW = 6,        // 3 d - d_previous: velocity x 2 dt, m
    kXError = 9,   // what rounding has added to x, m
    kDError = 12,  // what rounding has added to d, m
    kStep2 = 15,   // dt^2 / mass, s^2/kg; 0 holds a particle
    kPlanes = 16
  };

  explicit SweepState(const RowLayout& layout);
  // Column 0 of a plane in a row.
  T* row(int plane, int r) { return values_.data() + place(plane, r); }
  const T* row(int plane, int r) const { return values_.data() + place(plane, r); }

 private:
  std::ptrdiff_t place(int plane, int r) const {
    return RowLayout::kLanes + (r * kPlanes + plane) * stride_;
  }
  std::ptrdiff_t stride_;
  AlignedArray<T> values_;
};

// One substep of eq. 2 to 8 over the whole lattice, in one sweep over its rows: every connection
// once, forces and motion while they are in cache. Equal bits on every processor with FMA.
// Returns the largest displacement where law.measured, m.
float sweep(const SweepLaw<float>& law, SweepState<float>& state);
double sweep(const SweepLaw<double>& law, SweepState<double>& state);

// Whether this processor has FMA; without it sweeps have other bits.
bool sweeps_with_fma();

}  // namespace weft
