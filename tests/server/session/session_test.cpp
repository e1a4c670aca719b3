#include "server/session/session.h"

#include <gmock/gmock.h>
#include <malloc.h>

#include <cmath>
#include <future>
#include <limits>
#include <memory>
#include <mutex>
#include <thread>

#include "tests/server/session/session_support.h"
#include "tests/support/core/faulty_solver.h"
#include "tests/support/core/scenes.h"
#include "tests/support/core/triangle_meshes.h"

namespace weft::testing {
namespace {

using namespace std::chrono_literals;

Answer set_bend(Session& session, double bend) {
  SetTextile command;
  command.edit = [bend](const Textile& current) {
    Textile edited = current;
    std::get<RawTextile>(edited.model).bend = bend;
    return edited;
  };
  return {session, command};
}

Answer act(Session& session, const Action& action) { return {session, Act{{action}, {}, {}}}; }

TEST(Session, BeginsPausedAtFrame0) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  EXPECT_EQ(session->status().state, SessionState::kPaused);
  EXPECT_EQ(session->status().newest->number, 0);
  EXPECT_NE(session->uid(), make_session(scheduler)->uid());
}

TEST(Session, StepsAsManyFramesAsAskedAndAnswersWhenTheyExist) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  const Applied first = step(*session, 3).applied();
  EXPECT_EQ(first.frame, 1);
  EXPECT_EQ(first.newest, 3);
  const Applied second = step(*session, 2).applied();
  EXPECT_EQ(second.frame, 4);
  EXPECT_EQ(session->status().newest->number, 5);
}

TEST(Session, CarriesOutStepsOneAfterTheOther) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  Answer first = step(*session, 50), second = step(*session, 7);
  EXPECT_EQ(second.applied().frame, 51);
  EXPECT_TRUE(first.is_there());
  EXPECT_EQ(session->status().newest->number, 57);
}

TEST(Session, MakesNothingOfContactUntilSomebodyAsksAFrame) {
  Scheduler scheduler(2);
  Scene scene = hung_scene();
  scene.colliders = {{"ball", Sphere{Vector3d(0.1, -0.2, 0), 0.1}, 0.3, {}}};
  const auto session = make_session(scheduler, scene);
  const auto first = session->status().newest;
  step(*session, 20).applied();
  const auto later = session->status().newest;
  EXPECT_EQ(first->scene, later->scene);
  EXPECT_EQ(later->meter->made(), 0);
  const auto pressures = later->meter->pressures(later->scene, later->positions, later->time);
  EXPECT_EQ(later->meter->made(), 1);
  first->meter->pressures(first->scene, first->positions, first->time);
  EXPECT_EQ(later->meter->made(), 1);

  set_bend(*session, 3e-5).applied();
  step(*session, 1).applied();
  const auto changed = session->status().newest;
  EXPECT_NE(changed->scene, later->scene);
  EXPECT_EQ(later->meter->pressures(later->scene, later->positions, later->time), pressures);
}

TEST(Session, ComputesEnergyAndStrainOnlyWhereAReaderWantsThem) {
  Scheduler scheduler(2);
  const auto shown = make_session(scheduler), measured = make_session(scheduler);
  const auto viewer = Watcher::of(*shown, 0);
  const auto meter = Watcher::of(*measured, 0, SlowReader::kDisconnect, true);
  for (const auto& session : {shown, measured}) {
    step(*session, 10).applied();
    set_bend(*session, 3e-5).applied();
    step(*session, 1).applied();
  }
  const auto one = shown->status().newest, other = measured->status().newest;
  EXPECT_FALSE(one->deformation);
  ASSERT_TRUE(other->deformation);
  EXPECT_EQ(one->meter->made(), 0);
  EXPECT_EQ(deformation_of(*one).potential_energy, other->deformation->potential_energy);
  EXPECT_EQ(deformation_of(*one).largest_strain, other->deformation->largest_strain);
}

