#pragma once

#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/pattern/garment.h"
#include "core/pattern/panel_mesher.h"

namespace weft::testing {

PatternEdge line_to(double u, double v);
PatternEdge arc_to(Vector2d through, Vector2d end);
PatternPanel panel(std::string name, std::vector<PatternEdge> edges);
// From (0, 0). The edges: lower, right, upper, left.
PatternPanel rectangle(const std::string& name, double width, double height);
// An outline around the origin of 5 to 12 lines, straight or curved.
PatternPanel random_panel(std::mt19937& random);

// Fails the test where it cannot be built, or not be simulated.
Garment built(const Pattern& pattern, double edge);
// What keeps it from being built; fails the test where nothing does.
std::vector<Problem> refused(const Pattern& pattern, double edge = 0.02);

// Edges with their numbers of triangles, by particles.
std::map<std::pair<int, int>, int> edges_of(const TriangleMesh& mesh);
// Particles less edges plus triangles: 1 of a disc, 0 of a tube, 2 of a ball.
int euler_number(const TriangleMesh& mesh);
// Whether each triangle of one mesh is the mirror image of one of the other, to 2 nm.
void expect_mirrored(const PanelMesh& one, const PanelMesh& other);

}  // namespace weft::testing
