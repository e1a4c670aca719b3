#pragma once

#include <utility>
#include <vector>

#include "core/pattern/curve.h"
#include "core/pattern/panel_lines.h"
#include "core/plan.h"

namespace weft {

// The outline and the creases of a panel as triangles have them.
struct Border {
  PanelLines lines;
  std::vector<std::vector<int>> edges;  // points of each of the panel's edges, from start to end
};

// A point of a panel's border.
struct BorderPoint {
  int panel = 0;
  int point = 0;

  bool operator==(const BorderPoint&) const = default;
};

// A line of a panel's border that its seam is pressed along.
struct BorderFold {
  int panel = 0;
  std::vector<int> points;  // one after the other
  double angle = 0;         // rad
};

// The borders of a pattern's panels, cut alike on both sides of every seam.
struct Borders {
  std::vector<Border> panels;
  std::vector<std::pair<BorderPoint, BorderPoint>> sewn;  // points that are one
  std::vector<BorderFold> folds;
  std::vector<bool> turned;  // panels that seams turn over
  std::vector<Warning> notes;
  std::vector<Problem> problems;  // where there are any, the rest is void
};

// Cuts edges to pieces of about that length, m. A line with fewer than a quarter of it, on both
// sides of its seam, becomes a point.
// Precondition: find_problems() finds none.
Borders cut_borders(const Pattern& pattern, double edge, const std::string& field);

}  // namespace weft