// At rest, running without a goal.
std::shared_ptr<Session> sleeping_session(Scheduler& scheduler) {
  const auto session = make_session(scheduler);
  const auto watcher = Watcher::of(*session, {});
  run(*session).applied();
  while (!session->status().newest->at_rest) watcher->read();
  return session;
}

// Whether it makes no frame while another session makes 50.
bool is_idle(Scheduler& scheduler, const Session& session) {
  const std::int64_t frame = session.status().newest->number;
  step(*make_session(scheduler), 50).applied();
  return session.status().newest->number == frame;
}

TEST(Session, AsleepWithoutGoalAndUnattendedTakesNoTurn) {
  Scheduler scheduler(1);
  const auto session = sleeping_session(scheduler);
  while (!is_idle(scheduler, *session)) {
  }
  EXPECT_TRUE(is_idle(scheduler, *session));
  const auto viewer = Watcher::of(*session, {}, SlowReader::kSkip);
  EXPECT_TRUE(is_idle(scheduler, *session)) << "it goes on for one who looks and records nothing";
  EXPECT_EQ(session->status().state, SessionState::kRunning);
}

TEST(Session, WithNothingToDoHoldsAThirdLessThanWhatItsSimulationMovesIn) {
  const auto used = [] {
    const struct mallinfo2 now = mallinfo2();
    return static_cast<double>(now.uordblks + now.hblkhd);
  };
  Scene scene = hung_scene();
  scene.sheets[0].shape = Grid{101, 101, 0.01};
  scene.solver.precision = Precision::kSingle;
  ASSERT_TRUE(Simulation(scene).advance_frame());  // leaves to this thread what threads keep
  const double before_moving = used();
  auto moving = std::make_unique<Simulation>(scene);
  ASSERT_TRUE(moving->advance_frame());
  const double moves_in = used() - before_moving;
  if (moves_in == 0) GTEST_SKIP() << "this allocator does not count";
  moving.reset();

  Scheduler scheduler(1);
  std::weak_ptr<Session> first;
  {
    const auto session = make_session(scheduler, scene);
    step(*session, 1).applied();  // the same for the thread of the scheduler
    first = session;
  }
  while (!first.expired()) std::this_thread::yield();
  std::promise<void> destroyed;  // on that thread, if not on this one
  ASSERT_TRUE(scheduler.post([&] { destroyed.set_value(); }));
  destroyed.get_future().wait();
  const double before = used();
  const auto session = make_session(scheduler, scene);
  step(*session, 1).applied();
  const auto holds = [&] {
    return used() - before - 2 * static_cast<double>(session->status().newest->bytes());
  };
  for (int i = 0; i < 1000 && holds() > 0.67 * moves_in; ++i) std::this_thread::sleep_for(10ms);
  EXPECT_LT(holds(), 0.67 * moves_in);
  EXPECT_GT(holds(), 0.3 * moves_in);
}

// A square metre of 10 000 vertices, in a mesh of its own.
Scene cloth_of_triangles() {
  SheetDefinition sheet;
  sheet.name = "cloth";
  sheet.shape = complete(triangle_mesh(square(Cut::kAlternating, 1, 1.0 / 99)));
  sheet.textile.model = MeasuredTextile{.areal_density = 0.15,
                                        .tensile_warp = 100,
                                        .tensile_weft = 100,
                                        .shear = 10,
                                        .bend_rigidity_warp = 1e-6,
                                        .bend_rigidity_weft = 1e-6,
                                        .air_drag = 0.1};
  sheet.bending = Isometric{};
  sheet.pins = {{{0, 99}, {}}};
  Scene scene = floating(sheet);
  scene.solver.frame_step = 1e-3;
  scene.solver.precision = Precision::kSingle;
  return scene;
}

