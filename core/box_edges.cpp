#include "core/box_edges.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/contact/nearest.h"

namespace weft {
namespace {

constexpr double kFarOff = std::numeric_limits<double>::infinity();
constexpr double kMostOutward = 1;  // beside what it approaches by, m/s
constexpr int kBoxEdges = 12, kBoxCorners = 8;

// A box along its own axes, around its middle.
struct PlacedBox {
  Eigen::Matrix3d turn;
  Vector3d middle, half;  // m
  double skin;            // m

  PlacedBox(const Contacts::Placed& placed, const Box& box, double skin_around)
      : turn(placed.turn),
        middle(box.center + placed.offset),
        half((box.half_size.array() + std::min(skin_around, 0.0)).cwiseMax(0)),
        skin(std::max(skin_around, 0.0)) {}
  Vector3d local(const Vector3d& x) const { return turn.transpose() * (x - middle); }
  bool has(const Vector3d& x) const { return (x.cwiseAbs().array() < half.array()).all(); }
};

// An edge or a corner of a box: where it goes from and to, and how it lies from the middle along
// each axis: -1, 1, or 0 along the edge.
struct Place {
  Vector3d side, from, to;
};
Place edge_of(const PlacedBox& box, int edge) {
  const int axis = edge / 4;
  Place place;
  place.side[axis] = 0;
  place.side[(axis + 1) % 3] = edge & 1 ? 1 : -1;
  place.side[(axis + 2) % 3] = edge & 2 ? 1 : -1;
  place.from = place.to = place.side.cwiseProduct(box.half);
  place.from[axis] = -box.half[axis];
  place.to[axis] = box.half[axis];
  return place;
}
Place corner_of(const PlacedBox& box, int corner) {
  const Vector3d side(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
  return {side, side.cwiseProduct(box.half), side.cwiseProduct(box.half)};
}

// How far what lies within bounds is from edges and corners of a box, at least.
class GapsToBox {
 public:
  GapsToBox(const Vector3d& low, const Vector3d& high, const Vector3d& half) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<Eigen::Index>(axis);
      const double l = low[k], h = high[k], end = half[k];
      const auto square = [](double v) { return v > 0 ? v * v : 0; };
      span_[axis] = square(std::max(l - end, -end - h));
      end_[axis] = {square(std::max(l + end, -end - h)), square(std::max(l - end, end - h))};
    }
  }
  // m^2
  double to_edge(int edge) const {
    const auto e = static_cast<std::size_t>(edge), axis = e / 4;
    return span_[axis] + end_[(axis + 1) % 3][e & 1] + end_[(axis + 2) % 3][(e & 2) / 2];
  }
  double to_corner(int corner) const {
    const auto c = static_cast<std::size_t>(corner);
    return end_[0][c & 1] + end_[1][(c & 2) / 2] + end_[2][c / 4];
  }
  double to_nearest_edge() const {
    double sum = 0, most = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double end = std::min(end_[axis][0], end_[axis][1]);
      sum += end;
      most = std::max(most, end - span_[axis]);
    }
    return sum - most;
  }

 private:
  std::array<double, 3> span_;                // to it along each axis, m^2
  std::array<std::array<double, 2>, 3> end_;  // to where it ends, m^2
};

