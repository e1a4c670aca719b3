#include "core/pattern/garment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <set>

#include "core/pattern/panel_mesher.h"
#include "tests/support/core/patterns.h"

namespace weft::testing {
namespace {

using std::numbers::pi;

// Half of a disc about the origin on the side of +u, its straight edge last.
PatternPanel half_disc(const std::string& name, double radius) {
  return panel(name, {arc_to({radius, 0}, {0, radius}), line_to(0, -radius)});
}

PatternPanel turned(PatternPanel panel, double angle) {
  panel.rotation = Eigen::AngleAxisd(angle, Vector3d::UnitZ());
  return panel;
}

PatternSeam seam(EdgeRun first, EdgeRun second) {
  return {{std::move(first)}, {std::move(second)}};
}

double flat_area(const TriangleMesh& mesh) {
  double area = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vector2d a = flat_corner(mesh, t, 1) - flat_corner(mesh, t, 0),
                   b = flat_corner(mesh, t, 2) - flat_corner(mesh, t, 0);
    area += (a.x() * b.y() - a.y() * b.x()) / 2;
  }
  return area;
}

// Closed lines of edges of one triangle.
int count_borders(const TriangleMesh& mesh) {
  std::map<int, std::vector<int>> next;
  for (const auto& [edge, count] : edges_of(mesh))
    if (count == 1)
      next[edge.first].push_back(edge.second), next[edge.second].push_back(edge.first);
  int borders = 0;
  std::set<int> seen;
  for (const auto& [start, unused] : next) {
    if (!seen.insert(start).second) continue;
    ++borders;
    std::vector<int> open{start};
    while (!open.empty()) {
      const int at = open.back();
      open.pop_back();
      for (const int other : next[at])
        if (seen.insert(other).second) open.push_back(other);
    }
  }
  return borders;
}

std::set<std::string> codes(const Garment& garment) {
  std::set<std::string> codes;
  for (const Warning& note : garment.notes) codes.insert(note.code);
  return codes;
}

TEST(Garments, ADiscHasTheAreaOfItsPolygonAndComesNearToPiRSquared) {
  Pattern pattern{{panel("disc", {arc_to({0.1, 0}, {0, 0.1}), arc_to({-0.1, 0}, {0, -0.1})})}, {}};
  double before = 0;
  for (const double edge : {0.04, 0.02, 0.01, 0.005}) {
    const Garment disc = built(pattern, edge);
    const auto sides =
        static_cast<double>(disc.edges[0].particles.size() + disc.edges[1].particles.size() - 2);
    EXPECT_NEAR(flat_area(disc.mesh), 0.01 * sides / 2 * std::sin(2 * pi / sides), 1e-12);
    EXPECT_NEAR(disc.edges[0].length, 0.1 * pi, 1e-12);
    EXPECT_EQ(euler_number(disc.mesh), 1);
    const double error = 0.01 * pi - flat_area(disc.mesh);
    EXPECT_GT(error, 0);
    if (before > 0) {
      EXPECT_LT(error, before / 2.5) << "second order at " << edge;
    }
    before = error;
  }
}

TEST(Garments, TwoHalfDiscsSewnAreADisc) {
  const double edge = 0.01;
  Pattern pattern{{half_disc("right", 0.1), turned(half_disc("left", 0.1), pi)},
                  {seam({"right", 1}, {"left", 1})}};
  const Garment sewn = built(pattern, edge);
  EXPECT_EQ(euler_number(sewn.mesh), 1);
  EXPECT_EQ(count_borders(sewn.mesh), 1);
  EXPECT_EQ(sewn.edges[1].particles.size(), sewn.edges[3].particles.size());
  EXPECT_TRUE(std::equal(sewn.edges[1].particles.begin(), sewn.edges[1].particles.end(),
                         sewn.edges[3].particles.rbegin()));
  const Garment whole = built(
      {{panel("disc", {arc_to({0.1, 0}, {0, 0.1}), arc_to({-0.1, 0}, {0, -0.1})})}, {}}, edge);
  EXPECT_NEAR(flat_area(sewn.mesh), flat_area(whole.mesh), 1e-12);
  // and lies as one where its halves are placed side by side
  for (const Vector3d& place : sewn.mesh.start) EXPECT_LE(place.norm(), 0.1 + 1e-12);
  double in_space = 0;
  for (const auto& [a, b, c] : sewn.mesh.triangles) {
    const auto at = [&](int i) { return sewn.mesh.start[static_cast<std::size_t>(i)]; };
    in_space += (at(b) - at(a)).cross(at(c) - at(a)).z() / 2;
  }
  EXPECT_NEAR(in_space, flat_area(sewn.mesh), 1e-12);
}

TEST(Garments, ARectangleSewnToItselfIsATubeAtEveryWidth) {
  for (const double width : {0.004, 0.01, 0.017, 0.025, 0.04, 0.3}) {
    const Garment tube =
        built({{rectangle("tube", width, 0.2)}, {seam({"tube", 1}, {"tube", 3})}}, 0.01);
    EXPECT_EQ(euler_number(tube.mesh), 0) << width;
    EXPECT_EQ(count_borders(tube.mesh), 2) << width;
    EXPECT_NEAR(flat_area(tube.mesh), 0.2 * width, 1e-12);
  }
}

TEST(Garments, ABagIsClosedButForItsMouth) {
  const Garment bag = built({{rectangle("front", 0.02, 0.02), rectangle("back", 0.02, 0.02)},
                             {{{{"front", 3}, {"front", 0}, {"front", 1}},
                               {{"back", 3}, {"back", 0}, {"back", 1}},
                               true}}},
                            0.02);
  EXPECT_EQ(count_borders(bag.mesh), 1);
  EXPECT_EQ(euler_number(bag.mesh), 1);
}

TEST(Garments, SidesOfSeamsHaveEqualCountsHoweverTheyAreDivided) {
  // a waistband of one edge on three panels, two of which end where the third has a part left
  Pattern pattern{{rectangle("band", 0.5, 0.04), rectangle("left", 0.2, 0.3),
                   rectangle("middle", 0.13, 0.3), rectangle("right", 0.31, 0.3)},
                  {{{{"band", 0}}, {{"left", 2}, {"middle", 2}, {"right", 2, 0.2, 1}}, false}}};
  const Garment garment = built(pattern, 0.01);
  const auto particles = [&](std::size_t p, std::size_t e) {
    const auto& all = garment.edges[4 * p + e].particles;
    return std::set<int>(all.begin(), all.end());
  };
  std::set<int> below;
  for (const std::size_t p : {1U, 2U, 3U}) below.merge(particles(p, 2));
  for (const int particle : particles(0, 0)) EXPECT_TRUE(below.contains(particle));
  // the corner that is not sewn is the end of the seam's last run
  EXPECT_EQ(garment.edges[4 * 1 + 2].particles.back(), garment.edges[0].particles.front());
  EXPECT_TRUE(codes(garment).contains("SEAM_UNEQUAL"));
  EXPECT_EQ(euler_number(garment.mesh), 1 - 2 + 2 - 1 + 1);
}

TEST(Garments, ASeamPressedToAnAngleIsOneFoldAlongAllItsPanels) {
  Pattern pattern{
      {rectangle("band", 0.5, 0.04), rectangle("left", 0.2, 0.3), rectangle("right", 0.3, 0.3)},
      {{{{"band", 0}}, {{"left", 2}, {"right", 2}}, false, -2.5}, seam({"left", 1}, {"right", 3})}};
  const Garment garment = built(pattern, 0.01);
  ASSERT_EQ(garment.mesh.folds.size(), 1);
  EXPECT_EQ(garment.mesh.folds[0].particles, garment.edges[0].particles);
  EXPECT_EQ(garment.mesh.folds[0].angle, -2.5);
}

TEST(Garments, AGatherSharesItsFullnessEvenly) {
  Pattern pattern{{rectangle("full", 0.4, 0.1), rectangle("plain", 0.2, 0.1)},
                  {seam({"full", 2}, {"plain", 0})}};
  pattern.panels[1].origin.y() = 0.1;
  const Garment garment = built(pattern, 0.01);
  ASSERT_EQ(codes(garment), std::set<std::string>{"SEAM_UNEQUAL"});
  EXPECT_NE(garment.notes[0].message.find("a ratio of 2:"), std::string::npos);
  EXPECT_EQ(garment.notes[0].field, "pattern.seams[0]");
  // one line in 14.1 mm of one side and 7.07 mm of the other
  EXPECT_EQ(garment.edges[2].particles.size(), 29);
  const auto& mesh = garment.mesh;
  std::map<std::pair<int, int>, std::vector<double>> flat;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      flat[std::minmax(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3])].push_back(
          (flat_corner(mesh, t, (k + 1) % 3) - flat_corner(mesh, t, k)).norm());
  const auto& line = garment.edges[2].particles;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    auto lengths = flat[std::minmax(line[i], line[i + 1])];
    std::sort(lengths.begin(), lengths.end());
    ASSERT_EQ(lengths.size(), 2);
    EXPECT_NEAR(lengths[0], 0.2 / 28, 1e-12);
    EXPECT_NEAR(lengths[1], 0.4 / 28, 1e-12);
  }
}

