#include "server/session/snapshot.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "server/session/session.h"

namespace weft {

// Offers the log a snapshot when there was enough to compute since the one before, which large
// sessions have written more rarely.
void Session::offer_snapshot(std::chrono::duration<double> work) {
  constexpr double kParticles = 20'000;
  work_ += work;
  if (work_ < snapshot_after_ * std::max(1.0, simulation_.particle_count() / kParticles)) return;
  std::optional<std::int64_t> history_from;
  {
    std::lock_guard lock(mutex_);
    history_from = reach_.history_from;
  }
  if (log_->offer([this] { return snapshot(); }, history_from)) work_ = {};
}

// nullptr where it was closed, which ends in it what is to go on after a restart.
std::shared_ptr<const SessionSnapshot> Session::snapshot() const {
  auto made = std::make_shared<SessionSnapshot>();
  made->entries = entries_;
  made->simulation = simulation_.snapshot();
  answers_.for_each([&](const Request& request, const Outcome& outcome) {
    made->answers.push_back({request, outcome});
  });
  std::lock_guard lock(mutex_);
  if (closed_) return nullptr;
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
bool Session::begin_at(const SessionSnapshot& from, const std::vector<LogEntry>& log) {
  const auto entries = static_cast<std::size_t>(from.entries);
  const bool fits = from.entries >= 0 && entries <= log.size() &&
                    (entries == log.size() || log[entries].frame >= from.simulation.frame);
  if (!fits || !simulation_.restore(from.simulation)) {
    if (notify_) {
      notify_("session " + identity_.id + ": the snapshot of frame " +
              std::to_string(from.simulation.frame) +
              " does not fit its scene and log; it is computed from frame 0 on");
    }
    return false;
  }
  entries_ = from.entries;
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
