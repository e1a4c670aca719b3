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
// more rarely.
bool Session::snapshot_due() const {
  constexpr double kParticles = 20'000;
  return work_ > snapshot_after_ * std::max(1.0, simulation_.particle_count() / kParticles);
}

// Whether there were so many calls since the last snapshot that the log should not grow without
// one.
bool Session::log_grew() const {
  constexpr std::int64_t kManyEntries = 500;
  return entries_ - entries_in_snapshot_ >= kManyEntries;
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
  made->create_time = std::chrono::system_clock::now();
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

std::string default_snapshot_id(std::int64_t frame) { return "frame-" + std::to_string(frame); }

std::vector<NamedSnapshot> Session::snapshots() const {
  std::lock_guard lock(mutex_);
  return named_;
}

// Written before the log says so: what it says is there. The session stands still meanwhile.
void Session::execute(KeepSnapshot command) {
  std::shared_ptr<const SessionSnapshot> taken;
  auto refusal = refusal_of(command);
  if (!refusal) {
    taken = snapshot();
    if (!taken) refusal = refusal_of(command);  // closed meanwhile
  }
  if (!taken) return command.done(*refusal);
  if (command.id.empty()) command.id = default_snapshot_id(taken->simulation.frame);
  const auto made = std::make_shared<NamedSnapshot>();
  {
    std::lock_guard lock(mutex_);
    writing_.then = [this, command, made](const std::string& error) {
      enter(command, *made, error);
    };
    writing_.written.reset();
  }
  log_->keep(
      command.id, taken,
      [self = shared_from_this(), made](const std::string& error, const NamedSnapshot& kept) {
        {
          std::lock_guard lock(self->mutex_);
          *made = kept;
          self->writing_.written = error;
        }
        self->wake();
      });
}

// What keeps the snapshot from being taken.
std::optional<Refusal> Session::refusal_of(const KeepSnapshot& command) const {
  std::lock_guard lock(mutex_);
  if (auto refusal = refusal_of_change()) return refusal;
  const std::string id = command.id.empty() ? default_snapshot_id(latest()) : command.id;
  const auto same = [&](const NamedSnapshot& each) { return each.id == id; };
  if (std::any_of(named_.begin(), named_.end(), same)) {
    Refusal refusal = refuse(Refusal::Why::kSnapshotExists);
    refusal.text = id;
    return refusal;
  }
  if (named_.size() >= max_snapshots_) return refuse(Refusal::Why::kTooManySnapshots);
  return std::nullopt;
}

// Has the log say that there is the snapshot, where it could be written.
void Session::enter(const KeepSnapshot& command, const NamedSnapshot& made,
                    const std::string& error) {
  const auto not_kept = [this](const std::string& why) {
    std::lock_guard lock(mutex_);
    Refusal refusal = refuse(Refusal::Why::kNotKept);
    refusal.text = why;
    return refusal;
  };
  if (!error.empty()) return command.done(not_kept(error));
  write(command.request, SnapshotKept{command.id},
        [this, command, made, not_kept](const std::string& why) {
          if (!why.empty()) {
            log_->drop(command.id);
            return command.done(not_kept(why));
          }
          Outcome outcome;
          {
            std::lock_guard lock(mutex_);
            const auto after =
                std::find_if(named_.begin(), named_.end(),
                             [&](const NamedSnapshot& each) { return each.frame > made.frame; });
            named_.insert(after, made);
            outcome = applied(latest());
          }
          answer(command.request, command.done, outcome);
        });
}

}  // namespace weft
