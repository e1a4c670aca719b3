#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/around_bodies.h"
#include "core/model/scene.h"

namespace weft {

class MovingBodies;
struct MovingSheet;

// Something that keeps a drape from being good.
struct Fault {
  std::string code;
  std::string message;  // with the value and its bound
};

// Cloth that is strained too much, along the warp or the weft: 1 % of all by more than `strain`,
// where cloth that fits is by `most` at most.
struct TooTight {
  double strain = 0, most = 0;
  std::string panel;  // with most of it
};

// How cloth sits, judged from one frame.
struct Verdict {
  bool dressed = true;  // seams are closed, weight is in, nothing is held
  bool at_rest = false;
  std::int64_t cloth_cuts = 0;        // edges through triangles of cloth, exactly
  std::int64_t particles_inside = 0;  // of colliders
  double deepest = 0;                 // of them, m
  double strain_warp = 0;             // 99th percentile by area, l / L - 1
  double strain_weft = 0;
  std::optional<TooTight> too_tight;
  double largest_pressure = 0;  // of colliders on cloth, Pa
  double slid = 0;              // of what was held: farthest down from its start, its mean, m
  double fallen = 0;            // of sewn sheets without holds: their mean, m
  std::vector<LooseBorder> loose_borders;  // of what is dressed
  std::vector<Fault> faults;               // none: it is good
};

// The sheets as they are at the end of a frame at `time`, in the order of the scene.
Verdict judge(const Scene& scene, const MovingBodies& bodies,
              const std::vector<MovingSheet>& sheets, double time, bool at_rest);

}  // namespace weft
