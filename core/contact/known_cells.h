#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace weft {

// Of some particles: which cell of a grid each was in when it was last looked at, and what stands
// there. Cloth that lies on a body hardly leaves its cells, and grids are larger than caches.
struct KnownCells {
  static constexpr std::size_t kParticles = 8;
  template <class T>
  using Each = std::array<T, kParticles>;

  Each<std::int32_t> block, begin;           // block, where its values begin
  Each<std::int32_t> cell;                   // its first value
  std::array<Each<float>, 8> corner_values;  // in the order of the grid, m

  KnownCells() {
    block.fill(-1);
    cell.fill(-1);
  }
};

}  // namespace weft
