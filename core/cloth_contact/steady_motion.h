#pragma once

#include <cstdint>

#include "core/model/mesh.h"
#include "core/motion/thread_pool.h"

namespace weft {

// How far cloth comes beside a motion that it had and that goes on evenly, as particles see each
// other. Where nothing is hit, displacements hardly change from one step to the next.
class SteadyMotion {
 public:
  void forget() { *this = {}; }
  // The motion is from one place to the other, (3 x particles) m, in so many steps; some have been
  // taken, and were that together.
  void begin(const Matrix3Xd& from, const Matrix3Xd& to, int steps, int taken);
  // Steps are from now on others than before, by so much at most, m in relation to each other.
  void change(double by) { differs_ += by; }
  // Another step.
  void step() {
    ++taken_;
    strays_ += differs_;
  }
  // Looks where cloth is, and at the displacements of its last step, (3 x particles) m.
  void measure(const Matrix3Xd& x, const Matrix3Xd& d, ThreadPool& pool);

  // After so many more steps, which change by no more than `change` in all: how many times it has
  // come as far as the motion goes, and how far beside that at most, m.
  double times(int more) const { return static_cast<double>(taken_ + more) / steps_; }
  double strays(int more, double change) const {
    return more == 0 ? strays_ : strays_ + more * (differs_ + change);
  }

 private:
  Matrix3Xd from_, by_;  // m; in a step
  int steps_ = 0;
  std::int64_t taken_ = 0;  // grows as long as anything is near
  double differs_ = 0;      // the last step, m
  double strays_ = 0;       // m
};

}  // namespace weft
