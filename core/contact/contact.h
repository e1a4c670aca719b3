#pragma once

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "core/contact/moving_bodies.h"
#include "core/model/scene.h"

namespace weft {

// Signed distance of a point from a body (m, negative inside) and the direction out of it.
struct Distance {
  double value;
  Vector3d normal;
};

// Distances at the body's start place.
Distance distance(const Plane& plane, const Vector3d& point);
Distance distance(const Sphere& sphere, const Vector3d& point);
Distance distance(const Box& box, const Vector3d& point);
Distance distance(const Capsule& capsule, const Vector3d& point);
// Of a body of triangles as its grid has it; farther outside than its reach it is nearer than the
// body, and the direction of no meaning.
Distance distance(const SharedBody& body, const Vector3d& point);
// posed: the body as it was placed for that time, where it has left its first pose.
Distance distance(const Collider& collider, const Vector3d& point, double time,
                  const PosedBody* posed = nullptr);

// Of particles whose contact was resolved: how far the nearest was from a skin, below 0 where one
// was moved; how far they were moved, and how much their displacements changed, at most, m.
struct Resolved {
  double gap = std::numeric_limits<double>::infinity();
  double moved = 0, changed = 0;

  void move(double by, double in_step) {
    moved = std::max(moved, by);
    changed = std::max(changed, in_step);
  }
};

// The colliders of a scene during one step, as a sheet meets them.
class Contacts {
 public:
  // friction: of the textile; skin: m; from `time` - dt to `time`, s. Colliders are smaller all
  // around by `deflate` (m), and grow by `growth` (m) in the step. bodies: placed for the step.
  // pressed: how far other cloth may have moved a particle in the step without speed, m.
  Contacts(std::span<const Collider> colliders, const MovingBodies& bodies, double friction,
           double skin, double time, double dt, double deflate = 0, double growth = 0,
           double pressed = 0);

  // A collider where it is at the end of the step.
  struct Placed {
    const Collider& collider;
    Eigen::Matrix3d turn;              // of a box
    Vector3d offset;                   // from its start, m
    Vector3d carried;                  // its displacement in the step, m
    double friction;                   // between it and the textile
    double thickness;                  // of it where it is thinnest, with the skin on both sides, m
    double steepest;                   // by how much its distances grow in a metre, at most
    double creep;                      // how far what is in it is pushed out in the step, m
    const PosedBody* posed = nullptr;  // between poses; offset and carried are of its middle then
  };
  std::span<const Placed> placed() const { return placed_; }
  // Of the first collider, where it is a body of triangles in the shape that it is given in; or
  // none.
  const DistanceGrid* first_grid() const {
    const auto* body = std::get_if<SharedBody>(&placed_.front().collider.shape);
    return body != nullptr && placed_.front().posed == nullptr ? &(*body)->grid : nullptr;
  }
  // Of the textile, from colliders as they are given: less than nothing where they are deflated.
  double skin() const { return skin_; }
  // A body may push a particle into another one: so many rounds at most, until one moves it by no
  // more than kNothing (m).
  static constexpr int kRounds = 32;
  static constexpr double kNothing = 1e-12;
  static constexpr double kOutward = 0.25;  // m/s, see resolve()
  // How far the fastest collider moves in this step, m.
  double reach() const { return reach_; }
  // Whether a particle that moves so far (m) in this step could come through a collider unseen.
  bool may_cross(double moved) const { return kParts * (moved + reach_) > thinnest_; }
  // How far a point is from the nearest skin at the end of the step, m, or less; negative inside;
  // and the direction out of that collider.
  Distance nearest(const Vector3d& x) const;
  // How far a particle may come before it touches a skin, m, or less; negative inside.
  double gap(const Vector3d& x) const;
  // Whether a collider is a deflated body of triangles, whose skin lies where blocks of its grid
  // have eight values each: distances jump from one to the next, and what is inside the body as it
  // is given may touch the skin wherever it goes.
  bool jumps(const Placed& placed) const { return placed.steepest > 1 && skin_ < 0; }
  // Moves a particle that is closer to a collider than the skin out to it, inelastically, and slows
  // its sliding by Coulomb friction. Where it could have crossed one in the step, it meets them in
  // parts of the step, in each of which it comes no farther than a quarter of the thickness. What
  // is deeper in a body of triangles than it can have come in the step began there: it leaves at
  // kOutward. x: position, d: displacement of the last step, m. Whether it touched one.
  bool resolve(Vector3d& x, Vector3d& d) const;

 private:
  static constexpr double kParts = 4;  // of a thickness

  int parts(const Vector3d& x, const Vector3d& d) const;
  // In part `share` of the step that ends `left` of the step before its end.
  bool push_out(Vector3d& x, Vector3d& d, double left, double share) const;

  std::vector<Placed> placed_;
  double skin_, reach_ = 0, thinnest_;
};

}  // namespace weft
