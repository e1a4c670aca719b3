#pragma once

#include <string>

#include "core/lab/equilibrium.h"
#include "core/lab/lab.h"
#include "core/lattice/lattice.h"

namespace weft {

// A piece of a textile that is put to a test.
struct Specimen {
  SheetDefinition sheet;
  Mesh mesh;
  Matrix3Xd start;      // (3 x particles) m
  Eigen::ArrayXi held;  // (particles) 1 keeps its place
  double spacing = 0;   // m

  void hold_at(double x);  // what starts there, m

  // of a lattice
  int rows() const { return grid_of(sheet).rows; }
  int columns() const { return grid_of(sheet).columns; }
  int at(int row, int column) const { return row * columns() + column; }
  void hold_column(int column);
};

// A rectangle, of which nothing is held.
Specimen cut(const MeasuredTextile& textile, const BendingLaw& bending, int rows, int columns,
             double spacing);

// A piece of triangles, u along x and v along z, of which nothing is held.
Specimen cut(const MeasuredTextile& textile, const BendingLaw& bending, const RestShape& shape,
             double spacing);

// A rectangle of whole spacings on the mesh of an order, along x and z.
Specimen cut_rectangle(const LabOrder& order, double length, double width, double spacing);

// The textile of an order; one whose specimen is cut along the weft is turned.
MeasuredTextile along_warp(const LabOrder& order);

LabValue value(const std::string& quantity, const std::string& unit, const Specimen& specimen,
               std::optional<double> asked, double found);

// Puts each specimen to the test, until a stop.
template <class Specimens, class Test>
void for_each_specimen(const Specimens& specimens, const LabWatch& watch, const Test& test) {
  int done = 0;
  for (const auto& specimen : specimens) {
    if (watch.stop.stop_requested()) return;
    if (watch.progress) watch.progress(done++, static_cast<int>(specimens.size()));
    test(specimen);
  }
}

void note_unsettled(const Equilibrium& rest, double tolerance, LabReport& report);

}  // namespace weft