TEST(Garments, SewnParticlesStartInTheMeanOfTheirPlaces) {
  PatternPanel back = rectangle("back", 0.2, 0.3);
  back.origin = {0.2, 0, -0.1};
  back.rotation = Eigen::AngleAxisd(pi, Vector3d::UnitY());
  PatternPanel front = rectangle("front", 0.2, 0.3);
  front.origin = {0, 0, 0.1};
  const Garment garment = built({{front, back}, {seam({"front", 1}, {"back", 3})}}, 0.02);
  for (const int i : garment.edges[1].particles) {
    const Vector3d& place = garment.mesh.start[static_cast<std::size_t>(i)];
    EXPECT_NEAR(place.x(), 0.2, 1e-12);
    EXPECT_NEAR(place.z(), 0, 1e-12);
  }
  for (const int i : garment.edges[3].particles)
    EXPECT_NEAR(garment.mesh.start[static_cast<std::size_t>(i)].z(), 0.1, 1e-12);
}

TEST(Garments, ADartIsANotchWhoseSidesAreSewn) {
  const PatternPanel front =
      panel("front", {line_to(0.1, 0), line_to(0.2, 0), line_to(0.2, 0.3), line_to(0.11, 0.3),
                      line_to(0.1, 0.2), line_to(0.09, 0.3), line_to(0, 0.3), line_to(0, 0)});
  const Garment garment = built({{front}, {seam({"front", 3}, {"front", 4})}}, 0.01);
  EXPECT_EQ(euler_number(garment.mesh), 1);
  EXPECT_EQ(count_borders(garment.mesh), 1);
  EXPECT_EQ(garment.edges[3].particles.front(), garment.edges[4].particles.back());
}

