#pragma once

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
  std::size_t bytes() const { return (seen_.size() + own_.size()) * sizeof(T); }
  // Values from one vector of a row to the next.
  static constexpr std::ptrdiff_t kSeenStride = kSeen * LatticeLayout<T>::kLanes;
  std::ptrdiff_t own_stride() const { return (planes_ - kSeen) * LatticeLayout<T>::kLanes; }
  // Vector 0 of a row.
  T* seen(int r) { return seen_.data() + seen_at(r, halo_); }
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

  // Lets go of what only sweeps need, until the next is prepared.
  void release_memory();
  // Divides the sheet as it is now into so many bands, which may be swept at the same time.
  std::vector<SweepBand<T>>& divide(int bands);
  // What a band sees of row r, first - 2 <= r < last + 2.
  T* seen(SweepBand<T>& band, int r) {
    if (r < band.first) return band.before.data() + seen_at(r - band.first + 2, halo_);
    if (r >= band.last) return band.after.data() + seen_at(r - band.last, halo_);
    return seen(r);
  }

 private:
  static std::ptrdiff_t margin(int halo) { return (halo + 1) * kSeenStride; }
  std::ptrdiff_t row_size(int halo) const { return (vectors() + 2 * halo) * kSeenStride; }
  std::ptrdiff_t seen_at(int r, int halo) const { return margin(halo) + r * row_size(halo); }
  std::size_t seen_size(int halo) const {
    return static_cast<std::size_t>(seen_at(layout_.rows, halo) + margin(halo));
  }
  void set_halo(int halo);
  std::ptrdiff_t own_row() const { return layout_.vectors() * own_stride(); }

  struct Column {
    std::ptrdiff_t seen, own;  // where it is in the row, for plane 0
  };
  LatticeLayout<T> layout_;
  int planes_;
  int halo_ = LatticeLayout<T>::kHalo;  // 0: packed
  std::vector<Column> columns_;
  AlignedArray<T> seen_, own_;
  std::vector<SweepBand<T>> bands_;
};

}  // namespace weft
