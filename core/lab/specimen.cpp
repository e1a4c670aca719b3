#include "core/lab/specimen.h"

#include <utility>

#include "core/model/text.h"

namespace weft {

void Specimen::hold_column(int column) {
  for (int r = 0; r < rows(); ++r) held[at(r, column)] = 1;
}

Specimen cut(const MeasuredTextile& textile, const BendingLaw& bending, int rows, int columns,
             double spacing) {
  Specimen specimen;
  specimen.sheet.name = "specimen";
  specimen.sheet.shape = Grid{rows, columns, spacing};
  specimen.sheet.textile.model = textile;
  specimen.sheet.textile.damping = 0;
  specimen.sheet.bending = bending;
  specimen.mesh = make_lattice(specimen.sheet);
  specimen.start = start_positions(specimen.sheet);
  specimen.held.setZero(rows * columns);
  return specimen;
}

MeasuredTextile along_warp(const LabOrder& order) {
  MeasuredTextile textile = order.textile;
  if (order.weft) {
    std::swap(textile.tensile_warp, textile.tensile_weft);
    std::swap(textile.bend_rigidity_warp, textile.bend_rigidity_weft);
  }
  return textile;
}

LabValue value(const std::string& quantity, const std::string& unit, const Specimen& specimen,
               std::optional<double> asked, double found) {
  return {quantity, unit, specimen.sheet.spacing(), static_cast<int>(specimen.start.cols()),
          asked,    found};
}

void note_unsettled(const Equilibrium& rest, double tolerance, LabReport& report) {
  if (!rest.found)
    report.notes.push_back(join("at rest only up to ", rest.residual, " N, not the ", tolerance,
                                " N asked for: the figure is rough"));
}

}  // namespace weft
