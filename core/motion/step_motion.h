#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "core/model/mesh.h"

namespace weft {

// What a sweep says of its step, where it is asked, m.
template <class T>
struct Largest {
  T moved = 0;    // the largest displacement, at most
  T changed = 0;  // by how much one differs from the step before, at most
};

// How far the particles of a sheet come in a step, and how much that changes, at most, m.
class StepMotion {
 public:
  // From now on also how much it changes, of what is held, and of what colliders move, in so many
  // parts of the sheet.
  void measure(std::size_t parts) {
    measures_ = true;
    pushes_.resize(parts);
  }
  void start() { pushed_ = changed_ = 0; }

  template <class T>
  void step(const Largest<T>& largest) {
    moved_ = largest.moved;
    changed_ += step_changed_ = largest.changed;
  }
  // A held particle has come so far, which is not what the step took it to have come.
  void hold(const Vector3d& d, const Vector3d& before) {
    if (!measures_) return;
    moved_ = std::max(moved_, d.norm());
    if (const double changed = (d - before).norm(); changed > step_changed_)
      changed_ += changed - std::exchange(step_changed_, changed);
  }
  // So many tethers pulled particles back by so much each.
  void pull_back(double back, std::size_t tethers) {
    moved_ += back;
    changed_ += back * static_cast<double>(tethers);
  }
  void displace(const Eigen::Ref<const Matrix3Xd>& by, const Eigen::Ref<const Matrix3Xd>& in_step) {
    const double moved = farthest(by);
    moved_ += moved;
    if (measures_) changed_ += moved + farthest(in_step);
  }
  // Colliders moved particles of a part by so much, and their displacements, at most; threads may
  // say so, each of other parts.
  void push(int part, double x, double d) {
    if (measures_) pushes_[static_cast<std::size_t>(part)] = {x, d};
  }
  // Of all parts that colliders were near.
  void pushed(std::span<const int> parts) {
    pushed_ = 0;
    if (!measures_) return;
    double changed = 0;
    for (const int part : parts) {
      const Push& push = pushes_[static_cast<std::size_t>(part)];
      pushed_ = std::max(pushed_, push.x);
      changed = std::max(changed, push.d);
    }
    changed_ += pushed_ + changed;
  }

  double moved() const { return moved_; }
  double pushed() const { return pushed_; }
  double take_change() { return std::exchange(changed_, 0); }

 private:
  struct Push {
    double x = 0, d = 0;  // places, displacements
  };
  static double farthest(const Eigen::Ref<const Matrix3Xd>& ways) {
    return std::sqrt(ways.colwise().squaredNorm().maxCoeff());
  }

  double moved_ = 0, pushed_ = 0;
  double changed_ = 0, step_changed_ = 0;  // since taken; by the last step and what is held
  bool measures_ = false;
  std::vector<Push> pushes_;  // of each part, when last looked at
};

}  // namespace weft
