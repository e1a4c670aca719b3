#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/forces/wind_law.h"
#include "core/model/mesh.h"
#include "core/motion/aligned_array.h"
#include "core/motion/thread_pool.h"

namespace weft {

// A particle's place in memory: four values lie there, x, y, z and 0.
using Offset = std::uint32_t;

// An edge at a particle: where its other end lies, and the tensions of two triangles at it.
struct Side {
  Offset particle, tension[2];
};
// A particle farther away whose place bends the sheet here, N/m.
template <class T>
struct Reach {
  Offset particle;
  T stiffness;
};

// How forces on a particle are added up, in this order.
template <class T>
struct Gather {
  std::uint32_t sides = 0;
  std::uint32_t reaches = 0;         // in fours; what is missing reaches to itself
  std::uint32_t corners = 0;         // of triangles that wind presses on
  T reach_sum = 0, reach_error = 0;  // of stiffness, N/m, and what rounding has added to it
};

// What one substep does to a sheet of triangles. With l the lengths of its edges and L those in the
// flat shape, the energy of a triangle is a quadratic form in the three l^2 - L^2: its edges pull
// by sums of l^2. Bending is a quadratic form in all positions: its part between the ends of an
// edge pulls like that, too, and the rest between particles farther apart.
template <class T>
struct TriangleLaw {
  static constexpr int kLanes = 64 / sizeof(T);  // triangles in a group
  static constexpr int kBlock = 64;              // particles in a block

  int particles = 0, groups = 0;
  std::vector<int> place;  // of each particle of the sheet: which it is in memory

  bool pushes = true, bends = false;
  AlignedArray<Offset> corners;  // (groups x 3 x kLanes), of particles
  // Where triangles push: tension of edge k, N/m, the sum of s_kj l_j^2 less r_k: s_00, s_11, s_22,
  // s_01, s_12, s_02, r_0, r_1, r_2. Otherwise three modes a_0, a_1, a_2, r, of warp and weft,
  // which only pull, and of shear: m = a . l^2 - r, tension of edge k: the sum of m a_k, less a
  // last three.
  AlignedArray<T> stiffness;  // (groups x constants() x kLanes)
  int constants() const { return pushes ? 9 : 15; }

  AlignedArray<Gather<T>> gathers;  // of each particle
  AlignedArray<Side> sides;
  AlignedArray<Reach<T>> reaches;
  AlignedArray<Offset> blown;  // of triangles
  // Of each block of particles, where its share of these begins.
  struct Block {
    std::size_t side = 0, reach = 0, blown = 0;
    int groups = 0;  // that have all triangles at it and at those before it
  };
  std::vector<Block> blocks;
  // Lets go of all these, until restore().
  void release();
  bool released() const { return gathers.size() == 0; }
  void restore(const Mesh& mesh);

  T damping = 0;  // k_d / (2 dt), kg/s^2
  bool drags = false;
  std::array<T, 4> drift{};  // gravity dt^2, m
  std::array<T, 4> air{};    // displacement of the air in dt, m
  WindLaw<T> wind;
  bool compensated = true;  // the sums of d and x
  bool measured = false;    // whether sweep() says how far particles went
};

// Everything but damping, drag, drift and air, which depend on the step.
template <class T>
TriangleLaw<T> make_triangle_law(const Mesh& mesh, bool blows);

// Particles in an order that keeps neighbours near.
std::vector<int> near_order(const std::vector<std::vector<int>>& neighbours);

}  // namespace weft
