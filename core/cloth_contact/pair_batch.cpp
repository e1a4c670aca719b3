#include "core/cloth_contact/pair_batch.h"

#include <cmath>

// compiled again for every target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/cloth_contact/pair_batch.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/motion/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {

using PairTag = hn::CappedTag<double, 8>;
using Values = hn::Vec<PairTag>;
using Point = Triple<Values>;

HWY_INLINE Values of(double value) { return hn::Set(PairTag(), value); }
#if HWY_TARGET == HWY_SCALAR
template <class Of>
HWY_INLINE Point load_point(const Of& values) {
  const double* point = values(0);
  return {of(point[0]), of(point[1]), of(point[2])};
}
#else
// values(k): where the three values of the k-th lie.
template <class Of>
HWY_INLINE Point load_point(const Of& values) {
  const PairTag d;
  // of those with even and odd numbers
  const auto twos = [&](std::size_t odd, std::size_t axis) HWY_ATTR {
    return load_parts(d, [&](std::size_t k) { return values(k + odd) + axis; });
  };
  const Values even = twos(0, 0), odd = twos(1, 0);
  return {hn::InterleaveLower(d, even, odd), hn::InterleaveUpper(d, even, odd),
          hn::InterleaveUpper(d, twos(0, 1), twos(1, 1))};
}
#endif
// One particle of each pair from `at` on.
HWY_INLINE Point load_point(const PairBatch::Planes& planes, std::size_t particle, std::size_t at) {
  return load_point([&](std::size_t k) {
    return planes.x + std::ptrdiff_t{3} * planes.particles[at + k][particle];
  });
}
// a / b within 0 to 1; 0 where b is not above 0
HWY_INLINE Values share(Values a, Values b) {
  const auto some = hn::Gt(b, of(0));
  const Values quotient = hn::Div(a, hn::IfThenElse(some, b, of(1)));
  return hn::IfThenElseZero(some, hn::Min(hn::Max(quotient, of(0)), of(1)));
}
HWY_INLINE void put(const PairBatch::Planes& planes, std::size_t at, const Point& apart) {
  const PairTag d;
  hn::Store(apart.x, d, planes.apart[0] + at);
  hn::Store(apart.y, d, planes.apart[1] + at);
  hn::Store(apart.z, d, planes.apart[2] + at);
  hn::Store(squared(apart), d, planes.squared + at);
}

void solve_corners(const PairBatch::Planes& planes) {
  const PairTag d;
  const Values zero = of(0), one = of(1);
  for (std::size_t at = 0; at < planes.size; at += hn::Lanes(d)) {
    const Point p = load_point(planes, 0, at), a = load_point(planes, 1, at),
                b = load_point(planes, 2, at), c = load_point(planes, 3, at);
    const Point ab = minus(b, a), ac = minus(c, a), bc = minus(c, b), ap = minus(p, a),
                bp = minus(p, b), normal = product(ab, ac);
    const Values area = squared(normal);
    const auto flat = hn::Gt(area, zero);
    const Values inverse = hn::Div(one, hn::IfThenElse(flat, area, one));
    const Values v = hn::Mul(dot(product(ap, ac), normal), inverse),
                 w = hn::Mul(dot(product(ab, ap), normal), inverse),
                 u = hn::Sub(hn::Sub(one, v), w);
    const auto inside =
        hn::And(hn::And(flat, hn::Ge(u, zero)), hn::And(hn::Ge(v, zero), hn::Ge(w, zero)));

    const Values on_ab = share(dot(ap, ab), squared(ab)), on_ac = share(dot(ap, ac), squared(ac)),
                 on_bc = share(dot(bp, bc), squared(bc));
    const Values to_ab = squared(minus_times(ap, ab, on_ab)),
                 to_ac = squared(minus_times(ap, ac, on_ac)),
                 to_bc = squared(minus_times(bp, bc, on_bc));
    const auto is_ab = hn::And(hn::Le(to_ab, to_ac), hn::Le(to_ab, to_bc)),
               is_ac = hn::Le(to_ac, to_bc);
    const Values edge_v =
        hn::IfThenElse(is_ab, on_ab, hn::IfThenElse(is_ac, zero, hn::Sub(one, on_bc)));
    const Values edge_w = hn::IfThenElse(is_ab, zero, hn::IfThenElse(is_ac, on_ac, on_bc));

    const Values b_share = hn::IfThenElse(inside, v, edge_v),
                 c_share = hn::IfThenElse(inside, w, edge_w);
    hn::Store(one, d, planes.weights[0] + at);
    hn::Store(hn::Sub(hn::Add(b_share, c_share), one), d, planes.weights[1] + at);
    hn::Store(hn::Neg(b_share), d, planes.weights[2] + at);
    hn::Store(hn::Neg(c_share), d, planes.weights[3] + at);
    put(planes, at, minus_times(minus_times(ap, ab, b_share), ac, c_share));
  }
}

