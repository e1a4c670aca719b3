#include "core/open_seams.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace weft {
namespace {

constexpr double kSpacing = 0.01;  // of points that are looked at along an edge, at least, m
constexpr double kOutward = 1;     // fastest that an edge is pushed out, m/s

// Of an edge the point that is deepest within the skin, or closest to it.
struct Deepest {
  Distance distance{std::numeric_limits<double>::infinity(), Vector3d::Zero()};
  double share = 0;  // of the way to the second end
};

Deepest deepest_between(const Contacts& contacts, const Vector3d& from, const Vector3d& to) {
  const double length = (to - from).norm();
  Deepest deepest;
  for (double at = kSpacing; at < length - kSpacing;) {
    const Distance there = contacts.nearest(from + at / length * (to - from));
    if (there.value < deepest.distance.value) deepest = {there, at / length};
    at += std::max(kSpacing, there.value);
  }
  return deepest;
}

}  // namespace

OpenSeams::OpenSeams(const SheetDefinition& sheet, const std::vector<bool>& stretched) {
  std::set<std::array<int, 2>> edges;
  std::map<int, int> numbers;
  const auto triangles = triangles_of(sheet.shape);
  for (std::size_t t = 0; t < stretched.size(); ++t) {
    if (!stretched[t]) continue;
    const auto& [a, b, c] = triangles[t];
    for (const auto& [from, to] : {std::pair(a, b), {b, c}, {c, a}}) {
      edges.insert({std::min(from, to), std::max(from, to)});
      numbers[from] = 0;
    }
  }
  for (auto& [particle, number] : numbers) {
    number = static_cast<int>(particles_.size());
    particles_.push_back(particle);
  }
  for (const auto& [from, to] : edges) edges_.push_back({numbers[from], numbers[to]});
  clear_.assign(edges_.size(), 0);
  x_ = d_ = before_ = Matrix3Xd::Zero(3, static_cast<Eigen::Index>(particles_.size()));
}

void OpenSeams::keep_out(const Contacts& contacts, double dt, MovingSheet& sheet) {
  sheet.solver->read(particles_, x_, d_);
  const Eigen::RowVectorXd come = (x_ - before_).colwise().norm();
  before_ = x_;
  std::map<int, std::array<Vector3d, 2>> moved;  // by that, and in the step, m
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const auto& ends = edges_[e];
    clear_[e] -= std::max(come[ends[0]], come[ends[1]]) + contacts.reach();
    if (clear_[e] > 0) continue;
    const auto [distance, share] = deepest_between(contacts, x_.col(ends[0]), x_.col(ends[1]));
    clear_[e] = std::isfinite(distance.value) ? distance.value / 2 - kSpacing : 0;
    if (!(distance.value < 0)) continue;
    std::array<double, 2> part{1 - share, share};
    for (std::size_t k = 0; k < 2; ++k)
      if (sheet.dynamics.inverse_mass[particles_[static_cast<std::size_t>(ends[k])]] == 0)
        part[k] = 0;
    const double sum = part[0] * part[0] + part[1] * part[1];
    if (sum == 0) continue;

    // out, and no farther in
    const Vector3d motion = (1 - share) * d_.col(ends[0]) + share * d_.col(ends[1]);
    const Vector3d out = std::min(-distance.value, kOutward * dt) / sum * distance.normal;
    const Vector3d stop = std::max(0.0, -motion.dot(distance.normal)) / sum * distance.normal;
    for (std::size_t k = 0; k < 2; ++k) {
      if (part[k] == 0) continue;
      x_.col(ends[k]) += part[k] * out;
      d_.col(ends[k]) += part[k] * stop;
      auto& [by, in_step] =
          moved.try_emplace(ends[k], std::array<Vector3d, 2>{Vector3d::Zero(), Vector3d::Zero()})
              .first->second;
      by += part[k] * out;
      in_step += part[k] * stop;
    }
  }
  if (moved.empty()) return;
  std::vector<int> particles;
  Matrix3Xd by(3, static_cast<Eigen::Index>(moved.size())), in_step = by;
  for (const auto& [end, moves] : moved) {
    const auto k = static_cast<Eigen::Index>(particles.size());
    by.col(k) = moves[0];
    in_step.col(k) = moves[1];
    particles.push_back(particles_[static_cast<std::size_t>(end)]);
  }
  sheet.solver->displace(particles, by, in_step);
}

}  // namespace weft
