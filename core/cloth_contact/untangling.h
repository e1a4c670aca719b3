#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/cloth_contact/near_blocks.h"
#include "core/moving_sheet.h"

namespace weft {

// Leads apart cloth that has passed through cloth. Where an edge passes through a triangle, both
// are moved so that the line along which the two surfaces meet becomes shorter (Volino and
// Magnenat-Thalmann 2006), until there is none. That asks for no inside: borders, and lines that
// do not close, are led apart too; but what is linked, or a strip through a slit, may not be.
class Untangling {
 public:
  // How fast cloth is led apart at a time (s), m/s: each second ever faster, from the slowest on.
  // Taut cloth resists what is slow; let go in between, it may give way elsewhere.
  static double speed_at(double time);

  explicit Untangling(const Cloth& cloth) : cloth_(cloth) {}

  // These cuts of cloth at x, (3 x particles) m, are led apart at up to `speed`, m/s.
  void set(const std::vector<ClothPair>& cuts, const Matrix3Xd& x, double speed);
  void clear();
  bool empty() const { return pairs_.empty(); }
  // Whether all of these particles are at cuts: what they are to keep apart may be on wrong sides.
  bool has(const std::array<int, 4>& particles) const;
  // Has edges and triangles move apart in the step to come, which takes dt, s. What momentum one is
  // given is taken from the other. Returns the energy that it gave them, J.
  double lead(std::span<MovingSheet> sheets, double dt) const;

 private:
  // An edge and a triangle that it passes through.
  struct Pair {
    std::array<int, 5> particle;   // ends of the edge, corners of the triangle
    std::array<double, 5> weight;  // of its motion away from the triangle, where it passes through
    Vector3d way;                  // 1
    double speed;                  // m/s
  };

  using Around = std::vector<std::vector<int>>;  // triangles of each particle
  void add(int edge, int triangle, const Around& around, const Matrix3Xd& x, double speed);
  void free_beside(int edge, int triangle, const Around& around);

  const Cloth& cloth_;
  std::vector<Pair> pairs_;
  std::vector<bool> at_cut_;  // of each particle; or empty
};

}  // namespace weft
