#pragma once

#include "client/imports/borders.h"
#include "client/imports/import.h"
#include "client/output/json.h"

namespace weft::client {

struct PanelFacts {
  std::string name;
  int triangles = 0;
  double area = 0;                   // of the flat shape, m^2
  Vector2d size = Vector2d::Zero();  // of it along u and v, m
};

// Where two panels, or two borders of one, are sewn together.
struct SeamFacts {
  std::string first, second;               // panels
  double length = 0;                       // in space, m
  double first_flat = 0, second_flat = 0;  // of its two sides in the flat shape, m
};

// A triangle that keeps the step short, which goes with its least height.
struct LowTriangle {
  std::string place, around;
  double height = 0;  // m
  double cost = 1;    // substeps for one of a triangle of the median height
};

struct MeshFacts {
  int particles = 0, triangles = 0, pieces = 0;
  Vector3d size = Vector3d::Zero();  // m
  std::vector<PanelFacts> panels;
  std::vector<Border> borders;
  std::vector<std::pair<std::string, double>> sides;  // of borders, where no loop has the name, m
  std::vector<SeamFacts> seams;
  std::vector<LowTriangle> lowest;  // three at most
  double median_height = 0;         // m
};

MeshFacts facts_of(const Import& import);

std::string facts_text(const Import& import, const MeshFacts& facts);
Json facts_json(const Import& import, const MeshFacts& facts);

}  // namespace weft::client