TEST(Session, OfTrianglesHoldsAtMost200BytesAVertexAndItsFramesWhileIdle) {
  constexpr double kVertices = 10'000;
  const auto used = [] {
    const struct mallinfo2 now = mallinfo2();
    return static_cast<double>(now.uordblks + now.hblkhd);
  };
  Scheduler scheduler(1);
  step(*make_session(scheduler, cloth_of_triangles()), 1).applied();  // what a thread keeps
  std::promise<void> idle;
  ASSERT_TRUE(scheduler.post([&] { idle.set_value(); }));
  idle.get_future().wait();
  std::this_thread::sleep_for(2 * Session::kUnpackedTime);  // until it is gone
  const double before = used();
  const auto session = make_session(scheduler, cloth_of_triangles());
  if (used() == before) GTEST_SKIP() << "this allocator does not count";
  step(*session, 1).applied();
  const auto holds = [&] {
    return (used() - before - 2 * static_cast<double>(session->status().newest->bytes())) /
           kVertices;
  };
  for (int i = 0; i < 1000 && holds() > 200; ++i) std::this_thread::sleep_for(10ms);
  RecordProperty("bytes_a_vertex", std::to_string(holds()));
  EXPECT_LE(holds(), 200);
  EXPECT_GT(holds(), 64) << "what was given: start, flat shape and triangles";
}

TEST(Session, AsleepGoesOnWithItsFirstStream) {
  Scheduler scheduler(1);
  const auto session = sleeping_session(scheduler);
  while (!is_idle(scheduler, *session)) {
  }
  const std::int64_t next = session->status().newest->number + 1;
  const auto watcher = Watcher::of(*session, next);
  EXPECT_EQ(watcher->read().frame->number, next);
}

TEST(Session, AsleepGoesOnAsLongAsSomebodyLooks) {
  Scheduler scheduler(1);
  const auto session = sleeping_session(scheduler);
  while (!is_idle(scheduler, *session)) {
  }
  const std::int64_t frame = session->status().newest->number;
  while (session->status().newest->number < frame + 100) session->keep_awake();
  EXPECT_EQ(session->status().newest->substeps, 0);
}

TEST(Session, AsleepGoesOnWithAnotherTextile) {
  Scheduler scheduler(1);
  const auto session = sleeping_session(scheduler);
  while (!is_idle(scheduler, *session)) {
  }
  const std::int64_t applied = set_bend(*session, 1e-4).applied().frame;
  while (session->status().newest->number < applied) std::this_thread::yield();
  EXPECT_GE(session->status().newest->number, applied);
}

TEST(Session, AsleepWakesWhenItIsTouched) {
  Scheduler scheduler(1);
  const auto session = sleeping_session(scheduler);
  while (!is_idle(scheduler, *session)) {
  }
  const std::int64_t applied =
      act(*session, {.kind = Action::Kind::kGrab, .particle = 7}).applied().frame;
  EXPECT_GT(Watcher::of(*session, applied)->read().frame->substeps, 0);
  EXPECT_EQ(act(*session, {.kind = Action::Kind::kGrab, .particle = 7}).refused(),
            Refusal::Why::kInvalid);
}

TEST(Session, ComputesTheFramesThatTheSolverAloneComputes) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  step(*session, 20).applied();
  const auto newest = session->status().newest;
  Simulation alone(hung_scene());
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(alone.advance_frame());
  std::vector<double> positions(newest->positions.size());
  alone.copy_positions(positions);
  EXPECT_EQ(newest->positions, positions);
}

TEST(Session, RefusesAStepThatExpectsAnotherFrame) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  step(*session, 3).applied();
  StepCommand command;
  command.expected_frame = 2;
  EXPECT_EQ(Answer(*session, command).refused(), Refusal::Why::kStale);
  command.expected_frame = 3;
  EXPECT_EQ(Answer(*session, command).applied().frame, 4);
}