// A front of a shirt: round neck, sloping shoulders, hollow armholes, a curved hem.
std::vector<Vector2d> shirt_border(double lean, double edge) {
  PatternPanel front = panel("front", {{.points = {{0, -0.03}, {0.25, 0}}},
                                       line_to(0.24, 0.4),
                                       {.points = {{0.17, 0.41}, {0.18 + lean, 0.62}}},
                                       line_to(0.08, 0.66),
                                       {.points = {{0.05, 0.57}, {-0.05, 0.57}, {-0.08, 0.66}}},
                                       line_to(-0.18 + lean, 0.62),
                                       {.points = {{-0.17, 0.41}, {-0.24, 0.4}}},
                                       line_to(-0.25, 0)});
  const Garment garment = built({{front}, {}}, edge);
  std::vector<Vector2d> border;
  for (const GarmentEdge& each : garment.edges)
    for (std::size_t i = 0; i + 1 < each.particles.size(); ++i)
      border.push_back(garment.mesh.flat[static_cast<std::size_t>(each.particles[i])]);
  return border;
}

TEST(Garments, ASymmetricPanelHasSymmetricTriangles) {
  for (const double edge : {0.04, 0.02, 0.01})
    for (const double grain : {0.0, pi / 2}) {
      const PanelMesh mesh = mesh_panel({shirt_border(0, edge)}, grain, edge);
      expect_mirrored(mesh, mesh);
    }
}

