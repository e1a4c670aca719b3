#include <gmock/gmock.h>

#include <memory>

#include "server/convert/mesh.h"
#include "tests/support/service/assets.h"

namespace weft::testing {
namespace {

SharedBody body_of(const v1::MeshData& mesh, double cell, double reach = 1e-3) {
  return std::get<ConvertedBody>(to_body(mesh, cell, reach, "mesh")).body;
}

TEST(SharedBodies, AreThoseOfTheSameMeshAndCellsThoughTheFirstSceneHasGone) {
  const v1::MeshData cube = cube_mesh(0.2F, 0.1F, -0.3F, 0.1F);
  const std::weak_ptr<const Body> first = body_of(cube, 0.02);
  ASSERT_FALSE(first.expired());
  EXPECT_EQ(body_of(cube, 0.02), first.lock());
  EXPECT_EQ(body_of(cube, 0.01)->grid.cell, 0.01);
  EXPECT_EQ(body_of(cube, 0.02, 4e-3)->grid.reach, 4e-3);
  const auto moved = body_of(cube_mesh(0.21F, 0.1F, -0.3F, 0.1F), 0.02);
  EXPECT_NE(moved->mesh.vertices, first.lock()->mesh.vertices);
}

}  // namespace
}  // namespace weft::testing
