#include "server/session/session.h"

#include <algorithm>
#include <iomanip>
#include <limits>
#include <new>
#include <random>
#include <sstream>

namespace weft {
namespace {

// 128 random bits in hexadecimal.
std::string make_uid() {
  std::random_device random;
  std::string uid;
  for (int i = 0; i < 32; ++i) uid += "0123456789abcdef"[random() % 16];
  return uid;
}

std::int64_t count_particles(const Scene& scene) {
  std::int64_t particles = 0;
  for (const auto& sheet : scene.sheets) particles += sheet.particle_count();
  return particles;
}

}  // namespace

std::vector<Textile> textiles_of(const Scene& scene) {
  std::vector<Textile> textiles;
  for (const auto& sheet : scene.sheets) textiles.push_back(sheet.textile);
  return textiles;
}

SessionIdentity make_identity(std::string id, std::string numerics_id, std::string owner,
                              std::int64_t max_frame_work) {
  return {std::move(id),    make_uid(),    std::move(numerics_id), std::chrono::system_clock::now(),
          std::move(owner), max_frame_work};
}

Session::Session(SessionIdentity identity, Simulation simulation, const SessionHost& host,
                 std::unique_ptr<SessionLog> log)
    : identity_(std::move(identity)),
      scheduler_(host.scheduler),
      stats_(host.stats),
      log_(std::move(log)),
      notify_(host.notify),
      max_snapshots_(host.max_snapshots),
      timeline_(std::move(simulation), identity_.max_frame_work, host.snapshot_after),
      scene_(timeline_.simulation.scene()),
      particle_count_(count_particles(scene_)),
      journal_(host.limit_interval, scene_.solver.frame_step),
      audience_(host.history, host.return_time),
      textiles_(textiles_of(scene_)),
      plan_(std::make_shared<const Plan>(timeline_.simulation.plan())) {
  audience_.begin(timeline_.make_frame({}, false));
}

std::optional<Clock::time_point> Session::run_slice() {
  try {
    if (!go_on_with_frame() && !settle()) return std::nullopt;
    write_limit();
    if (const auto due = due_time(); due && *due <= Clock::now()) {
      compute_frame(*due);
      if (!go_on_with_frame() && !settle()) return std::nullopt;
      write_limit();
    }
  } catch (const std::bad_alloc&) {
    fail("the server ran out of memory");
  }
  return next_due();
}

// Does what is to be done between two frames; false while it waits for the log.
bool Session::settle() {
  for (;;) {
    if (!settle_writing()) return false;
    if (!settle_restoring()) return true;
    if (execute_command()) continue;
    if (settle_steps()) return true;
  }
}

bool Session::settle_writing() {
  for (;;) {
    std::unique_lock lock(mutex_);
    if (!journal_.waits()) return true;
    const auto written = journal_.take();
    if (!written) return false;
    lock.unlock();
    const auto& [then, error] = *written;
    then(error);  // which may write again
    if (timeline_.log_grew()) offer_snapshot();
  }
}

// Answers steps that are over, and begins the next one; false when the log is to be written for it.
bool Session::settle_steps() {
  std::vector<std::pair<StepCommand, Outcome>> settled;
  bool begin = false, end = false;
  {
    std::lock_guard lock(mutex_);
    for (StepCommand& command : queue_.take_cancelled())
      settled.emplace_back(std::move(command), refuse(Refusal::Why::kCancelled));
    while (queue_.has_steps()) {
      auto outcome = outcome_of(queue_.step());
      if (!outcome) break;
      settled.emplace_back(queue_.pop_step(), std::move(*outcome));
    }
    begin = queue_.has_steps() && !queue_.step_begun();
    end = queue_.step_cancelled();
  }
  for (const auto& [command, outcome] : settled) answer(command.request, command.done, outcome);
  if (begin) begin_step();
  if (end) end_step();
  return !begin && !end;
}

// Whether a frame is unfinished, which nothing is done before but to drop it.
bool Session::go_on_with_frame() {
  if (timeline_.simulation.frame_share() == 0) return false;
  if (!frame_unwanted() || !timeline_.drop_frame()) return true;
  std::lock_guard lock(mutex_);
  frame_share_ = 0;
  return false;
}

// Whether the frame under way is not to be waited for.
bool Session::frame_unwanted() const {
  std::lock_guard lock(mutex_);
  return !restoring_ && (queue_.has_pause() || queue_.step_cancelled());
}

bool Session::stats_wanted() const {
  std::lock_guard lock(mutex_);
  return audience_.wants_stats();
}

void Session::compute_frame(Clock::time_point due) {
  const FramePart part = timeline_.advance(scheduler_);
  {
    std::lock_guard lock(mutex_);
    frame_share_ = part == FramePart::kUnfinished ? timeline_.simulation.frame_share() : 0;
  }
  if (part != FramePart::kUnfinished) end_frame(part, due);
}

void Session::end_frame(FramePart part, Clock::time_point due) {
  const Simulation& simulation = timeline_.simulation;
  auto repairs = publish_repairs();
  if (part == FramePart::kFailed) return fail("the solver diverged: " + simulation.failure());
  timeline_.count_frame(stats_);
  const auto frame = timeline_.make_frame(std::move(repairs), stats_wanted());
  {
    std::lock_guard lock(mutex_);
    if (closed_) return;
    const auto end = used_ = Clock::now();
    audience_.push(frame, end);
    if (simulation.textile_changed()) textiles_ = textiles_of(simulation.scene());
    if (simulation.textile_changed() || simulation.plan().step.substeps != plan_->step.substeps)
      plan_ = std::make_shared<const Plan>(simulation.plan());
    lateness_ = {};
    if (due != Clock::time_point::min()) {
      lateness_ = end - due;
      stats_.lateness.add(lateness_);
    }
    if (run_ && run_->reached(frame->number, frame->at_rest)) {
      run_.reset();
      set_state(SessionState::kPaused);
    }
  }
  offer_to_all();
  if (timeline_.snapshot_due() || timeline_.log_grew()) offer_snapshot();
}

// Those that the last frame took, which are published with it.
std::vector<Repair> Session::publish_repairs() {
  const std::vector<Repair>& all = timeline_.simulation.repairs();
  std::vector<Repair> made;
  {
    std::lock_guard lock(mutex_);
    made.assign(all.begin() + static_cast<std::ptrdiff_t>(repairs_.size()), all.end());
    if (made.empty()) return made;
    stats_.repairs += static_cast<std::int64_t>(made.size());
    repairs_ = all;
    plan_ = std::make_shared<const Plan>(timeline_.simulation.plan());
  }
  if (!notify_) return made;
  for (const Repair& repair : made) {
    std::ostringstream us;
    us << std::setprecision(4) << repair.substep * 1e6;
    notify_("session " + identity_.id + ": frame " + std::to_string(repair.frame) +
            " is computed again, " + us.str() + " us a substep: " + repair.reason);
  }
  return made;
}

// Has the log say in advance how far frames are published, so that none is ever changed.
void Session::write_limit() {
  PublishLimit limit;
  {
    std::lock_guard lock(mutex_);
    if (!journal_.idle() || closed_ || restoring_) return;
    const auto now = Clock::now();
    const std::int64_t ahead =
        run_ ? journal_.ahead.frames(run_->time_scale) : journal_.ahead.frames();
    const bool suffices =
        !active() || (journal_.limit.frame >= std::min(latest() + ahead / 2, goal()) &&
                      audience_.knows_holders(journal_.limit, now));
    if (suffices && audience_.knows_readers(journal_.limit, now)) return;
    if (!suffices) journal_.ahead.note_used_up(now);
    limit = audience_.limit_at(std::min(latest() + ahead, goal()), now);
    journal_.limit_under_way = true;
  }
  log_->write(std::nullopt, limit, [self = shared_from_this(), limit](const std::string&) {
    {
      std::lock_guard lock(self->mutex_);
      self->journal_.limit = limit;  // even where it could not be written: the session goes on
      self->journal_.limit_under_way = false;
    }
    self->wake();
  });
}

void Session::fail(const std::string& why) {
  {
    std::lock_guard lock(mutex_);
    failure_ = why + "; frame " + std::to_string(latest()) + " is the last";
    run_.reset();
    restoring_.reset();
    set_state(SessionState::kFailed);
  }
  ++stats_.failures;
  if (notify_) notify_("session " + identity_.id + " failed: " + failure_);
  offer_to_all();
}

// When the next frame is to be computed, or memory let go; nullopt: not before something happens.
std::optional<Clock::time_point> Session::next_due() {
  if (const auto due = due_time()) return due;
  const auto since = idle_since();
  if (!since) return std::nullopt;
  if (Clock::now() < *since + kUnpackedTime) return *since + kUnpackedTime;
  timeline_.release_memory();
  return std::nullopt;
}

// Since when there is nothing to compute: nothing was asked for, or there is nobody to see it.
std::optional<Clock::time_point> Session::idle_since() const {
  std::lock_guard lock(mutex_);
  if (active() && (restoring_ || !unattended())) return std::nullopt;
  return used_;
}

std::optional<Clock::time_point> Session::due_time() {
  std::lock_guard lock(mutex_);
  if (closed_ || journal_.waits() || !active()) return std::nullopt;
  const auto now = Clock::now();
  if (audience_.must_hold(now)) {
    held_ = true;
    return audience_.holds_until(now);
  }
  if (restoring_) return Clock::time_point::min();
  if (unattended()) {
    held_ = true;
    return std::nullopt;
  }
  release();
  const PublishLimit& limit = journal_.limit;
  if (latest() >= limit.frame || !audience_.knows_holders(limit, now))
    return std::nullopt;  // being written
  if (queue_.step_begun()) return Clock::time_point::min();
  return run_->due(latest() + 1, scene_.solver.frame_step);
}

void Session::offer_to_all() {
  std::unique_lock lock(mutex_);
  const auto sinks = audience_.sinks();
  lock.unlock();
  for (const auto& sink : sinks) sink->offer();
}

SessionStatus Session::status() const {
  std::lock_guard lock(mutex_);
  return {state_, audience_.newest(), textiles_, plan_, repairs_, failure_, lateness_};
}

std::vector<NamedSnapshot> Session::snapshots() const {
  std::lock_guard lock(mutex_);
  return journal_.named;
}

void Session::keep_awake() {
  {
    std::lock_guard lock(mutex_);
    looked_at_ = used_ = Clock::now();
    if (!release()) return;
  }
  wake();
}

void Session::submit(Command command) {
  std::optional<Refusal> refusal;
  {
    std::lock_guard lock(mutex_);
    used_ = Clock::now();
    if (closed_)
      refusal = refuse(*closed_);
    else if (!queue_.push(command))
      refusal = refuse(Refusal::Why::kBusy);
  }
  if (refusal) {
    std::visit([&](const auto& refused) { refused.done(*refusal); }, command);
  } else {
    wake();
  }
}

void Session::trim_history() {
  std::lock_guard lock(mutex_);
  audience_.trim(Clock::now());
}

bool Session::evict(std::chrono::duration<double> unused) {
  std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  const bool busy = closed_ || state_ != SessionState::kPaused || !queue_.empty() ||
                    audience_.has_any() || audience_.holds_until(now) || !journal_.idle();
  if (busy || now - used_ < unused) return false;
  closed_ = Refusal::Why::kEvicted;
  return true;
}

void Session::close(Refusal::Why why) {
  std::deque<Command> commands;
  std::deque<CommandQueue::Step> steps;
  Refusal refusal;
  {
    std::lock_guard lock(mutex_);
    if (closed_) return;
    closed_ = why;
    refusal = refuse(why);
    commands = queue_.take_commands();
    steps = queue_.take_steps();
    run_.reset();
  }
  for (const auto& step : steps) step.command.done(refusal);
  for (const auto& command : commands) {
    std::visit([&](const auto& refused) { refused.done(refusal); }, command);
  }
  offer_to_all();
}

std::unique_ptr<Subscription> Session::subscribe(std::weak_ptr<FrameSink> sink,
                                                 std::optional<std::int64_t> start,
                                                 SlowReader policy, bool wants_stats) {
  std::unique_lock lock(mutex_);
  auto subscription = std::make_unique<Subscription>(
      shared_from_this(),
      FrameReader{std::move(sink), start.value_or(latest()), policy, wants_stats});
  audience_.add(subscription->reader_, Clock::now());
  release();
  lock.unlock();
  wake();
  return subscription;
}

void Session::unsubscribe(const FrameReader& reader) {
  {
    std::lock_guard lock(mutex_);
    audience_.remove(reader);
    used_ = Clock::now();
    if (reader.policy != SlowReader::kSkip) looked_at_ = Clock::now();
    release();
  }
  wake();
}

Reading Session::read(FrameReader& reader, bool frame_wanted) {
  Reading reading;
  {
    std::lock_guard lock(mutex_);
    reading.progress = progress();
    if (closed_ == Refusal::Why::kDeleted || closed_ == Refusal::Why::kEvicted) {
      const bool evicted = closed_ == Refusal::Why::kEvicted;
      reading.kind = evicted ? Reading::Kind::kEvicted : Reading::Kind::kDeleted;
      return reading;
    }
    if (!frame_wanted && reader.next <= latest()) return reading;
    auto found = audience_.take_next(reader);
    reading.frame = std::move(found.frame);
    reading.skipped = found.skipped;
    if (reading.frame)
      reading.kind = Reading::Kind::kFrame;
    else if (found.expired)
      reading.kind = Reading::Kind::kExpired;
    else if (state_ == SessionState::kFailed)
      reading.kind = Reading::Kind::kFailed;
    if (!reading.frame || !release()) return reading;
  }
  wake();
  return reading;
}

// Whether the frames to come are all like the last one, without a goal and with nobody to see them.
bool Session::unattended() const {
  return timeline_.simulation.asleep() && audience_.recorders() == 0 && !queue_.step_begun() &&
         !run_->until_frame && Clock::now() > looked_at_ + kAwakeTime;
}

// While it is restored it shows nothing else, but a failure.
void Session::set_state(SessionState state) {
  if (restoring_ && state != SessionState::kFailed) return;
  if (state != state_) ++state_changes_;
  state_ = state;
}

// Ends the wait for somebody; false: there was none.
bool Session::release() {
  if (!std::exchange(held_, false)) return false;
  if (run_) run_->restart(Clock::now(), latest());
  return true;
}

// Last frame that is to be computed as things are.
std::int64_t Session::goal() const {
  constexpr auto kNever = std::numeric_limits<std::int64_t>::max();
  std::int64_t goal = latest();
  if (run_) goal = std::max(goal, run_->until_frame.value_or(kNever));
  if (queue_.step_begun()) goal = std::max(goal, queue_.last_frame());
  return goal;
}

Progress Session::progress() const {
  return {audience_.oldest(),          latest(),     state_,
          audience_.newest()->at_rest, frame_share_, state_changes_};
}

}  // namespace weft
