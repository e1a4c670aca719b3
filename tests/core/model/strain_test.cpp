#include "core/model/strain.h"

#include <gtest/gtest.h>

#include <numbers>

#include "core/model/mesh.h"
#include "tests/support/core/triangle_meshes.h"

namespace weft::testing {
namespace {

// Warp along x, weft along z: both stretched, then sheared by the angle whose sine is 0.1.
std::vector<double> deformed(const SheetShape& shape) {
  SheetDefinition sheet;
  sheet.shape = shape;
  const Matrix3Xd x = start_positions(sheet);
  const auto particles = static_cast<std::size_t>(x.cols());
  std::vector<double> planes(3 * particles);
  for (std::size_t i = 0; i < particles; ++i) {
    const Vector3d at = x.col(static_cast<Eigen::Index>(i));
    planes[i] = 1.02 * at.x() + 0.1 * 1.03 * at.z();
    planes[2 * particles + i] = std::sqrt(0.99) * 1.03 * at.z();
  }
  return planes;
}

TEST(Strain, OfEveryTriangleIsThatOfItsThreads) {
  TriangleMesh turned = triangle_mesh(square(Cut::kIrregular, 0.2, 0.05));
  turned.panels = {{"panel", static_cast<int>(turned.triangles.size()), std::numbers::pi / 2}};
  for (Vector2d& flat : turned.flat) flat = Vector2d(-flat.y(), flat.x());
  for (const SheetShape& shape :
       {SheetShape(Grid{4, 5, 0.05}),
        SheetShape(complete(triangle_mesh(square(Cut::kAlternating, 0.2, 0.05)))),
        SheetShape(complete(turned))}) {
    const std::vector<double> strains = strains_of(deformed(shape), {shape});
    const auto triangles = static_cast<std::size_t>(triangle_count(shape));
    ASSERT_EQ(strains.size(), 3 * triangles);
    for (std::size_t t = 0; t < triangles; ++t) {
      EXPECT_NEAR(strains[t], 0.02, 1e-12);
      EXPECT_NEAR(strains[t + triangles], 0.03, 1e-12);
      EXPECT_NEAR(std::abs(strains[t + 2 * triangles]), 0.1, 1e-12);
    }
  }
}

}  // namespace
}  // namespace weft::testing
