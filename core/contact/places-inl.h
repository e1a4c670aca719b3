// Contact of vectors of particles, in double; included once for every target.
#if defined(WEFT_PLACES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef WEFT_PLACES_INL_H
#undef WEFT_PLACES_INL_H
#else
#define WEFT_PLACES_INL_H
#endif

#include <hwy/highway.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/contact/contact.h"
#include "core/contact/known_cells.h"
#include "core/motion/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {

using ContactTag = hn::ScalableTag<double>;
using Reals = hn::Vec<ContactTag>;
using Places = Triple<Reals>;
using IntTag = hn::Rebind<std::int32_t, ContactTag>;
using Ints = hn::Vec<IntTag>;
using FloatTag = hn::Rebind<float, ContactTag>;
using Floats = hn::Vec<FloatTag>;

HWY_INLINE Reals real(double value) { return hn::Set(ContactTag(), value); }
HWY_INLINE Places everywhere(const Vector3d& v) { return {real(v[0]), real(v[1]), real(v[2])}; }
// Signed distances from a body, negative inside, and directions out of it.
struct Distances {
  Reals value;
  Places normal;
  Reals change = real(0);  // of the value from one grid to the next
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

// Where points are in a grid: as in the plain version, which says more of it.
struct InGrids {
  Reals first, row, layer;
  Places share;
  Reals beyond;
};

// begin_of: where the values of blocks begin, by their index.
template <class F>
HWY_INLINE InGrids locate(const DistanceGrid& grid, const Places& point, const F& begin_of) {
  constexpr double kBlock = DistanceGrid::kBlock;
  const double edge = kBlock * grid.cell;
  const Reals zero = real(0), one = real(1);
  const Places most{real(grid.blocks[0]), real(grid.blocks[1]), real(grid.blocks[2])};

  // the block, and where in it
  const Places at = times(minus(point, everywhere(grid.low)), real(1 / edge));
  const auto within = [&](Reals v, Reals end) HWY_ATTR {
    return hn::IfThenElseZero(hn::Gt(v, zero), hn::Min(v, end));  // also what is no number
  };
  const Places inside{within(at.x, most.x), within(at.y, most.y), within(at.z, most.z)};
  const auto whole = [&](Reals v, Reals end)
                         HWY_ATTR { return hn::Min(hn::Floor(v), hn::Sub(end, one)); };
  const Places block{whole(inside.x, most.x), whole(inside.y, most.y), whole(inside.z, most.z)};
  const Reals index = hn::MulAdd(hn::MulAdd(block.z, most.y, block.y), most.x, block.x);
  const Reals begin = hn::PromoteTo(ContactTag(), begin_of(hn::DemoteTo(IntTag(), index)));
  const auto fine = hn::Ge(begin, zero);
  const Reals cells = hn::IfThenElse(fine, real(kBlock), one);
  const Places in_block = times(minus(inside, block), cells);
  const Places cell{whole(in_block.x, cells), whole(in_block.y, cells), whole(in_block.z, cells)};

  const Reals row = hn::Add(cells, one), layer = hn::Mul(row, row);
  const Reals first = hn::Add(hn::IfThenElse(fine, begin, hn::Sub(hn::Neg(one), begin)),
                              hn::MulAdd(cell.z, layer, hn::MulAdd(cell.y, row, cell.x)));
  const Places away = minus(at, inside);
  return {first, row, layer, minus(in_block, cell), hn::Mul(hn::Sqrt(squared(away)), real(edge))};
}

HWY_INLINE auto read_begin(const DistanceGrid& grid) {
  return [&grid](Ints index)
             HWY_ATTR { return hn::GatherIndex(IntTag(), grid.begin.data(), index); };
}
HWY_INLINE InGrids locate(const DistanceGrid& grid, const Places& point) {
  return locate(grid, point, read_begin(grid));
}

struct BetweenCorners {
  Reals value;
  Places slope;
};

// Values at two corners of cells that are neighbours along x.
struct TwoCorners {
  Floats low, high;
};
// In the order of the grid: corners 0 and 1, 2 and 3, 4 and 5, 6 and 7.
using Corners = std::array<TwoCorners, 4>;

HWY_INLINE TwoCorners read_two(const float* values, Reals from) {
  const hn::Rebind<std::uint32_t, ContactTag> words;
  const hn::RebindToSigned<ContactTag> offsets;
  const hn::RebindToUnsigned<ContactTag> pairs;
  const auto bytes = hn::ShiftLeft<2>(hn::PromoteTo(offsets, hn::DemoteTo(IntTag(), from)));
  const auto pair = hn::GatherOffset(pairs, reinterpret_cast<const std::uint64_t*>(values), bytes);
  return {hn::BitCast(FloatTag(), hn::TruncateTo(words, pair)),
          hn::BitCast(FloatTag(), hn::TruncateTo(words, hn::ShiftRight<32>(pair)))};
}

HWY_INLINE Corners read_corners(const float* values, const InGrids& at) {
  const Reals above = hn::Add(at.first, at.layer);
  return {read_two(values, at.first), read_two(values, hn::Add(at.first, at.row)),
          read_two(values, above), read_two(values, hn::Add(above, at.row))};
}

HWY_INLINE BetweenCorners between(const Corners& corners, const Places& share) {
  const auto mix = [](Reals a, Reals b, Reals s)
                       HWY_ATTR { return hn::MulAdd(hn::Sub(b, a), s, a); };
  Reals x[4], dx[4], y[2], dxy[2], dy[2];
  for (std::size_t k = 0; k < 4; ++k) {
    const Reals low = hn::PromoteTo(ContactTag(), corners[k].low);
    dx[k] = hn::Sub(hn::PromoteTo(ContactTag(), corners[k].high), low);
    x[k] = hn::MulAdd(dx[k], share.x, low);
  }
  for (std::size_t k = 0; k < 2; ++k) {
    dy[k] = hn::Sub(x[2 * k + 1], x[2 * k]);
    y[k] = hn::MulAdd(dy[k], share.y, x[2 * k]);
    dxy[k] = mix(dx[2 * k], dx[2 * k + 1], share.y);
  }
  return {mix(y[0], y[1], share.z),
          {mix(dxy[0], dxy[1], share.z), mix(dy[0], dy[1], share.z), hn::Sub(y[1], y[0])}};
}

// Between the values at the corners of cells.
HWY_INLINE BetweenCorners between_corners(const float* values, const InGrids& at) {
  return between(read_corners(values, at), at.share);
}

HWY_INLINE Places direction(const Places& v) {
  const Reals zero = real(0), one = real(1);
  const Reals length = hn::Sqrt(squared(v));
  const auto sloped = hn::Gt(length, zero);
  const Places normal = times(v, hn::Div(one, length));
  return {hn::IfThenElseZero(sloped, normal.x), hn::IfThenElse(sloped, normal.y, one),
          hn::IfThenElseZero(sloped, normal.z)};
}

HWY_INLINE Distances distances(const DistanceGrid& grid, const InGrids& at,
                               const BetweenCorners& between) {
  return {hn::IfThenElse(hn::Gt(at.beyond, real(0)), hn::Add(real(grid.reach), at.beyond),
                         between.value),
          direction(between.slope)};
}
HWY_INLINE Distances distances(const DistanceGrid& grid, const Places& point) {
  const InGrids at = locate(grid, point);
  return distances(grid, at, between_corners(grid.values.data(), at));
}
// lane: which of the particles that the cells are of is the first here.
HWY_INLINE Distances distances(const DistanceGrid& grid, const Places& point, KnownCells& known,
                               std::size_t lane) {
  const auto same = [](Ints a, Ints b) HWY_ATTR { return hn::AllTrue(IntTag(), hn::Eq(a, b)); };
  std::int32_t *const block = &known.block[lane], *const begin = &known.begin[lane],
                      *const cell = &known.cell[lane];
  const InGrids at = locate(grid, point, [&](Ints index) HWY_ATTR {
    if (same(index, hn::LoadU(IntTag(), block))) return hn::LoadU(IntTag(), begin);
    const Ints read = read_begin(grid)(index);
    hn::StoreU(index, IntTag(), block);
    hn::StoreU(read, IntTag(), begin);
    return read;
  });

  Corners corners;
  auto& values = known.corner_values;
  const Ints now = hn::DemoteTo(IntTag(), at.first);
  if (same(now, hn::LoadU(IntTag(), cell))) {
    for (std::size_t k = 0; k < corners.size(); ++k)
      corners[k] = {hn::LoadU(FloatTag(), &values[2 * k][lane]),
                    hn::LoadU(FloatTag(), &values[2 * k + 1][lane])};
  } else {
    corners = read_corners(grid.values.data(), at);
    hn::StoreU(now, IntTag(), cell);
    for (std::size_t k = 0; k < corners.size(); ++k) {
      hn::StoreU(corners[k].low, FloatTag(), &values[2 * k][lane]);
      hn::StoreU(corners[k].high, FloatTag(), &values[2 * k + 1][lane]);
    }
  }
  return distances(grid, at, between(corners, at.share));
}

HWY_INLINE Distances distances(const PosedBody& body, const Places& point) {
  const Distances from = distances(body.from->distances, point),
                  to = distances(body.to->distances, point);
  const Reals share = real(body.share), change = hn::Sub(to.value, from.value);
  return {hn::MulAdd(change, share, from.value),
          direction(plus_times(from.normal, minus(to.normal, from.normal), share)), change};
}

HWY_INLINE Distances distances(const Contacts::Placed& placed, const Places& point) {
  const Places at = minus(point, everywhere(placed.offset));
  const auto& shape = placed.collider.shape;
  if (const auto* plane = std::get_if<Plane>(&shape)) return distances(*plane, placed.turn, at);
  if (const auto* sphere = std::get_if<Sphere>(&shape)) return distances(*sphere, placed.turn, at);
  if (const auto* box = std::get_if<Box>(&shape)) return distances(*box, placed.turn, at);
  if (placed.posed != nullptr) return distances(*placed.posed, at);
  if (const auto* body = std::get_if<SharedBody>(&shape)) return distances((*body)->grid, at);
  return distances(*std::get_if<Capsule>(&shape), placed.turn, at);
}

// As values of T keep it.
template <class T>
HWY_INLINE Reals rounded(Reals v) {
  if constexpr (sizeof(T) == sizeof(double)) {
    return v;
  } else {
    const hn::Rebind<T, ContactTag> d;
    return hn::PromoteTo(ContactTag(), hn::DemoteTo(d, v));
  }
}
template <class T>
HWY_INLINE Places rounded(const Places& v) {
  return {rounded<T>(v.x), rounded<T>(v.y), rounded<T>(v.z)};
}

// Of vectors of particles, so far; see Resolved.
struct ResolvedPlaces {
  Reals gap;
  Reals moved, changed;  // squared, m^2

