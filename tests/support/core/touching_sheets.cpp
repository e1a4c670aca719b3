#include "tests/support/core/touching_sheets.h"

#include "core/cloth_contact/cuts.h"
#include "core/triangles/cut.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {

Textile soft_cloth(double friction) {
  Textile textile;
  textile.model = MeasuredTextile{.areal_density = 0.2,
                                  .tensile_warp = 200,
                                  .tensile_weft = 200,
                                  .shear = 20,
                                  .bend_rigidity_warp = 1e-5,
                                  .bend_rigidity_weft = 1e-5};
  textile.friction = friction;
  return textile;
}

SheetDefinition soft_lattice(int rows, int columns, double spacing) {
  SheetDefinition sheet;
  sheet.name = "lattice";
  sheet.shape = Grid{rows, columns, spacing};
  sheet.textile = soft_cloth();
  sheet.bending = Isometric{};
  return sheet;
}

SheetDefinition soft_rectangle(double length, double width, double spacing) {
  SheetDefinition sheet = soft_lattice(2, 2);
  sheet.name = "triangles";
  sheet.shape = complete(triangle_mesh(cut_rectangle(Cut::kAlternating, length, width, spacing)));
  return sheet;
}

Scene touching(const std::vector<SheetDefinition>& sheets) {
  Scene scene;
  scene.sheets = sheets;
  scene.cloth_contact = true;
  return scene;
}

std::vector<Matrix3Xd> by_sheet(const Simulation& simulation, const Matrix3Xd& all) {
  std::vector<Matrix3Xd> x;
  Eigen::Index first = 0;
  for (const SheetDefinition& sheet : simulation.scene().sheets) {
    x.emplace_back(all.middleCols(first, sheet.particle_count()));
    first += sheet.particle_count();
  }
  return x;
}

std::int64_t cuts_now(const Simulation& simulation) {
  return count_cuts(simulation.scene().sheets, by_sheet(simulation, positions(simulation))).count;
}

}  // namespace weft::testing
