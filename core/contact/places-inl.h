// Contact of vectors of particles, in double; included once for every target.
#if defined(WEFT_PLACES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef WEFT_PLACES_INL_H
#undef WEFT_PLACES_INL_H
#else
#define WEFT_PLACES_INL_H
#endif

#include <hwy/highway.h>

#include "core/contact/contact.h"
#include "core/motion/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {

using ContactTag = hn::ScalableTag<double>;
using Reals = hn::Vec<ContactTag>;
using Places = Triple<Reals>;

HWY_INLINE Reals real(double value) { return hn::Set(ContactTag(), value); }
HWY_INLINE Places everywhere(const Vector3d& v) { return {real(v[0]), real(v[1]), real(v[2])}; }
// Signed distances from a body, negative inside, and directions out of it.
struct Distances {
  Reals value;
  Places normal;
};

HWY_INLINE Distances distances_from_ball(const Places& center, double radius, const Places& point) {
  const Reals zero = real(0), one = real(1);
  const Places away = minus(point, center);
  const Reals length = hn::Sqrt(squared(away));
  const auto apart = hn::Gt(length, zero);
  const Places normal = times(away, hn::Div(one, length));
  return {hn::Sub(length, real(radius)),
          {hn::IfThenElseZero(apart, normal.x), hn::IfThenElse(apart, normal.y, one),
           hn::IfThenElseZero(apart, normal.z)}};
}

HWY_INLINE Distances distances(const Plane& plane, const Eigen::Matrix3d&, const Places& point) {
  const Places normal = everywhere(plane.normal.normalized());
  return {dot(minus(point, everywhere(plane.point)), normal), normal};
}

HWY_INLINE Distances distances(const Sphere& sphere, const Eigen::Matrix3d&, const Places& point) {
  return distances_from_ball(everywhere(sphere.center), sphere.radius, point);
}

HWY_INLINE Distances distances(const Capsule& capsule, const Eigen::Matrix3d&,
                               const Places& point) {
  const Vector3d axis = capsule.end - capsule.start;
  const double squared = axis.squaredNorm();
  const Places start = everywhere(capsule.start), along = everywhere(axis);
  const Reals share =
      squared > 0 ? hn::Div(dot(minus(point, start), along), real(squared)) : real(0);
  const Reals inside = hn::Min(hn::Max(share, real(0)), real(1));
  return distances_from_ball(plus_times(start, along, inside), capsule.radius, point);
}

// turn: of the box.
HWY_INLINE Distances distances(const Box& box, const Eigen::Matrix3d& turn, const Places& point) {
  const Reals zero = real(0);
  const Places away = minus(point, everywhere(box.center));
  const Places edge[] = {everywhere(turn.col(0)), everywhere(turn.col(1)), everywhere(turn.col(2))};
  const Places local{dot(away, edge[0]), dot(away, edge[1]), dot(away, edge[2])};
  const Places half = everywhere(box.half_size);
  const Places to_faces{hn::Sub(hn::Abs(local.x), half.x), hn::Sub(hn::Abs(local.y), half.y),
                        hn::Sub(hn::Abs(local.z), half.z)};
  const Places outside{hn::Max(to_faces.x, zero), hn::Max(to_faces.y, zero),
                       hn::Max(to_faces.z, zero)};
  const Reals length = hn::Sqrt(squared(outside));
  const auto apart = hn::Gt(length, zero);

  // inside: out by the nearest face
  const Reals inside = hn::Max(to_faces.x, hn::Max(to_faces.y, to_faces.z));
  const auto by_x = hn::Eq(to_faces.x, inside);
  const auto by_y = hn::AndNot(by_x, hn::Eq(to_faces.y, inside));
  const auto by_z = hn::AndNot(hn::Or(by_x, by_y), hn::Eq(to_faces.z, inside));
  const Reals one = real(1);
  const Reals inverse = hn::Div(one, length);
  const auto part = [&](Reals out, auto face, Reals side) HWY_ATTR {
    const Reals size = hn::IfThenElse(apart, hn::Mul(out, inverse), hn::IfThenElseZero(face, one));
    return hn::CopySign(size, side);
  };
  const Places normal = plus_times(plus_times(times(edge[0], part(outside.x, by_x, local.x)),
                                              edge[1], part(outside.y, by_y, local.y)),
                                   edge[2], part(outside.z, by_z, local.z));
  return {hn::IfThenElse(apart, length, inside), normal};
}

HWY_INLINE Distances distances(const Contacts::Placed& placed, const Places& point) {
  const Places at = minus(point, everywhere(placed.offset));
  const auto& shape = placed.collider.shape;
  if (const auto* plane = std::get_if<Plane>(&shape)) return distances(*plane, placed.turn, at);
  if (const auto* sphere = std::get_if<Sphere>(&shape)) return distances(*sphere, placed.turn, at);
  if (const auto* box = std::get_if<Box>(&shape)) return distances(*box, placed.turn, at);
  return distances(*std::get_if<Capsule>(&shape), placed.turn, at);
}

// See Contacts::resolve().
template <class M>
HWY_INLINE void resolve_places(const Contacts& contacts, M active, Places& x, Places& d) {
  const Reals zero = real(0), skin = real(contacts.skin());
  for (int round = 0; round < Contacts::kRounds; ++round) {
    Reals deepest = zero;
    for (const Contacts::Placed& placed : contacts.placed()) {
      const auto [value, normal] = distances(placed, x);
      const auto touching = hn::And(active, hn::Lt(value, skin));
      const Reals depth = hn::IfThenElseZero(touching, hn::Sub(skin, value));
      deepest = hn::Max(deepest, depth);
      const Places relative = minus(d, everywhere(placed.carried));
      const Reals approach = dot(relative, normal);

      x = plus_times(x, normal, depth);
      const Reals push = hn::Min(hn::Max(hn::Neg(approach), zero), depth);
      d = plus_times(d, normal, push);

      const Places sliding = minus_times(relative, normal, approach);
      const Reals length = hn::Sqrt(squared(sliding));
      const Reals most = hn::Div(hn::Mul(real(placed.friction), push), length);
      const Reals share =
          hn::IfThenElseZero(hn::And(touching, hn::Gt(length, zero)), hn::Min(real(1), most));
      x = minus_times(x, sliding, share);
      d = minus_times(d, sliding, share);
    }
    active = hn::And(active, hn::Gt(deepest, real(Contacts::kNothing)));
    if (contacts.placed().size() == 1 || hn::AllFalse(ContactTag(), active)) return;
  }
}

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
