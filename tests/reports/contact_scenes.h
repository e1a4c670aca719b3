#pragma once

#include <string>
#include <vector>

#include "core/model/scene.h"

// Scenes in which cloth meets bodies and cloth.
namespace weft::reports {

struct ContactScene {
  std::string name, says;
  Scene scene;
  double seconds = 0;
  double shown = 0;  // when its picture is taken, s
};

// A sheet of n x n particles that hangs from two corners and touches nothing; as triangles, or as a
// lattice; in air that slows it by `drag`, 1/s.
Scene hung(int n, bool lattice, double drag = 0);
// A sheet of n x n particles, 10 mm apart, that falls onto a ball of 0.15 m given as triangles.
Scene draped(int n);
// Ten sheets of n x n particles over one another that fall onto such a ball.
Scene stacked(int n);

// Those whose cuts are counted.
std::vector<ContactScene> contact_scenes(bool large);

}  // namespace weft::reports
