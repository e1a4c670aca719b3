#pragma once

#include <span>

#include "core/contact/contact.h"
#include "core/contact/known_cells.h"
#include "core/lattice/state.h"

namespace weft {

// Contacts::resolve() for the free particles of a row, in vectors of double. `origin` is what
// positions are relative to, m. known: of every eight lanes of the sheet's vectors, or nothing.
template <class T>
Resolved resolve_row(const Contacts& contacts, const Vector3d& origin, bool compensated, int row,
                     std::span<KnownCells> known, SweepState<T>& state);

}  // namespace weft
