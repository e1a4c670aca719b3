#pragma once

#include <cstddef>
#include <vector>

#include "core/lattice/state.h"
#include "core/model/shape.h"
#include "core/motion/tethers.h"

namespace weft {

// Finds the nearest particle of each attachment, and its distance in the flat sheet.
void measure_tethers(const Grid& grid, Tethers& tethers);

// An attachment as vectors have it. Where one particle is held, its six values stand for all.
template <class T>
struct LatticeAttachment {
  bool single = false;
  AlignedArray<T> length;  // (rows x vectors x lanes) m; infinity: none
  AlignedArray<T> end;     // (rows x vectors x 6 x lanes) x, d: where each is tethered to, m
};

template <class T>
class LatticeTethers {
 public:
  LatticeTethers() = default;
  // `tethers` outlive it.
  LatticeTethers(const Tethers& tethers, const LatticeLayout<T>& layout);

  const std::vector<LatticeAttachment<T>>& attachments() const { return attachments_; }
  // Where the ends are now: to be called when held particles have moved.
  void read_ends(const SweepState<T>& state);

 private:
  struct Place {
    std::ptrdiff_t vector, lane;  // of the lattice
  };
  Place place(int particle) const {
    const int row = particle / layout_.columns, column = particle % layout_.columns;
    return {row * layout_.vectors() + layout_.vector(column), layout_.lane(column)};
  }

  const Tethers* tethers_ = nullptr;
  LatticeLayout<T> layout_;
  std::vector<LatticeAttachment<T>> attachments_;
};

// pull_back() for the particles of some rows, in vectors. inward: m.
template <class T>
T pull_back_rows(const LatticeTethers<T>& tethers, T inward, bool compensated, int first, int last,
                 SweepState<T>& state);

}  // namespace weft
