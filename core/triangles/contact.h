#pragma once

#include "core/contact/contact.h"
#include "core/triangles/sweep.h"

namespace weft {

// Contacts::resolve() for the free particles of a block, in vectors of double. `origin` is what
// positions are relative to, m. Returns how far the nearest of them was from a skin, m.
template <class T>
double resolve_block(const Contacts& contacts, const Vector3d& origin, bool compensated, int block,
                     TriangleState<T>& state);

}  // namespace weft
