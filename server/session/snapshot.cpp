#include "server/session/snapshot.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "server/session/session.h"

namespace weft {

// Whether there was enough to compute since the last snapshot, which large sessions have written
// more rarely, or so many calls that the log should not grow without one.
bool Session::snapshot_due() const {
  constexpr double kParticles = 20'000;
  constexpr std::int64_t kManyEntries = 500;
  return work_ > snapshot_after_ * std::max(1.0, simulation_.particle_count() / kParticles) ||
         entries_ - entries_in_snapshot_ >= kManyEntries;
}

void Session::offer_snapshot() {
  std::int64_t oldest = 0;
  {
    std::lock_guard lock(mutex_);
    oldest = reach_.history_from.value_or(history_.oldest());
  }
  if (!log_->offer([this] { return snapshot(); }, oldest)) return;
  work_ = {};
  entries_in_snapshot_ = entries_;
}

// nullptr where it failed or was closed, which ends in it what is to go on after a restart.
std::shared_ptr<const SessionSnapshot> Session::snapshot() const {
  auto made = std::make_shared<SessionSnapshot>();
  made->entries = entries_;
  made->simulation = simulation_.snapshot();
  answers_.for_each([&](const Request& request, const Outcome& outcome) {
    made->answers.push_back({request, outcome});
  });
  std::lock_guard lock(mutex_);
  if (closed_ || state_ == SessionState::kFailed) return nullptr;
  if (run_) {
    made->under_way.push_back(
        {latest(), {}, RunBegun{run_->time_scale, run_->until_frame, run_->until_rest}});
  }
  if (steps_begun()) {
    const Step& step = steps_.front();
    made->under_way.push_back(
        {*step.first - 1, step.command.request, StepsBegun{step.command.frames}});
  }
  return made;
}

// Begins where it was taken, as far as it belongs to the log; false, and nothing done, where it
// does not.
bool Session::begin_at(const SessionSnapshot& from, const SessionPast& past) {
  const auto& log = past.log;
  const auto entries = static_cast<std::size_t>(from.entries - past.first);
  const bool fits = from.entries >= past.first && entries <= log.size() &&
                    (entries == log.size() || log[entries].frame >= from.simulation.frame);
  if (!fits || !simulation_.restore(from.simulation)) {
    if (notify_) {
      notify_("session " + identity_.id + ": the snapshot of frame " +
              std::to_string(from.simulation.frame) + " does not fit its scene and log");
    }
    return false;
  }
  entries_ = entries_in_snapshot_ = from.entries;
  for (const auto& [request, outcome] : from.answers) answers_.remember(request, outcome);
  const std::vector<Repair>& repairs = simulation_.repairs();
  std::vector<Repair> of_frame;
  std::copy_if(repairs.begin(), repairs.end(), std::back_inserter(of_frame),
               [&](const Repair& repair) { return repair.frame == simulation_.frame(); });
  const auto frame = make_frame(std::move(of_frame));
  std::lock_guard lock(mutex_);
  history_.begin(frame);
  repairs_ = repairs;
  plan_ = std::make_shared<const Plan>(simulation_.plan());
  for (std::size_t i = 0; i < textiles_.size(); ++i)
    textiles_[i] = simulation_.scene().sheets[i].textile;
  for (const LogEntry& entry : from.under_way) {
    if (const auto* run = std::get_if<RunBegun>(&entry.event)) {
      run_ = Run{run->time_scale, run->until_frame, run->until_rest, Clock::now(), latest()};
    } else if (const auto* steps = std::get_if<StepsBegun>(&entry.event)) {
      StepCommand command;
      command.frames = steps->frames;
      command.request = entry.request;
      command.done = [](const Outcome&) {};
      steps_.push_back({std::move(command), entry.frame + 1});
    }
  }
  return true;
}

}  // namespace weft
