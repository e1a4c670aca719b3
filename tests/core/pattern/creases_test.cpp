#include "core/pattern/creases.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/forces/hinges.h"
#include "core/simulation.h"
#include "core/triangles/folds.h"
#include "tests/support/core/patterns.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {
namespace {

using std::numbers::pi;
using ::testing::HasSubstr;
using ::testing::SizeIs;

PatternPanel creased(PatternPanel panel, std::vector<Vector2d> points, double angle = 1) {
  panel.creases.push_back({std::move(points), angle});
  return panel;
}

// A rectangle of 200 by 300 mm.
PatternPanel creased(std::vector<Vector2d> points, double angle = 1) {
  return creased(rectangle("front", 0.2, 0.3), std::move(points), angle);
}

// Points of a fold in the flat shape of a garment of one panel without seams.
std::vector<Vector2d> points_of(const Garment& garment, std::size_t fold) {
  std::vector<Vector2d> points;
  for (const int i : garment.mesh.folds[fold].particles)
    points.push_back(garment.mesh.flat[static_cast<std::size_t>(i)]);
  return points;
}

double length_of(const std::vector<Vector2d>& line) {
  double length = 0;
  for (std::size_t i = 1; i < line.size(); ++i) length += (line[i] - line[i - 1]).norm();
  return length;
}

// Every two neighbours of it are the ends of an edge of two triangles.
void expect_along_edges(const Garment& garment, std::size_t fold) {
  const auto edges = edges_of(garment.mesh);
  const std::vector<int>& particles = garment.mesh.folds[fold].particles;
  for (std::size_t i = 1; i < particles.size(); ++i) {
    const auto edge = edges.find(std::minmax(particles[i - 1], particles[i]));
    ASSERT_NE(edge, edges.end()) << i;
    EXPECT_EQ(edge->second, 2) << i;
  }
}

TEST(Creases, TrianglesHaveEdgesAlongThemFromOutlineToOutline) {
  for (const double edge : {0.03, 0.01, 0.004}) {
    const Garment garment = built({{creased({{0.06, 0}, {0.06, 0.3}}, -2.5)}, {}}, edge);
    ASSERT_THAT(garment.mesh.folds, SizeIs(1));
    EXPECT_EQ(garment.mesh.folds[0].angle, -2.5);
    expect_along_edges(garment, 0);
    const std::vector<Vector2d> points = points_of(garment, 0);
    for (const Vector2d& point : points) EXPECT_NEAR(point.x(), 0.06, 1e-12);
    EXPECT_EQ(points.front().y(), 0);
    EXPECT_EQ(points.back().y(), 0.3);
    EXPECT_NEAR(length_of(points), 0.3, 1e-12);
    EXPECT_TRUE(garment.notes.empty());
    EXPECT_EQ(euler_number(garment.mesh), 1);
    EXPECT_GE(garment.least_height, 0.35 * edge);
  }
}

TEST(Creases, OneMayEndInside) {
  const Garment garment = built({{creased({{0.06, 0.05}, {0.06, 0.2}, {0.15, 0.2}})}, {}}, 0.01);
  ASSERT_THAT(garment.mesh.folds, SizeIs(1));
  expect_along_edges(garment, 0);
  const std::vector<Vector2d> points = points_of(garment, 0);
  EXPECT_NEAR((points.front() - Vector2d(0.06, 0.05)).norm(), 0, 1e-12);
  EXPECT_NEAR((points.back() - Vector2d(0.15, 0.2)).norm(), 0, 1e-12);
  EXPECT_NEAR(length_of(points), 0.15 + 0.09, 1e-12) << "the corner is a point of it";
  EXPECT_GE(garment.least_height, 0.35 * 0.01);
}

TEST(Creases, AFineLineIsFollowedByEdgesOfTriangles) {
  constexpr double kRadius = 0.06;
  std::vector<Vector2d> arc;
  for (int i = 0; i < 60; ++i)
    arc.emplace_back(0.09 + kRadius * std::cos(pi * i / 59), 0.1 + kRadius * std::sin(pi * i / 59));
  const Garment garment = built({{creased(arc)}, {}}, 0.01);
  expect_along_edges(garment, 0);
  const std::vector<Vector2d> points = points_of(garment, 0);
  EXPECT_NEAR(static_cast<double>(points.size()), 20, 1) << "edges of about 10 mm";
  for (const Vector2d& point : points)
    EXPECT_NEAR((point - Vector2d(0.09, 0.1)).norm(), kRadius, 1e-4);
  EXPECT_GE(garment.least_height, 0.35 * 0.01);
}

TEST(Creases, OneWithoutAnAngleIsALineOfEdgesAndNoFold) {
  const Garment garment = built({{creased({{0.0633, 0}, {0.0633, 0.3}}, 0)}, {}}, 0.01);
  EXPECT_THAT(garment.mesh.folds, SizeIs(0));
  double along = 0;
  for (const auto& [edge, count] : edges_of(garment.mesh)) {
    const Vector2d &a = garment.mesh.flat[static_cast<std::size_t>(edge.first)],
                   &b = garment.mesh.flat[static_cast<std::size_t>(edge.second)];
    if (std::abs(a.x() - 0.0633) < 1e-12 && std::abs(b.x() - 0.0633) < 1e-12)
      along += (a - b).norm();
  }
  EXPECT_NEAR(along, 0.3, 1e-12);
}

TEST(Creases, AnEndBesideTheOutlineLiesOnIt) {
  PatternPanel round = panel("round", {arc_to({0.1, -0.1}, {0.2, 0}), arc_to({0.1, 0.1}, {0, 0})});
  const double reach = std::sqrt(0.1 * 0.1 - 0.03 * 0.03);
  const Garment garment =
      built({{creased(round, {{0.07, -reach + 0.002}, {0.07, reach + 0.002}})}, {}}, 0.01);
  const std::vector<Vector2d> points = points_of(garment, 0);
  for (const Vector2d& end : {points.front(), points.back()})
    EXPECT_NEAR((end - Vector2d(0.1, 0)).norm(), 0.1, 1e-9);
  // beside a corner it is the corner
  const Garment cornered = built({{creased({{0.001, 0.001}, {0.2, 0.3}})}, {}}, 0.01);
  EXPECT_EQ(points_of(cornered, 0).front(), Vector2d(0, 0));
}

TEST(Creases, RandomOnesLeaveTrianglesAsHighAsOutlinesDo) {
  std::mt19937 random(11);
  const auto within = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) * 0x1p-32;
  };
  int made = 0, plain = 0;
  for (int round = 0; round < 1500; ++round) {
    const double edge = round % 2 == 0 ? 0.01 : 0.02;
    PatternPanel any = random_panel(random);
    for (std::size_t c = 0, count = 1 + random() % 3; c < count; ++c) {
      std::vector<Vector2d> points;
      for (std::size_t i = 0, corners = 2 + random() % 2; i < corners; ++i)
        points.emplace_back(within(-0.2, 0.2), within(-0.2, 0.2));
      if (random() % 2 == 0) points.front() = any.edges[0].points.back();
      if (random() % 2 == 0) points.back() = any.edges[2].points.back();
      any.creases.push_back({points, 1});
    }
    if (std::holds_alternative<std::vector<Problem>>(build_garment({{any}, {}}, edge, "", "")))
      continue;
    ++made;
    const Garment garment = built({{any}, {}}, edge);
    EXPECT_EQ(euler_number(garment.mesh), 1) << round;
    for (std::size_t f = 0; f < garment.mesh.folds.size(); ++f) expect_along_edges(garment, f);
    if (!garment.notes.empty()) continue;
    ++plain;
    EXPECT_GE(garment.least_height, 0.35 * edge) << round;
  }
  EXPECT_GT(made, 60);
  EXPECT_GT(plain, 0.9 * made);
}

