#include "core/triangles/fit.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <complex>

namespace weft {
namespace {

// Places and turns in the plane, as complex numbers.
using Plane2 = std::complex<double>;

struct Neighbour {
  int particle;
  Plane2 offset;  // from the particle, m
};

// The triangles around a particle, laid flat beside each other in the frame of the first.
struct Fan {
  std::vector<Neighbour> ring;  // by particle
  std::vector<Plane2> turns;    // of each triangle, in order of Corners, against its own frame
  bool turned = false;          // some of them are
};

class Fans {
 public:
  explicit Fans(const RestShape& shape) : shape_(shape), corners_(shape) {
    fans_.reserve(static_cast<std::size_t>(shape.particles));
    for (int i = 0; i < shape.particles; ++i) fans_.push_back(lay(i));
  }

  const Fan& at(int i) const { return fans_[static_cast<std::size_t>(i)]; }
  const Corners& corners() const { return corners_; }

  // With those neighbours of its neighbours that at least so many of them have.
  std::vector<Neighbour> widened(int i, int least) const {
    const std::vector<Neighbour>& ring = at(i).ring;
    std::vector<Neighbour> wide = ring;
    std::vector<int> times(ring.size(), least);
    for (const auto& [j, offset] : ring) {
      const Plane2 turn = turn_between(i, j);
      for (const auto& [k, further] : at(j).ring) {
        if (k == i) continue;
        std::size_t known = 0;
        while (known < wide.size() && wide[known].particle != k) ++known;
        if (known == wide.size()) {
          wide.push_back({k, offset + turn * further});
          times.push_back(0);
        }
        ++times[known];
      }
    }
    std::size_t kept = 0;
    for (std::size_t n = 0; n < wide.size(); ++n)
      if (times[n] >= least) wide[kept++] = wide[n];
    wide.resize(kept);
    return wide;
  }

 private:
  // From triangle t's corner k to the one after it, or the one after that.
  Plane2 side(int t, int k, int to) const {
    const auto& corner = shape_.corners[static_cast<std::size_t>(t)];
    const Vector2d d =
        corner[static_cast<std::size_t>((k + to) % 3)] - corner[static_cast<std::size_t>(k)];
    return {d.x(), d.y()};
  }
  int particle(int t, int k) const {
    return shape_.triangles[static_cast<std::size_t>(t)][static_cast<std::size_t>(k % 3)];
  }

  Fan lay(int i) const {
    const Corners::At* const begin = corners_.begin(i);
    const auto count = static_cast<std::size_t>(corners_.end(i) - begin);
    Fan fan;
    fan.turns.resize(count);
    std::vector<bool> laid(count);
    const auto place_of = [&](int j) {
      return std::find_if(fan.ring.begin(), fan.ring.end(),
                          [&](const Neighbour& each) { return each.particle == j; });
    };
    for (std::size_t done = 0; done < count; ++done) {
      // next to those that lie, else by itself
      std::size_t next = count;
      Plane2 turn = 1;
      for (std::size_t n = 0; n < count; ++n) {
        if (laid[n]) continue;
        const auto [t, k] = begin[n];
        for (const int to : {1, 2}) {
          const auto beside = place_of(particle(t, k + to));
          if (beside == fan.ring.end()) continue;
          const Plane2 own = side(t, k, to);
          next = n;
          constexpr double kSame = 1e-9;
          if (std::abs(beside->offset - own) > kSame * std::abs(own)) {
            turn = beside->offset / own;
            turn /= std::abs(turn);
          }
          break;
        }
        if (next != count) break;
      }
      if (next == count)
        next = static_cast<std::size_t>(std::find(laid.begin(), laid.end(), false) - laid.begin());
      const auto [t, k] = begin[next];
      for (const int to : {1, 2})
        if (const int j = particle(t, k + to); place_of(j) == fan.ring.end())
          fan.ring.push_back({j, turn * side(t, k, to)});
      laid[next] = true;
      fan.turns[next] = turn;
      fan.turned |= turn != Plane2(1);
    }
    std::sort(fan.ring.begin(), fan.ring.end(),
              [](const Neighbour& a, const Neighbour& b) { return a.particle < b.particle; });
    return fan;
  }

  // Of the frame of j's fan against that of i's, by a triangle that they share.
  Plane2 turn_between(int i, int j) const {
    const Fan &here = at(i), &there = at(j);
    if (!here.turned && !there.turned) return 1;  // of one panel
    for (const Corners::At* a = corners_.begin(i); a != corners_.end(i); ++a)
      for (const Corners::At* b = corners_.begin(j); b != corners_.end(j); ++b)
        if (a->triangle == b->triangle)
          return here.turns[static_cast<std::size_t>(a - corners_.begin(i))] /
                 there.turns[static_cast<std::size_t>(b - corners_.begin(j))];
    return 1;
  }