// What is nearest to a place of a box.
struct Meeting {
  Vector3d weights = Vector3d::Zero();  // of particles
  Vector3d out = Vector3d::Zero();
  double distance = kFarOff, depth = 0;  // of the place, and below the skin, m
};
// of: the point of the place. Nearest are particles themselves: colliders push these.
Meeting meet(const PlacedBox& box, const Place& place, const Vector3d& weights, const Vector3d& at,
             const Vector3d& of) {
  Meeting met;
  const Vector3d away = at - of;
  met.distance = away.norm();
  if ((weights.array() > 0).count() + (place.side.array() == 0).count() < 3) return met;
  // inside it is led out; outside it has to be over that place
  const bool inside = box.has(at);
  if (!inside && (met.distance >= box.skin || (away.cwiseProduct(place.side).array() < 0).any()))
    return met;
  if (!(met.distance > 0)) return met;
  met.weights = weights;
  met.out = away / (inside ? -met.distance : met.distance);
  met.depth = box.skin + (inside ? met.distance : -met.distance);
  return met;
}
Meeting meet_edge(const PlacedBox& box, int edge, const Vector3d& a, const Vector3d& b) {
  const Place place = edge_of(box, edge);
  // across the box's edge, and where that is along it
  const int along = edge / 4, one = (along + 1) % 3, other = (along + 2) % 3;
  const Vector3d u = b - a;
  const double square = u[one] * u[one] + u[other] * u[other];
  const double to_it = u[one] * (place.to[one] - a[one]) + u[other] * (place.to[other] - a[other]);
  if (square > 0) {
    const double share = std::clamp(to_it / square, 0.0, 1.0);
    const Vector3d at = a + share * u;
    if (std::abs(at[along]) <= box.half[along]) {
      Vector3d of = place.to;
      of[along] = at[along];
      return meet(box, place, {1 - share, share, 0}, at, of);
    }
  }
  const auto [share, share_of_it] = nearest_on_edges(a, b, place.from, place.to);
  return meet(box, place, {1 - share, share, 0}, a + share * u,
              place.from + share_of_it * (place.to - place.from));
}
Meeting meet_corner(const PlacedBox& box, int corner, const Vector3d& a, const Vector3d& b,
                    const Vector3d& c) {
  const Place place = corner_of(box, corner);
  const auto [u, v, w] = nearest_in_triangle(place.from, a, b, c);
  return meet(box, place, {u, v, w}, u * a + v * b + w * c, place.from);
}

}  // namespace

BoxEdges::BoxEdges(const SheetDefinition& sheet)
    : margin_(2 * sheet.spacing()), number_(static_cast<std::size_t>(sheet.particle_count()), -1) {
  std::vector<std::array<int, 3>> edges;  // two ends, and which of all triangles' edges it is
  for (const auto& particles : triangles_of(sheet.shape)) {
    triangles_.push_back({particles, {}});
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [from, to] = std::minmax(particles[k], particles[(k + 1) % 3]);
      edges.push_back({from, to, static_cast<int>(edges.size())});
    }
  }
  std::sort(edges.begin(), edges.end());
  for (std::size_t n = 0; n < edges.size(); ++n) {
    const auto& [from, to, which] = edges[n];
    if (n > 0 && edges[n - 1][0] == from && edges[n - 1][1] == to) continue;
    triangles_[static_cast<std::size_t>(which / 3)].edges[static_cast<std::size_t>(which % 3)] =
        true;
  }
}

void BoxEdges::look(const Contacts& contacts, const MovingSheet& sheet) {
  Matrix3Xd x;
  sheet.solver->positions(x);
  edges_.clear();
  corners_.clear();
  come_ = 0;
  lasts_ = kFarOff;
  for (std::size_t c = 0; c < contacts.placed().size(); ++c) {
    const Contacts::Placed& placed = contacts.placed()[c];
    const auto* shape = std::get_if<Box>(&placed.collider.shape);
    if (shape == nullptr) continue;
    const PlacedBox box(placed, *shape, contacts.skin());
    const Matrix3Xd local = box.turn.transpose() * (x.colwise() - box.middle);
    const double within = (margin_ + box.skin) * (margin_ + box.skin);
    const auto is_far = [&](const GapsToBox& gaps) {
      const double gap = gaps.to_nearest_edge();
      lasts_ = std::min(lasts_, gap < within ? margin_ : std::sqrt(gap) - box.skin);
      return gap >= within;
    };
    if (is_far({local.rowwise().minCoeff(), local.rowwise().maxCoeff(), box.half})) continue;
    for (const auto& [particles, edges] : triangles_) {
      const Vector3d x0 = local.col(particles[0]), x1 = local.col(particles[1]),
                     x2 = local.col(particles[2]);
      const GapsToBox gaps(x0.cwiseMin(x1).cwiseMin(x2), x0.cwiseMax(x1).cwiseMax(x2), box.half);
      if (is_far(gaps)) continue;
      for (int corner = 0; corner < kBoxCorners; ++corner)
        if (gaps.to_corner(corner) < within) corners_.push_back({c, corner, particles});
      for (std::size_t n = 0; n < 3; ++n) {
        if (!edges[n]) continue;
        const int from = particles[n], to = particles[(n + 1) % 3];
        const Vector3d a = local.col(from), b = local.col(to);
        const GapsToBox of_edge(a.cwiseMin(b), a.cwiseMax(b), box.half);
        for (int edge = 0; edge < kBoxEdges; ++edge)
          if (of_edge.to_edge(edge) < within) edges_.push_back({c, edge, {from, to, -1}});
      }
    }
  }
}