TEST(Session, RunsUntilAFrameAndPausesThere) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  const auto watcher = Watcher::of(*session, 0);
  EXPECT_EQ(run(*session, 40).applied().frame, 1);
  watcher->wait_for_frame(40);
  EXPECT_EQ(session->status().state, SessionState::kPaused);
  EXPECT_EQ(session->status().newest->number, 40);
  EXPECT_EQ(run(*session, 40).refused(), Refusal::Why::kNotAhead);
}

TEST(Session, RunsUntilRestAndPausesThere) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  const auto watcher = Watcher::of(*session, 0);
  RunCommand command;
  command.until_rest = true;
  Answer(*session, command).applied();
  watcher->wait_for_state(SessionState::kPaused);
  EXPECT_TRUE(session->status().newest->at_rest);
}

TEST(Session, RunsUntilItIsPaused) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  const auto watcher = Watcher::of(*session, 0);
  run(*session).applied();
  watcher->wait_for_frame(10);
  EXPECT_EQ(step(*session, 1).refused(), Refusal::Why::kRunning);
  const Applied paused = pause(*session).applied();
  EXPECT_EQ(paused.frame, paused.newest + 1);
  EXPECT_EQ(session->status().state, SessionState::kPaused);
  EXPECT_EQ(session->status().newest->number, paused.newest) << "it went on";
}

TEST(Session, RunsNoFasterThanItsPace) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  const auto watcher = Watcher::of(*session, 0);
  const auto begin = Clock::now();
  RunCommand command;
  command.time_scale = 2;
  command.until_frame = 12;
  Answer(*session, command).applied();
  watcher->wait_for_frame(12);
  EXPECT_GE(Clock::now() - begin, 100ms) << "12 frames of 1/60 s at double speed take 0.1 s";
}

TEST(Session, APacedSessionAnswersCallsBetweenItsFrames) {
  Scheduler scheduler(1);
  const auto session = make_session(scheduler);
  RunCommand command;
  command.time_scale = 1e-3;  // a frame in 17 s
  Answer(*session, command).applied();
  EXPECT_EQ(set_bend(*session, 2e-5).applied().frame, 1);
  EXPECT_EQ(pause(*session).applied().frame, 1);
}

TEST(Session, ChangesATextileFromTheNextFrameOn) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  step(*session, 5).applied();
  EXPECT_EQ(set_bend(*session, 1e-3).applied().frame, 6);
  step(*session, 5).applied();
  const auto newest = session->status().newest;
  EXPECT_EQ(std::get<RawTextile>(session->status().textiles[0].model).bend, 1e-3);

  Simulation alone(hung_scene());
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(alone.advance_frame());
  Textile textile = alone.scene().sheets[0].textile;
  std::get<RawTextile>(textile.model).bend = 1e-3;
  ASSERT_FALSE(alone.set_textile(0, textile));
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(alone.advance_frame());
  std::vector<double> positions(newest->positions.size());
  alone.copy_positions(positions);
  EXPECT_EQ(newest->positions, positions);
}

TEST(Session, ShowsATextileThatChangesOverTimeAsItIs) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  const auto bend = [&] { return std::get<RawTextile>(session->status().textiles[0].model).bend; };
  SetTextile command;
  command.edit = [](Textile textile) {
    std::get<RawTextile>(textile.model).bend *= 3;
    return textile;
  };
  command.duration = 4.0 / 60;
  EXPECT_EQ(Answer(*session, command).applied().frame, 1);
  EXPECT_DOUBLE_EQ(bend(), 1e-5);
  step(*session, 2).applied();
  EXPECT_DOUBLE_EQ(bend(), 2e-5);
  command.duration = 0;
  EXPECT_DOUBLE_EQ(std::get<RawTextile>(Answer(*session, command).applied().textile.model).bend,
                   9e-5)
      << "an edit begins with what the textile changes to";
  EXPECT_DOUBLE_EQ(bend(), 9e-5);
}

