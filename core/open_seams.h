#pragma once

#include <array>
#include <vector>

#include "core/cloth_contact/cloth.h"
#include "core/contact/contact.h"
#include "core/moving_sheet.h"

namespace weft {

// Of triangles at open seams, those that start through another sheet, or that it starts through; of
// a sheet where one starts so through the sheet itself, all: cloth contact would keep them there.
LeftOut through_cloth_at_start(const Scene& scene, const LeftOut& open);

// Edges that reach from panel to panel while a seam closes. Colliders push particles, and such an
// edge has none between its ends: it would be drawn through a shoulder. So it is kept out as a
// thread is that lies over it.
class OpenSeams {
 public:
  // stretched: which triangles of the sheet are at open seams.
  OpenSeams(const SheetDefinition& sheet, const std::vector<bool>& stretched);
  // After a step of dt, s.
  void keep_out(const Contacts& contacts, double dt, MovingSheet& sheet);

 private:
  std::vector<int> particles_;             // ends of edges, ascending
  std::vector<std::array<int, 2>> edges_;  // numbers among particles_
  std::vector<int> parts_;                 // of each edge when it was looked at, between points
  std::vector<double> clear_;              // of each edge: so far its ends may come unlooked at, m
  Matrix3Xd x_, d_, before_;               // of particles: now, in the step, when last read, m
};

}  // namespace weft