  template <class M>
  HWY_INLINE void move(M touching, const Places& by, const Places& in_step) {
    moved = hn::Max(moved, hn::IfThenElseZero(touching, squared(by)));
    changed = hn::Max(changed, hn::IfThenElseZero(touching, squared(in_step)));
  }
  HWY_INLINE Resolved result() const {
    const ContactTag d;
    return {hn::GetLane(hn::MinOfLanes(d, gap)), std::sqrt(hn::GetLane(hn::MaxOfLanes(d, moved))),
            std::sqrt(hn::GetLane(hn::MaxOfLanes(d, changed)))};
  }
};

// Displacement of the surface near points in the step. What leads out is as the distance changes.
HWY_INLINE Places carried_at(const Contacts::Placed& placed, const Places& x, const Places& normal,
                             Reals change) {
  const Places carried = everywhere(placed.carried);
  const PosedBody* posed = placed.posed;
  if (posed == nullptr) return carried;
  const PoseGrid& grid = *posed->from;
  const InGrids at = locate(grid.distances, minus(x, everywhere(placed.offset)));
  const Places way{between_corners(grid.ways[0].data(), at).value,
                   between_corners(grid.ways[1].data(), at).value,
                   between_corners(grid.ways[2].data(), at).value};
  const Places led = minus_times(way, normal, hn::Add(dot(way, normal), change));
  return plus_times(carried, led, real(posed->step));
}

// See Contacts::gap(); and the distances from the first collider. Precondition: there is one.
struct Gaps {
  Reals least;
  Distances first;
};
// known: of the first collider where that is a first_grid(), and lane as in distances(); or none.
HWY_INLINE Gaps gaps(const Contacts& contacts, const Places& x, KnownCells* known,
                     std::size_t lane) {
  const auto gap = [&](const Contacts::Placed& placed, Reals value) HWY_ATTR {
    Reals beyond = hn::Sub(value, real(contacts.skin()));
    if (contacts.jumps(placed)) beyond = hn::Min(beyond, hn::Max(value, real(0)));
    return placed.steepest == 1 ? beyond : hn::Div(beyond, real(placed.steepest));
  };
  const auto placed = contacts.placed();
  const DistanceGrid* grid = known != nullptr ? contacts.first_grid() : nullptr;
  const Distances first =
      grid != nullptr ? distances(*grid, minus(x, everywhere(placed[0].offset)), *known, lane)
                      : distances(placed[0], x);
  Reals least = gap(placed[0], first.value);
  for (const Contacts::Placed& each : placed.subspan(1))
    least = hn::Min(least, gap(each, distances(each, x).value));
  return {least, first};
}

// See Contacts::resolve(). first: distances of x from the first collider.
template <class M>
HWY_INLINE void resolve_places(const Contacts& contacts, M active, const Distances& first,
                               Places& x, Places& d) {
  const Reals zero = real(0), skin = real(contacts.skin());
  Reals pushed = zero;
  for (int round = 0; round < Contacts::kRounds; ++round) {
    Reals deepest = zero;
    for (const Contacts::Placed& placed : contacts.placed()) {
      const bool known = round == 0 && &placed == contacts.placed().data();
      const auto [value, normal, change] = known ? first : distances(placed, x);
      const auto touching = hn::And(active, hn::Lt(value, skin));
      const Places relative = minus(d, carried_at(placed, x, normal, change));
      const Reals approach = dot(relative, normal);
      const Reals come = hn::Max(hn::Neg(approach), zero);
      const Reals most = hn::Add(hn::Add(come, pushed), real(placed.creep));
      const Reals depth = hn::IfThenElseZero(touching, hn::Min(hn::Sub(skin, value), most));
      pushed = hn::Add(pushed, depth);
      deepest = hn::Max(deepest, depth);

      x = plus_times(x, normal, depth);
      const Reals push = hn::Min(come, depth);
      d = plus_times(d, normal, push);

      const Places sliding = minus_times(relative, normal, approach);
      const Reals length = hn::Sqrt(squared(sliding));
      const Reals stopped = hn::Div(hn::Mul(real(placed.friction), push), length);
      const Reals share =
          hn::IfThenElseZero(hn::And(touching, hn::Gt(length, zero)), hn::Min(real(1), stopped));
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
