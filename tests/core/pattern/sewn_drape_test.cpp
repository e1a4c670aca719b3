#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "core/pattern/garment.h"
#include "core/simulation.h"
#include "core/triangles/triangles.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

using std::numbers::pi;

PatternEdge straight(double u, double v, const char* label = "") {
  return {.points = {{u, v}}, .label = label};
}

// With the middle of its lower edge at (0, low). The edges: lower, right, upper, left.
PatternPanel trapezoid_panel(const std::string& name, double low, double lower, double height,
                             double upper) {
  PatternPanel panel;
  panel.name = name;
  panel.edges = {straight(lower / 2, low), straight(upper / 2, low + height),
                 straight(-upper / 2, low + height), straight(-lower / 2, low)};
  return panel;
}

// That panel, and one like it behind, as far away on the other side.
void add_both(Pattern& pattern, PatternPanel panel, double away) {
  const std::string name = panel.name;
  panel.name = name + "-front";
  panel.origin.z() = away;
  pattern.panels.push_back(panel);
  panel.name = name + "-back";
  panel.origin.z() = -away;
  panel.rotation = Eigen::AngleAxisd(pi, Vector3d::UnitY());
  pattern.panels.push_back(panel);
  for (const auto& [front, back] : {std::pair(1, 3), std::pair(3, 1)})
    pattern.seams.push_back({{{name + "-front", front}}, {{name + "-back", back}}});
}

Garment sewn(const Pattern& pattern, double edge) {
  auto result = build_garment(pattern, edge, "pattern", "edge_m");
  if (auto* garment = std::get_if<Garment>(&result)) return std::move(*garment);
  ADD_FAILURE() << std::get<std::vector<Problem>>(result)[0].message;
  return {};
}

SheetDefinition cloth_of(const Garment& garment, double bend_rigidity) {
  SheetDefinition sheet;
  sheet.name = "cloth";
  sheet.shape = complete(garment.mesh);
  sheet.textile.model = MeasuredTextile{.areal_density = 0.15,
                                        .tensile_warp = 200,
                                        .tensile_weft = 200,
                                        .shear = 20,
                                        .bend_rigidity_warp = bend_rigidity,
                                        .bend_rigidity_weft = bend_rigidity};
  sheet.textile.damping = 2e-3;
  sheet.bending = Isometric{};
  sheet.skin = 0.003;
  return sheet;
}

// Of light from above, m^2.
double shadow(const std::vector<std::array<int, 3>>& triangles, const Matrix3Xd& x) {
  constexpr double kPixel = 5e-4;
  std::set<std::pair<int, int>> dark;
  for (const auto& [i, j, k] : triangles) {
    const auto seen = [&](int particle) { return Vector2d(x(0, particle), x(2, particle)); };
    const Vector2d a = seen(i), b = seen(j) - a, c = seen(k) - a;
    const double area = b.x() * c.y() - b.y() * c.x();
    const Vector2d low = a + b.cwiseMin(c).cwiseMin(0), high = a + b.cwiseMax(c).cwiseMax(0);
    for (int row = static_cast<int>(low.y() / kPixel) - 1; row * kPixel < high.y(); ++row)
      for (int column = static_cast<int>(low.x() / kPixel) - 1; column * kPixel < high.x();
           ++column) {
        const Vector2d p = Vector2d((column + 0.5) * kPixel, (row + 0.5) * kPixel) - a;
        const double u = (p.x() * c.y() - p.y() * c.x()) / area,
                     v = (b.x() * p.y() - b.y() * p.x()) / area;
        if (u >= 0 && v >= 0 && u + v <= 1) dark.emplace(row, column);
      }
  }
  return static_cast<double>(dark.size()) * kPixel * kPixel;
}

// What a disc that lies on a ball still shadows, of what it does flat.
double drape_coefficient(const Garment& disc) {
  constexpr double kBall = 0.09, kHeld = 0.02;
  Scene scene;
  scene.sheets = {cloth_of(disc, 5e-5)};
  scene.sheets[0].rotation = Quaterniond(Eigen::AngleAxisd(-pi / 2, Vector3d::UnitX()));
  Pin middle;
  for (std::size_t i = 0; i < disc.mesh.start.size(); ++i)
    if (disc.mesh.start[i].norm() < kHeld) middle.particles.push_back(static_cast<int>(i));
  scene.sheets[0].pins = {middle};
  scene.colliders = {{"ball", Sphere{Vector3d(0, -kBall - 0.003, 0), kBall}, 0, {}}};
  Simulation simulation(scene);
  const Matrix3Xd flat = positions(simulation);
  for (int frame = 0; frame < 600 && !simulation.at_rest(); ++frame)
    EXPECT_TRUE(simulation.advance_frame());
  EXPECT_TRUE(simulation.at_rest());
  return shadow(disc.mesh.triangles, positions(simulation)) / shadow(disc.mesh.triangles, flat);
}

TEST(SewnDrape, TwoHalfDiscsHangAsOneDisc) {
  constexpr double kRadius = 0.15, kEdge = 0.012;
  const auto arc = [](double u, double v, double end) {
    return PatternEdge{.points = {{u, v}, {0, end}}, .arc = true};
  };
  PatternPanel whole{.name = "disc",
                     .edges = {arc(kRadius, 0, kRadius), arc(-kRadius, 0, -kRadius)}};
  PatternPanel right{.name = "right", .edges = {arc(kRadius, 0, kRadius), straight(0, -kRadius)}};
  PatternPanel left = right;
  left.name = "left";
  left.rotation = Eigen::AngleAxisd(pi, Vector3d::UnitZ());
  const double one = drape_coefficient(sewn({{whole}, {}}, kEdge)),
               two = drape_coefficient(
                   sewn({{right, left}, {{{{"right", 1}}, {{"left", 1}}, false}}}, kEdge));
  EXPECT_GT(one, 0.2);
  EXPECT_LT(one, 0.8);
  EXPECT_NEAR(two, one, 0.01 * one);
}

