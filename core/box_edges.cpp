#include "core/box_edges.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace weft {
namespace {

constexpr double kUnmet = std::numeric_limits<double>::infinity();
constexpr double kToldMotion = 1.001;  // of what solvers say, which is rounded
constexpr double kLookedAt = 1e-6;     // what is so near is looked at in every step, m
// A point that follows free particles by less would throw them far.
constexpr double kLeastFollowing = 0.1;

// From a point to the nearest of the twelve edges of a box; `corners`: of the eight corners.
double distance_from_frame(const Vector3d& local, const Vector3d& half, bool corners) {
  const Vector3d beyond = local.cwiseAbs() - half;
  const double along = corners ? 0 : beyond.cwiseMin(0).cwiseAbs2().maxCoeff();
  return std::sqrt(beyond.squaredNorm() - along);
}

}  // namespace

BoxEdges::BoxEdges(const SheetDefinition& sheet)
    : cloth_(std::vector{sheet}), column_(static_cast<std::size_t>(sheet.particle_count()), -1) {
  forget();
}

void BoxEdges::forget() {
  block_due_.assign(cloth_.first_block.size() - 1, 0);
  edge_due_.assign(cloth_.edges.size(), 0);
  triangle_due_.assign(cloth_.triangles.size(), 0);
  due_ = come_ = 0;
}

double BoxEdges::keep_out(const Contacts& contacts, double dt, double pressed, MovingSheet& sheet) {
  // corners of a box that grows come faster than its faces, by less than twice
  come_ += kToldMotion * (sheet.solver->moved() + sheet.solver->pushed()) + pressed +
           2 * contacts.reach();
  if (come_ < due_) return 0;
  find_due();
  sheet.solver->read(particles_, x_, d_);
  inverse_mass_.clear();
  for (const int i : particles_) inverse_mass_.push_back(sheet.dynamics.inverse_mass[i]);
  touches_.clear();
  for (const Contacts::Placed& placed : contacts.placed())
    if (std::holds_alternative<Box>(placed.collider.shape)) meet(placed, contacts.skin());
  keep_due();
  if (touches_.empty()) return 0;

  separate(Contacts::kOutward * dt + pressed);
  moved_.clear();
  for (Eigen::Index k = 0; k < by_.cols(); ++k) {
    if (by_.col(k).isZero(0) && in_step_.col(k).isZero(0)) continue;
    const auto n = static_cast<Eigen::Index>(moved_.size());
    moved_.push_back(particles_[static_cast<std::size_t>(k)]);
    by_.col(n) = by_.col(k);
    in_step_.col(n) = in_step_.col(k);
  }
  if (moved_.empty()) return 0;
  const auto moved = static_cast<Eigen::Index>(moved_.size());
  sheet.solver->displace(moved_, by_.leftCols(moved), in_step_.leftCols(moved));
  const double farthest =
      kToldMotion * std::sqrt(by_.leftCols(moved).colwise().squaredNorm().maxCoeff());
  come_ += farthest;
  return farthest;
}

// Parts that may touch, and their particles.
void BoxEdges::find_due() {
  for (const int i : particles_) column_[static_cast<std::size_t>(i)] = -1;
  particles_.clear();
  blocks_.clear();
  edges_.clear();
  triangles_.clear();
  for (std::size_t block = 0; block < block_due_.size(); ++block) {
    if (come_ < block_due_[block]) continue;
    blocks_.push_back(static_cast<int>(block));
    const auto first = static_cast<std::size_t>(cloth_.first_block[block]),
               last = static_cast<std::size_t>(cloth_.first_block[block + 1]);
    for (int e = cloth_.first_edge[first]; e < cloth_.first_edge[last]; ++e) {
      const auto& [from, to] = cloth_.edges[static_cast<std::size_t>(e)];
      if (come_ >= edge_due_[static_cast<std::size_t>(e)])
        edges_.push_back({e, {column(from), column(to), column(to)}, kUnmet});
    }
    for (std::size_t t = first; t < last; ++t) {
      const auto& [a, b, c] = cloth_.triangles[t];
      if (come_ >= triangle_due_[t])
        triangles_.push_back({static_cast<int>(t), {column(a), column(b), column(c)}, kUnmet});
    }
  }
  const auto count = static_cast<Eigen::Index>(particles_.size());
  for (Matrix3Xd* all : {&x_, &d_, &local_, &by_, &in_step_}) all->resize(3, count);
  by_.setZero();
  in_step_.setZero();
}