TEST(Session, AnEditThatFindsProblemsChangesNothing) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  SetTextile command;
  command.edit = [](const Textile&) { return std::vector<Problem>{{"raw", "bad"}}; };
  const Outcome outcome = Answer(*session, command).outcome();
  ASSERT_TRUE(std::holds_alternative<Refusal>(outcome));
  EXPECT_EQ(std::get<Refusal>(outcome).problems.size(), 1u);
  EXPECT_EQ(std::get<RawTextile>(session->status().textiles[0].model).bend, 1e-5);
}

TEST(Session, PausingInterruptsAStep) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  const auto watcher = Watcher::of(*session, 0);
  Answer endless = step(*session, 1'000'000'000);
  watcher->wait_for_frame(5);
  pause(*session).applied();
  EXPECT_EQ(endless.refused(), Refusal::Why::kInterrupted);
}

TEST(Session, AStepEndsWithItsCaller) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  const auto watcher = Watcher::of(*session, 0);
  std::stop_source caller;
  StepCommand command;
  command.frames = 1'000'000'000;
  command.cancelled = caller.get_token();
  Answer endless(*session, command);
  watcher->wait_for_frame(5);
  caller.request_stop();
  session->wake();
  EXPECT_EQ(endless.refused(), Refusal::Why::kCancelled);
  EXPECT_GT(step(*session, 1).applied().frame, 5) << "the session is fine";
}

// A frame of it takes minutes.
Scene endless_scene() {
  Scene scene = hung_scene();
  scene.sheets[0].shape = Grid{30, 30, 0.05};
  scene.solver.plain = true;
  scene.solver.frame_step *= 900'000 / static_cast<double>(Simulation(scene).plan().step.substeps);
  return scene;
}

void wait_for_part_of_a_frame(const Watcher& watcher) {
  while (watcher.subscription().progress().frame_share == 0) std::this_thread::sleep_for(1ms);
}

TEST(Session, PausingDropsAFrameThatTakesLong) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler, endless_scene());
  const auto watcher = Watcher::of(*session, 0);
  const auto expect_dropped = [&] {
    wait_for_part_of_a_frame(*watcher);
    EXPECT_EQ(pause(*session).applied().newest, 0);
    EXPECT_EQ(watcher->subscription().progress().frame_share, 0);
  };
  Answer stepping = step(*session, 2);
  expect_dropped();
  EXPECT_EQ(stepping.refused(), Refusal::Why::kInterrupted);
  run(*session).applied();
  expect_dropped();
}

TEST(Session, AStepWhoseCallerGoesAwayDropsAFrameThatTakesLong) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler, endless_scene());
  const auto watcher = Watcher::of(*session, 0);
  std::stop_source caller;
  Answer stepping(*session, StepCommand{1, {}, caller.get_token(), {}, {}});
  wait_for_part_of_a_frame(*watcher);
  caller.request_stop();
  session->wake();
  EXPECT_EQ(stepping.refused(), Refusal::Why::kCancelled);
}

TEST(Session, WithAFrameThatTakesLongLeavesTheirTurnsToOthersAndEndsAtOnce) {
  Scheduler scheduler(1);
  const auto session = make_session(scheduler, endless_scene());
  run(*session).applied();
  std::vector<std::shared_ptr<Session>> others;
  std::vector<Answer> answers;
  for (int i = 0; i < 20; ++i) {
    others.push_back(make_session(scheduler));
    answers.push_back(step(*others.back(), 50));
  }
  for (Answer& each : answers) EXPECT_EQ(each.applied().newest, 50);
  Answer change = set_bend(*session, 1e-4);
  session->close(Refusal::Why::kDeleted);
  EXPECT_EQ(change.refused(), Refusal::Why::kDeleted);
}

