#pragma once

#include "core/contact/contact.h"
#include "core/lattice/state.h"

namespace weft {

// Contacts::resolve() for the free particles of a row, in vectors of double. `origin` is what
// positions are relative to, m. Returns how far the nearest of them was from a skin, m.
template <class T>
double resolve_row(const Contacts& contacts, const Vector3d& origin, bool compensated, int row,
                   SweepState<T>& state);

}  // namespace weft
