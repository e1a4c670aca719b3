#pragma once

#include <array>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "core/forces/wind_law.h"
#include "core/lattice/state.h"
#include "core/motion/thread_pool.h"

namespace weft {

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

enum class BendKind {
  kNone,
  kTable32,
  kOptimalTable32,  // at optimal breakpoints
  kTable,           // of more segments, at any
  kPolynomial,
  kIsometric
};

// Which lane of a vector; as large as its values.
template <class T>
using LaneNumber = std::conditional_t<sizeof(T) == 4, std::int32_t, std::int64_t>;

// What the columns of a vector differ in.
enum ColumnPlane {
  kShare,      // of connections along the column
  kNearCount,  // how many of the columns c - 1 ... c + 1 exist
  kFarCount,   // how many of c - 2, c, c + 2
  // all bits where the column and this neighbour exist, else none
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
  T slow = 1;     // how many times as strongly the isometric law acts in this substep
  T damping = 0;  // k_d / (2 dt), kg/s^2
  bool damp_far = false, damp_far_diagonal = false;  // bend connections damp too
  T drag = 0, drag_share = 1;                        // c dt / m, 1 / (1 + drag / 2)
  WindLaw<T> wind;
  std::array<T, 3> drift{};  // (gravity + c / m air) dt^2, m
  bool compensated = true;   // the sums of d and x
  bool measured = false;     // whether sweep() says how far particles went
  bool changes = false;      // and by how much that has changed

  AlignedArray<T> columns;   // (vectors x kColumnPlanes x lanes)
  std::vector<char> border;  // of each vector: whether some column lacks a neighbour
  // all bits, else none: where a column of the halo exists, and which lanes of the vector that it
  // continues it holds
  AlignedArray<T> halo_exists, halo_folds;  // (2 kHalo x lanes)
  // the lane of that vector which each of its lanes continues, and the other way round
  AlignedArray<LaneNumber<T>> halo_from, halo_to;  // (2 kHalo x lanes)
};

// One substep of eq. 2 to 8 over the whole lattice, in one sweep over its rows: every connection
// once, forces and motion while they are in cache. Equal bits on every processor with FMA, and for
// every number of bands.
template <class T>
Largest<T> sweep(const SweepLaw<T>& law, SweepState<T>& state, int bands, ThreadPool& pool);

}  // namespace weft
