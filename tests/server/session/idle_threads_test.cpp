#include "server/session/idle_threads.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "tests/server/session/session_support.h"
#include "tests/support/core/scenes.h"
#include "tests/support/core/triangle_meshes.h"

namespace weft::testing {
namespace {

using namespace std::chrono_literals;

// With every thread of the scheduler in it.
std::unique_ptr<IdleThreads> all_threads(Scheduler& scheduler, int threads) {
  for (auto patience = 1ms;; patience = std::min(2 * patience, 64ms)) {
    // its threads may be busy, or slow to come
    auto pool = std::make_unique<IdleThreads>(scheduler, threads);
    const auto end = Clock::now() + patience;
    while (Clock::now() < end) {
      if (pool->threads() == threads) return pool;
      std::this_thread::yield();
    }
    pool.reset();
    std::this_thread::sleep_for(patience);  // while they leave it: no new one gets them before
  }
}

TEST(IdleThreads, RunsEveryPartOnce) {
  Scheduler scheduler(2);
  const auto pool = all_threads(scheduler, 3);
  for (int round = 0; round < 100; ++round) {
    std::vector<int> runs(8);
    pool->run(8, [&](int part) { ++runs[static_cast<std::size_t>(part)]; });
    ASSERT_THAT(runs, ::testing::Each(1)) << round;
  }
}

TEST(IdleThreads, TakesNoThreadThatHasSomethingToDo) {
  std::promise<void> begun, end;
  Scheduler scheduler(1);
  ASSERT_TRUE(scheduler.post([&] {
    begun.set_value();
    end.get_future().wait();
  }));
  begun.get_future().wait();
  EXPECT_FALSE(scheduler.help([] {}));
  end.set_value();
}

TEST(IdleThreads, LeavesWhenSomethingElseWaits) {
  std::promise<void> done;
  Scheduler scheduler(1);
  const auto pool = all_threads(scheduler, 2);
  ASSERT_TRUE(scheduler.post([&] { done.set_value(); }));
  done.get_future().wait();
  EXPECT_EQ(pool->threads(), 1);
}

// Waits for a time, once.
class Waits : public Task {
 public:
  explicit Waits(std::promise<void>& done) : done_(done) {}
  std::optional<Clock::time_point> run_slice() override {
    if (!due_) return due_ = Clock::now() + 50ms;
    if (Clock::now() < *due_) return due_;
    done_.set_value();
    return std::nullopt;
  }

 private:
  std::promise<void>& done_;
  std::optional<Clock::time_point> due_;
};

TEST(IdleThreads, LeavesForATaskWhoseTimeHasCome) {
  std::promise<void> done;
  Scheduler scheduler(1);
  scheduler.wake(std::make_shared<Waits>(done));
  const auto pool = all_threads(scheduler, 2);
  done.get_future().wait();
}

void expect_same_frames_by_many_threads(const Scene& scene) {
  Simulation alone(scene);
  ASSERT_GT(alone.most_threads(), 1);

  Scheduler scheduler(3);
  const auto session = make_session(scheduler, scene);
  const auto watcher = Watcher::of(*session, 1);
  step(*session, 4).applied();
  for (int frame = 1; frame <= 4; ++frame) {
    ASSERT_TRUE(alone.advance_frame());
    std::vector<double> expected(3 * static_cast<std::size_t>(alone.particle_count()));
    alone.copy_positions(expected);
    EXPECT_EQ(watcher->read().frame->positions, expected) << frame;
  }
}

// Parts of a step write beside each other, in contact as well.
Scene hung_over_ball(SheetDefinition sheet) {
  sheet.pins = {{{0, 129}, {}}};
  Scene scene = floating(sheet);
  scene.environment.gravity = {0, -9.8, 0};
  scene.solver.frame_step = 2e-4;
  const Vector3d middle = start_positions(sheet).rowwise().mean();
  scene.colliders = {{"ball", Sphere{middle - Vector3d(0, 0.1, 0), 0.1}, 0.3, {}}};
  return scene;
}

TEST(IdleThreads, DoNotChangeTheFramesOfALargeGrid) {
  expect_same_frames_by_many_threads(hung_over_ball(flat_sheet(64, 130)));
}

TEST(IdleThreads, DoNotChangeTheFramesOfManyTriangles) {
  SheetDefinition sheet = flat_sheet(2, 2);
  sheet.shape = complete(triangle_mesh(square(Cut::kAlternating, 1, 1.0 / 90)));
  sheet.textile.model = light_textile(0.15);
  sheet.bending = Isometric{};
  expect_same_frames_by_many_threads(hung_over_ball(sheet));
}

// They pass through each other along a line.
TEST(IdleThreads, DoNotChangeTheFramesOfSheetsInContact) {
  SheetDefinition below = flat_sheet(2, 2);
  below.name = "below";
  below.shape = complete(triangle_mesh(square(Cut::kAlternating, 1, 1.0 / 45)));
  below.textile.model = light_textile(0.15);
  below.bending = Isometric{};
  SheetDefinition above = below;
  above.name = "above";
  above.origin.y() += 0.01;
  above.rotation = Eigen::AngleAxisd(-0.02, Vector3d::UnitZ());
  Scene scene = floating(below);
  scene.sheets.push_back(above);
  scene.cloth_contact = true;
  scene.untangle = 1;
  scene.solver.frame_step = 2e-4;
  EXPECT_GT(Simulation(scene).cloth_cuts(), 0);
  expect_same_frames_by_many_threads(scene);
}

}  // namespace
}  // namespace weft::testing
