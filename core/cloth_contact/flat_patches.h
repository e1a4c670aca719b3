#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "core/cloth_contact/cloth.h"
#include "core/cloth_contact/gradients.h"
#include "core/cloth_contact/made_once.h"

namespace weft {

// At right angles to each other; the first two lie in a plane that goes both ways.
Eigen::Matrix3d axes_of(const Eigen::Matrix<double, 3, 2>& ways);

// Tells where cloth lies so flat that it cannot be near itself. Let x(u) be the sheet over its flat
// shape as seen along a line, and H convex there and without border inside. If the gradients of all
// triangles over H differ from one matrix F by less than e, then |x(u) - x(v)| >= (s - e) |u - v|
// for u and v in H, s the smaller singular value of F: the way from u to v leads through these
// triangles alone. And what shares no particle is no nearer to each other in H than triangles are
// high.
class FlatPatches {
 public:
  // runs: beyond the numbers of all runs of blocks that are asked for.
  FlatPatches(const Cloth& cloth, int runs);

  // From now on cloth is at `places`, (4 x particles) m in single precision, no coordinate beyond
  // `farthest`, which outlive what is asked.
  void set(const Eigen::Matrix4Xf& places, double farthest);
  // Blocks first ... last - 1, a run with a number of its own.
  struct Blocks {
    int number, first, last;
  };
  // The least distance between particles and edges of some blocks and others, or within these, that
  // share no particle, at least, m; 0 where none is known. Threads may ask at the same time.
  double distance(const Blocks& some, const Blocks& others);

 private:
  using Box = Eigen::AlignedBox2d;
  using Polygon = std::vector<Vector2d>;  // convex, anticlockwise
  struct Patch {
    MadeOnce is_made;
    bool whole = false;       // no border lies inside
    double least_height = 0;  // of its triangles, m
    std::vector<int> blocks;
    MadeOnce has_distance;
    double distance = 0;  // m
  };
  struct Border {
    int piece;
    Vector2d from, to;
  };

  struct Known {
    int other;  // run
    std::unique_ptr<Patch> patch;
  };

  Patch& patch(const Blocks& some, const Blocks& others);
  void make(const Blocks& some, const Blocks& others, Patch& patch) const;
  double distance(const Patch& over);

  const Cloth& cloth_;
  std::vector<Polygon> hull_;         // of each block
  std::vector<Box> box_;              // around these
  std::vector<double> least_height_;  // of each block, m
  std::vector<Border> borders_;
  std::mutex mutex_;                         // of patches_, but not of what is in these
  std::vector<std::vector<Known>> patches_;  // of each run, ascending

  const Eigen::Matrix4Xf* places_ = nullptr;
  double farthest_ = 0;   // m
  std::int64_t now_ = 0;  // counts what was set
  Gradients gradients_;
  std::vector<MadeOnce> are_set_;  // of each block, at places
};

}  // namespace weft