TEST(Creases, ASymmetricPanelWithSymmetricOnesHasSymmetricTriangles) {
  const std::vector<Vector2d> across = {{0, 0.1}, {0.1, 0.14}, {0.2, 0.1}};
  const std::vector<Vector2d> left = {{0.04, 0}, {0.05, 0.3}}, right = {{0.15, 0.3}, {0.16, 0}};
  const std::vector<Vector2d> middle = {{0.1, 0.3}, {0.1, 0.18}};
  const std::vector<std::vector<std::vector<Vector2d>>> kinds = {
      {across}, {left, right}, {middle}, {across, middle}};
  for (const double edge : {0.02, 0.01, 0.007})
    for (const double grain : {0.0, pi / 2})
      for (const auto& lines : kinds) {
        PatternPanel front = rectangle("front", 0.2, 0.3);
        front.grain = grain;
        for (const auto& line : lines) front.creases.push_back({line, 1});
        const Garment garment = built({{front}, {}}, edge);
        PanelMesh mesh{garment.mesh.flat, garment.mesh.triangles};
        for (Vector2d& point : mesh.points) point.x() -= 0.1;
        expect_mirrored(mesh, mesh);
        EXPECT_EQ(euler_number(garment.mesh), 1);
        EXPECT_GE(garment.least_height, 0.35 * edge);
        for (std::size_t f = 0; f < lines.size(); ++f) expect_along_edges(garment, f);
      }
}

