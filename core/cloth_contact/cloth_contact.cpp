#include "core/cloth_contact/cloth_contact.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/contact/nearest.h"

namespace weft {
namespace {

constexpr double kMotionRounding = 1.001;  // of motion as solvers tell it
constexpr double kSpareReach = 1.5;        // of reach, for steps to come
constexpr int kMostPasses = 16;            // at most
constexpr double kNoMorePasses = 1e-3;     // of thickness: what needs no other pass
constexpr double kDepthShare = 0.1;        // of its depth that a pair is moved apart in a step

}  // namespace

ClothContact::ClothContact(const Scene& scene)
    : scene_(scene), cloth_(scene.sheets), lists_(cloth_) {
  every_.resize(static_cast<std::size_t>(cloth_.particles()));
  std::iota(every_.begin(), every_.end(), 0);
  place_.assign(static_cast<std::size_t>(cloth_.particles()), -1);
}

void ClothContact::forget() {
  lists_.forget();
  candidates_ = {};
  contacts_ = {};
  begin_ = x_ = d_ = {};
  listed_ = pruned_ = {};
  corrected_ = moved_before_ = 0;
}

void ClothContact::resolve(std::span<MovingSheet> sheets) {
  double moved = 0, pushed = 0;
  for (const MovingSheet& sheet : sheets) {
    moved = std::max(moved, kMotionRounding * sheet.solver->moved());
    pushed = std::max(pushed, kMotionRounding * sheet.solver->pushed());
  }
  // pairs act from as far as they may come in this step; faster than their own thickness they may
  // pass unseen
  const double margin = std::min(2 * moved, cloth_.thickest);
  const double relative = 2 * (moved_before_ + pushed + corrected_);
  corrected_ = 0;
  listed_.used += relative;
  pruned_.used += relative;
  if (scene_.solver.plain) {
    if (candidates_.empty()) take(all_pairs(cloth_));
  } else {
    if (!listed_.lasts(margin)) list(sheets, margin);
    if (!pruned_.lasts(margin)) prune(sheets, margin);
  }
  if (!candidates_.empty()) {
    read(sheets);
    touch(margin);
    if (!contacts_.empty()) {
      separate();
      write(sheets);
    }
  }
  moved_before_ = moved;
}

void ClothContact::list(std::span<MovingSheet> sheets, double margin) {
  read_begin(sheets);
  lists_.update(begin_, margin);
  listed_ = {lists_.lasts(), 0};
  pruned_ = {};
}

void ClothContact::read_begin(std::span<MovingSheet> sheets) {
  begin_.resize(3, cloth_.particles());
  Matrix3Xd& d = d_;
  d.resize(3, cloth_.particles());
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const int first = cloth_.first_particle[s], count = cloth_.first_particle[s + 1] - first;
    sheets[s].solver->read(std::span(every_).first(static_cast<std::size_t>(count)),
                           begin_.middleCols(first, count), d.middleCols(first, count));
  }
  begin_ -= d;
}

// Of those listed the ones that may act soon.
void ClothContact::prune(std::span<MovingSheet> sheets, double margin) {
  constexpr std::size_t kWorthPruning = 1000;
  std::vector<ClothPairs> near;
  std::size_t count = 0;
  lists_.for_each_list(
      [&](const ClothPairs& pairs) { count += pairs.corners.size() + pairs.edges.size(); });
  if (count < kWorthPruning) {
    lists_.for_each_list([&](const ClothPairs& pairs) { near.push_back(pairs); });
    pruned_ = listed_;
    return take(near);
  }
  read_begin(sheets);
  pruned_ = {std::max(cloth_.thickest / 4, kSpareReach * margin), 0};
  lists_.for_each_list([&](const ClothPairs& pairs) {
    ClothPairs& some_near = near.emplace_back();
    for (const ClothPair& pair : pairs.corners)
      if (near_corner(cloth_, begin_, pair.first, pair.second, pruned_.reach))
        some_near.corners.push_back(pair);
    for (const ClothPair& pair : pairs.edges)
      if (near_edges(cloth_, begin_, pair.first, pair.second, pruned_.reach))
        some_near.edges.push_back(pair);
  });
  take(near);
}