int BoxEdges::column(int particle) {
  int& column = column_[static_cast<std::size_t>(particle)];
  if (column < 0) {
    column = static_cast<int>(particles_.size());
    particles_.push_back(particle);
  }
  return column;
}

void BoxEdges::meet(const Contacts::Placed& placed, double skin) {
  const Box& box = std::get<Box>(placed.collider.shape);
  const Vector3d half = box.half_size.array() + std::min(skin, 0.0);
  local_ = placed.turn.transpose() * (x_.colwise() - (box.center + placed.offset));
  for (Part& edge : edges_) meet_edge(placed, half, std::max(skin, 0.0), edge);
  for (Part& triangle : triangles_) meet_corner(placed, half, std::max(skin, 0.0), triangle);
}

// Where an edge of cloth passes an edge of the box closest it does so in the plane across that.
void BoxEdges::meet_edge(const Contacts::Placed& placed, const Vector3d& half, double skin,
                         Part& edge) {
  const Vector3d from = local_.col(edge.corners[0]), to = local_.col(edge.corners[1]);
  // whatever it cuts off an edge of the box, that edge is as near to its middle as its ends are
  const double gap =
      distance_from_frame((from + to) / 2, half, false) - (to - from).norm() / 2 - skin - kLookedAt;
  edge.gap = std::min(edge.gap, gap);
  if (gap > 0) return;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::Index i = (k + 1) % 3, j = (k + 2) % 3;
    for (const double u : {-1.0, 1.0})
      for (const double v : {-1.0, 1.0}) {
        const Vector2d begin(u * from[i] - half[i], v * from[j] - half[j]),
            way(u * (to[i] - from[i]), v * (to[j] - from[j]));
        if (way.x() * way.y() > 0 || way.isZero(0)) continue;
        const double share = -begin.dot(way) / way.squaredNorm();
        if (!(share > 0 && share < 1)) continue;
        if (std::abs(from[k] + share * (to[k] - from[k])) > half[k]) continue;
        const Vector2d nearest = begin + share * way;
        if (nearest.x() < -half[i] || nearest.y() < -half[j]) continue;  // beyond the middle
        const Vector2d out = Vector2d(std::abs(way.y()), std::abs(way.x())).normalized();
        add(placed, edge, {1 - share, share, 0},
            u * out.x() * placed.turn.col(i) + v * out.y() * placed.turn.col(j),
            skin - out.dot(nearest));
      }
  }
}

void BoxEdges::meet_corner(const Contacts::Placed& placed, const Vector3d& half, double skin,
                           Part& triangle) {
  constexpr double kBeyond = 1.5;  // of its radius: a corner through it reaches no farther
  const Vector3d a = local_.col(triangle.corners[0]), b = local_.col(triangle.corners[1]),
                 c = local_.col(triangle.corners[2]), middle = (a + b + c) / 3;
  const double radius = std::sqrt(std::max(
      {(a - middle).squaredNorm(), (b - middle).squaredNorm(), (c - middle).squaredNorm()}));
  const double gap = distance_from_frame(middle, half, true) - kBeyond * radius - skin - kLookedAt;
  triangle.gap = std::min(triangle.gap, gap);
  if (gap > 0) return;
  const Vector3d area = (b - a).cross(c - a);
  const double squared = area.squaredNorm();
  if (!(squared > 0)) return;
  for (const double x : {-1.0, 1.0})
    for (const double y : {-1.0, 1.0})
      for (const double z : {-1.0, 1.0}) {
        const Vector3d side(x, y, z);
        Vector3d out = area.cwiseProduct(side) / std::sqrt(squared);
        if (out.maxCoeff() <= 0) out = -out;
        if (out.minCoeff() < 0) continue;  // the triangle cuts an edge of the box before
        const Vector3d corner = half.cwiseProduct(side), normal = out.cwiseProduct(side);
        const double above = normal.dot(a - corner);
        if (((above * out).array() < -half.array()).any()) continue;  // beyond the middle
        const Vector3d nearest = corner + above * normal;
        const std::array<double, 3> weight{(b - nearest).cross(c - nearest).dot(area) / squared,
                                           (c - nearest).cross(a - nearest).dot(area) / squared,
                                           (a - nearest).cross(b - nearest).dot(area) / squared};
        if (*std::min_element(weight.begin(), weight.end()) < 0) continue;
        add(placed, triangle, weight, placed.turn * normal, skin - above);
      }
}