TEST(Session, FramesThatTakeLongAreTheSolversWhateverIsAskedMeanwhile) {
  Scheduler scheduler(2);
  Scene scene = hung_scene();
  scene.solver.plain = true;
  scene.solver.frame_step *= 3000;
  Simulation alone(scene);
  const auto session = make_session(scheduler, scene);
  const auto watcher = Watcher::of(*session, 0);
  watcher->read();
  run(*session).applied();
  wait_for_part_of_a_frame(*watcher);
  pause(*session).applied();
  for (int i = 0; i < 3; ++i) {
    run(*session).applied();
    wait_for_part_of_a_frame(*watcher);
    pause(*session).applied();
  }
  Answer stepping = step(*session, 2);
  wait_for_part_of_a_frame(*watcher);
  const std::int64_t changed = set_bend(*session, 1e-4).applied().frame;
  stepping.applied();
  const std::int64_t last = session->status().newest->number;
  for (std::int64_t number = 1; number <= last; ++number) {
    if (number == changed) {
      Textile textile = alone.scene().sheets[0].textile;
      std::get<RawTextile>(textile.model).bend = 1e-4;
      ASSERT_FALSE(alone.set_textile(0, textile));
    }
    ASSERT_TRUE(alone.advance_frame());
    const auto frame = watcher->read().frame;
    ASSERT_TRUE(frame);
    std::vector<double> expected(frame->positions.size());
    alone.copy_positions(expected);
    EXPECT_EQ(frame->positions, expected) << number;
    EXPECT_EQ(frame->substeps, alone.substeps());
  }
  EXPECT_LE(changed, last);
}

