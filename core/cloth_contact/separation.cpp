#include "core/cloth_contact/separation.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/cloth_contact/pair_batch.h"

namespace weft {
namespace {

constexpr int kMostPasses = 12;
// of thickness: what others need not answer; the next window begins with what was given in this one
constexpr double kSmall = 1e-4;
constexpr int kNever = -1;
constexpr double kDepthShare = 0.2;  // of its depth that a pair is moved apart

std::size_t hash(const std::array<int, 4>& particle) {
  std::uint64_t sum = 0;
  for (const int i : particle) sum = (sum ^ static_cast<std::uint64_t>(i)) * 0x9e3779b97f4a7c15;
  return static_cast<std::size_t>(sum >> 32);
}

}  // namespace

void Separation::touch(std::span<const NearCloth> near, const Untangling& untangling,
                       const Ways& ways, double most, int layers, ThreadPool& pool) {
  constexpr std::int64_t kLeastShare = 64;  // lists, of a thread
  if (!near.empty()) set_out(ways, pool);
  const Surroundings around{untangling, ways, movers_, most, static_cast<double>(layers)};
  const std::size_t shares = shares_of(pool, std::ssize(near), kLeastShare);
  found_.resize(2 * shares);
  for (const bool edges : {false, true})
    run_shares(pool, shares, std::ssize(near),
               [&](std::size_t share, std::int64_t begin, std::int64_t end) {
                 const auto part = near.subspan(static_cast<std::size_t>(begin),
                                                static_cast<std::size_t>(end - begin));
                 touch(edges, part, around, found_[share + (edges ? shares : 0)]);
               });
  most_steps_ = std::numeric_limits<double>::infinity();
  for (const Found& found : found_) most_steps_ = std::min(most_steps_, found.most_steps);
}

void Separation::touch(bool edges, std::span<const NearCloth> near, const Surroundings& around,
                       Found& found) {
  found.contacts.clear();
  found.most_steps = std::numeric_limits<double>::infinity();
  struct Waiting {
    const Candidate* candidate;
    double within, friction;
  };
  PairBatch batch;
  std::array<Waiting, PairBatch::kMost> waiting;
  const auto solve = [&] {
    if (edges)
      batch.solve_edges();
    else
      batch.solve_corners();
    for (std::size_t n = 0; n < batch.size(); ++n) {
      const double squared = batch.squared(n);
      const auto& [candidate, within, friction] = waiting[n];
      if (squared < within * within && squared > 0)
        add(edges, *candidate, batch.weights(n), batch.apart(n), std::sqrt(squared), friction,
            around, found);
    }
    batch.clear();
  };
  const auto of_kind = [&](std::size_t n) { return edges ? near[n].edges : near[n].corners; };
  for (std::size_t n = 0; n < near.size(); ++n) {
    // lists lie anywhere in memory
    constexpr std::size_t kAhead = 4, kInLine = 2;
    if (n + kAhead < near.size()) {
      const std::span<const Candidate> ahead = of_kind(n + kAhead);
      for (std::size_t k = 0; k < ahead.size(); k += kInLine) hwy::Prefetch(&ahead[k]);
    }
    const NearCloth& cloth = near[n];
    for (const Candidate& candidate : of_kind(n)) {
      const auto& [i, j, k, l] = candidate.particle;
      waiting[batch.size()] = {&candidate, candidate.thickness + cloth.come, cloth.friction};
      const Matrix3Xd& x = around.ways.from;
      batch.add(x.col(i), x.col(j), x.col(k), x.col(l));
      if (batch.full()) solve();
    }
  }
  solve();
}

// That may have come nearer than its thickness, as far as its particles moved in relation to each
// other.
void Separation::add(bool edges, const Candidate& candidate, const std::array<double, 4>& weight,
                     const Vector3d& apart, double distance, double friction,
                     const Surroundings& around, Found& found) {
  constexpr double kLeastReach = 0.02;      // of the thickness, where things nearly touch
  constexpr double kLeastMoves = 0.01;      // of its lightest particle's 1 / mass
  constexpr double kMostGivenIfHeld = 0.1;  // of the thickness
  const std::size_t ends = edges ? 2 : 1;
  // of all of the one to all of the other, m^2
  const auto farthest = [&](Eigen::Vector4d Mover::*motion) {
    const auto by = [&](std::size_t n) -> const Eigen::Vector4d& {
      return around.movers[static_cast<std::size_t>(candidate.particle[n])].*motion;
    };
    double most = 0;
    for (std::size_t m = 0; m < ends; ++m)
      for (std::size_t n = ends; n < 4; ++n) most = std::max(most, (by(m) - by(n)).squaredNorm());
    return most;
  };
  const double room = distance - candidate.thickness;
  if (room >= around.most || (room > 0 && room * room >= farthest(&Mover::way))) return;
  if (!around.untangling.empty() && around.untangling.has(candidate.particle)) return;

  std::array<double, 4> share;
  double moves = 0, lightest = 0;  // 1/kg, of what the pair moves
  std::array<bool, 2> is_held{};   // a particle of each side
  for (std::size_t n = 0; n < 4; ++n) {
    const double inverse =
        around.ways.inverse_mass[static_cast<std::size_t>(candidate.particle[n])];
    share[n] = weight[n] * inverse;
    moves += weight[n] * share[n];
    lightest = std::max(lightest, inverse);
    if (inverse == 0) is_held[n < ends ? 0 : 1] = true;
  }
  // what is held there, or moves far where its nearest point moves little, stays as it is
  if (moves <= kLeastMoves * lightest) return;
  for (double& part : share) part /= moves;
  const double reach =
      std::max(std::min(distance / 2, candidate.thickness / 4), kLeastReach * candidate.thickness);
  const double in_step = farthest(&Mover::in_step);
  if (in_step > 0) found.most_steps = std::min(found.most_steps, reach / std::sqrt(in_step));

  Contact& contact = found.contacts.emplace_back();
  contact.particle = candidate.particle;
  contact.edges = edges;
  contact.weight = weight;
  contact.share = share;
  contact.normal << apart / distance, 0;
  contact.room = room;
  contact.thickness = candidate.thickness;
  contact.friction = friction;
  contact.most_given =
      (is_held[0] && is_held[1] ? kMostGivenIfHeld : around.layers) * candidate.thickness;
}

// Has particles begin with their own ways.
void Separation::set_out(const Ways& ways, ThreadPool& pool) {
  const Eigen::Index count = ways.from.cols();
  movers_.resize(static_cast<std::size_t>(count));
  for_shares(pool, count, kParticlesOfShare, [&](std::int64_t begin, std::int64_t end) {
    for (Eigen::Index i = begin; i < end; ++i) {
      Mover& mover = movers_[static_cast<std::size_t>(i)];
      mover.way << ways.to.col(i) - ways.from.col(i), 0;
      mover.in_step << ways.in_step.col(i), 0;
    }
  });
}

// Those are looked at again whose particles others have moved.
void Separation::separate(double steps) {
  changed_.assign(movers_.size(), kNever);
  // what was given the last time
  std::size_t next = 0;  // most pairs come in the order in which they came then
  for_each_contact([&](Contact& contact) {
    const std::size_t found = find_given(contact, next);
    if (found == given_.size()) return;
    next = found + 1;
    const Eigen::Vector4d& normal = contact.normal;
    const auto turned = [&](const Change& change) -> Change {
      return {change.along, change.sliding - change.sliding.dot(normal) * normal};
    };
    contact.way = turned(given_[found].way);
    contact.in_step = turned(given_[found].in_step);
    move(contact, contact.way.along * normal + contact.way.sliding,
         contact.in_step.along * normal + contact.in_step.sliding);
  });

  int now = 0;
  for (int pass = 0; pass < kMostPasses; ++pass) {
    const int before = now;
    for_each_contact([&](Contact& contact) {
      int changed = 0;
      for (const int i : contact.particle)
        changed = std::max(changed, changed_[static_cast<std::size_t>(i)]);
      if (changed <= contact.looked_at) return;
      const double by = separate(steps, contact);
      const bool gives_up = std::max(contact.way.along, contact.in_step.along) > contact.most_given;
      if (gives_up) give_up(contact);
      if (gives_up || by > kSmall * contact.thickness) {
        ++now;
        for (const int i : contact.particle) changed_[static_cast<std::size_t>(i)] = now;
      }
      contact.looked_at = gives_up ? std::numeric_limits<int>::max() : now;
    });
    if (now == before) break;
  }
  keep_given();
}

// What a motion lacks to be at least `least` along the normal, and without sliding as far as
// friction by what is given beyond `free` holds that; some of what was given may be taken back. m
Eigen::Vector4d Separation::give(const Eigen::Vector4d& motion, const Eigen::Vector4d& normal,
                                 double least, double friction, double free, Change& given) {
  const double along = motion.dot(normal), before = given.along;
  given.along = std::max(before + least - along, 0.0);
  Eigen::Vector4d sliding = given.sliding - (motion - along * normal);
  const double most = friction * std::max(given.along - free, 0.0), length = sliding.norm();
  if (length > most) sliding *= most / length;
  Eigen::Vector4d by = (given.along - before) * normal + sliding - given.sliding;
  given.sliding = sliding;
  return by;
}

void Separation::move(const Contact& contact, const Eigen::Vector4d& way,
                      const Eigen::Vector4d& in_step) {
  for (std::size_t n = 0; n < 4; ++n) {
    const auto at = static_cast<std::size_t>(contact.particle[n]);
    movers_[at].way += contact.share[n] * way;
    movers_[at].in_step += contact.share[n] * in_step;
    changed_[at] = std::max(changed_[at], 0);
  }
}

// Returns how far it was from what it is to be, m.
double Separation::separate(double steps, Contact& contact) {
  Eigen::Vector4d way = Eigen::Vector4d::Zero(), in_step = Eigen::Vector4d::Zero();
  for (std::size_t n = 0; n < 4; ++n) {
    const Mover& mover = movers_[static_cast<std::size_t>(contact.particle[n])];
    way += contact.weight[n] * mover.way;
    in_step += contact.weight[n] * mover.in_step;
  }

  const Eigen::Vector4d& normal = contact.normal;
  const double missing = kDepthShare * std::max(-contact.room, 0.0),
               least = missing - std::max(contact.room, 0.0);
  // no nearer than the thickness, or than where it set out, and from there on out
  const double come = way.dot(normal), speed = in_step.dot(normal);
  const auto allowed = [&](double come_by) {
    return -std::max(contact.room + come_by, 0.0) / steps;
  };
  const double pushed_before = contact.way.along, braked_before = contact.in_step.along;
  if (come >= least && speed >= allowed(come) && pushed_before == 0 && braked_before == 0) return 0;
  const Eigen::Vector4d by = give(way, normal, least, contact.friction, missing, contact.way);
  const double pushed = contact.way.along - pushed_before;
  // nor in the steps to come
  const Eigen::Vector4d braked =
      give(in_step, normal, allowed(come + pushed), contact.friction, 0, contact.in_step);
  move(contact, by, braked);
  return std::max(std::abs(pushed), std::abs(contact.in_step.along - braked_before) * steps);
}

// Takes back what it has given.
void Separation::give_up(Contact& contact) {
  const auto of = [&](const Change& given) -> Eigen::Vector4d {
    return given.along * contact.normal + given.sliding;
  };
  move(contact, -of(contact.way), -of(contact.in_step));
  contact.way = contact.in_step = {};
}

void Separation::forget_given() {
  given_.clear();
  place_.clear();
}

void Separation::keep_given() {
  given_.clear();
  for_each_contact([&](const Contact& contact) {
    if (contact.way.along > 0 || contact.in_step.along > 0)
      given_.push_back({contact.particle, contact.edges, contact.way, contact.in_step});
  });
  place_.assign(std::bit_ceil(2 * given_.size() + 1), 0);
  for (std::size_t k = 0; k < given_.size(); ++k) {
    std::size_t at = hash(given_[k].particle);
    while (place_[at & (place_.size() - 1)] != 0) ++at;
    place_[at & (place_.size() - 1)] = static_cast<std::uint32_t>(k + 1);
  }
}

// Its place in given_, or the size of that. First looks at `next`.
std::size_t Separation::find_given(const Contact& contact, std::size_t next) const {
  const auto is = [&](const Given& given) {
    return given.particle == contact.particle && given.edges == contact.edges;
  };
  if (next < given_.size() && is(given_[next])) return next;
  if (given_.empty()) return 0;
  for (std::size_t at = hash(contact.particle);; ++at) {
    const std::uint32_t k = place_[at & (place_.size() - 1)];
    if (k == 0) return given_.size();
    if (is(given_[k - 1])) return k - 1;
  }
}

}  // namespace weft