TEST(Creases, MirroredPanelsHaveMirroredTriangles) {
  PatternPanel one = panel("leg", {line_to(0.2, 0), line_to(0.23, 0.3), line_to(0.01, 0.28),
                                   line_to(0, 0)}),
               other = panel("leg", {line_to(0, 0), line_to(-0.01, 0.28), line_to(-0.23, 0.3),
                                     line_to(-0.2, 0)});
  one.creases = {{{{0.03, 0}, {0.07, 0.284}}, 1}};
  other.creases = {{{{-0.07, 0.284}, {-0.03, 0}}, 1}};
  const Garment right = built({{one}, {}}, 0.01), left = built({{other}, {}}, 0.01);
  expect_mirrored({right.mesh.flat, right.mesh.triangles}, {left.mesh.flat, left.mesh.triangles});
}

TEST(Creases, TheyGoOnAcrossSeams) {
  PatternPanel leg = creased(rectangle("leg", 0.2, 0.3), {{0.07, 0}, {0.07, 0.3}}, 2),
               cuff = creased(rectangle("cuff", 0.2, 0.06), {{0.0702, 0}, {0.0702, 0.06}}, 2);
  const Garment garment = built({{leg, cuff}, {{{{"leg", 0}}, {{"cuff", 2}}}}}, 0.02);
  ASSERT_THAT(garment.mesh.folds, SizeIs(2));
  EXPECT_EQ(garment.mesh.folds[0].particles.front(), garment.mesh.folds[1].particles.back());
  // where only one side is creased, too, both have the same particles
  cuff.creases.clear();
  const Garment plain = built({{leg, cuff}, {{{{"leg", 0}}, {{"cuff", 2}}}}}, 0.02);
  EXPECT_EQ(euler_number(plain.mesh), 1);
  EXPECT_EQ(plain.edges[0].particles.size(), plain.edges[6].particles.size());
}

TEST(Creases, APieceTooNarrowForItsSeamsKeepsThem) {
  // a strip whose long sides are sewn to each other: edges across it get a point in their middle
  const PatternPanel strip = creased(rectangle("strip", 0.3, 0.02), {{0.15, 0}, {0.15, 0.02}});
  const Garment garment = built({{strip}, {{{{"strip", 0}}, {{"strip", 2}}}}}, 0.02);
  ASSERT_THAT(garment.mesh.folds, SizeIs(1));
  expect_along_edges(garment, 0);
}

// Without weight, from flat.
TEST(Creases, AFreePanelComesToRestAtTheirAngle) {
  for (const double angle : {-pi / 2, 2.4}) {
    const Garment garment = built({{creased({{0.07, 0}, {0.13, 0.3}}, angle)}, {}}, 0.02);
    SheetDefinition sheet;
    sheet.name = "cloth";
    sheet.shape = complete(garment.mesh);
    sheet.textile = {light_textile(0.2), 1e-3, 0.3};
    std::get<MeasuredTextile>(sheet.textile.model).air_drag = 2;
    sheet.bending = Isometric{};
    Simulation simulation(floating(sheet));
    for (int frame = 0; frame < 600; ++frame) ASSERT_TRUE(simulation.advance_frame());
    const Matrix3Xd x = positions(simulation);
    const auto hinges = make_hinges(rest_shape(*complete(garment.mesh)), garment.mesh.folds,
                                    {BendStiffness{1, 1, 1}});
    double sum = 0;
    for (const Hinge& hinge : hinges) sum += angle_of(hinge, x);
    EXPECT_NEAR(sum / static_cast<double>(hinges.size()), angle, 0.03);
    EXPECT_LT(simulation.deformation().largest_strain, 1e-3);
  }
}

