#pragma once

#include <string>
#include <utility>
#include <vector>

namespace weft::client {

// Points joined by a line.
struct Series {
  std::string name;
  std::vector<std::pair<double, double>> points;
};

struct Plot {
  std::string title;
  std::string x_label, y_label;
  std::vector<Series> series;
  bool points = false;       // marks on the lines
  bool downwards = false;    // y grows downwards, in the measure of x
  bool logarithmic = false;  // both axes; points that are not above 0 are left out
};

inline constexpr int kPlotWidth = 920, kPlotHeight = 480;
// As it stands in XML or HTML.
std::string escaped(const std::string& text);
// The plot as an SVG document of that size.
std::string svg_text(const Plot& given);

}  // namespace weft::client