void BoxEdges::add(const Contacts::Placed& placed, const Part& part,
                   const std::array<double, 3>& weight, const Vector3d& normal, double depth) {
  if (!(depth > 0)) return;
  Touch touch{part.corners, weight, {}, normal, placed.carried, depth, placed.friction};
  double mobility = 0, most = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double free = inverse_mass_[static_cast<std::size_t>(part.corners[k])];
    if (free > 0) most = std::max(most, weight[k]);
    touch.share[k] = free * weight[k];
    mobility += touch.share[k] * weight[k];
  }
  if (most < kLeastFollowing) return;
  for (double& share : touch.share) share /= mobility;
  touches_.push_back(touch);
}

// Says when those that were looked at are due again.
void BoxEdges::keep_due() {
  const auto keep = [&](const std::vector<Part>& parts, std::vector<double>& due) {
    for (const Part& part : parts)
      due[static_cast<std::size_t>(part.number)] = come_ + std::max(part.gap, 0.0);
  };
  keep(edges_, edge_due_);
  keep(triangles_, triangle_due_);
  for (const int block : blocks_) {
    const auto b = static_cast<std::size_t>(block);
    const auto first = static_cast<std::size_t>(cloth_.first_block[b]),
               last = static_cast<std::size_t>(cloth_.first_block[b + 1]);
    double due = kUnmet;
    for (int e = cloth_.first_edge[first]; e < cloth_.first_edge[last]; ++e)
      due = std::min(due, edge_due_[static_cast<std::size_t>(e)]);
    for (std::size_t t = first; t < last; ++t) due = std::min(due, triangle_due_[t]);
    block_due_[b] = due;
  }
  due_ = *std::min_element(block_due_.begin(), block_due_.end());
}

// Touches follow one another, again and again, and take back what others have made needless.
// creep: how far what was inside is led out, m.
void BoxEdges::separate(double creep) {
  constexpr int kRounds = 16;
  constexpr double kNothing = 1e-9;  // m
  const auto of = [](const Touch& touch, const Matrix3Xd& all) {
    Vector3d sum = Vector3d::Zero();
    for (std::size_t k = 0; k < 3; ++k) sum += touch.weight[k] * all.col(touch.corners[k]);
    return sum;
  };
  const auto give = [](const Touch& touch, const Vector3d& motion, Matrix3Xd& all) {
    for (std::size_t k = 0; k < 3; ++k) all.col(touch.corners[k]) += touch.share[k] * motion;
  };
  for (Touch& touch : touches_) {
    const double approach = -(of(touch, d_) - touch.carried).dot(touch.normal);
    touch.depth = std::min(touch.depth, std::max(approach, 0.0) + creep);
  }
  for (int round = 0; round < kRounds; ++round) {
    double most = 0;
    for (Touch& touch : touches_) {
      const double push = std::max(touch.depth - of(touch, by_).dot(touch.normal), -touch.pushed);
      touch.pushed += push;
      give(touch, push * touch.normal, by_);

      const double approach =
          -(of(touch, d_) + of(touch, in_step_) - touch.carried).dot(touch.normal);
      const double stop = std::clamp(touch.stopped + approach, 0.0, touch.pushed) - touch.stopped;
      touch.stopped += stop;
      give(touch, stop * touch.normal, in_step_);
      most = std::max({most, std::abs(push), std::abs(stop)});
    }
    if (most <= kNothing) break;
  }
  for (const Touch& touch : touches_) {
    const Vector3d relative = of(touch, d_) + of(touch, in_step_) - touch.carried;
    const Vector3d sliding = relative - relative.dot(touch.normal) * touch.normal;
    const double length = sliding.norm();
    if (length == 0) continue;
    const Vector3d stopped = -std::min(1.0, touch.friction * touch.stopped / length) * sliding;
    give(touch, stopped, by_);
    give(touch, stopped, in_step_);
  }
}

}  // namespace weft