TEST(Garments, MirroredPanelsHaveMirroredTriangles) {
  for (const double grain : {0.0, 0.3}) {
    const std::vector<Vector2d> left = shirt_border(0.02, 0.01);
    std::vector<Vector2d> right;
    for (auto point = left.rbegin(); point != left.rend(); ++point)
      right.emplace_back(-point->x(), point->y());
    expect_mirrored(mesh_panel({left}, grain, 0.01), mesh_panel({right}, -grain, 0.01));
  }
}

TEST(Garments, TrianglesInsideLieAlongTheGrain) {
  const double grain = 0.4, edge = 0.01;
  const PanelMesh mesh = mesh_panel({{{0, 0}, {0.3, 0}, {0.3, 0.3}, {0, 0.3}}}, grain, edge);
  const Vector2d along(-std::sin(grain), std::cos(grain));
  int inner = 0, even = 0;
  for (const auto& triangle : mesh.triangles) {
    std::array<Vector2d, 3> corner;
    for (std::size_t k = 0; k < 3; ++k)
      corner[k] = mesh.points[static_cast<std::size_t>(triangle[k])];
    const Vector2d middle = (corner[0] + corner[1] + corner[2]) / 3;
    if ((middle - Vector2d(0.15, 0.15)).lpNorm<Eigen::Infinity>() > 0.12) continue;
    ++inner;
    bool has_one = false;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector2d side = corner[(k + 1) % 3] - corner[k];
      EXPECT_NEAR(side.norm(), edge, 1e-3 * edge);
      has_one |= std::abs(side.normalized().dot(along)) > 1 - 1e-6;
    }
    even += has_one ? 1 : 0;
  }
  EXPECT_GT(inner, 1000);
  EXPECT_EQ(even, inner);
}

TEST(Garments, TrianglesOfRandomOutlinesAreNoLowerThanAThirdOfAnEdgeWhereNothingIsNoted) {
  std::mt19937 random(5);
  int plain = 0;
  for (int round = 0; round < 300; ++round) {
    const double edge = round % 2 == 0 ? 0.01 : 0.02;
    const PatternPanel any = random_panel(random);
    const Garment garment = built({{any}, {}}, edge);
    EXPECT_EQ(euler_number(garment.mesh), 1) << round;
    if (!garment.notes.empty()) continue;
    ++plain;
    EXPECT_GE(garment.least_height, 0.35 * edge) << round;
    std::vector<Vector2d> border;
    for (const GarmentEdge& each : garment.edges)
      for (std::size_t i = 0; i + 1 < each.particles.size(); ++i)
        border.push_back(garment.mesh.flat[static_cast<std::size_t>(each.particles[i])]);
    EXPECT_NEAR(flat_area(garment.mesh), area_within(border), 1e-12);
  }
  EXPECT_GT(plain, 280);
}

TEST(Garments, APatternHasTheSameBitsTwice) {
  std::mt19937 random(3);
  Pattern pattern{{random_panel(random), rectangle("tube", 0.3, 0.2)},
                  {seam({"tube", 1}, {"tube", 3})}};
  const Garment one = built(pattern, 0.01), other = built(pattern, 0.01);
  EXPECT_EQ(one.mesh.triangles, other.mesh.triangles);
  EXPECT_EQ(one.mesh.flat_triangles, other.mesh.flat_triangles);
  EXPECT_EQ(one.mesh.flat, other.mesh.flat);
  EXPECT_EQ(one.mesh.start, other.mesh.start);
}

TEST(Garments, RefinementKeepsLengthsAndComesToTheCurvesArea) {
  const auto area = [](double edge) { return area_within(shirt_border(0, edge)); };
  const double finest = area(0.0025);
  EXPECT_NEAR(area(0.04), finest, 0.008 * finest);
  EXPECT_NEAR(area(0.02), finest, 0.002 * finest);
  EXPECT_NEAR(area(0.01), finest, 0.0005 * finest);
}

