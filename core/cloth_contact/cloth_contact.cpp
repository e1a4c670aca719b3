#include "core/cloth_contact/cloth_contact.h"

#include <algorithm>
#include <cmath>

#include "core/cloth_contact/cuts.h"

namespace weft {
namespace {

constexpr double kMotionRounding = 1.001;  // of motion as solvers tell it
// Of a window, s: what lies at rest falls and is lifted again within it, by less than a micrometre;
// in windows of a millisecond cloth bounced by 20, and slid where friction should have held it.
constexpr double kWindowTime = 2.5e-4;
// of the thickest cloth: what comes in a window, and at least where things nearly touch
constexpr double kWindowReach = 0.25, kLeastReach = 0.02;

}  // namespace

ClothContact::ClothContact(const Scene& scene, const LeftOut& left_out)
    : scene_(scene), cloth_(scene.sheets, left_out), lists_(cloth_), untangling_(cloth_) {
  place_.assign(static_cast<std::size_t>(cloth_.particles()), -1);
  forget();
}

void ClothContact::forget() {
  lists_.forget();
  candidates_ = {};
  separation_ = {};
  all_ = one_sheet_ = begin_ = x_ = d_ = {};
  window_ = {.reach = kWindowReach * cloth_.thickest};
  come_ = moved_ = 0;
}

void ClothContact::resolve(std::span<MovingSheet> sheets, double dt, bool ends_frame) {
  double in_step = 0, pushed = 0;  // in relation to each other
  for (const MovingSheet& sheet : sheets) {
    in_step = std::max(in_step, 2 * kMotionRounding * sheet.solver->moved());
    pushed = std::max(pushed, 2 * kMotionRounding * sheet.solver->pushed());
  }
  come_ += pushed;
  if (window_.steps == 0) begin_window(sheets, in_step);
  come_ += in_step;
  ++window_.steps;
  if (!ends_frame && window_.steps < window_.most_steps && come_ + in_step <= window_.reach) return;

  const double most_reach = kWindowReach * cloth_.thickest;
  window_ = {0, ends_frame ? 1 : std::max(1, static_cast<int>(kWindowTime / dt)), most_reach};
  untangling_.lead(sheets, dt);
  if (candidates_.empty()) return;
  read(sheets);
  set_out();
  separation_.touch(candidates_, begin_, inverse_mass_, movers_,
                    PairLists::kMostMotion * cloth_.thickest);
  if (separation_.empty()) return;
  if (!ends_frame)
    window_.reach =
        std::clamp(separation_.least_distance() / 2, kLeastReach * cloth_.thickest, most_reach);
  separation_.separate(
      std::clamp(window_.reach / in_step, 1.0, static_cast<double>(window_.most_steps)), movers_);
  write(sheets);
}

void ClothContact::untangle(std::span<const MovingSheet> sheets, bool wanted) {
  const bool was_empty = untangling_.empty();
  untangling_.clear();
  if (wanted) {
    cloth_.join([&](std::size_t s) -> const Matrix3Xd& { return sheets[s].good().x; }, all_);
    lists_.blocks().set(all_);
    untangling_.find(lists_.blocks(), all_);
  }
  if (!was_empty || !untangling_.empty()) forget();
}

std::int64_t ClothContact::count_cuts(std::span<const MovingSheet> sheets) {
  Matrix3Xd x;
  cloth_.join([&](std::size_t s) -> const Matrix3Xd& { return sheets[s].good().x; }, x);
  NearBlocks& blocks = lists_.blocks();
  blocks.set(x);
  return weft::count_cuts(cloth_, blocks, x, 0).count;
}

// Makes candidates of pairs.
template <class Lists>
void ClothContact::take(const Lists& for_each_list) {
  candidates_.clear();
  const auto friction = [&](int particle) {
    return scene_.sheets[static_cast<std::size_t>(cloth_.sheet_of(particle))].textile.friction;
  };
  for_each_list([&](const ClothPairs& pairs) {
    for (const auto& [particle, triangle] : pairs.corners) {
      const auto& [a, b, c] = cloth_.triangles[static_cast<std::size_t>(triangle)];
      if (untangling_.has({particle, a, b, c})) continue;
      candidates_.push_back({{particle, a, b, c},
                             false,
                             thickness_of_corner(cloth_, particle, triangle),
                             std::sqrt(friction(particle) * friction(a))});
    }
    for (const auto& [one, other] : pairs.edges) {
      const auto& [a, b] = cloth_.edges[static_cast<std::size_t>(one)];
      const auto& [c, d] = cloth_.edges[static_cast<std::size_t>(other)];
      if (untangling_.has({a, b, c, d})) continue;
      candidates_.push_back({{a, b, c, d},
                             true,
                             thickness_of_edges(cloth_, one, other),
                             std::sqrt(friction(a) * friction(c))});
    }
  });

  particles_.clear();
  for (const ContactCandidate& candidate : candidates_)
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
  for (ContactCandidate& candidate : candidates_)
    for (int& i : candidate.place) i = place_[static_cast<std::size_t>(i)];
  for (const int i : particles_) place_[static_cast<std::size_t>(i)] = -1;
}

void ClothContact::begin_window(std::span<MovingSheet> sheets, double in_step) {
  constexpr double kSpare = 1.25;  // where the last step is faster than the one before
  const double margin = kSpare * window_.reach;
  moved_ += come_;
  come_ = 0;
  if (scene_.solver.plain) {
    if (candidates_.empty()) {
      const std::vector<ClothPairs> all = all_pairs(cloth_);
      take([&](const auto& f) { std::for_each(all.begin(), all.end(), f); });
    }
  } else if (moved_ + in_step + margin > lists_.lasts()) {
    update_lists(sheets, margin, in_step);
  }
  if (candidates_.empty()) return;
  read(sheets);
  begin_ = x_ - d_;
}

void ClothContact::update_lists(std::span<MovingSheet> sheets, double margin, double in_step) {
  const auto positions = [&](std::size_t s) -> const Matrix3Xd& {
    sheets[s].solver->positions(one_sheet_);
    return one_sheet_;
  };
  cloth_.join(positions, all_);
  moved_ = 0;
  if (!lists_.update(all_, margin, in_step)) return;
  take([&](const auto& f) { lists_.for_each_list(f); });
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
  inverse_mass_.resize(particles_.size());
  for_each_run([&](std::size_t sheet, std::size_t first, std::size_t count) {
    const auto at = static_cast<Eigen::Index>(first), n = static_cast<Eigen::Index>(count);
    const std::span<const int> own = std::span(own_number_).subspan(first, count);
    sheets[sheet].solver->read(own, x_.middleCols(at, n), d_.middleCols(at, n));
    for (std::size_t k = first; k < first + count; ++k)
      inverse_mass_[k] = sheets[sheet].dynamics.inverse_mass[own_number_[k]];
  });
}

void ClothContact::set_out() {
  movers_.resize(particles_.size());
  for (std::size_t k = 0; k < movers_.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    movers_[k].way << x_.col(column) - begin_.col(column), 0;
    movers_[k].in_step << d_.col(column), 0;
  }
}

// To those that moved: others keep their bits.
void ClothContact::write(std::span<MovingSheet> sheets) {
  double corrected = 0;
  for_each_run([&](std::size_t sheet, std::size_t first, std::size_t count) {
    changed_.clear();
    Eigen::Index n = 0;
    for (std::size_t k = first; k < first + count; ++k) {
      const auto column = static_cast<Eigen::Index>(k);
      const Vector3d by = movers_[k].way.head<3>() - (x_.col(column) - begin_.col(column)),
                     in_step = movers_[k].in_step.head<3>() - d_.col(column);
      if (by.isZero(0) && in_step.isZero(0)) continue;
      corrected = std::max(corrected, kMotionRounding * by.norm());
      changed_.push_back(own_number_[k]);
      x_.col(n) = by;
      d_.col(n++) = in_step;
    }
    if (n > 0) sheets[sheet].solver->displace(changed_, x_.leftCols(n), d_.leftCols(n));
  });
  come_ += 2 * corrected;
}

}  // namespace weft
