#include "core/cloth_contact/cloth_contact.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "core/cloth_contact/cuts.h"

namespace weft {
namespace {

constexpr double kMotionRounding = 1.001;  // of motion as solvers tell it
// Of a window, s: what lies at rest falls and is lifted again within it, by less than a micrometre;
// in windows of a millisecond cloth bounced by 20, and slid where friction should have held it.
constexpr double kWindowTime = 2.5e-4;
// of the thickest cloth: what comes in a window at most, where nothing has met in its frame yet,
// and what is not looked at closer
constexpr double kWindowReach = 0.5, kReachUnmet = 1.0, kLeastReach = 0.02;
constexpr double kSpare = 1.25;  // where steps are faster than the ones before
// By how much steps change in a window that is known ahead, at most, of the thickest cloth; and
// where they change more than at its begin.
constexpr double kSteady = 0.05, kSpareChange = 1.5;
// Of a step in single precision, of places within 10 m, m.
constexpr double kPlaceRounding = 1e-6;

// Since last asked, in relation to each other, m.
double change_of(std::span<const MovingSheet> sheets) {
  double change = 0;
  for (const MovingSheet& sheet : sheets)
    change = std::max(change, 2 * kMotionRounding * sheet.solver->take_change());
  return change;
}

// Of windows.
double share_of(const SolverSettings& settings) {
  return std::min(1.0, settings.safety / SolverSettings().safety);
}

}  // namespace

ClothContact::ClothContact(const Scene& scene, const LeftOut& left_out)
    : scene_(scene), cloth_(scene.sheets, left_out), lists_(cloth_), untangling_(cloth_) {
  forget();
}

int ClothContact::most_steps(const SolverSettings& settings, double dt, int halvings) {
  const double time = std::ldexp(share_of(settings) * kWindowTime, -halvings);
  return std::max(1, static_cast<int>(std::min(time / dt, 1e6)));
}

void ClothContact::forget() {
  forget_motion();
  cuts_.reset();
}

void ClothContact::forget_motion() {
  lists_.forget();
  all_ = {};
  near_ = {};
  separation_ = {};
  begin_ = x_ = d_ = ahead_ = {};
  own_x_ = own_d_ = {};
  window_ = {};
  come_ = moved_ = 0;
  steady_.forget();
}

void ClothContact::resolve(std::span<MovingSheet> sheets, double dt, bool ends_frame,
                           ThreadPool& pool) {
  corrected_ = 0;
  cuts_.reset();
  double in_step = 0, pushed = 0;  // in relation to each other
  for (const MovingSheet& sheet : sheets) {
    in_step = std::max(in_step, 2 * kMotionRounding * sheet.solver->moved());
    pushed = std::max(pushed, 2 * kMotionRounding * sheet.solver->pushed());
  }
  const double changed = kPlaceRounding + change_of(sheets);
  steady_.change(changed);
  steady_.step();
  come_ += pushed;
  // as where a pin jerks: positions before this step are still known
  if (come_ + in_step > window_.most_come || window_.changed + changed > window_.most_change)
    window_.steps = 0;
  if (window_.steps == 0) begin_window(sheets, in_step, changed, pool);
  come_ += in_step;
  if (++window_.steps > 1) window_.changed += changed;
  if (!ends_frame && window_.steps < window_.most_steps && come_ + in_step <= window_.reach) return;

  has_met_ = has_met_ || come_ > PairLists::kMostMotion * cloth_.thickest;
  const Window past = window_;
  const bool is_known = past.is_known && !(lists_.empty() && untangling_.empty() && stays_apart(0));
  // the begin of a window of one step told where it ends, unless pairs are led apart meanwhile
  const bool is_read = window_.steps == 1 && untangling_.empty();
  window_ = {.most_steps = ends_frame ? 1 : most_steps(scene_.solver, dt, halvings_)};
  given_ += untangling_.lead(sheets, dt);
  if (is_known) {
    if (!is_read) read(sheets, pool);
    act(sheets, past, ends_frame, pool);
  }
  if (ends_frame) separation_.forget_given();
}

void ClothContact::begin_window(std::span<MovingSheet> sheets, double in_step, double changed,
                                ThreadPool& pool) {
  moved_ += come_;
  come_ = 0;
  window_.reach = reach(in_step);
  window_.most_come = in_step + kSpare * window_.reach;
  window_.changed = 0;
  window_.most_change = most_change(changed);
  const bool is_unmet = !scene_.solver.plain && lists_.empty();
  const int more = window_.most_steps - 1;
  window_.is_known =
      !is_unmet || !(moved_ + window_.most_come <= lists_.lasts() || stays_apart(more));
  if (!window_.is_known) return;
  read(sheets, pool);
  begin_.resize(3, x_.cols());
  for_shares(pool, x_.cols(), kParticlesOfShare, [&](std::int64_t from, std::int64_t to) {
    begin_.middleCols(from, to - from) =
        x_.middleCols(from, to - from) - d_.middleCols(from, to - from);
  });
  if (!is_unmet || !std::isfinite(window_.most_change)) return;
  steady_.measure(x_, d_, pool);
  if (!stays_apart(more)) look_ahead(pool);
  window_.is_known = !lists_.empty() || !stays_apart(more);
}

// After the first step of a window.
void ClothContact::look_ahead(ThreadPool& pool) {
  ahead_ = begin_ + window_.most_steps * d_;
  lists_.update(begin_, ahead_, pool);
  moved_ = 0;
  steady_.begin(begin_, ahead_, window_.most_steps, 1);
}

// Whether nothing is near that lists do not have until so many more steps are taken, if these
// change no more than foreseen.
bool ClothContact::stays_apart(int steps) const {
  return steady_.strays(steps, window_.most_change) <= lists_.lasts_beside(steady_.times(steps));
}

// By how much steps may change in a window whose first one has changed by so much, m; where much
// changes, or anything meets, it is not foreseen.
double ClothContact::most_change(double changed) const {
  const double change = kSpareChange * window_.most_steps * changed;
  const bool is_steady = !has_met_ && untangling_.empty() &&
                         change < kSteady * share_of(scene_.solver) * cloth_.thickest;
  return is_steady ? change : std::numeric_limits<double>::infinity();
}

// Of the motion in a window whose steps are like one, m.
double ClothContact::reach(double in_step) const {
  const double all = share_of(scene_.solver) * cloth_.thickest;
  const bool meets = has_met_ || !untangling_.empty();
  return std::clamp(kSpare * window_.most_steps * in_step, kLeastReach * all,
                    (meets ? kWindowReach : kReachUnmet) * all);
}

// What may have met in the window.
void ClothContact::find_near(const Window& past, ThreadPool& pool) {
  const double most = PairLists::kMostMotion * cloth_.thickest;
  near_.clear();
  const auto add = [&](const BlockPair& blocks, const Candidates& candidates, double come) {
    const auto friction = [&](int block) {
      const auto first =
          static_cast<std::size_t>(cloth_.first_block[static_cast<std::size_t>(block)]);
      const int sheet = cloth_.sheet_of(cloth_.triangles[first][0]);
      return scene_.sheets[static_cast<std::size_t>(sheet)].textile.friction;
    };
    near_.push_back({candidates.corners, candidates.edges,
                     std::sqrt(friction(blocks.one) * friction(blocks.other)), come});
  };
  if (scene_.solver.plain) {
    if (all_.empty())
      for (const auto& [blocks, pairs] : all_pairs(cloth_))
        all_.emplace_back(blocks, candidates_of(cloth_, pairs));
    for (const auto& [blocks, candidates] : all_) add(blocks, candidates, most);
    return;
  }
  const bool last = moved_ + come_ <= lists_.lasts();
  if (!last) {
    lists_.update(begin_, x_, pool);
    moved_ = 0;
    if (lists_.empty()) {
      steady_.begin(begin_, x_, past.steps, past.steps);
      steady_.change(past.changed);
    }
  }
  const double come = std::min(come_, most);
  lists_.for_each_list([&](const BlockPair& blocks, const Candidates& candidates, double came) {
    add(blocks, candidates, last ? come : came);
  });
}

void ClothContact::act(std::span<MovingSheet> sheets, const Window& past, bool ends_frame,
                       ThreadPool& pool) {
  find_near(past, pool);
  inverse_mass_.clear();
  if (!near_.empty())
    for (const MovingSheet& sheet : sheets)
      inverse_mass_.insert(inverse_mass_.end(), sheet.dynamics.inverse_mass.begin(),
                           sheet.dynamics.inverse_mass.end());
  const Separation::Ways ways{begin_, x_, d_, inverse_mass_};
  const int others = std::max(1, static_cast<int>(scene_.sheets.size()) - 1);
  separation_.touch(near_, untangling_, ways, others, pool);
  if (separation_.empty()) return separation_.forget_given();
  has_met_ = true;
  const double steps =
      std::clamp(separation_.most_steps(), 1.0, static_cast<double>(window_.most_steps));
  if (!ends_frame) window_.most_steps = static_cast<int>(steps);
  separation_.separate(steps);
  write(sheets);
}

// Of all sheets at the end of the last frame, m.
Matrix3Xd ClothContact::good_positions(std::span<const MovingSheet> sheets) const {
  Matrix3Xd x;
  cloth_.join([&](std::size_t s) -> const Matrix3Xd& { return sheets[s].good().x; }, x);
  return x;
}

std::vector<ClothPair> ClothContact::find_cuts(const Matrix3Xd& x, ThreadPool& pool) {
  lists_.blocks().set(x, pool);
  return weft::find_cuts(cloth_, lists_.blocks(), x, pool);
}

// Asked for at its end, and when the next one begins.
const std::vector<ClothPair>& ClothContact::cuts_of_last(std::span<const MovingSheet> sheets,
                                                         ThreadPool& pool) {
  if (!cuts_) cuts_ = find_cuts(good_positions(sheets), pool);
  return *cuts_;
}

void ClothContact::begin_frame(std::span<const MovingSheet> sheets, int halvings, double speed,
                               ThreadPool& pool) {
  halvings_ = halvings;
  // what came after the last step: windows are those of a frame that is gone on from
  steady_.change(change_of(sheets));
  const bool was_empty = untangling_.empty();
  untangling_.clear();
  has_met_ = false;
  given_ = 0;
  if (speed > 0)
    if (const std::vector<ClothPair>& cuts = cuts_of_last(sheets, pool); !cuts.empty())
      untangling_.set(cuts, good_positions(sheets), speed);
  if (!was_empty || !untangling_.empty()) forget_motion();
}

std::int64_t ClothContact::first_cuts(std::span<const MovingSheet> sheets,
                                      std::span<const SheetState> end, ThreadPool& pool) {
  if (!has_met_) return 0;
  Matrix3Xd x;
  cloth_.join([&](std::size_t s) -> const Matrix3Xd& { return end[s].x; }, x);
  std::vector<ClothPair> cuts = find_cuts(x, pool);
  const bool first = !cuts.empty() && find_cuts(good_positions(sheets), pool).empty();
  cuts_ = std::move(cuts);
  return first ? std::ssize(*cuts_) : 0;
}

std::int64_t ClothContact::count_cuts(std::span<const MovingSheet> sheets, ThreadPool& pool) {
  return std::ssize(cuts_of_last(sheets, pool));
}

void ClothContact::read(std::span<MovingSheet> sheets, ThreadPool& pool) {
  x_.resize(3, cloth_.particles());
  d_.resize(3, cloth_.particles());
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const int first = cloth_.first_particle[s], count = cloth_.first_particle[s + 1] - first;
    for (int i = static_cast<int>(numbers_.size()); i < count; ++i) numbers_.push_back(i);
    for_shares(pool, count, kParticlesOfShare, [&](std::int64_t begin, std::int64_t end) {
      const auto own = std::span(numbers_).subspan(static_cast<std::size_t>(begin),
                                                   static_cast<std::size_t>(end - begin));
      sheets[s].solver->read(own, x_.middleCols(first + begin, end - begin),
                             d_.middleCols(first + begin, end - begin));
    });
  }
}

// To those that moved: others keep their bits.
void ClothContact::write(std::span<MovingSheet> sheets) {
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const int first = cloth_.first_particle[s], end = cloth_.first_particle[s + 1];
    own_x_.resize(3, end - first);
    own_d_.resize(3, end - first);
    changed_.clear();
    Eigen::Index n = 0;
    for (int i = first; i < end; ++i) {
      if (!separation_.has_moved(i)) continue;
      const Mover& mover = separation_.mover(i);
      const Vector3d by = mover.way.head<3>() - (x_.col(i) - begin_.col(i)),
                     in_step = mover.in_step.head<3>() - d_.col(i);
      if (by.isZero(0) && in_step.isZero(0)) continue;
      corrected_ = std::max(corrected_, kMotionRounding * by.norm());
      changed_.push_back(i - first);
      own_x_.col(n) = by;
      own_d_.col(n++) = in_step;
    }
    if (n > 0) sheets[s].solver->displace(changed_, own_x_.leftCols(n), own_d_.leftCols(n));
  }
  come_ += 2 * corrected_;
}

}  // namespace weft
