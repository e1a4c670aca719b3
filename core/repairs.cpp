#include "core/repairs.h"

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

void Repairs::begin_frame() {
  doubtful_.reset();
  halvings_before_ = halvings_;
  repairs_before_ = all_.size();
}

Decision Repairs::judge(std::int64_t frame, const Attempt& made, StepPlan& step) {
  if (made.reason.empty()) return Decision::kDone;
  if (doubtful_ && made.confirms(*doubtful_)) {
    set(halvings_ - 1, halvings_, step);
    --halvings_;
    all_.resize(repairs_before_ + static_cast<std::size_t>(halvings_ - halvings_before_));
    return Decision::kConfirmed;
  }
  if (!halve(frame, made.reason, step)) return Decision::kImpossible;
  doubtful_ = made;
  return Decision::kAgain;
}

bool Repairs::halve(std::int64_t frame, const std::string& reason, StepPlan& step) {
  if (halvings_ >= most_ || 2 * step.substeps > most_substeps_) return false;
  set(halvings_ + 1, halvings_, step);
  ++halvings_;
  all_.push_back({frame, step.substep, reason});
  return true;
}

}  // namespace weft
