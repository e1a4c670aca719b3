#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/cloth_contact/pair_lists.h"
#include "core/cloth_contact/separation.h"
#include "core/cloth_contact/steady_motion.h"
#include "core/cloth_contact/untangling.h"
#include "core/moving_sheet.h"

namespace weft {

// Keeps cloth from passing through cloth: particles from triangles and edges from edges, of one
// sheet or of two (separation.h).
//
// Contact acts once in a window of several steps, in which nothing moves far in relation to what it
// is near; a window ends with its frame at the latest, so frames can be gone on from. Where it ends
// it is known how far everything came, and so what may have met. Where nothing was near enough to
// begin with, and steps hardly change from one to the next (steady_motion.h), nothing is read for
// many windows. A step in which something comes farther, or that changes by more, than was foreseen
// for its window begins a window of its own. What comes of it does not depend on lists, nor on who
// computes them.
class ClothContact {
 public:
  // Holds on to the scene.
  explicit ClothContact(const Scene& scene, const LeftOut& left_out = {});

  // Sheets may be anywhere now, or be held otherwise, at the begin of a frame. Nothing that was
  // found before is used, nor kept in memory.
  void forget();
  // Sheets are where they were, but solvers begin anew: cuts stay known.
  void forget_motion();
  // After how many steps of dt (s) it acts, at most, where windows are halved so often. They are
  // shorter by as much as steps are by their safety: what they cost in error is of first order.
  static int most_steps(const SolverSettings& settings, double dt, int halvings = 0);

  // To be called before each attempt at a frame, in which windows are halved so often. Looks for
  // cloth that has passed through cloth: until the next call such pairs do not keep each other
  // apart, but are led apart at up to `speed`, m/s (untangling.h). At 0 they stay so.
  void begin_frame(std::span<const MovingSheet> sheets, int halvings, double speed,
                   ThreadPool& pool);
  // Whether there are any.
  bool untangles() const { return !untangling_.empty(); }
  // Of sheets that have taken a step of dt, s.
  void resolve(std::span<MovingSheet> sheets, double dt, bool ends_frame, ThreadPool& pool);
  // How far that moved a particle at most, m.
  double moved() const { return corrected_; }
  // The energy that leading cuts apart gave in this frame, J.
  double given() const { return given_; }
  // After resolve(): something else moved particles by so much at most, m.
  void follow(double moved) { come_ += 2 * moved; }

  // At the end of a frame, if it began with none; else 0.
  std::int64_t first_cuts(std::span<const MovingSheet> sheets, std::span<const SheetState> end,
                          ThreadPool& pool);
  // At the end of the last frame (cuts.h).
  std::int64_t count_cuts(std::span<const MovingSheet> sheets, ThreadPool& pool = calling_thread());

 private:
  // Steps after which contact acts once.
  struct Window {
    int steps = 0, most_steps = 1;
    double reach = 0;  // of motion in it, in relation to anything else, m
    // What is foreseen; where more comes, or steps change by more, it begins anew, m.
    double most_come = 0, most_change = 0;
    double changed = 0;     // steps in it have, at most, m
    bool is_known = false;  // where it began
  };

  double reach(double in_step) const;
  double most_change(double changed) const;
  bool stays_apart(int steps) const;
  void begin_window(std::span<MovingSheet> sheets, double in_step, double changed,
                    ThreadPool& pool);
  void look_ahead(ThreadPool& pool);
  void act(std::span<MovingSheet> sheets, const Window& past, bool ends_frame, ThreadPool& pool);
  void find_near(const Window& past, ThreadPool& pool);
  void read(std::span<MovingSheet> sheets, ThreadPool& pool);
  void write(std::span<MovingSheet> sheets);
  Matrix3Xd good_positions(std::span<const MovingSheet> sheets) const;
  std::vector<ClothPair> find_cuts(const Matrix3Xd& x, ThreadPool& pool);
  const std::vector<ClothPair>& cuts_of_last(std::span<const MovingSheet> sheets, ThreadPool& pool);

  const Scene& scene_;
  Cloth cloth_;
  PairLists lists_;
  std::vector<std::pair<BlockPair, Candidates>> all_;  // where no lists are kept
  std::vector<NearCloth> near_;
  Window window_;
  // in relation to each other: since where the window began, and from where lists were looked at
  // until there, m
  double come_ = 0, moved_ = 0;
  SteadyMotion steady_;   // since lists were looked at
  double corrected_ = 0;  // how far contact moved a particle in the last step at most, m
  int halvings_ = 0;      // of windows in this frame
  bool has_met_ = false;  // whether anything may have in it
  double given_ = 0;      // in it, J

  std::vector<double> inverse_mass_;  // of all particles, 1/kg
  Matrix3Xd begin_, x_, d_;           // where the window began; now, and in the last step, m
  Matrix3Xd ahead_;                   // where the window may end, m
  Matrix3Xd own_x_, own_d_;           // of a sheet, m
  Separation separation_;
  Untangling untangling_;
  std::vector<int> changed_;                    // of a sheet, by its own numbers
  std::vector<int> numbers_;                    // 0, 1, ... of the largest sheet
  std::optional<std::vector<ClothPair>> cuts_;  // of the last frame, where nothing has moved since
};

}  // namespace weft
