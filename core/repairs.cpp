#include "core/repairs.h"

#include <algorithm>
#include <utility>

namespace weft {

bool Attempt::confirms(const Attempt& other) const {
  for (std::size_t s = 0; s < sheets.size(); ++s)
    if (!sheets[s].reason.empty() && !weft::confirms(sheets[s], other.sheets[s])) return false;
  return true;
}

void Repairs::adopt(int halvings, std::vector<Repair> all) {
  halvings_ = halvings;
  all_ = std::move(all);
}

void Repairs::set(int halvings, int instead_of, StepPlan& step) const {
  step.substeps = (step.substeps >> instead_of) << halvings;
  step.substep = frame_step_ / static_cast<double>(step.substeps);
}

bool Repairs::grow(std::int64_t frame, StepPlan& step) {
  if (halvings_ == 0 || all_.empty()) return false;
  constexpr std::int64_t kGood = 64;
  constexpr int kMostDoublings = 10;
  int lasting = 0, times = 0;
  std::int64_t last = 0;
  for (const Repair& repair : all_) {
    lasting += repair.lasts ? 1 : 0;
    times += repair.frame == last ? 0 : 1;
    last = repair.frame;
  }
  if (halvings_ <= lasting || 2 * step.substep > step.longest()) return false;
  const std::int64_t good = frame - 1 - last;
  if (good == 0 || good % (kGood << std::clamp(times - 1, 0, kMostDoublings)) != 0) return false;
  set(halvings_ - 1, halvings_, step);
  --halvings_;
  return true;
}

void Repairs::begin_frame() {
  doubtful_.reset();
  tangled_ = 0;
  halvings_before_ = halvings_;
  repairs_before_ = all_.size();
}

Decision Repairs::judge(std::int64_t frame, const Attempt& made, StepPlan& step) {
  if (made.reason.empty()) return Decision::kDone;
  if (made.tangles) return judge_tangled(frame, made, step);
  if (doubtful_ && made.confirms(*doubtful_)) {
    take_back(1, step);
    return Decision::kConfirmed;
  }
  if (!halve({.frame = frame, .reason = made.reason}, step)) return Decision::kImpossible;
  doubtful_ = made;
  return Decision::kAgain;
}

// Where cloth passes in shorter steps as well, the frame is left so.
Decision Repairs::judge_tangled(std::int64_t frame, const Attempt& made, StepPlan& step) {
  constexpr int kMostTangled = 2;
  doubtful_.reset();
  if (tangled_ < kMostTangled && halve({.frame = frame, .reason = made.reason}, step)) {
    ++tangled_;
    return Decision::kAgain;
  }
  if (tangled_ == 0) return Decision::kDone;
  take_back(tangled_, step);
  return Decision::kConfirmed;
}

void Repairs::take_back(int halvings, StepPlan& step) {
  set(halvings_ - halvings, halvings_, step);
  halvings_ -= halvings;
  all_.resize(repairs_before_ + static_cast<std::size_t>(halvings_ - halvings_before_));
}

bool Repairs::keep_halved(std::int64_t frame, const std::string& reason, StepPlan& step) {
  return halve({.frame = frame, .reason = reason, .lasts = true}, step);
}

bool Repairs::halve(Repair repair, StepPlan& step) {
  if (halvings_ >= most_ || 2 * step.substeps > most_substeps_) return false;
  set(halvings_ + 1, halvings_, step);
  ++halvings_;
  repair.substep = step.substep;
  all_.push_back(std::move(repair));
  return true;
}

}  // namespace weft