TEST(Garments, PanelsThatSeamsTurnOverAreMirrored) {
  PatternPanel front =
      panel("front", {line_to(0.2, 0), line_to(0.25, 0.3), line_to(0, 0.3), line_to(0, 0)});
  PatternPanel lining = front;
  lining.name = "lining";
  Pattern pattern{{front, lining}, {{{{"front", 1}}, {{"lining", 1}}, true}}};
  const Garment garment = built(pattern, 0.02);
  ASSERT_EQ(codes(garment), std::set<std::string>{"PANEL_TURNED"});
  EXPECT_EQ(garment.notes[0].field, "pattern.panels[1]");
  EXPECT_EQ(count_borders(garment.mesh), 1);
  // both start where the pattern has them
  for (const Vector3d& place : garment.mesh.start) EXPECT_GE(place.x(), -1e-12);
  // a band sewn to itself face to back has one side
  pattern = {{rectangle("band", 0.3, 0.04)}, {{{{"band", 1}}, {{"band", 3}}, true}}};
  EXPECT_EQ(refused(pattern)[0].field, "pattern.seams[0].same_direction");
}

TEST(Garments, ShortEdgesBecomePointsAndSharpCornersAreNoted) {
  Pattern pattern{{panel("front", {line_to(0.2, 0), line_to(0.2, 0.3), line_to(0.001, 0.3),
                                   line_to(0, 0.299), line_to(0, 0)})},
                  {}};
  const Garment blunt = built(pattern, 0.01);
  ASSERT_EQ(codes(blunt), std::set<std::string>{"EDGE_SHORT"});
  EXPECT_EQ(blunt.notes[0].field, "pattern.panels[0].edges[3]");
  EXPECT_EQ(blunt.edges[3].particles.size(), 1);
  EXPECT_GE(blunt.least_height, 0.0035);
  pattern = {{panel("godet", {line_to(0.1, 0), line_to(0, 0.5), line_to(0, 0)})}, {}};
  const Garment sharp = built(pattern, 0.01);
  ASSERT_EQ(codes(sharp), std::set<std::string>{"CORNER_SHARP"});
  EXPECT_EQ(sharp.notes[0].field, "pattern.panels[0].edges[2]");
  EXPECT_NE(sharp.notes[0].message.find("11.31 degrees"), std::string::npos);
  pattern = {{rectangle("strap", 0.003, 0.3)}, {}};
  EXPECT_EQ(codes(built(pattern, 0.01)), (std::set<std::string>{"EDGE_SHORT", "PANEL_NARROW"}));
}

TEST(Garments, PanelsPlacedIntoEachOtherInOnePlaneStartApart) {
  // legs of 0.3 m whose middles are 0.2 m apart, in a plane that faces the side
  Pattern pattern{{rectangle("right", 0.3, 0.4), rectangle("left", 0.3, 0.5)}, {}};
  const Quaterniond to_side{Eigen::AngleAxisd(pi / 2, Vector3d::UnitY())};
  for (PatternPanel& each : pattern.panels) each.rotation = to_side;
  pattern.panels[0].origin = {0.1, 0, 0.1};
  pattern.panels[1].origin = {0.1, -0.05, -0.1};
  const Garment garment = built(pattern, 0.02);
  ASSERT_EQ(codes(garment), std::set<std::string>{"PANELS_OVERLAP"});
  EXPECT_EQ(garment.notes[0].field, "pattern.panels[1]");

  const TriangleMesh& mesh = garment.mesh;
  const auto right = static_cast<std::size_t>(mesh.panels[0].triangles);
  double right_from = 1, right_to = -1, left_from = 1, left_to = -1;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const int i : mesh.triangles[t]) {
      const Vector3d& at = mesh.start[static_cast<std::size_t>(i)];
      EXPECT_NEAR(at.x(), 0.1, 1e-12);
      double &from = t < right ? right_from : left_from, &to = t < right ? right_to : left_to;
      from = std::min(from, at.z());
      to = std::max(to, at.z());
    }
  EXPECT_NEAR(right_to - right_from, 0.3, 1e-9);
  EXPECT_NEAR(left_to - left_from, 0.3, 1e-9);
  EXPECT_GT(right_from, left_to);
  EXPECT_LT(right_from - left_to, 0.01);
  EXPECT_NEAR(right_from + left_to, -0.3, 1e-9);  // both go half of the way
}