// Makes candidates of pairs.
void ClothContact::take(const std::vector<ClothPairs>& lists) {
  candidates_.clear();
  const auto friction = [&](int particle) {
    return scene_.sheets[static_cast<std::size_t>(cloth_.sheet_of(particle))].textile.friction;
  };
  for (const ClothPairs& pairs : lists) {
    for (const auto& [particle, triangle] : pairs.corners) {
      const auto& [a, b, c] = cloth_.triangles[static_cast<std::size_t>(triangle)];
      candidates_.push_back({{particle, a, b, c},
                             false,
                             thickness_of_corner(cloth_, particle, triangle),
                             std::sqrt(friction(particle) * friction(a))});
    }
    for (const auto& [one, other] : pairs.edges) {
      const auto& [a, b] = cloth_.edges[static_cast<std::size_t>(one)];
      const auto& [c, d] = cloth_.edges[static_cast<std::size_t>(other)];
      candidates_.push_back({{a, b, c, d},
                             true,
                             thickness_of_edges(cloth_, one, other),
                             std::sqrt(friction(a) * friction(c))});
    }
  }

  particles_.clear();
  for (const Candidate& candidate : candidates_)
    for (const int i : candidate.place) {
      int& place = place_[static_cast<std::size_t>(i)];
      if (place < 0) particles_.push_back(i);
      place = 0;
    }
  std::sort(particles_.begin(), particles_.end());
  own_number_.clear();
  for (std::size_t k = 0; k < particles_.size(); ++k) {
    place_[static_cast<std::size_t>(particles_[k])] = static_cast<int>(k);
    own_number_.push_back(cloth_.own_number(particles_[k]));
  }
  for (Candidate& candidate : candidates_)
    for (int& i : candidate.place) i = place_[static_cast<std::size_t>(i)];
  for (const int i : particles_) place_[static_cast<std::size_t>(i)] = -1;
}

// Calls f(sheet, first, count) for the runs of particles_ that are of one sheet.
template <class F>
void ClothContact::for_each_run(const F& f) const {
  for (std::size_t first = 0; first < particles_.size();) {
    const int sheet = cloth_.sheet_of(particles_[first]);
    std::size_t last = first;
    while (last < particles_.size() && cloth_.sheet_of(particles_[last]) == sheet) ++last;
    f(static_cast<std::size_t>(sheet), first, last - first);
    first = last;
  }
}

void ClothContact::read(std::span<MovingSheet> sheets) {
  const auto size = static_cast<Eigen::Index>(particles_.size());
  x_.resize(3, size);
  d_.resize(3, size);
  movers_.resize(particles_.size());
  for_each_run([&](std::size_t sheet, std::size_t first, std::size_t count) {
    const auto at = static_cast<Eigen::Index>(first), n = static_cast<Eigen::Index>(count);
    const std::span<const int> own = std::span(own_number_).subspan(first, count);
    sheets[sheet].solver->read(own, x_.middleCols(at, n), d_.middleCols(at, n));
    for (std::size_t k = first; k < first + count; ++k) {
      Mover& mover = movers_[k];
      const Vector3d d = d_.col(static_cast<Eigen::Index>(k));
      mover.in_step = mover.way = {d.x(), d.y(), d.z(), 0};
      mover.inverse_mass = sheets[sheet].dynamics.inverse_mass[own_number_[k]];
    }
  });
  x_ -= d_;
}