BoxEdges::Mover& BoxEdges::mover(int particle, const Vector3d& d) {
  int& number = number_[static_cast<std::size_t>(particle)];
  if (number < 0) {
    number = static_cast<int>(movers_.size());
    movers_.push_back({particle, d});
  }
  return movers_[static_cast<std::size_t>(number)];
}

void BoxEdges::keep_off(const Contacts& contacts, double dt, MovingSheet& sheet) {
  constexpr double kOfStep = 2.002;  // a collider pushes back no farther than a particle came
  come_ += kOfStep * (sheet.solver->moved() + contacts.reach());
  if (!(come_ < lasts_)) look(contacts, sheet);
  find_touching(contacts, dt, sheet);
  if (touching_.empty()) return;
  part();

  particles_.clear();
  x_.resize(3, static_cast<Eigen::Index>(movers_.size()));
  d_.resize(3, x_.cols());
  for (const Mover& mover : movers_) {
    number_[static_cast<std::size_t>(mover.particle)] = -1;
    if (mover.touching == 0) continue;  // it is held
    const auto k = static_cast<Eigen::Index>(particles_.size());
    x_.col(k) = mover.by;
    d_.col(k) = mover.in_step;
    particles_.push_back(mover.particle);
  }
  const auto count = static_cast<Eigen::Index>(particles_.size());
  sheet.solver->displace(particles_, x_.leftCols(count), d_.leftCols(count));
  come_ += x_.leftCols(count).colwise().norm().maxCoeff();
}

// Each edge, or triangle, with the place that it is led out by.
void BoxEdges::find_touching(const Contacts& contacts, double dt, const MovingSheet& sheet) {
  touching_.clear();
  movers_.clear();
  due_.clear();
  particles_.clear();
  for (std::vector<Near>* const list : {&edges_, &corners_})
    for (Near& near : *list) {
      if (come_ < near.clear) continue;
      due_.push_back(&near);
      particles_.insert(particles_.end(), near.particles.begin(),
                        near.particles.begin() + near.count());
    }
  if (due_.empty()) return;
  x_.resize(3, static_cast<Eigen::Index>(particles_.size()));
  d_.resize(3, x_.cols());
  sheet.solver->read(particles_, x_, d_);

  std::vector<std::optional<PlacedBox>> boxes;
  for (const Contacts::Placed& placed : contacts.placed()) {
    const auto* shape = std::get_if<Box>(&placed.collider.shape);
    boxes.emplace_back();
    if (shape != nullptr) boxes.back().emplace(placed, *shape, contacts.skin());
  }
  const auto touch = [&](const Near& near, Eigen::Index first, const Meeting& meeting) {
    const Contacts::Placed& placed = contacts.placed()[near.collider];
    Touching made{.weights = meeting.weights,
                  .out = boxes[near.collider]->turn * meeting.out,
                  .carried = placed.carried,
                  .friction = placed.friction};
    Vector3d motion = -placed.carried;
    double sum = 0;
    for (Eigen::Index k = 0; k < near.count(); ++k) {
      const int particle = near.particles[static_cast<std::size_t>(k)];
      made.share[k] = meeting.weights[k] * sheet.dynamics.inverse_mass[particle];
      sum += meeting.weights[k] * made.share[k];
      motion += meeting.weights[k] * d_.col(first + k);
    }
    if (sum == 0) return;
    made.share /= sum;
    made.depth = std::min(meeting.depth, std::max(-motion.dot(made.out), 0.0) + kMostOutward * dt);
    for (Eigen::Index k = 0; k < near.count(); ++k) {
      const int particle = near.particles[static_cast<std::size_t>(k)];
      Mover& moved = mover(particle, d_.col(first + k));
      if (made.share[k] > 0) ++moved.touching;
      made.movers[static_cast<std::size_t>(k)] = number_[static_cast<std::size_t>(particle)];
    }
    touching_.push_back(made);
  };
  Meeting nearest;
  Eigen::Index first = 0;
  for (std::size_t n = 0; n < due_.size(); first += due_[n++]->count()) {
    Near& near = *due_[n];
    const PlacedBox& box = *boxes[near.collider];
    const auto at = [&](Eigen::Index k) { return box.local(x_.col(first + k)); };
    const Meeting meeting = near.count() == 2 ? meet_edge(box, near.place, at(0), at(1))
                                              : meet_corner(box, near.place, at(0), at(1), at(2));
    near.clear = meeting.depth > 0 ? 0 : come_ + meeting.distance - box.skin;
    bool inside = false;  // the collider leads particles out first
    for (Eigen::Index k = 0; k < near.count(); ++k) inside = inside || box.has(at(k));
    if (!inside && meeting.depth > 0 && meeting.distance < nearest.distance) nearest = meeting;
    const bool is_last = n + 1 == due_.size() || due_[n + 1]->collider != near.collider ||
                         due_[n + 1]->particles != near.particles;
    if (!is_last) continue;
    if (nearest.depth > 0) touch(near, first, nearest);
    nearest = {};
  }
}