// Worn by a pole of 0.1 m about y.
Scene on_a_pole(const Garment& garment) {
  Scene scene;
  scene.sheets = {cloth_of(garment, 1e-5)};
  scene.colliders = {{"pole", Capsule{Vector3d(0, -1, 0), Vector3d(0, 1, 0), 0.1}, 0, {}}};
  scene.cloth_contact = true;
  scene.dressing.emplace();
  return scene;
}

TEST(SewnDrape, ASymmetricSkirtStaysSymmetric) {
  Pattern pattern;
  add_both(pattern, trapezoid_panel("skirt", 0, 0.5, 0.2, 0.31), 0.16);
  Simulation simulation(on_a_pole(sewn(pattern, 0.03)));
  const Matrix3Xd start = positions(simulation);
  std::vector<Eigen::Index> image;  // of each particle, in x = 0
  for (Eigen::Index i = 0; i < start.cols(); ++i) {
    const Vector3d wanted(-start(0, i), start(1, i), start(2, i));
    (start.colwise() - wanted).colwise().norm().minCoeff(&image.emplace_back());
    ASSERT_LT((start.col(image.back()) - wanted).norm(), 1e-6) << i;
  }
  for (int frame = 0; frame < 150; ++frame) ASSERT_TRUE(simulation.advance_frame());
  const Matrix3Xd x = positions(simulation);
  double most = 0;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const Vector3d other = x.col(image[static_cast<std::size_t>(i)]);
    most = std::max(most, (x.col(i) - Vector3d(-other.x(), other.y(), other.z())).norm());
  }
  EXPECT_LT(most, 1e-4);  // m; rounding grows, to 2e-6 here
}

TEST(SewnDrape, AGatherOfTwoToOneFallsEvenly) {
  constexpr int kHem = 0, kSeam = 2;
  Pattern pattern;
  add_both(pattern, trapezoid_panel("band", 0.2, 0.31, 0.05, 0.31), 0.15);
  add_both(pattern, trapezoid_panel("full", 0, 0.62, 0.19, 0.62), 0.15);
  for (const char* side : {"-front", "-back"})
    pattern.seams.push_back({{{std::string("full") + side, 2}}, {{std::string("band") + side, 0}}});
  const Garment garment = sewn(pattern, 0.02);
  Simulation simulation(on_a_pole(garment));
  for (int frame = 0; frame < 150; ++frame) ASSERT_TRUE(simulation.advance_frame());
  const Matrix3Xd x = positions(simulation);
  for (const GarmentEdge& edge : garment.edges) {
    if (pattern.panels[static_cast<std::size_t>(edge.panel)].name.starts_with("band")) continue;
    if (edge.edge != kHem && edge.edge != kSeam) continue;
    // around the pole
    std::vector<double> turns;
    double last = 0;
    for (const int i : edge.particles) {
      const double angle = std::atan2(x(2, i), x(0, i));
      turns.push_back(turns.empty() ? 0 : turns.back() + std::remainder(angle - last, 2 * pi));
      last = angle;
    }
    EXPECT_NEAR(std::abs(turns.back()), pi, 0.01);
    const double most = edge.edge == kSeam ? 0.08 : 0.16;  // folds are wider at the hem
    for (std::size_t k = 0; k < turns.size(); ++k) {
      const double share = static_cast<double>(k) / static_cast<double>(turns.size() - 1);
      EXPECT_NEAR(turns[k] / turns.back(), share, most) << edge.edge;
    }
  }
  EXPECT_EQ(simulation.verdict().cloth_cuts, 0);
}

// Placed flat, outside to +z, or turned down in front already; no weight.
TEST(SewnDrape, APressedSeamTurnsAPanelToItsAngleOnTheSideThatIsMeant) {
  constexpr double kWidth = 0.1, kSeam = 0.12, kFlap = 0.06;
  for (const bool down : {false, true})
    for (const double angle : {-pi / 2, 2.0}) {
      PatternPanel flap = trapezoid_panel("flap", kSeam, kWidth, kFlap, kWidth);
      if (down) {
        flap.origin = {0, 2 * kSeam, angle > 0 ? 0.03 : -0.03};
        flap.rotation = Eigen::AngleAxisd(pi, Vector3d::UnitX());
      }
      const Garment garment = sewn({{trapezoid_panel("base", 0, kWidth, kSeam, kWidth), flap},
                                    {{{{"base", 2}}, {{"flap", 0}}, false, angle}}},
                                   0.02);
      Scene scene;
      scene.sheets = {cloth_of(garment, 1e-5)};
      for (const int i : garment.edges[0].particles) scene.sheets[0].pins.push_back({{i}, {}});
      scene.environment.gravity.setZero();
      scene.dressing.emplace();
      Simulation simulation(scene);
      for (int frame = 0; frame < 240; ++frame) ASSERT_TRUE(simulation.advance_frame());
      const Matrix3Xd x = positions(simulation);
      const auto middle = [&](std::size_t edge) {
        Vector3d sum = Vector3d::Zero();
        for (const int i : garment.edges[edge].particles) sum += x.col(i);
        return Vector3d(sum / static_cast<double>(garment.edges[edge].particles.size()));
      };
      const Vector3d up = (middle(2) - middle(0)).normalized(), way = middle(6) - middle(2);
      EXPECT_NEAR(std::atan2(way.dot(Vector3d::UnitX().cross(up)), way.dot(up)), angle, 0.1)
          << down;
    }
}

}  // namespace
}  // namespace weft::testing
