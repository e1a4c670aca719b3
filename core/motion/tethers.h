#pragma once

#include <algorithm>
#include <vector>

#include "core/model/mesh.h"

namespace weft {

// Long range attachments (Kim, Chentanez and Mueller 2012): no free particle comes farther from a
// held one than the cloth between them is long. Soft cloth then hangs as stiff cloth does.

// Held particles that hang together. Each free particle is tethered to the nearest of them.
struct Attachment {
  std::vector<int> held;
  // Of each particle of the sheet:
  std::vector<int> nearest;    // which of `held`
  std::vector<double> length;  // m; infinity: it is held, or no cloth leads there
};
using Tethers = std::vector<Attachment>;

// More than these are taken together.
inline constexpr std::size_t kMostAttachments = 8;
// What is beyond its tether without having moved away comes back at no more than, m/s.
inline constexpr double kInward = 0.25;

// The attachments of a sheet, without lengths; where nothing is held none.
Tethers find_attachments(const SheetDefinition& sheet);

// A particle, and how far it came in the last step, m.
struct Moved {
  Vector3d x, d;
};
// Moves a particle that is farther from the end of its tether than that is long back, by so much
// that it has come nearer in the step by no more than `inward`, m; its displacement is then what it
// has come, so that it keeps no velocity that took it away. Returns how far, m.
double pull_back(const Moved& end, double length, double inward, Moved& particle);

// Does so with all particles of a sheet, for one attachment after the other: get(i) -> Moved,
// put(i, Moved). Returns how far at most.
template <class Get, class Put>
double pull_back(const Tethers& tethers, double inward, const Get& get, const Put& put) {
  double farthest = 0;
  for (const Attachment& attachment : tethers)
    for (std::size_t i = 0; i < attachment.length.size(); ++i) {
      const int end = attachment.held[static_cast<std::size_t>(attachment.nearest[i])];
      Moved particle = get(static_cast<int>(i));
      const double back = pull_back(get(end), attachment.length[i], inward, particle);
      if (back == 0) continue;
      put(static_cast<int>(i), particle);
      farthest = std::max(farthest, back);
    }
  return farthest;
}

}  // namespace weft