// Of its folds, at their edges, as it starts.
std::vector<double> start_angles(const Garment& garment) {
  const auto hinges = make_hinges(rest_shape(*complete(garment.mesh)), garment.mesh.folds,
                                  {BendStiffness{1, 1, 1}});
  Matrix3Xd x(3, std::ssize(garment.mesh.start));
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    x.col(i) = garment.mesh.start[static_cast<std::size_t>(i)];
  std::vector<double> angles;
  for (const Hinge& hinge : hinges) angles.push_back(angle_of(hinge, x));
  return angles;
}

// Its particle at that place of the flat shape.
Vector3d start_at(const Garment& garment, const Vector2d& flat) {
  for (std::size_t i = 0; i < garment.mesh.flat.size(); ++i)
    if ((garment.mesh.flat[i] - flat).norm() < 1e-9) return garment.mesh.start[i];
  ADD_FAILURE() << "no particle at " << flat.transpose();
  return Vector3d::Zero();
}

TEST(Creases, APanelStartsFoldedByTheirAnglesAndTheRestOfItStaysWhereItIsPlaced) {
  // a box pleat 30 mm deep in a panel that stands in the plane x = 1
  PatternPanel pleated = rectangle("front", 0.24, 0.3);
  for (const auto& [u, angle] :
       {std::pair(0.06, -pi / 2), {0.09, pi / 2}, {0.15, pi / 2}, {0.18, -pi / 2}})
    pleated.creases.push_back({{{u, 0}, {u, 0.3}}, 3, angle});
  pleated.origin = {1, 0, 0};
  pleated.rotation = Quaterniond(Eigen::AngleAxisd(pi / 2, Vector3d::UnitY()));
  const Garment garment = built({{pleated}, {}}, 0.03);
  // of particles at a height of 0.3 m: along the panel, and out of it
  for (const auto& [u, along, out] : {std::tuple(0.0, 0.0, 0.0),
                                      {0.06, 0.06, 0.0},
                                      {0.09, 0.06, -0.03},
                                      {0.15, 0.12, -0.03},
                                      {0.18, 0.12, 0.0},
                                      {0.24, 0.18, 0.0}}) {
    const Vector3d expected(1 + out, 0.3, -along);
    EXPECT_LT((start_at(garment, {u, 0.3}) - expected).norm(), 1e-9) << u;
  }
  // nothing is strained by that
  for (const auto& triangle : garment.mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto a = static_cast<std::size_t>(triangle[k]),
                 b = static_cast<std::size_t>(triangle[(k + 1) % 3]);
      EXPECT_NEAR((garment.mesh.start[a] - garment.mesh.start[b]).norm(),
                  (garment.mesh.flat[a] - garment.mesh.flat[b]).norm(), 1e-9);
    }
}

TEST(Creases, APanelThatASeamTurnsOverStartsFoldedToTheSameSideOfItsCloth) {
  // both lie in one place, with the left edges sewn: one of them is turned over
  PatternPanel front = creased({{0.1, 0}, {0.1, 0.3}}), back = front;
  back.name = "back";
  for (PatternPanel* panel : {&front, &back}) panel->creases[0].start_angle = 1.2;
  const Garment garment = built({{front, back}, {{{{"front", 3}}, {{"back", 3}}, true}}}, 0.02);
  EXPECT_EQ(garment.notes.at(0).code, "PANEL_TURNED");
  ASSERT_THAT(garment.mesh.folds, SizeIs(2));
  EXPECT_THAT(start_angles(garment), ::testing::Each(::testing::DoubleNear(1.2, 1e-9)));
}

