#include "tests/server/session/session_support.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <utility>

namespace weft::testing {
namespace {

constexpr std::chrono::seconds kPatience{60};  // then a test has failed

}  // namespace

Scene hung_scene() {
  SheetDefinition sheet;
  sheet.name = "sheet";
  sheet.shape = Grid{4, 5, 0.05};
  sheet.textile.model = RawTextile{.particle_mass = 1e-3,
                                   .stretch = 200,
                                   .shear = 200,
                                   .bend = 1e-5,
                                   .clamp = {},
                                   .air_drag = 1e-2};
  sheet.pins = {{{0, 4}, {}}};
  Scene scene;
  scene.sheets = {sheet};
  return scene;
}

Scene diverging_scene() {
  Scene scene = hung_scene();
  scene.solver.frame_step = 1;
  scene.solver.substep = 0.05;
  scene.solver.allow_unstable = true;
  scene.solver.max_repairs = 0;
  return scene;
}

Stats& stats() {
  static Stats all;
  return all;
}

std::shared_ptr<HistoryBudget> history_for(std::size_t bytes) {
  return std::make_shared<HistoryBudget>(bytes, bytes);
}

std::shared_ptr<Session> make_session(Scheduler& scheduler, const Scene& scene,
                                      std::size_t history_bytes, const std::string& id) {
  return std::make_shared<Session>(make_identity(id, "test"), Simulation(scene),
                                   SessionHost{scheduler, stats(), history_for(history_bytes)},
                                   std::make_unique<NoLog>());
}

std::size_t history_of(std::size_t frames) {
  Scheduler scheduler(1);
  return frames * make_session(scheduler)->status().newest->bytes();
}

Answer::Answer(Session& session, Command command) {
  const auto done = [shared = shared_](const Outcome& outcome) {
    std::lock_guard lock(shared->mutex);
    EXPECT_FALSE(shared->outcome) << "answered twice";
    shared->outcome.emplace(outcome);
    shared->changed.notify_all();
  };
  std::visit([&](auto& each) { each.done = done; }, command);
  session.submit(std::move(command));
}

Outcome Answer::outcome() {
  std::unique_lock lock(shared_->mutex);
  const auto there = [&] { return shared_->outcome.has_value(); };
  if (!shared_->changed.wait_for(lock, kPatience, there)) {
    throw std::runtime_error("no answer came");
  }
  return *shared_->outcome;
}

Applied Answer::applied() {
  const Outcome got = outcome();
  if (const auto* refusal = std::get_if<Refusal>(&got)) {
    throw std::runtime_error("refused: " + std::to_string(static_cast<int>(refusal->why)));
  }
  return std::get<Applied>(got);
}

Refusal::Why Answer::refused() { return std::get<Refusal>(outcome()).why; }

bool Answer::is_there() const {
  std::lock_guard lock(shared_->mutex);
  return shared_->outcome.has_value();
}

Answer step(Session& session, std::int64_t frames) {
  return {session,
          StepCommand{
              .frames = frames, .expected_frame = {}, .cancelled = {}, .request = {}, .done = {}}};
}

Answer run(Session& session, std::optional<std::int64_t> until_frame) {
  RunCommand command;
  command.until_frame = until_frame;
  return {session, command};
}

Answer pause(Session& session) { return {session, PauseCommand{}}; }

std::shared_ptr<Watcher> Watcher::of(Session& session, std::optional<std::int64_t> start,
                                     SlowReader policy, bool wants_stats) {
  auto watcher = std::make_shared<Watcher>();
  watcher->subscription_ = session.subscribe(watcher, start, policy, wants_stats);
  return watcher;
}

void Watcher::offer() {
  std::lock_guard lock(mutex_);
  ++offers_;
  changed_.notify_all();
}

// Looks again whenever something was offered since it looked last.
void Watcher::wait_until(const std::function<bool()>& met) {
  for (;;) {
    std::unique_lock lock(mutex_);
    const std::uint64_t seen = offers_;
    lock.unlock();
    if (met()) return;
    lock.lock();
    if (!changed_.wait_for(lock, kPatience, [&] { return offers_ != seen; })) {
      ADD_FAILURE() << "nothing came";
      return;
    }
  }
}

Reading Watcher::read() {
  Reading reading;
  wait_until([&] {
    reading = subscription_->read();
    return reading.kind != Reading::Kind::kNothingYet;
  });
  return reading;
}

void Watcher::wait_for_frame(std::int64_t frame) {
  wait_until([&] { return subscription_->progress().latest_frame >= frame; });
}

void Watcher::wait_for_state(SessionState state) {
  wait_until([&] { return subscription_->progress().state == state; });
}

void Watcher::leave() { subscription_.reset(); }

}  // namespace weft::testing