void solve_edges(const PairBatch::Planes& planes) {
  constexpr double kParallel = 1e-12;  // squared sine, where any share will do
  const PairTag tag;
  const Values one = of(1);
  for (std::size_t at = 0; at < planes.size; at += hn::Lanes(tag)) {
    const Point a = load_point(planes, 0, at), b = load_point(planes, 1, at),
                c = load_point(planes, 2, at), d = load_point(planes, 3, at);
    const Point u = minus(b, a), v = minus(d, c), w = minus(a, c);
    const Values uu = squared(u), uv = dot(u, v), vv = squared(v), uw = dot(u, w), vw = dot(v, w),
                 both = hn::Mul(uu, vv), sine = hn::NegMulAdd(uv, uv, both);
    const Values first =
        hn::IfThenElse(hn::Gt(sine, hn::Mul(of(kParallel), both)),
                       share(hn::NegMulAdd(vv, uw, hn::Mul(uv, vw)), sine), of(0.5));
    const Values t = share(hn::MulAdd(first, uv, vw), vv);
    const Values s = share(hn::Sub(hn::Mul(t, uv), uw), uu);
    hn::Store(hn::Sub(one, s), tag, planes.weights[0] + at);
    hn::Store(s, tag, planes.weights[1] + at);
    hn::Store(hn::Sub(t, one), tag, planes.weights[2] + at);
    hn::Store(hn::Neg(t), tag, planes.weights[3] + at);
    put(planes, at, minus_times(plus_times(w, u, s), v, t));
  }
}

// Of all particles of the one side to all of the other. Summed in the order of Eigen's vectors.
template <std::size_t kEnds, class Of>
HWY_INLINE Values farthest(const Of& motion) {
  const Point each[] = {motion(0), motion(1), motion(2), motion(3)};
  Values most = of(0);
  for (std::size_t m = 0; m < kEnds; ++m)
    for (std::size_t n = kEnds; n < 4; ++n) {
      const Point by = minus(each[m], each[n]);
      const Values squared_by =
          hn::Add(hn::Add(hn::Mul(by.x, by.x), hn::Mul(by.z, by.z)), hn::Mul(by.y, by.y));
      most = hn::IfThenElse(hn::Gt(squared_by, most), squared_by, most);
    }
  return most;
}

template <std::size_t kEnds>
HWY_INLINE void find_farthest_of(const PairBatch::Motions& motions) {
  const PairTag d;
  for (std::size_t at = 0; at < motions.size; at += hn::Lanes(d)) {
    const auto farthest_of = [&](Eigen::Vector4d Mover::*motion) HWY_ATTR {
      return farthest<kEnds>([&](std::size_t n) HWY_ATTR {
        return load_point([&](std::size_t k) {
          return (motions.movers[motions.particles[at + k][n]].*motion).data();
        });
      });
    };
    hn::Store(farthest_of(&Mover::way), d, motions.way + at);
    hn::Store(farthest_of(&Mover::in_step), d, motions.in_step + at);
  }
}
void find_farthest(const PairBatch::Motions& motions) {
  if (motions.edges)
    find_farthest_of<2>(motions);
  else
    find_farthest_of<1>(motions);
}

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace weft {

HWY_EXPORT(solve_corners);
HWY_EXPORT(solve_edges);
HWY_EXPORT(find_farthest);

// Lanes beyond the last pair look at particles, too.
void PairBatch::fill(Particles& particles, std::size_t size) {
  constexpr std::size_t kMostLanes = 8;
  static_assert(kMost % kMostLanes == 0);
  for (std::size_t k = size; k % kMostLanes != 0; ++k) particles[k] = {};
}

void PairBatch::solve() {
  fill(particles_, size_);
  const Planes planes{x_, particles_.data(), weights_, apart_, squared_, size_};
  if (edges_)
    HWY_DYNAMIC_DISPATCH(solve_edges)(planes);
  else
    HWY_DYNAMIC_DISPATCH(solve_corners)(planes);
}

// Without branches, which nothing foretells.
void PairBatch::find_met(std::span<const Mover> movers) {
  std::size_t near = 0;
  for (std::size_t k = 0; k < size_; ++k) {
    met_[near] = k;
    met_particles_[near] = particles_[k];
    const bool is_near = (squared_[k] < within_[k] * within_[k]) & (squared_[k] > 0);
    near += is_near ? 1 : 0;
  }
  fill(met_particles_, near);
  HWY_DYNAMIC_DISPATCH(find_farthest)
  ({edges_, movers.data(), met_particles_.data(), squared_way_, squared_in_step_, near});
  met_size_ = 0;
  for (std::size_t n = 0; n < near; ++n) {
    const std::size_t k = met_[n];
    met_[met_size_] = k;
    squared_in_step_[met_size_] = squared_in_step_[n];
    distance_[met_size_] = std::sqrt(squared_[k]);
    const double room = distance_[met_size_] - thickness_[k];
    const bool stays = (room > 0) & (room * room >= squared_way_[n]);
    met_size_ += stays ? 0 : 1;
  }
}

}  // namespace weft
#endif
