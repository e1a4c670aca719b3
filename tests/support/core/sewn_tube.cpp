#include "tests/support/core/sewn_tube.h"

#include <gtest/gtest.h>

#include <array>
#include <utility>
#include <vector>

#include "tests/support/core/scenes.h"

namespace weft::testing {

TriangleMesh sewn_tube() {
  constexpr double kPanelHeight = 0.1;   // m
  constexpr double kPanelsApart = 0.08;  // of a panel from the middle, m
  TriangleMesh mesh;
  const auto particle = [](int side, int row, int column) {
    if (column == 0 || column == kTubeColumns) side = 0;
    const int inner = (kTubeRows + 1) * (kTubeColumns + 1);
    return side == 0 ? row * (kTubeColumns + 1) + column
                     : inner + row * (kTubeColumns - 1) + column - 1;
  };
  mesh.start.resize(static_cast<std::size_t>((kTubeRows + 1) * 2 * kTubeColumns));
  for (int side = 0; side < 2; ++side) {
    const int first = static_cast<int>(mesh.flat.size());
    for (int row = 0; row <= kTubeRows; ++row)
      for (int column = 0; column <= kTubeColumns; ++column) {
        const double u = kPanelWidth * column / kTubeColumns, v = kPanelHeight * row / kTubeRows;
        const bool sewn = column == 0 || column == kTubeColumns;
        mesh.start[static_cast<std::size_t>(particle(side, row, column))] =
            Vector3d(u - kPanelWidth / 2, v,
                     sewn        ? 0
                     : side == 0 ? kPanelsApart
                                 : -kPanelsApart);
        mesh.flat.emplace_back(side == 0 ? u : 1 - u, v);
      }
    for (int row = 0; row < kTubeRows; ++row)
      for (int column = 0; column < kTubeColumns; ++column)
        for (const bool upper : {false, true}) {
          const auto corner = [&](int r, int c) { return std::pair(row + r, column + c); };
          std::array corners = upper ? std::array{corner(0, 0), corner(1, 1), corner(1, 0)}
                                     : std::array{corner(0, 0), corner(0, 1), corner(1, 1)};
          if (side == 1) std::swap(corners[1], corners[2]);
          auto& triangle = mesh.triangles.emplace_back();
          auto& flat = mesh.flat_triangles.emplace_back();
          for (std::size_t k = 0; k < 3; ++k) {
            triangle[k] = particle(side, corners[k].first, corners[k].second);
            flat[k] = first + corners[k].first * (kTubeColumns + 1) + corners[k].second;
          }
        }
    mesh.panels.push_back({side == 0 ? "front" : "back", 2 * kTubeRows * kTubeColumns, 0});
  }
  return mesh;
}

Scene around_pole(double radius) {
  SheetDefinition sheet;
  sheet.name = "tube";
  sheet.shape = complete(sewn_tube());
  sheet.textile.model = MeasuredTextile{.areal_density = 0.15,
                                        .tensile_warp = 200,
                                        .tensile_weft = 200,
                                        .shear = 20,
                                        .bend_rigidity_warp = 1e-5,
                                        .bend_rigidity_weft = 1e-5};
  sheet.textile.friction = 0;
  sheet.bending = Isometric{};
  sheet.skin = 0.001;
  Scene scene;
  scene.sheets = {sheet};
  scene.colliders = {{"pole", Capsule{Vector3d(0, -1, 0), Vector3d(0, 1, 0), radius}, 0, {}}};
  scene.dressing.emplace();
  return scene;
}

void dress(Simulation& simulation, int frames) {
  for (int i = 0; i < frames; ++i) ASSERT_TRUE(simulation.advance_frame()) << simulation.failure();
}

double girth(const Simulation& simulation, int row) {
  const Matrix3Xd x = positions(simulation);
  const int inner = (kTubeRows + 1) * (kTubeColumns + 1);
  std::vector<int> ring;
  for (int c = 0; c <= kTubeColumns; ++c) ring.push_back(row * (kTubeColumns + 1) + c);
  for (int c = kTubeColumns - 1; c > 0; --c)
    ring.push_back(inner + row * (kTubeColumns - 1) + c - 1);
  double sum = 0;
  for (std::size_t k = 0; k < ring.size(); ++k)
    sum += (x.col(ring[k]) - x.col(ring[(k + 1) % ring.size()])).norm();
  return sum;
}

}  // namespace weft::testing
