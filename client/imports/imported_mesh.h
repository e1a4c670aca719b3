#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "client/problem.h"

namespace weft::client {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Triangles = std::vector<std::array<int, 3>>;

inline std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

// A corner whose flat place the file does not give.
inline constexpr int kNoCorner = -1;

// Triangles as a file has them. Indices are sound and numbers finite: readers see to that.
struct ImportedMesh {
  struct Source {
    int part;  // of `parts`
    int face;  // from 1
    int line;  // from 1, of an OBJ file
  };

  // A point sewn to the line between two others, at that share of the way to the second.
  struct Stitch {
    int point, first, second;
    double share;
  };

  std::vector<Vector3d> positions;  // of particles, in the unit of the file, then m
  std::vector<Vector2d> flat;       // (u, v) in the unit of the file, then m
  Triangles triangles;              // particles of each
  Triangles corners;                // places in `flat` of each, or kNoCorner
  std::vector<int> panel;           // of each triangle, in `panels`
  std::vector<Source> source;       // of each triangle
  std::vector<std::string> panels;  // names as scenes have them
  std::string panels_by;            // what makes a panel in the file: "g"
  std::vector<std::string> parts;   // of a glTF file: "shirt, primitive 0"
  std::vector<Stitch> stitches;     // of an OBJ file of C-IPC, until they are sewn
  std::vector<std::string> notes;   // what was done on the way, a sentence each
};

// "line 812 (face 400)", or "shirt, primitive 0, triangle 17"
std::string place(const ImportedMesh& mesh, int triangle);
// "panel front, at (0.12, 1.3, 0.05)"
std::string surroundings(const ImportedMesh& mesh, int triangle);
std::string position_text(const Vector3d& position);

// A name as the interface has them, [a-z0-9_-], of any text.
std::string plain_name(std::string_view text, std::string_view without = "panel");
// A new panel; its name is made plain, and "front-2" where there is one.
int add_panel(ImportedMesh& mesh, std::string_view name);

// Leaves only those triangles.
void keep_triangles(ImportedMesh& mesh, const std::vector<bool>& kept);
// Leaves out particles that no triangle has; how many.
int drop_unused_points(ImportedMesh& mesh);
// Makes triangles of one panel neighbours in their arrays, and leaves out panels without any.
void order_by_panel(ImportedMesh& mesh);

// Diagonal of the box around, of particles.
double size_of(const std::vector<Vector3d>& positions);

// What is wrong with a mesh, and where.
struct Fault {
  std::string place;
  std::string what;
};
// The first five of one kind, and how many more there are.
void add_some(std::vector<Fault>& faults, const std::vector<Fault>& kind);
Problem mesh_problem(const std::string& path, const std::vector<Fault>& faults);

}  // namespace weft::client
