#include "core/cloth_contact/separation.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace weft {
namespace {

std::size_t hash(const std::array<int, 4>& particle) {
  std::uint64_t sum = 0;
  for (const int i : particle) sum = (sum ^ static_cast<std::uint64_t>(i)) * 0x9e3779b97f4a7c15;
  return static_cast<std::size_t>(sum >> 32);
}

}  // namespace

void Separation::touch(std::span<const NearCloth> near, const Untangling& untangling,
                       const Ways& ways, int layers, ThreadPool& pool) {
  constexpr std::int64_t kLeastShare = 64;  // lists, of a thread
  if (!near.empty()) set_out(ways, pool);
  const Surroundings around{untangling, ways, movers_, static_cast<double>(layers)};
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
    double friction;
  };
  PairBatch batch(edges, around.ways.from);
  std::array<Waiting, PairBatch::kMost> waiting;
  const auto solve = [&] {
    batch.solve();
    batch.find_met(around.movers);
    for (std::size_t n = 0; n < batch.met_size(); ++n) {
      const auto& [candidate, friction] = waiting[batch.met(n)];
      add(*candidate, friction, batch, n, around, found);
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
      waiting[batch.size()] = {&candidate, cloth.friction};
      batch.add(candidate.particle, candidate.thickness, cloth.come);
      if (batch.full()) solve();
    }
  }
  solve();
}

void Separation::add(const Candidate& candidate, double friction, const PairBatch& batch,
                     std::size_t met, const Surroundings& around, Found& found) {
  constexpr double kLeastReach = 0.02;      // of the thickness, where things nearly touch
  constexpr double kLeastMoves = 0.01;      // of its lightest particle's 1 / mass
  constexpr double kMostGivenIfHeld = 0.1;  // of the thickness
  const std::size_t k = batch.met(met), ends = batch.edges() ? 2 : 1;
  const double distance = batch.distance(met), room = distance - candidate.thickness;
  if (!around.untangling.empty() && around.untangling.has(candidate.particle)) return;

  const std::array<double, 4> weight = batch.weights(k);
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
  if (const double in_step = batch.squared_in_step(met); in_step > 0)
    found.most_steps = std::min(found.most_steps, reach / std::sqrt(in_step));

  PairContact& contact = found.contacts.emplace_back();
  contact.particle = candidate.particle;
  contact.edges = batch.edges();
  contact.weight = weight;
  contact.share = share;
  contact.normal << batch.apart(k) / distance, 0;
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

void Separation::separate(double steps) {
  constexpr int kMostPasses = 4;  // what is left over is answered in the next window
  constexpr int kUnmoved = -1;
  changed_.assign(movers_.size(), kUnmoved);
  const Movers movers{movers_, changed_};
  // what was given the last time
  std::size_t next = 0;  // most pairs come in the order in which they came then
  for_each_contact([&](PairContact& contact) {
    const std::size_t found = find_given(contact, next);
    if (found == given_.size()) return;
    next = found + 1;
    const auto turned = [&](const PairContact::Change& change) -> PairContact::Change {
      return {change.along, change.sliding - change.sliding.dot(contact.normal) * contact.normal};
    };
    contact.way = turned(given_[found].way);
    contact.in_step = turned(given_[found].in_step);
    give(contact, movers);
  });

  int now = 0;
  for (int pass = 0; pass < kMostPasses; ++pass) {
    const int before = now;
    for (Found& found : found_) answer(found.contacts, steps, movers, now);
    if (now == before) break;
  }
  keep_given();
}

void Separation::forget_given() {
  given_.clear();
  place_.clear();
}

void Separation::keep_given() {
  given_.clear();
  for_each_contact([&](const PairContact& contact) {
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
std::size_t Separation::find_given(const PairContact& contact, std::size_t next) const {
  const auto is = [&](const Given& given) {
    const auto& [a, b, c, d] = given.particle;
    const auto& [i, j, k, l] = contact.particle;
    return a == i && b == j && c == k && d == l && given.edges == contact.edges;
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