// Finds the pairs that may come nearer than their thickness in this step.
void ClothContact::touch(double margin) {
  contacts_.clear();
  for (const Candidate& candidate : candidates_) {
    const auto& [i, j, k, l] = candidate.place;
    const Vector3d a = x_.col(i), b = x_.col(j), c = x_.col(k), d = x_.col(l);
    std::array<double, 4> weight;
    if (candidate.edges) {
      const auto [s, t] = nearest_on_edges(a, b, c, d);
      weight = {1 - s, s, t - 1, -t};
    } else {
      const auto [u, v, w] = nearest_in_triangle(a, b, c, d);
      weight = {1, -u, -v, -w};
    }
    const Vector3d apart = weight[0] * a + weight[1] * b + weight[2] * c + weight[3] * d;
    const double distance = apart.norm();
    if (!(distance < candidate.thickness + margin) || distance == 0) continue;

    Contact contact{candidate.place,         weight,   {},
                    Eigen::Vector4d::Zero(), distance, candidate.thickness,
                    candidate.friction};
    contact.normal.head<3>() = apart / distance;
    double inverse_mass = 0;  // of what the pair moves
    for (std::size_t n = 0; n < 4; ++n) {
      contact.share[n] = weight[n] * mover(contact, n).inverse_mass;
      inverse_mass += weight[n] * contact.share[n];
    }
    if (inverse_mass == 0) continue;
    for (double& share : contact.share) share /= inverse_mass;
    contacts_.push_back(contact);
  }
}

void ClothContact::separate() {
  for (int pass = 0; pass < kMostPasses; ++pass) {
    double most = 0;
    for (const Contact& contact : contacts_) most = std::max(most, separate(contact));
    if (most <= kNoMorePasses * cloth_.thickest) break;
  }
}

// Returns how far it was from what it is to be, m.
double ClothContact::separate(const Contact& contact) {
  Eigen::Vector4d in_step = Eigen::Vector4d::Zero(), way = Eigen::Vector4d::Zero();
  for (std::size_t n = 0; n < 4; ++n) {
    in_step += contact.weight[n] * mover(contact, n).in_step;
    way += contact.weight[n] * mover(contact, n).way;
  }

  // no nearer than the thickness, or than it was
  const Eigen::Vector4d& normal = contact.normal;
  const double away = in_step.dot(normal);
  const double push = -away - std::max(contact.distance - contact.thickness, 0.0);
  Eigen::Vector4d change = Eigen::Vector4d::Zero();
  if (push > 0) {
    const Eigen::Vector4d sliding = in_step - away * normal;
    const double length = sliding.norm();
    change = push * normal;
    if (length > 0) change -= std::min(1.0, contact.friction * push / length) * sliding;
  }

  const double depth = contact.thickness - contact.distance;
  const double wanted = contact.thickness - (1 - kDepthShare) * std::max(depth, 0.0);
  const double missing = wanted - contact.distance - normal.dot(way + change);
  if (push <= 0 && missing <= 0) return 0;
  const Eigen::Vector4d out = change + std::max(missing, 0.0) * normal;
  for (std::size_t n = 0; n < 4; ++n) {
    mover(contact, n).in_step += contact.share[n] * change;
    mover(contact, n).way += contact.share[n] * out;
  }
  return std::max(push, missing);
}

// To those that moved: others keep their bits.
void ClothContact::write(std::span<MovingSheet> sheets) {
  for_each_run([&](std::size_t sheet, std::size_t first, std::size_t count) {
    moved_.clear();
    Eigen::Index n = 0;
    for (std::size_t k = first; k < first + count; ++k) {
      const Vector3d d = d_.col(static_cast<Eigen::Index>(k));
      const Vector3d by = movers_[k].way.head<3>() - d, in_step = movers_[k].in_step.head<3>() - d;
      if (by.isZero(0) && in_step.isZero(0)) continue;
      corrected_ = std::max(corrected_, kMotionRounding * by.norm());
      moved_.push_back(own_number_[k]);
      x_.col(n) = by;
      d_.col(n++) = in_step;
    }
    if (n > 0) sheets[sheet].solver->displace(moved_, x_.leftCols(n), d_.leftCols(n));
  });
}

}  // namespace weft
