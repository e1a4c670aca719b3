#pragma once

#include <cstddef>
#include <vector>

#include "core/motion/aligned_array.h"
#include "core/motion/step_motion.h"

namespace weft {

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

// Rows first ... last - 1, which are swept apart from others: with copies of the shared planes,
// from before the sweep, of the two rows before and the two after them.
template <class T>
struct SweepBand {
  int first = 0, last = 0;
  AlignedArray<T> before, after;
  Largest<T> largest;
};

// A lattice sheet in motion. Lanes without a column are and stay 0. Of every vector, its planes one
// after the other: shared ones, which neighbours read, with a halo, and local ones.
template <class T>
class SweepState {
 public:
  enum Plane {
    kX = 0,  // position, m
    kW = 3,  // lead d - (lead - 2) d_previous: velocity x 2 dt, m
    kShared = 6,
    kD = kShared,  // displacement of the last step, m
    kStep2 = 9,    // dt^2 / mass, s^2/kg; 0 holds a particle
    kXError = 10,  // what rounding has added to x, m; with compensation only, as the next one
    kDError = 13,  // what rounding has added to d, m
  };

  SweepState(const LatticeLayout<T>& layout, bool compensated, T lead = 3);

  T lead() const { return lead_; }  // of velocities, see lead_of()
  int planes() const { return planes_; }
  int vectors() const { return layout_.vectors(); }
  std::size_t bytes() const { return (shared_.size() + local_.size()) * sizeof(T); }
  // Values from one vector of a row to the next.
  static constexpr std::ptrdiff_t kSharedStride = kShared * LatticeLayout<T>::kLanes;
  std::ptrdiff_t local_stride() const { return (planes_ - kShared) * LatticeLayout<T>::kLanes; }
  // Vector 0 of a row.
  T* shared(int r) { return shared_.data() + shared_at(r, halo_); }
  T* local(int r) { return local_.data() + r * local_row(); }

  // A particle's values, by plane.
  template <class Value>
  struct PlaceOf {
    Value *shared, *local;
    Value& operator[](int plane) const {
      return (plane < kShared ? shared : local)[plane * LatticeLayout<T>::kLanes];
    }
  };
  using Place = PlaceOf<T>;
  using ConstPlace = PlaceOf<const T>;
  // Column c of row r; also columns beyond the last, as far as vectors reach.
  Place place(int r, int c) {
    const Column& column = columns_[static_cast<std::size_t>(c)];
    return {shared(r) + column.shared, local(r) + column.local};
  }
  ConstPlace place(int r, int c) const {
    const Place place = const_cast<SweepState*>(this)->place(r, c);
    return {place.shared, place.local};
  }

  // Lets go of what only sweeps need, until the next is prepared.
  void release_memory();
  // Divides the sheet as it is now into so many bands, which may be swept at the same time.
  std::vector<SweepBand<T>>& divide(int bands);
  // The shared planes of row r for a band, first - 2 <= r < last + 2.
  T* shared(SweepBand<T>& band, int r) {
    if (r < band.first) return band.before.data() + shared_at(r - band.first + 2, halo_);
    if (r >= band.last) return band.after.data() + shared_at(r - band.last, halo_);
    return shared(r);
  }

 private:
  static std::ptrdiff_t margin(int halo) { return (halo + 1) * kSharedStride; }
  std::ptrdiff_t row_size(int halo) const { return (vectors() + 2 * halo) * kSharedStride; }
  std::ptrdiff_t shared_at(int r, int halo) const { return margin(halo) + r * row_size(halo); }
  std::size_t shared_size(int halo) const {
    return static_cast<std::size_t>(shared_at(layout_.rows, halo) + margin(halo));
  }
  void set_halo(int halo);
  std::ptrdiff_t local_row() const { return layout_.vectors() * local_stride(); }

  struct Column {
    std::ptrdiff_t shared, local;  // where it is in the row, for plane 0
  };
  LatticeLayout<T> layout_;
  T lead_;
  int planes_;
  int halo_ = LatticeLayout<T>::kHalo;  // 0: packed
  std::vector<Column> columns_;
  AlignedArray<T> shared_, local_;
  std::vector<SweepBand<T>> bands_;
};

}  // namespace weft
