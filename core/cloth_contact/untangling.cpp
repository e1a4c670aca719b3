#include "core/cloth_contact/untangling.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace weft {

double Untangling::speed_at(double time) {
  constexpr double kSlowest = 1, kDoublings = 3;
  return kSlowest * std::exp2(kDoublings * (time - std::floor(time)));
}

void Untangling::clear() {
  pairs_.clear();
  at_cut_.clear();
}

void Untangling::set(const std::vector<ClothPair>& cuts, const Matrix3Xd& x, double speed) {
  clear();
  if (cuts.empty()) return;
  Around around(static_cast<std::size_t>(cloth_.particles()));
  for (std::size_t t = 0; t < cloth_.triangles.size(); ++t)
    for (const int i : cloth_.triangles[t])
      around[static_cast<std::size_t>(i)].push_back(static_cast<int>(t));
  at_cut_.resize(around.size());
  // A crease that stays folded through itself is held so by the cloth beside it, which is on the
  // wrong side too. Where more has passed through, that keeps it from passing farther.
  constexpr double kSlow = 5;  // m/s
  constexpr std::size_t kFew = 8;
  const bool frees_beside = speed > kSlow && cuts.size() <= kFew;
  for (const auto& [edge, triangle] : cuts) {
    add(edge, triangle, around, x, speed);
    if (frees_beside) free_beside(edge, triangle, around);
  }
}

// Of an edge and a triangle that are joined by another triangle what lies around them is at the
// cut.
void Untangling::free_beside(int edge, int triangle, const Around& around) {
  const auto& [p, q] = cloth_.edges[static_cast<std::size_t>(edge)];
  const std::array<int, 3> corners = cloth_.triangles[static_cast<std::size_t>(triangle)];
  const auto around_any = [&](std::initializer_list<int> particles, const auto& see) {
    for (const int i : particles)
      for (const int t : around[static_cast<std::size_t>(i)])
        for (const int corner : cloth_.triangles[static_cast<std::size_t>(t)]) see(corner);
  };
  bool joined = false;
  around_any({p, q},
             [&](int i) { joined = joined || std::ranges::find(corners, i) != corners.end(); });
  if (!joined) return;
  around_any({p, q, corners[0], corners[1], corners[2]},
             [&](int i) { at_cut_[static_cast<std::size_t>(i)] = true; });
}

bool Untangling::has(const std::array<int, 4>& particles) const {
  return !at_cut_.empty() && std::ranges::all_of(particles, [&](int i) {
    return at_cut_[static_cast<std::size_t>(i)];
  });
}

void Untangling::add(int edge, int triangle, const Around& around, const Matrix3Xd& x,
                     double speed) {
  constexpr double kHalfTurn = 0.2;  // of the line where the speed is half of that
  const auto& [p, q] = cloth_.edges[static_cast<std::size_t>(edge)];
  const std::array<int, 3> corners = cloth_.triangles[static_cast<std::size_t>(triangle)];
  const auto& [a, b, c] = corners;
  const Vector3d along = x.col(q) - x.col(p), ab = x.col(b) - x.col(a), ac = x.col(c) - x.col(a);
  const Vector3d area = ab.cross(ac), normal = area.normalized();
  const double rise = along.dot(normal);
  if (rise == 0) return;  // but for rounding

  // the ways of the line from here into the triangles at the edge
  Vector3d line = Vector3d::Zero();
  const auto at_cut = [&](int i) { at_cut_[static_cast<std::size_t>(i)] = true; };
  std::ranges::for_each(corners, at_cut);
  for (const int t : around[static_cast<std::size_t>(p)]) {
    const auto& own = cloth_.triangles[static_cast<std::size_t>(t)];
    if (std::ranges::find(own, q) == own.end()) continue;
    std::ranges::for_each(own, at_cut);
    for (const int tip : own) {
      if (tip == p || tip == q) continue;
      const Vector3d out = along.cross(x.col(tip) - x.col(p)), way = normal.cross(out).normalized();
      line += way.dot(out.cross(along)) < 0 ? -way : way;
    }
  }
  // along which an edge leaves the plane of the triangle shortens the line too
  const Vector3d way = line - along.dot(line) / rise * normal;
  const double turn = way.norm();
  if (turn == 0) return;

  const double share = std::clamp((x.col(a) - x.col(p)).dot(normal) / rise, 0.0, 1.0);
  const Vector3d at = x.col(p) + share * along - x.col(a);
  const double v = at.cross(ac).dot(area) / area.squaredNorm(),
               w = ab.cross(at).dot(area) / area.squaredNorm();
  pairs_.push_back({{p, q, a, b, c},
                    {1 - share, share, v + w - 1, -v, -w},
                    way / turn,
                    speed * turn / std::hypot(turn, kHalfTurn)});
}

double Untangling::lead(std::span<MovingSheet> sheets, double dt) const {
  constexpr double kLeastMoves = 0.01;  // of its lightest particle's 1 / mass
  double given = 0;
  for (const Pair& pair : pairs_) {
    double speed = 0, moves = 0, lightest = 0;  // m/s; 1/kg
    std::array<double, 5> share{};
    Matrix3Xd x(3, 1), d(3, 1);
    const auto sheet_of = [&](int particle) -> MovingSheet& {
      return sheets[static_cast<std::size_t>(cloth_.sheet_of(particle))];
    };
    for (std::size_t n = 0; n < share.size(); ++n) {
      const MovingSheet& sheet = sheet_of(pair.particle[n]);
      const int own = cloth_.own_number(pair.particle[n]);
      sheet.solver->read({&own, 1}, x, d);
      speed += pair.weight[n] * pair.way.dot(d.col(0)) / dt;
      share[n] = pair.weight[n] * sheet.dynamics.inverse_mass[own];
      moves += pair.weight[n] * share[n];
      lightest = std::max(lightest, sheet.dynamics.inverse_mass[own]);
    }
    const double missing = pair.speed - speed;
    // where nearly all is held, what is free would be thrown
    if (missing <= 0 || moves <= kLeastMoves * lightest) continue;
    given += missing / moves * std::max(speed + missing / 2, 0.0);
    x.setZero();
    for (std::size_t n = 0; n < share.size(); ++n) {
      if (share[n] == 0) continue;
      const int own = cloth_.own_number(pair.particle[n]);
      d = share[n] / moves * missing * dt * pair.way;
      sheet_of(pair.particle[n]).solver->displace({&own, 1}, x, d);
    }
  }
  return given;
}

}  // namespace weft
