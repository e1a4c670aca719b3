#pragma once

#include <random>

#include "core/simulation.h"

namespace weft::testing {

// A legal scene that nothing disturbs: a small sheet of any stiffness and of a damping over six
// decades, hung by corners or by an edge, or crumpled and free.
Scene undisturbed_scene(std::mt19937_64& random);

// What became of a scene's energy (kinetic, elastic, of gravity), as means over quarters of a
// second, the first second left out: velocities of one time say too much of fast modes, so energy
// seems to rise while these begin to move.
struct EnergyTrial {
  double gain = 0;        // largest rise above what it had been before, J
  double stored = 0;      // largest kinetic and elastic energy, J
  double weight = 0;      // m g h, J
  bool warned = false;    // UNDERDAMPED, before the run
  bool repaired = false;  // or failed

  // Whether it gained more than 5 % of its energy, and more than 1e-6 m g h, and nobody was told.
  bool silent_gain() const {
    return !warned && !repaired && gain > 0.05 * stored && gain > 1e-6 * weight;
  }
};
EnergyTrial try_energy(const Scene& scene, double seconds);

}  // namespace weft::testing
