#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "core/model/scene.h"

namespace weft {

// A line of an outline. It begins where the one before ends, the first where the last ends.
struct PatternEdge {
  // u and v of one to three points, the last of which is the end, m: straight, or a Bezier curve.
  std::vector<Vector2d> points;
  bool arc = false;  // of a circle through the first of two points
  std::string label = {};
};

// A line inside a panel that it is creased along, from point to point.
struct PatternCrease {
  std::vector<Vector2d> points;  // u and v, m; an end beside the outline lies on it
  double angle = 0;              // that it is pressed to, as Fold has it, rad; 0: no fold
  double start_angle = 0;        // that the panel is folded by where it is placed, rad
};

// A piece of a garment, u to the right and v up; unplaced it lies at x = u, y = v.
struct PatternPanel {
  std::string name;
  std::vector<PatternEdge> edges;      // of the outline, anticlockwise
  double grain = 0;                    // from the v axis to the warp, rad, anticlockwise
  Vector3d origin = Vector3d::Zero();  // where (0, 0) is placed, m
  Quaterniond rotation = Quaterniond::Identity();  // about it
  std::vector<PatternCrease> creases = {};
};

// Part of an edge, by shares of its length.
struct EdgeRun {
  std::string panel;
  int edge = 0;
  double begin = 0, end = 1;
};

// Two lines that become one: each side's runs one after the other along the seam.
struct PatternSeam {
  std::vector<EdgeRun> first;
  std::vector<EdgeRun> second;  // in the same order, each against its outline
  bool same_direction = false;  // no: along it
  double fold = 0;              // angle that it is pressed to, as Fold has it, rad
};

// Shares of an edge that are that close are the same.
inline constexpr double kRunGap = 1e-6;

struct Pattern {
  std::vector<PatternPanel> panels;
  std::vector<PatternSeam> seams;
};

// Bounds of the wanted length of triangles' edges, m.
inline constexpr double kLeastPatternEdge = 2e-3, kMostPatternEdge = 0.1;

// Everything in the numbers and names of a pattern that keeps it from being cut and sewn with
// edges that long, m. `field` is its path. Where there is nothing, outlines may still cross.
std::vector<Problem> find_problems(const Pattern& pattern, double edge, const std::string& field,
                                   const std::string& edge_field);

}  // namespace weft