  const RestShape& shape_;
  Corners corners_;
  std::vector<Fan> fans_;
};

// Rows uu, uv, vv: what neighbours weigh in the second derivatives of a quadratic through a
// particle, 1/m^2.
Eigen::Matrix3Xd quadratic(const std::vector<Neighbour>& near) {
  const auto count = static_cast<Eigen::Index>(near.size());
  double mean = 0;  // distance, by which all lengths are divided
  for (const auto& [j, offset] : near) mean += std::abs(offset) / static_cast<double>(count);

  Eigen::MatrixXd terms(count, 5);
  VectorXd weights(count);
  for (Eigen::Index row = 0; row < count; ++row) {
    constexpr double kNearest = 0.3;
    const Plane2 d = near[static_cast<std::size_t>(row)].offset / mean;
    const double u = d.real(), v = d.imag();
    weights[row] = 1 / std::pow(std::max(std::abs(d), kNearest), 2);
    terms.row(row) << u, v, u * u / 2, u * v, v * v / 2;
    terms.row(row) *= weights[row];
  }
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> qr;
  qr.setThreshold(1e-6);
  qr.compute(terms);
  const Eigen::MatrixXd inverse = qr.pseudoInverse();  // (5 x count)
  return inverse.bottomRows<3>() * weights.asDiagonal() / (mean * mean);
}

// A part of a particle's area whose warp lies in one direction.
struct Share {
  int panel;
  Plane2 turn;
  double area;
};

std::vector<Share> shares(const RestShape& shape, const Fans& fans, int i) {
  std::vector<Share> all;
  const Corners::At* const begin = fans.corners().begin(i);
  for (const Corners::At* at = begin; at != fans.corners().end(i); ++at) {
    const auto t = static_cast<std::size_t>(at->triangle);
    const Plane2 turn = fans.at(i).turns[static_cast<std::size_t>(at - begin)];
    const double part = area(shape.corners[t]) / 3;
    const auto same = std::find_if(all.begin(), all.end(), [&](const Share& each) {
      return each.panel == panel_of(shape, t) && std::abs(each.turn - turn) < 1e-6;
    });
    if (same != all.end())
      same->area += part;
    else
      all.push_back({panel_of(shape, t), turn, part});
  }
  return all;
}

CurvatureFit fit_along(int i, const std::vector<Neighbour>& near, const Eigen::Matrix3Xd& weights,
                       const Share& share) {
  const double c = share.turn.real(), s = share.turn.imag();
  Eigen::Matrix3d turned;  // of uu, uv, vv
  turned << c * c, 2 * c * s, s * s, -c * s, c * c - s * s, c * s, s * s, -2 * c * s, c * c;
  CurvatureFit fit;
  fit.area = share.area;
  fit.panel = share.panel;
  fit.particle.reserve(near.size() + 1);
  fit.weight.reserve(near.size() + 1);
  fit.particle.push_back(i);
  fit.weight.push_back({0, 0, 0});
  for (std::size_t k = 0; k < near.size(); ++k) {
    const Vector3d weight = turned * weights.col(static_cast<Eigen::Index>(k));
    fit.particle.push_back(near[k].particle);
    fit.weight.push_back({weight[0], weight[1], weight[2]});
    for (std::size_t d = 0; d < 3; ++d) fit.weight[0][d] -= fit.weight.back()[d];
  }
  return fit;
}

}  // namespace

std::vector<CurvatureFit> fit_curvature(const RestShape& shape) {
  constexpr std::size_t kEnough = 6;
  const Fans fans(shape);
  const std::vector<bool> on_border = border(shape);
  std::vector<CurvatureFit> fits;
  fits.reserve(static_cast<std::size_t>(shape.particles));
  for (int i = 0; i < shape.particles; ++i) {
    const bool full = fans.at(i).ring.size() >= kEnough;
    const std::vector<Neighbour> near = on_border[static_cast<std::size_t>(i)] ? fans.widened(i, 1)
                                        : full                                 ? fans.at(i).ring
                                                                               : fans.widened(i, 2);
    const Eigen::Matrix3Xd weights = quadratic(near);
    for (const Share& share : shares(shape, fans, i))
      fits.push_back(fit_along(i, near, weights, share));
  }
  return fits;
}

}  // namespace weft
