#include "core/lab/specimen.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/model/text.h"
#include "core/triangles/triangles.h"

namespace weft {

void Specimen::hold_column(int column) {
  for (int r = 0; r < rows(); ++r) held[at(r, column)] = 1;
}

void Specimen::hold_at(double x) {
  for (Eigen::Index i = 0; i < held.size(); ++i)
    if (std::abs(start(0, i) - x) < 1e-6 * spacing) held[i] = 1;
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
  specimen.spacing = spacing;
  return specimen;
}

Specimen cut(const MeasuredTextile& textile, const BendingLaw& bending, const RestShape& shape,
             double spacing) {
  Specimen specimen;
  specimen.sheet.name = "specimen";
  specimen.sheet.shape = complete(triangle_mesh(shape));
  specimen.sheet.textile.model = textile;
  specimen.sheet.textile.damping = 0;
  specimen.sheet.bending = bending;
  specimen.mesh = make_triangles(specimen.sheet);
  specimen.start = start_positions(specimen.sheet);
  specimen.held.setZero(shape.particles);
  specimen.spacing = spacing;
  return specimen;
}

Specimen cut_rectangle(const LabOrder& order, double length, double width, double spacing) {
  if (order.mesh)
    return cut(along_warp(order), order.bending, cut_rectangle(*order.mesh, length, width, spacing),
               spacing);
  const auto particles = [&](double size) {
    return std::max(1, static_cast<int>(std::lround(size / spacing))) + 1;
  };
  return cut(along_warp(order), order.bending, particles(width), particles(length), spacing);
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
  return {quantity, unit, specimen.spacing, static_cast<int>(specimen.start.cols()), asked, found};
}

void note_unsettled(const Equilibrium& rest, double tolerance, LabReport& report) {
  if (!rest.found)
    report.notes.push_back(join("at rest only up to ", rest.residual, " N, not the ", tolerance,
                                " N asked for: the figure is rough"));
}

}  // namespace weft
