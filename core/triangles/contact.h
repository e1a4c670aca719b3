#pragma once

#include <span>

#include "core/contact/contact.h"
#include "core/contact/known_cells.h"
#include "core/triangles/sweep.h"

namespace weft {

// Particles, in the order of memory, whose contact is resolved together.
inline constexpr std::size_t kContactRun = KnownCells::kParticles;

// Contacts::resolve() for the free particles of a run, in vectors of double. `origin` is what
// positions are relative to, m. known: of every run, or nothing.
template <class T>
Resolved resolve_run(const Contacts& contacts, const Vector3d& origin, bool compensated, int run,
                     std::span<KnownCells> known, TriangleState<T>& state);

}  // namespace weft
