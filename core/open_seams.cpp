#include "core/open_seams.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "core/cloth_contact/cuts.h"

namespace weft {
namespace {

constexpr double kSpacing = 0.01;  // of points that are looked at along an edge, at least, m
constexpr double kOutward = 1;     // fastest that an edge is pushed out, m/s

// Of an edge, between its ends and the points that are looked at along it.
int parts_between(const Vector3d& from, const Vector3d& to) {
  return static_cast<int>((to - from).norm() / kSpacing);
}

// Of an edge what lies within skins, by how deep it is there.
struct Depth {
  double nearest = std::numeric_limits<double>::infinity();  // m, negative within
  // how far points may come before one is within, or less, m
  double clear = std::numeric_limits<double>::infinity();
  Vector3d out = Vector3d::Zero();  // mean direction
  double share = 0;                 // of the way to the second end
};

Depth depth_between(const Contacts& contacts, const Vector3d& from, const Vector3d& to, int parts) {
  const double step = (to - from).norm() / parts;
  // a deflated body's distances jump within the body as it is given
  const double sure = std::min(contacts.skin(), 0.0);
  Depth found;
  double sum = 0;
  for (int k = 1; k < parts;) {
    const double share = static_cast<double>(k) / parts;
    const Distance there = contacts.nearest(from + share * (to - from));
    found.nearest = std::min(found.nearest, there.value);
    found.clear = std::min(found.clear, there.value + sure);
    const int skipped =
        there.value > step ? static_cast<int>(std::min<double>(parts, there.value / step)) - 1 : 0;
    if (skipped > 0) found.clear = std::min(found.clear, there.value - skipped * step + sure);
    k += 1 + skipped;
    if (!(there.value < 0)) continue;
    found.out -= there.value * there.normal;
    found.share -= there.value * share;
    sum -= there.value;
  }
  if (sum > 0) found.share /= sum;
  found.out.normalize();
  return found;
}

}  // namespace

LeftOut through_cloth_at_start(const Scene& scene, const LeftOut& open) {
  constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();
  std::vector<Matrix3Xd> x;
  std::vector<std::vector<std::array<int, 3>>> triangles;
  std::vector<std::vector<std::vector<std::size_t>>> around;  // particles of each sheet
  LeftOut through;
  for (const SheetDefinition& sheet : scene.sheets) {
    x.push_back(start_positions(sheet));
    triangles.push_back(triangles_of(sheet.shape));
    auto& ring = around.emplace_back(static_cast<std::size_t>(sheet.particle_count()));
    for (std::size_t t = 0; t < triangles.back().size(); ++t)
      for (const int particle : triangles.back()[t])
        ring[static_cast<std::size_t>(particle)].push_back(t);
    through.emplace_back(triangles.back().size());
  }
  const auto note = [&](std::size_t s, const auto& particles, bool within) {
    if (open[s].empty()) return;
    std::vector<std::size_t> having = around[s][static_cast<std::size_t>(particles[0])];
    std::erase_if(having, [&](std::size_t t) {
      return !std::ranges::all_of(particles, [&](int particle) {
        return std::ranges::find(triangles[s][t], particle) != triangles[s][t].end();
      });
    });
    if (!std::ranges::all_of(having, [&](std::size_t t) { return open[s][t]; })) return;
    if (within) through[s] = open[s];
    for (const std::size_t t : having) through[s][t] = true;
  };
  for (const ClothCut& cut : count_cuts(scene.sheets, x, kAll).first) {
    const bool within = cut.edge_sheet == cut.triangle_sheet;
    note(cut.edge_sheet, cut.edge, within);
    note(cut.triangle_sheet, cut.triangle, within);
  }
  return through;
}

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
  parts_.assign(edges_.size(), -1);
  clear_.assign(edges_.size(), 0);
  x_ = d_ = before_ = Matrix3Xd::Zero(3, static_cast<Eigen::Index>(particles_.size()));
}

void OpenSeams::keep_out(const Contacts& contacts, double dt, MovingSheet& sheet) {
  sheet.solver->read(particles_, x_, d_);
  const Eigen::RowVectorXd come = (x_ - before_).colwise().norm();
  before_ = x_;
  // of an end: by how much, and in the step, by so many edges, m
  struct Move {
    Vector3d by = Vector3d::Zero(), in_step = Vector3d::Zero();
    int edges = 0;
  };
  std::map<int, Move> moves;
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const auto& ends = edges_[e];
    const int parts = parts_between(x_.col(ends[0]), x_.col(ends[1]));
    clear_[e] -= std::max(come[ends[0]], come[ends[1]]) + contacts.reach();
    if (parts == parts_[e] && clear_[e] > 0) continue;
    const auto [nearest, clear, normal, share] =
        depth_between(contacts, x_.col(ends[0]), x_.col(ends[1]), parts);
    parts_[e] = parts;
    clear_[e] = clear;
    if (!(nearest < 0) || normal.isZero(0)) continue;
    std::array<double, 2> part{1 - share, share};
    for (std::size_t k = 0; k < 2; ++k)
      if (sheet.dynamics.inverse_mass[particles_[static_cast<std::size_t>(ends[k])]] == 0)
        part[k] = 0;
    const double sum = part[0] * part[0] + part[1] * part[1];
    if (sum == 0) continue;

    // back by what it came in, and out
    const Vector3d motion = (1 - share) * d_.col(ends[0]) + share * d_.col(ends[1]);
    const double approach = std::max(0.0, -motion.dot(normal));
    const Vector3d out = std::min(-nearest, approach + kOutward * dt) / sum * normal;
    const Vector3d stop = approach / sum * normal;
    for (std::size_t k = 0; k < 2; ++k) {
      if (part[k] == 0) continue;
      Move& move = moves[ends[k]];
      move.by += part[k] * out;
      move.in_step += part[k] * stop;
      ++move.edges;
    }
  }
  if (moves.empty()) return;
  // the mean of what edges ask of an end: none goes before another, so that symmetry stays
  std::vector<int> particles;
  Matrix3Xd by(3, static_cast<Eigen::Index>(moves.size())), in_step = by;
  for (const auto& [end, move] : moves) {
    const auto k = static_cast<Eigen::Index>(particles.size());
    by.col(k) = move.by / move.edges;
    in_step.col(k) = move.in_step / move.edges;
    particles.push_back(particles_[static_cast<std::size_t>(end)]);
  }
  sheet.solver->displace(particles, by, in_step);
}

}  // namespace weft