TEST(Creases, APanelThatStartsFoldedAlongBentOnesStartsInOnePiece) {
  PatternPanel bent = rectangle("front", 0.2, 0.3);
  bent.creases = {{{{0.06, 0}, {0.06, 0.15}, {0.08, 0.3}}, 3, -2},
                  {{{0.14, 0.3}, {0.13, 0.1}, {0.13, 0}}, -3, 2.5}};
  const Garment garment = built({{bent}, {}}, 0.01);
  for (const double angle : start_angles(garment)) EXPECT_NEAR(std::abs(angle), 2.25, 0.3);
  // its triangles are stretched, or turned out of a plane, by what its creases are bent
  for (const auto& triangle : garment.mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto a = static_cast<std::size_t>(triangle[k]),
                 b = static_cast<std::size_t>(triangle[(k + 1) % 3]);
      const double length = (garment.mesh.flat[a] - garment.mesh.flat[b]).norm();
      EXPECT_NEAR((garment.mesh.start[a] - garment.mesh.start[b]).norm(), length, 0.3 * length);
    }
}

TEST(Creases, WhatCannotBeCreasedIsToldOfByPanelAndCrease) {
  const auto told = [](const PatternPanel& panel, const char* field, const char* message,
                       double edge = 0.01) {
    const std::vector<Problem> problems = refused({{panel}, {}}, edge);
    EXPECT_EQ(problems[0].field, std::string("pattern.panels[0].creases") + field);
    EXPECT_THAT(problems[0].message, HasSubstr(message));
  };
  told(creased({{0.1, 0}}), "[0].points_m", "has 1 points, not 2 to 64");
  told(creased({{0.1, 0}, {0.1, 0.3}}, 3.3), "[0].fold_rad", "3.3 rad is not within");
  told(creased({{0.1, 0}, {0.1, std::nan("")}}), "[0].points_m", "is not within");
  told(creased({{0.1, 0.1}, {0.1, 0.1}}), "[0].points_m", "make a line of 0 m");
  told(creased({{0.1, 0}, {0.1, 0.34}}), "[0].points_m",
       "crease 0 of panel front leaves it: point 1, (0.1, 0.34) m, is outside of its outline");
  told(creased({{0.1, 0}, {0.25, 0.1}, {0.1, 0.3}}), "[0].points_m", "leaves it: point 1");
  told(creased({{0.02, 0}, {0.02, 0.3}}), "[0].points_m",
       "crease 0 of panel front comes within 20 mm of edge 3", 0.06);
  told(creased({{0, 0}, {0.2, 0}}), "[0].points_m", "touches edge 0");
  told(creased({{0.05, 0.1}, {0.15, 0.1}, {0.15, 0.2}, {0.1, 0.05}}), "[0].points_m",
       "crosses or touches itself");
  told(creased(creased({{0.1, 0}, {0.1, 0.3}}), {{0, 0.1}, {0.2, 0.1}}), "[1].points_m",
       "crease 1 of panel front crosses or touches crease 0");
  told(creased(creased({{0.1, 0}, {0.1, 0.3}}), {{0.102, 0.104}, {0.15, 0.1}}), "[1].points_m",
       "crease 1 of panel front comes within 2 mm of crease 0");
  const PatternPanel notched = panel("front", {line_to(0.2, 0), line_to(0.2, 0.3),
                                               line_to(0.1, 0.1), line_to(0, 0.3), line_to(0, 0)});
  told(creased(notched, {{0.05, 0.2}, {0.15, 0.2}}), "[0].points_m", "leaves it near");
  const auto started = [](std::vector<Vector2d> points, double angle) {
    PatternPanel any = creased(std::move(points));
    any.creases[0].start_angle = angle;
    return any;
  };
  told(started({{0.1, 0}, {0.1, 0.3}}, -3.3), "[0].start_rad", "-3.3 rad is not within");
  told(started({{0.1, 0}, {0.1, 0.2}}, 1), "[0].start_rad",
       "is 1 rad, but crease 0 of panel front ends inside it");
  told(started({{0.1, 0}, {0.1, 0.2}, {0.05, 0.1}, {0.05, 0.3}}, 1), "[0].start_rad",
       "is 1 rad, but crease 0 of panel front turns back");
  PatternPanel many = rectangle("front", 0.2, 0.3);
  for (int i = 0; i < 65; ++i) many.creases.push_back({{{0.1, 0}, {0.1, 0.3}}, 1});
  told(many, "", "has 65 creases, more than 64");
}

}  // namespace
}  // namespace weft::testing
