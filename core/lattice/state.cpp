#include "core/lattice/state.h"

#include <algorithm>
#include <new>
#include <utility>

namespace weft {
template <class T>
SweepState<T>::SweepState(const LatticeLayout<T>& layout, bool compensated, T lead)
    : layout_(layout),
      lead_(lead),
      planes_(compensated ? kDError + 3 : kXError),
      shared_(shared_size(halo_)),
      local_(static_cast<std::size_t>(layout.rows * local_row())) {
  for (int c = 0; c < layout.vectors() * LatticeLayout<T>::kLanes; ++c) {
    const std::ptrdiff_t vector = layout.vector(c), lane = layout.lane(c);
    columns_.push_back(
        {vector * kSharedStride + lane, vector * local_stride() - kSharedStride + lane});
  }
}

template <class T>
void SweepState<T>::set_halo(int halo) {
  if (halo == halo_) return;
  AlignedArray<T> old(shared_size(halo));
  std::swap(old, shared_);
  const int old_halo = std::exchange(halo_, halo);
  for (int r = 0; r < layout_.rows; ++r)
    std::copy_n(old.data() + shared_at(r, old_halo), layout_.vectors() * kSharedStride, shared(r));
}

template <class T>
void SweepState<T>::release_memory() {
  bands_.clear();
  try {
    set_halo(0);
  } catch (const std::bad_alloc&) {  // it stays as it is
  }
}

template <class T>
std::vector<SweepBand<T>>& SweepState<T>::divide(int bands) {
  set_halo(LatticeLayout<T>::kHalo);
  bands_.resize(static_cast<std::size_t>(bands));
  const int rows = layout_.rows;
  const auto copy = [&](int row, AlignedArray<T>& to) {
    if (to.size() == 0)
      to = AlignedArray<T>(static_cast<std::size_t>(2 * (row_size(halo_) + margin(halo_))));
    for (int k = 0; k < 2; ++k) {
      if (row + k < 0 || row + k >= rows) continue;
      std::copy_n(shared(row + k), layout_.vectors() * kSharedStride,
                  to.data() + margin(halo_) + k * row_size(halo_));
    }
  };
  for (int b = 0; b < bands; ++b) {
    SweepBand<T>& band = bands_[static_cast<std::size_t>(b)];
    band.first = rows * b / bands;
    band.last = rows * (b + 1) / bands;
    if (b > 0) copy(band.first - 2, band.before);
    if (b + 1 < bands) copy(band.last, band.after);
  }
  return bands_;
}

template class SweepState<float>;
template class SweepState<double>;

}  // namespace weft
