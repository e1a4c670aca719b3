#include "server/session/baked_bodies.h"

#include <gmock/gmock.h>

#include <atomic>
#include <future>
#include <stdexcept>
#include <vector>

#include "tests/support/core/bodies.h"

namespace weft::testing {
namespace {

class BakedBodiesTest : public ::testing::Test {
 protected:
  // A ball of that radius, m, in cells of that edge, m.
  MadeBody get(BakedBodies& bodies, double radius, double cell = 0.02) {
    const std::string key = std::to_string(radius) + ' ' + std::to_string(cell);
    return bodies.get(key, [&] {
      ++baked_;
      return make_body(ball_mesh(radius, 2), {.cell = cell, .reach = 1e-3}, "mesh");
    });
  }

  std::atomic<int> baked_ = 0;
};

TEST_F(BakedBodiesTest, AreBakedOnceThoughNobodyHasThemMeanwhile) {
  BakedBodies bodies(1 << 30);
  EXPECT_EQ(get(bodies, 0.1).body->grid.cell, 0.02);
  EXPECT_TRUE(get(bodies, 0.1).body);
  EXPECT_EQ(baked_, 1);
}

TEST_F(BakedBodiesTest, WithAnotherMeshOrOtherCellsAreOthers) {
  BakedBodies bodies(1 << 30);
  const MadeBody one = get(bodies, 0.1), larger = get(bodies, 0.11), finer = get(bodies, 0.1, 0.01);
  EXPECT_EQ(baked_, 3);
  EXPECT_LT(one.body->thickness, larger.body->thickness);
  EXPECT_EQ(finer.body->grid.cell, 0.01);
  EXPECT_EQ(get(bodies, 0.1).body, one.body);
}

TEST_F(BakedBodiesTest, LeaveAtTheBoundInTheOrderInWhichTheyWereLastAskedFor) {
  std::size_t size = 0;
  {
    BakedBodies bodies(1 << 30);
    get(bodies, 0.1);
    size = bodies.kept_bytes();
  }
  EXPECT_GT(size, 10'000u);
  BakedBodies bodies(2 * size + size / 2);
  get(bodies, 0.1);
  get(bodies, 0.1001);
  get(bodies, 0.1);
  baked_ = 0;
  get(bodies, 0.1002);
  EXPECT_LE(bodies.kept_bytes(), 2 * size + size / 2);
  get(bodies, 0.1);
  EXPECT_EQ(baked_, 1);
  get(bodies, 0.1001);
  EXPECT_EQ(baked_, 2);
}

TEST_F(BakedBodiesTest, BeyondTheBoundAreSharedWhileOneIsThere) {
  BakedBodies bodies(0);
  {
    const MadeBody one = get(bodies, 0.1);
    EXPECT_EQ(get(bodies, 0.1).body, one.body);
    EXPECT_EQ(bodies.kept_bytes(), 0u);
  }
  EXPECT_EQ(baked_, 1);
  get(bodies, 0.1);
  EXPECT_EQ(baked_, 2);
}

TEST_F(BakedBodiesTest, AskedForAtOnceAreBakedOnce) {
  BakedBodies bodies(1 << 30);
  std::vector<std::future<std::shared_ptr<const Body>>> asked;
  for (int i = 0; i < 8; ++i)
    asked.push_back(std::async(std::launch::async,
                               [&, i] { return get(bodies, i % 2 == 0 ? 0.1 : 0.12).body; }));
  std::vector<std::shared_ptr<const Body>> got;
  for (auto& each : asked) got.push_back(each.get());
  EXPECT_EQ(baked_, 2);
  for (std::size_t i = 2; i < got.size(); ++i) EXPECT_EQ(got[i], got[i - 2]);
}

TEST_F(BakedBodiesTest, ThatFailAreTriedAgain) {
  BakedBodies bodies(1 << 30);
  const auto fail = []() -> MadeBody { return {nullptr, {{"mesh.triangles", "is open"}}}; };
  EXPECT_EQ(bodies.get("key", fail).problems.size(), 1u);
  const auto run_out = []() -> MadeBody { throw std::runtime_error("memory"); };
  EXPECT_THROW(bodies.get("key", run_out), std::runtime_error);
  EXPECT_TRUE(
      bodies.get("key", [] { return make_body(ball_mesh(0.1, 1), {.reach = 1e-3}, "mesh"); }).body);
}

}  // namespace
}  // namespace weft::testing
