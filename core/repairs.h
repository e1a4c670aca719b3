#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/motion/guard.h"
#include "core/plan.h"

namespace weft {

// A frame that had to be computed again with half the step.
struct Repair {
  std::int64_t frame = 0;
  double substep = 0;  // from then on, s
  std::string reason;
  bool lasts = false;  // the step is not doubled again, see Repairs::grow()
};

// What the guard says of an attempt at a frame.
struct Attempt {
  std::vector<Inspection> sheets;
  std::string reason;    // the first of theirs; empty: the frame is good
  bool tangles = false;  // cloth passed through cloth, and nothing else speaks against it

  // Whether every sheet that is in doubt does here as it did there.
  bool confirms(const Attempt& other) const;
};

// What is to be done after an attempt at a frame.
enum class Decision {
  kDone,
  kConfirmed,   // a longer step was right: it stays, the state is this one's
  kAgain,       // from the frame before, with half the step
  kImpossible,  // no shorter step is to be had
};

// How often the planned step was halved, and when.
class Repairs {
 public:
  explicit Repairs(const SolverSettings& settings)
      : frame_step_(settings.frame_step), most_(settings.max_repairs) {}

  int halvings() const { return halvings_; }
  // Attempts at the frame under way in which cloth passed through cloth.
  int tangled() const { return tangled_; }
  const std::vector<Repair>& all() const { return all_; }
  // Of a frame; more are not computed.
  std::int64_t most_substeps() const { return most_substeps_; }
  void limit_substeps(std::int64_t most) { most_substeps_ = most; }
  // Goes on from there.
  void adopt(int halvings, std::vector<Repair> all);
  // A plan made anew, without what was halved.
  void shorten(StepPlan& step) const { set(halvings_, 0, step); }

  // Doubles a halved step again, up to its bound, after a while without repairs: 64 frames, and
  // twice as many for each time that frames broke before.
  [[nodiscard]] bool grow(std::int64_t frame, StepPlan& step);
  void begin_frame();
  // Says what follows from an attempt at a frame, and sets the step for it.
  Decision judge(std::int64_t frame, const Attempt& made, StepPlan& step);
  // Halves the step for good; false: that is not possible any more.
  bool keep_halved(std::int64_t frame, const std::string& reason, StepPlan& step);

 private:
  Decision judge_tangled(std::int64_t frame, const Attempt& made, StepPlan& step);
  bool halve(Repair repair, StepPlan& step);
  void take_back(int halvings, StepPlan& step);
  // Substeps are doubled so many times instead of so many.
  void set(int halvings, int instead_of, StepPlan& step) const;

  double frame_step_;  // s
  int most_;
  std::int64_t most_substeps_ = kMaxSubsteps;
  int halvings_ = 0;
  std::vector<Repair> all_;
  // before the frame under way
  int halvings_before_ = 0;
  std::size_t repairs_before_ = 0;
  // the attempt before, with twice the step
  std::optional<Attempt> doubtful_;
  int tangled_ = 0;
};

}  // namespace weft
