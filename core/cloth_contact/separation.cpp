#include "core/cloth_contact/separation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/cloth_contact/pair_batch.h"

namespace weft {
namespace {

constexpr int kMostPasses = 100;
constexpr double kSmall = 2e-5;      // of thickness: what others need not answer
constexpr double kDepthShare = 0.2;  // of its depth that a pair is moved apart

// What takes `push` (m, along the normal) from a motion, and by friction from its sliding.
Eigen::Vector4d against(const Eigen::Vector4d& motion, const Eigen::Vector4d& normal, double along,
                        double push, double friction) {
  const Eigen::Vector4d sliding = motion - along * normal;
  const double length = sliding.norm();
  Eigen::Vector4d change = push * normal;
  if (length > 0) change -= std::min(1.0, friction * push / length) * sliding;
  return change;
}

}  // namespace

void Separation::touch(std::span<const ContactCandidate> candidates, const Matrix3Xd& x,
                       std::span<const double> inverse_mass, std::span<const Mover> movers,
                       double most) {
  contacts_.clear();
  come_.clear();
  for (const Mover& mover : movers) come_.push_back(mover.way.norm());
  const auto come = [&](int i) { return come_[static_cast<std::size_t>(i)]; };
  least_distance_ = std::numeric_limits<double>::infinity();
  const auto margin_of = [&](const ContactCandidate& candidate) {
    const auto& [i, j, k, l] = candidate.place;
    const double margin = candidate.edges ? std::max(come(i), come(j)) + std::max(come(k), come(l))
                                          : come(i) + std::max({come(j), come(k), come(l)});
    return std::min(margin, most);
  };
  // of a run of candidates of a kind
  PairBatch batch;
  for (std::size_t begin = 0; begin < candidates.size(); begin += batch.size()) {
    const bool edges = candidates[begin].edges;
    batch.clear();
    for (std::size_t n = begin;
         n < candidates.size() && candidates[n].edges == edges && !batch.full(); ++n) {
      const auto& [i, j, k, l] = candidates[n].place;
      batch.add(x.col(i), x.col(j), x.col(k), x.col(l));
    }
    if (edges)
      batch.solve_edges();
    else
      batch.solve_corners();
    for (std::size_t n = 0; n < batch.size(); ++n) {
      const ContactCandidate& candidate = candidates[begin + n];
      const double within = candidate.thickness + margin_of(candidate), squared = batch.squared(n);
      if (squared < within * within && squared > 0)
        add(candidate, batch.weights(n), batch.apart(n), std::sqrt(squared), inverse_mass);
    }
  }
}

void Separation::add(const ContactCandidate& candidate, const std::array<double, 4>& weight,
                     const Vector3d& apart, double distance, std::span<const double> inverse_mass) {
  Contact contact{candidate.place,         weight,   {},
                  Eigen::Vector4d::Zero(), distance, candidate.thickness,
                  candidate.friction,      -1};
  contact.normal.head<3>() = apart / distance;
  double moves = 0;  // 1/kg, of what the pair moves
  for (std::size_t n = 0; n < 4; ++n) {
    contact.share[n] = weight[n] * inverse_mass[static_cast<std::size_t>(candidate.place[n])];
    moves += weight[n] * contact.share[n];
  }
  if (moves == 0) return;
  for (double& share : contact.share) share /= moves;
  least_distance_ = std::min(least_distance_, distance);
  contacts_.push_back(contact);
}

// Those are looked at again whose particles others have moved.
void Separation::separate(double steps, std::span<Mover> movers) {
  changed_.assign(movers.size(), 0);
  int now = 0;
  for (int pass = 0; pass < kMostPasses; ++pass) {
    const int before = now;
    for (Contact& contact : contacts_) {
      int changed = 0;
      for (const int i : contact.place)
        changed = std::max(changed, changed_[static_cast<std::size_t>(i)]);
      if (changed <= contact.looked_at) continue;
      if (separate(steps, contact, movers) > kSmall * contact.thickness) {
        ++now;
        for (const int i : contact.place) changed_[static_cast<std::size_t>(i)] = now;
      }
      contact.looked_at = now;
    }
    if (now == before) break;
  }
}

// Returns how far it was from what it is to be, m.
double Separation::separate(double steps, const Contact& contact, std::span<Mover> movers) const {
  const auto mover = [&](std::size_t n) -> Mover& {
    return movers[static_cast<std::size_t>(contact.place[n])];
  };
  Eigen::Vector4d way = Eigen::Vector4d::Zero(), in_step = Eigen::Vector4d::Zero();
  for (std::size_t n = 0; n < 4; ++n) {
    way += contact.weight[n] * mover(n).way;
    in_step += contact.weight[n] * mover(n).in_step;
  }

  // no nearer than the thickness, or than where it set out, and from there on out
  const Eigen::Vector4d& normal = contact.normal;
  const double depth = std::max(contact.thickness - contact.distance, 0.0),
               room = std::max(contact.distance - contact.thickness, 0.0);
  const double come = way.dot(normal), push = std::max(-come - room, 0.0);
  const double missing = std::max(kDepthShare * depth - room - (come + push), 0.0);
  // nor in the steps to come
  const double left = std::max(contact.distance + come + push + missing - contact.thickness, 0.0);
  const double speed = in_step.dot(normal), brake = std::max(-speed - left / steps, 0.0);
  if (push <= 0 && missing <= 0 && brake <= 0) return 0;

  Eigen::Vector4d by = missing * normal, change = Eigen::Vector4d::Zero();
  if (push > 0) by += against(way, normal, come, push, contact.friction);
  if (brake > 0) change = against(in_step, normal, speed, brake, contact.friction);
  for (std::size_t n = 0; n < 4; ++n) {
    mover(n).way += contact.share[n] * by;
    mover(n).in_step += contact.share[n] * change;
  }
  return std::max(push + missing, brake * steps);
}

}  // namespace weft