TEST(Garments, PanelsThatTouchOrLieBeforeEachOtherStartWhereTheyArePlaced) {
  Pattern pattern{{rectangle("one", 0.3, 0.4), rectangle("beside", 0.3, 0.4),
                   rectangle("before", 0.3, 0.4), rectangle("across", 0.3, 0.4)},
                  {}};
  pattern.panels[1].origin = {0.3, 0, 0};
  pattern.panels[2].origin = {0.1, 0, 0.005};
  pattern.panels[3].rotation = Eigen::AngleAxisd(pi / 2, Vector3d::UnitX());
  const Garment garment = built(pattern, 0.02);
  EXPECT_TRUE(codes(garment).empty());
  for (const Vector3d& corner :
       {Vector3d(0, 0, 0), Vector3d(0.6, 0.4, 0), Vector3d(0.4, 0.4, 0.005)})
    EXPECT_TRUE(std::ranges::any_of(
        garment.mesh.start, [&](const Vector3d& at) { return (at - corner).norm() < 1e-9; }));
}

TEST(Garments, CoordinatesAndGrainsNextToNothingAreAsNothing) {
  PatternPanel near = rectangle("front", 0.2, 0.3);
  near.edges[3].points[0] = {5e-324, -1e-200};
  near.edges[2].points[0].x() = 1e-160;
  near.grain = 5e-324;
  const Garment garment = built({{near}, {}}, 0.01),
                exact = built({{rectangle("front", 0.2, 0.3)}, {}}, 0.01);
  EXPECT_EQ(garment.mesh.triangles, exact.mesh.triangles);
}

TEST(Garments, WhatCannotBeCutOrSewnIsRefusedByItsField) {
  const auto field_of = [](const Pattern& pattern) { return refused(pattern)[0].field; };
  const PatternPanel good = rectangle("front", 0.2, 0.3);
  EXPECT_EQ(field_of({{}, {}}), "pattern.panels");
  EXPECT_EQ(field_of({{good, good}, {}}), "pattern.panels[1].name");
  EXPECT_EQ(field_of({{good}, {seam({"front", 1}, {"back", 3})}}),
            "pattern.seams[0].second_side[0].panel");
  EXPECT_EQ(field_of({{good}, {seam({"front", 4}, {"front", 3})}}),
            "pattern.seams[0].first_side[0].edge");
  EXPECT_EQ(field_of({{good}, {seam({"front", 1, 0.5, 0.4}, {"front", 3})}}),
            "pattern.seams[0].first_side[0].end");
  EXPECT_EQ(
      field_of(
          {{good}, {seam({"front", 1}, {"front", 3}), seam({"front", 0}, {"front", 1, 0.5, 1})}}),
      "pattern.seams[1].second_side[0]");
  EXPECT_EQ(field_of({{good}, {{{}, {{"front", 1}}}}}), "pattern.seams[0].first_side");
  EXPECT_EQ(field_of({{good}, {{{{"front", 1}}, {{"front", 3}}, false, 3.3}}}),
            "pattern.seams[0].fold_rad");
  EXPECT_EQ(field_of({{panel("line", {line_to(1, 0)})}, {}}), "pattern.panels[0].edges");
  PatternPanel bad = good;
  bad.edges[2].points[0].x() = std::nan("");
  EXPECT_EQ(field_of({{bad}, {}}), "pattern.panels[0].edges[2].points_m");
  bad = panel("bow", {line_to(0.2, 0), line_to(0, 0.2), line_to(0.2, 0.2), line_to(0, 0)});
  EXPECT_EQ(field_of({{bad}, {}}), "pattern.panels[0].edges");
  EXPECT_NE(refused({{bad}, {}})[0].message.find("edge 1 and edge 3"), std::string::npos);
  bad = good;
  std::reverse(bad.edges.begin(), bad.edges.end());
  EXPECT_NE(refused({{bad}, {}})[0].message.find("clockwise"), std::string::npos);
  bad = good;
  bad.edges[0] = arc_to({-0.1, 0}, {0.2, 0});
  EXPECT_EQ(field_of({{bad}, {}}), "pattern.panels[0].edges[0].arc");
  EXPECT_EQ(refused({{good}, {}}, 0.2)[0].field, "edge_m");
  EXPECT_EQ(refused({{rectangle("sail", 5, 5)}, {}}, 0.01)[0].field, "edge_m");
  EXPECT_EQ(refused({{rectangle("ribbon", 90, 0.01)}, {}}, 0.01)[0].field, "edge_m");
}

}  // namespace
}  // namespace weft::testing
