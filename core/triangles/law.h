#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/forces/wind_law.h"
#include "core/model/mesh.h"
#include "core/motion/aligned_array.h"
#include "core/motion/thread_pool.h"

namespace weft {

// A particle's place in memory: four values lie there, x, y, z and 0.
using Offset = std::uint32_t;
// A place within a patch: of a particle or of a wind's push in steps of 8 bytes, of a tension in
// values.
using Near = std::uint16_t;

// An edge at a particle: where its other end lies, and the tensions of two triangles at it.
struct Side {
  Near particle, tension[2];
};
// Four particles farther away whose places bend the sheet here, N/m.
template <class T>
struct Reaches {
  T stiffness[4];
  Near particle[4];
};

// How forces on a particle are added up, in this order.
template <class T>
struct Gather {
  T reach_sum = 0, reach_error = 0;  // of stiffness, N/m, and what rounding has added to it
  std::uint16_t sides = 0;
  std::uint16_t reaches = 0;  // in fours; what is missing reaches to itself
  std::uint16_t corners = 0;  // of triangles that wind presses on
};

// What one substep does to a sheet of triangles. With l the lengths of its edges and L those in the
// flat shape, the energy of a triangle is a quadratic form in the three l^2 - L^2: its edges pull
// by sums of l^2. Bending is a quadratic form in all positions: its part between the ends of an
// edge pulls like that, too, and the rest between particles farther apart.
template <class T>
struct TriangleLaw {
  static constexpr int kLanes = 64 / sizeof(T);  // triangles in a group
  static constexpr int kBlock = 64;              // particles in a block
  static constexpr int kPatchBlocks = 16;

  int particles = 0;
  std::vector<int> place;  // of each particle of the sheet: which it is in memory
  int blocks() const { return (particles + kBlock - 1) / kBlock; }

  // Blocks that are stepped together, out of a copy of their particles and of those around them
  // that stays in a core's own caches; half and twice as many are as fast. A triangle between two
  // patches is in both.
  struct Patch {
    int block = 0, blocks = 0;
    std::size_t around = 0, around_count = 0, beside_count = 0, group = 0, group_count = 0;
    std::size_t side = 0, reach = 0, blown = 0;  // where its share of these begins
  };
  std::vector<Patch> patches;
  std::size_t most_particles = 0, most_groups = 0;  // of a patch
  AlignedArray<Offset> around;                      // particles, in their order within the patch

  bool pushes = true, bends = false;
  AlignedArray<Near> corners;  // (groups x 3 x kLanes), of particles
  // Where triangles push: tension of edge k, N/m, the sum of s_kj l_j^2 less r_k: s_00, s_11, s_22,
  // s_01, s_12, s_02, r_0, r_1, r_2. Otherwise three modes a_0, a_1, a_2, r, of warp and weft,
  // which only pull, and of shear: m = a . l^2 - r, tension of edge k: the sum of m a_k, less a
  // last three.
  AlignedArray<T> stiffness;   // (groups x constants() x kLanes)
  std::vector<int> triangles;  // of the mesh (groups x kLanes); -1 where there is none
  std::size_t constants() const { return pushes ? 9 : 15; }

  AlignedArray<Gather<T>> gathers;  // of each particle
  AlignedArray<Side> sides;
  AlignedArray<Reaches<T>> reaches;
  AlignedArray<Near> blown;  // of triangles
  // Sets stiffness, gathers and reaches by a mesh of the same triangles, whose rest shape and
  // stiffness may be others.
  void set_constants(const Mesh& mesh);
  // Lets go of all these, until restore().
  void release();
  bool released() const { return gathers.size() == 0; }
  void restore(const Mesh& mesh);

  T damping = 0;  // k_d / (2 dt), kg/s^2
  bool drags = false;
  std::array<T, 4> drift{};  // gravity dt^2, m
  std::array<T, 4> air{};    // displacement of the air in dt, m
  WindLaw<T> wind;
  T slow = 1;  // how many times as strongly drag acts in this substep; 0: neither it nor wind does
  bool compensated = true;  // the sums of d and x
  bool measured = false;    // whether sweep() says how far particles went
  bool changes = false;     // and by how much that has changed
};

// Everything but damping, drag, drift and air, which depend on the step. Nothing where particles
// have too many neighbours for a patch, some thousands.
template <class T>
std::optional<TriangleLaw<T>> make_triangle_law(const Mesh& mesh, bool blows);

}  // namespace weft