// As a collider pushes a particle: out, no farther in, and rubbing. In a round each gets as large a
// part of what it needs as the most crowded of its particles has room for, so that symmetry stays,
// and none gains energy: sums of parts of projections, at most 1 at a particle, never lengthen.
void BoxEdges::part() {
  constexpr int kRounds = 8;  // with one cloth crept down from a table that friction holds it on
  for (Touching& each : touching_)
    for (std::size_t k = 0; k < 3; ++k)
      if (each.share[static_cast<Eigen::Index>(k)] > 0)
        each.part =
            std::min(each.part, 1.0 / movers_[static_cast<std::size_t>(each.movers[k])].touching);
  for (int round = 0; round < kRounds; ++round) {
    for (Mover& mover : movers_) mover.more_by = mover.more_in_step = Vector3d::Zero();
    for (Touching& each : touching_) {
      Vector3d by = Vector3d::Zero(), motion = -each.carried;
      for (std::size_t k = 0; k < 3 && each.movers[k] >= 0; ++k) {
        const Mover& mover = movers_[static_cast<std::size_t>(each.movers[k])];
        const double weight = each.weights[static_cast<Eigen::Index>(k)];
        by += weight * mover.by;
        motion += weight * (mover.d + mover.in_step);
      }
      const double approach = motion.dot(each.out);
      const double out = each.part * std::max(each.depth - by.dot(each.out), 0.0),
                   stop = each.part * std::max(-approach, 0.0);
      each.stopped += stop;
      Vector3d rub = motion - approach * each.out;
      const double sliding = rub.norm();
      if (sliding > 0) {
        const double rubbed =
            std::min(each.part * sliding, each.friction * each.stopped - each.rubbed);
        each.rubbed += rubbed;
        rub *= rubbed / sliding;
      }
      for (std::size_t k = 0; k < 3 && each.movers[k] >= 0; ++k) {
        Mover& mover = movers_[static_cast<std::size_t>(each.movers[k])];
        const double share = each.share[static_cast<Eigen::Index>(k)];
        mover.more_by += share * (out * each.out - rub);
        mover.more_in_step += share * (stop * each.out - rub);
      }
    }
    for (Mover& mover : movers_) {
      mover.by += mover.more_by;
      mover.in_step += mover.more_in_step;
    }
  }
}

}  // namespace weft