TEST(Session, ASolverThatDivergesFailsTheSessionAndItsGoodFramesStay) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler, diverging_scene());
  EXPECT_EQ(step(*session, 100'000).refused(), Refusal::Why::kFailed);
  const SessionStatus status = session->status();
  EXPECT_EQ(status.state, SessionState::kFailed);
  EXPECT_THAT(status.failure,
              ::testing::HasSubstr("frame " + std::to_string(status.newest->number + 1)));
  for (const double value : status.newest->positions) ASSERT_TRUE(std::isfinite(value));
  EXPECT_EQ(run(*session).refused(), Refusal::Why::kFailed);
  EXPECT_EQ(step(*session, 1).refused(), Refusal::Why::kFailed);
  EXPECT_EQ(set_bend(*session, 1e-4).refused(), Refusal::Why::kFailed);
}

// Frames 1 to `last` as a subscriber reads them; none holds a value that is not finite.
std::vector<std::shared_ptr<const Frame>> finite_frames(Watcher& watcher, std::int64_t last) {
  std::vector<std::shared_ptr<const Frame>> frames;
  do {
    frames.push_back(watcher.read().frame);
    const Frame& frame = *frames.back();
    for (const double value : frame.positions) EXPECT_TRUE(std::isfinite(value));
    for (const double value : frame.velocities) EXPECT_TRUE(std::isfinite(value));
    const Deformation deformation = deformation_of(frame);
    EXPECT_TRUE(std::isfinite(frame.kinetic_energy + deformation.potential_energy +
                              deformation.largest_strain));
  } while (frames.back()->number < last);
  return frames;
}

TEST(Session, RepairsAFaultInTheMiddleOfARunAndTellsOfIt) {
  Scheduler scheduler(2);
  std::mutex mutex;
  std::vector<std::string> lines;
  const auto session = std::make_shared<Session>(
      make_identity("test", "test"),
      Simulation(hung_scene(),
                 faulty_solvers(
                     {.frame = 7, .times = 2, .jump = std::numeric_limits<double>::quiet_NaN()})),
      SessionHost{scheduler, stats(), history_for(kMuchHistory),
                  [&](const std::string& line) {
                    std::lock_guard lock(mutex);
                    lines.push_back(line);
                  }},
      std::make_unique<NoLog>());
  const std::int64_t planned = session->status().plan->step.substeps;
  const auto watcher = Watcher::of(*session, 1);
  step(*session, 20).applied();
  for (const auto& frame : finite_frames(*watcher, 20)) {
    EXPECT_EQ(frame->repairs.size(), frame->number == 7 ? 2u : 0u);
    EXPECT_EQ(frame->substeps, frame->number < 7 ? planned : 4 * planned);
  }
  const SessionStatus status = session->status();
  EXPECT_EQ(status.state, SessionState::kPaused);
  ASSERT_EQ(status.repairs.size(), 2u);
  EXPECT_EQ(status.repairs[1].frame, 7);
  EXPECT_EQ(status.plan->step.substeps, 4 * planned);
  std::lock_guard lock(mutex);
  EXPECT_THAT(lines, ::testing::ElementsAre(::testing::HasSubstr("frame 7"),
                                            ::testing::HasSubstr("stopped being finite")));
}

TEST(Session, FailsWhenRepairsAreUsedUpWithItsLastGoodFrameReadable) {
  Scheduler scheduler(2);
  Scene scene = hung_scene();
  scene.solver.max_repairs = 8;
  const auto session = std::make_shared<Session>(
      make_identity("test", "test"),
      Simulation(scene, faulty_solvers({.frame = 7, .times = 1000, .jump = 1e300})),
      SessionHost{scheduler, stats(), history_for(kMuchHistory)}, std::make_unique<NoLog>());
  const auto watcher = Watcher::of(*session, 1);
  EXPECT_EQ(step(*session, 20).refused(), Refusal::Why::kFailed);
  const SessionStatus status = session->status();
  EXPECT_EQ(status.state, SessionState::kFailed);
  EXPECT_EQ(status.newest->number, 6);
  EXPECT_EQ(status.repairs.size(), 8u);
  EXPECT_THAT(status.failure, ::testing::HasSubstr("frame 7"));
  EXPECT_THAT(status.failure, ::testing::HasSubstr("after 8 halvings"));
  finite_frames(*watcher, 6);
  EXPECT_EQ(watcher->read().kind, Reading::Kind::kFailed);
}

TEST(Session, ClosingAnswersEveryCommandThatWaits) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  const auto watcher = Watcher::of(*session, 0);
  Answer endless = step(*session, 1'000'000'000), waiting = step(*session, 1);
  watcher->wait_for_frame(3);
  session->close(Refusal::Why::kDeleted);
  EXPECT_EQ(endless.refused(), Refusal::Why::kDeleted);
  EXPECT_EQ(waiting.refused(), Refusal::Why::kDeleted);
  EXPECT_EQ(step(*session, 1).refused(), Refusal::Why::kDeleted);
}

TEST(Session, RefusesCommandsWhenTooManyWait) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  constexpr std::size_t kBeingMoved = 1;  // neither waiting nor begun
  std::vector<Answer> accepted;
  std::optional<Answer> refused;
  while (!refused && accepted.size() <= CommandQueue::kMost + kBeingMoved) {
    Answer answer = step(*session, 1'000'000'000);
    if (answer.is_there()) {
      refused = answer;
    } else {
      accepted.push_back(answer);
    }
  }
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->refused(), Refusal::Why::kBusy);
  EXPECT_GE(accepted.size(), CommandQueue::kMost);
  act(*session, {.kind = Action::Kind::kLetGo, .hand = session->new_hand()}).applied();
  session->close(Refusal::Why::kDeleted);
  EXPECT_EQ(accepted.front().refused(), Refusal::Why::kDeleted);
}

TEST(Session, TakesCallsFromManyThreadsAtOnce) {
  Scheduler scheduler(2);
  const auto session = make_session(scheduler);
  constexpr int kThreads = 8, kCalls = 20;
  std::vector<std::jthread> callers;
  for (int i = 0; i < kThreads; ++i) {
    callers.emplace_back([&] {
      for (int k = 0; k < kCalls; ++k) {
        step(*session, 1).applied();
        set_bend(*session, 1e-5 * (1 + k)).applied();
      }
    });
  }
  callers.clear();
  EXPECT_EQ(session->status().newest->number, kThreads * kCalls);
}

}  // namespace
}  // namespace weft::testing
