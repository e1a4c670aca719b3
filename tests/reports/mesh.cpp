// Meshes of triangles: what textiles measure on them, beside the lattice and beside hinges.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/forces/curvature.h"
#include "core/lab/equilibrium.h"
#include "core/lab/lab.h"
#include "core/motion/stability.h"
#include "core/triangles/fit.h"
#include "core/triangles/triangles.h"
#include "tests/reports/report.h"
#include "tests/reports/trial.h"
#include "tests/support/core/scenes.h"
#include "tests/support/core/triangle_meshes.h"

namespace weft::reports {
namespace {

using Cells = std::vector<std::string>;

constexpr std::array kCuts = {Cut::kRight, Cut::kAlternating, Cut::kEquilateral, Cut::kIrregular};

std::string name_of(const std::optional<Cut>& cut) {
  constexpr std::array names = {"right", "alternating", "equilateral", "irregular"};
  return cut ? names[static_cast<std::size_t>(*cut)] : "lattice";
}

MeasuredTextile wool() {
  MeasuredTextile textile = kWool;
  textile.air_drag = 0;
  return textile;
}

SheetDefinition sheet_of(const SheetShape& shape) {
  SheetDefinition sheet;
  sheet.name = "sheet";
  sheet.shape = shape;
  sheet.textile.model = wool();
  sheet.textile.damping = 0;
  sheet.bending = Isometric{};
  return sheet;
}

// Bending energy of hinges by Bergou et al. 2006 per stiffness: for every inner edge 3 / A times
// the square of the cotangent-weighted sum of its four particles, J / (N m).
double hinge_energy(const RestShape& shape, const Matrix3Xd& x) {
  struct Side {
    int opposite;
    std::array<double, 2> cotangent;  // of its angles at the smaller and the larger particle
    double area;
  };
  std::map<Connection, std::vector<Side>> sides;
  const auto cotangent = [](const Vector2d& a, const Vector2d& b) {
    return a.dot(b) / std::abs(a.x() * b.y() - b.x() * a.y());
  };
  for (std::size_t t = 0; t < shape.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      std::size_t from = (k + 1) % 3, to = (k + 2) % 3;
      const auto& triangle = shape.triangles[t];
      if (triangle[from] > triangle[to]) std::swap(from, to);
      const auto& corner = shape.corners[t];
      sides[{triangle[from], triangle[to]}].push_back(
          {triangle[k],
           {cotangent(corner[to] - corner[from], corner[k] - corner[from]),
            cotangent(corner[from] - corner[to], corner[k] - corner[to])},
           area(corner)});
    }
  }
  double energy = 0;
  for (const auto& [edge, two] : sides) {
    if (two.size() != 2) continue;
    const auto& [one, other] = std::tie(two[0], two[1]);
    const Vector3d sum = (one.cotangent[1] + other.cotangent[1]) * x.col(edge.first) +
                         (one.cotangent[0] + other.cotangent[0]) * x.col(edge.second) -
                         (one.cotangent[0] + one.cotangent[1]) * x.col(one.opposite) -
                         (other.cotangent[0] + other.cotangent[1]) * x.col(other.opposite);
    energy += 1.5 / (one.area + other.area) * sum.squaredNorm();
  }
  return energy;
}

Matrix3Xd cylinder(const RestShape& shape, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  const std::vector<Vector2d> points = points_of(shape);
  Matrix3Xd x(3, shape.particles);
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const Vector2d& point = points[static_cast<std::size_t>(i)];
    const double along = c * point.x() + s * point.y();
    x.col(i) << std::sin(along), -std::cos(along), c * point.y() - s * point.x();
  }
  return x;
}

void cylinders(Page& page, bool large) {
  page.text("## A cylinder");
  page.text(
      "Energy of a square of 400 mm on a cylinder of radius 1 m over B kappa^2 / 2 times its area, "
      "by the angle between threads and bending: 1 is right. Hinges: 3 / A |sum of cotangents x|^2 "
      "an edge (Bergou et al. 2006), as many engines bend; with whatever factor in front, they "
      "depend on mesh and direction, and finer meshes do not help.");
  std::vector<Cells> rows;
  Plot plot{"Cylinder: energy over what is right", "degrees", "energy", {}, true};
  for (const Cut cut : kCuts)
    for (const double spacing : large ? std::vector{0.04, 0.02, 0.01} : std::vector{0.04, 0.02}) {
      const RestShape shape = testing::square(cut, 0.4, spacing);
      Surface surface;
      surface.fits = fit_curvature(shape);
      surface.bend = {{1, 1, 1}};
      const double right = areas(shape).sum() / 2;
      Cells row = {name_of(cut), number(1e3 * spacing)};
      Series ours{name_of(cut) + ", fits", {}}, theirs{name_of(cut) + ", hinges", {}};
      for (const int degrees : {0, 30, 45, 90}) {
        const Matrix3Xd x = cylinder(shape, degrees * std::numbers::pi / 180);
        const double fits = curvature_energy(surface, x) / right;
        const double hinges = hinge_energy(shape, x) / right;
        row.push_back(fmt::format("{:.4f}", fits));
        row.push_back(fmt::format("{:.2f}", hinges));
        ours.points.emplace_back(degrees, fits);
        theirs.points.emplace_back(degrees, hinges);
        page.row({"cylinder " + std::to_string(degrees), name_of(cut), number(spacing),
                  number(fits), number(hinges)});
      }
      rows.push_back(row);
      if (spacing == 0.02) plot.series.push_back(theirs);
      if (spacing == 0.02 && cut == Cut::kIrregular) plot.series.push_back(ours);
    }
  page.table({"mesh", "mm", "fits 0", "hinges 0", "fits 30", "hinges 30", "fits 45", "hinges 45",
              "fits 90", "hinges 90"},
             rows);
  page.plot("cylinder", plot);
}

LabReport test(LabTest kind, const std::optional<Cut>& mesh, const std::vector<double>& spacings) {
  return run_lab({kind, wool(), Isometric{}, false, spacings, mesh});
}

void cantilevers(Page& page, bool large) {
  page.text("## A strip over an edge");
  page.text(
      "ASTM D1388 with wool, whose overhang is 30 mm: degrees of the chord less those of the heavy "
      "elastica. A spacing divides the overhang.");
  std::vector<Cells> rows;
  Plot plot{"D1388: error over spacing", "spacing mm", "degrees", {}, true};
  std::vector<std::optional<Cut>> meshes = {std::nullopt};
  meshes.insert(meshes.end(), kCuts.begin(), kCuts.end());
  std::vector<double> spacings = {0.008, 0.0065, 0.005, 0.004, 0.003, 0.002};
  if (large) spacings.push_back(0.001);
  for (const auto& mesh : meshes) {
    Series series{name_of(mesh), {}};
    for (const LabValue& value : test(LabTest::kCantilever, mesh, spacings).values) {
      const double error = value.found - value.asked.value_or(0);
      series.points.emplace_back(1e3 * value.spacing, error);
      rows.push_back({name_of(mesh), fmt::format("{:.2f}", 1e3 * value.spacing),
                      std::to_string(value.particles), fmt::format("{:+.3f}", error)});
      page.row({"cantilever", name_of(mesh), number(value.spacing), number(error), ""});
    }
    plot.series.push_back(series);
  }
  page.table({"mesh", "spacing mm", "particles", "error, degrees"}, rows);
  page.plot("cantilever", plot);
}

void moduli(Page& page) {
  page.text("## Strip and frame");
  page.text(
      "What a strip that is pulled by 0.2 % and a frame sheared by 1 degree measure over what was "
      "given. A lattice is pulled by 1 %; its shear connections pull along.");
  std::vector<Cells> rows;
  std::vector<std::optional<Cut>> meshes = {std::nullopt};
  meshes.insert(meshes.end(), kCuts.begin(), kCuts.end());
  for (const auto& mesh : meshes) {
    const auto error = [&](LabTest kind) {
      const LabValue value = test(kind, mesh, {0.01}).values[0];
      page.row({value.quantity, name_of(mesh), "0.01", number(value.found),
                number(value.asked.value_or(0))});
      return fmt::format("{:+.2f} %", 100 * (value.found / value.asked.value_or(1) - 1));
    };
    rows.push_back({name_of(mesh), error(LabTest::kTensile), error(LabTest::kShear)});
  }
  page.table({"mesh", "tensile", "shear"}, rows);
}

// A square of 0.2 m that hangs from two corners, at rest.
Matrix3Xd hung(const SheetDefinition& sheet, int columns) {
  const Mesh mesh = make_mesh(sheet);
  Eigen::ArrayXi held = Eigen::ArrayXi::Zero(sheet.particle_count());
  held[0] = held[columns] = 1;
  Matrix3Xd start = start_positions(sheet);
  const double reach = start(2, start.cols() - 1);
  for (auto place : start.colwise())  // hung down already, and a little off its plane
    place = Vector3d(place.x(), -place.z(), 0.01 * std::sin(place.z() / reach));
  return find_equilibrium(mesh, held, {0, -kStandardGravity, 0}, start, 1e-9).x;
}

void hung_sheets(Page& page) {
  page.text("## A lattice given as triangles");
  page.text(
      "A square of 200 mm of wool hung from two corners, at rest: root mean square of the "
      "distances "
      "of its particles from those of the same kind at half the spacing, and of triangles "
      "(alternating) from the lattice. Up to the mesh error of either they are one.");
  std::map<std::pair<bool, int>, Matrix3Xd> rest;
  for (const int columns : {10, 20, 40})
    for (const bool triangles : {false, true}) {
      const double spacing = 0.2 / columns;
      const SheetShape shape =
          triangles ? SheetShape(
                          complete(triangle_mesh(testing::square(Cut::kAlternating, 0.2, spacing))))
                    : SheetShape(Grid{columns + 1, columns + 1, spacing});
      rest[{triangles, columns}] = hung(sheet_of(shape), columns);
    }
  const auto apart = [&](const Matrix3Xd& a, const Matrix3Xd& b, int columns, int finer) {
    double sum = 0;
    for (int r = 0; r <= columns; ++r)
      for (int c = 0; c <= columns; ++c)
        sum += (a.col(r * (columns + 1) + c) - b.col(r * finer * (finer * columns + 1) + c * finer))
                   .squaredNorm();
    return 1e3 * std::sqrt(sum / std::pow(columns + 1, 2));
  };
  std::vector<Cells> rows;
  for (const int columns : {10, 20, 40}) {
    Cells row = {number(200.0 / columns)};
    for (const bool triangles : {false, true})
      row.push_back(columns == 40 ? ""
                                  : number(apart(rest.at({triangles, columns}),
                                                 rest.at({triangles, 2 * columns}), columns, 2)));
    const double between = apart(rest.at({false, columns}), rest.at({true, columns}), columns, 1);
    row.push_back(number(between));
    page.row({"hung", "alternating", number(0.2 / columns), number(between), ""});
    rows.push_back(row);
  }
  page.table({"spacing mm", "lattice to its finer one, mm", "triangles to their finer ones, mm",
              "triangles to lattice, mm"},
             rows);
}

void energies(Page& page, bool large) {
  const double seconds = large ? 10 : 2;
  page.text("## Energy");
  page.text(fmt::format(
      "A free square of 200 mm at 20 mm, stretched by 1 % and crumpled by 0.2 mm, without damping, "
      "gravity or air, at the planned step in double: mean of its energy over the last tenth of {} "
      "s over that of the first.",
      seconds));
  std::vector<Cells> rows;
  std::vector<std::optional<Cut>> meshes = {std::nullopt};
  meshes.insert(meshes.end(), kCuts.begin(), kCuts.end());
  for (const auto& mesh : meshes) {
    SheetDefinition sheet =
        sheet_of(mesh ? SheetShape(complete(triangle_mesh(testing::square(*mesh, 0.2, 0.02))))
                      : SheetShape(Grid{11, 11, 0.02}));
    sheet.start_positions = testing::values(1.01 * start_positions(sheet) +
                                            2e-4 * testing::noise(sheet.particle_count()));
    Scene scene = testing::floating(sheet);
    scene.solver.precision = Precision::kDouble;
    scene.solver.plain = true;
    scene.solver.frame_step = 0.01;
    Simulation simulation(scene);
    const int frames = static_cast<int>(seconds / scene.solver.frame_step), tenth = frames / 10;
    double first = 0, last = 0;
    for (int k = 0; k < frames; ++k) {
      if (!simulation.advance_frame()) break;
      const FrameStats stats = simulation.stats();
      const double energy = stats.kinetic_energy + stats.potential_energy;
      if (k < tenth) first += energy;
      if (k >= frames - tenth) last += energy;
    }
    page.row({"energy", name_of(mesh), "0.02", number(last / first), ""});
    rows.push_back({name_of(mesh), fmt::format("{:.4f}", last / first),
                    std::to_string(simulation.repairs().size())});
  }
  page.table({"mesh", "energy left", "repairs"}, rows);
}

void steps(Page& page) {
  page.text("## Stable step");
  page.text(
      "Of a square of 120 mm at 20 mm, flat and stretched by 2 %: the bound before the run, the "
      "closer estimate, and the longest step with which a disturbance of 1 nm about that shape "
      "does not grow in 1500 steps.");
  std::vector<Cells> rows;
  for (const Cut cut : kCuts)
    for (const double strain : {0.0, 0.02}) {
      const SheetDefinition sheet =
          sheet_of(complete(triangle_mesh(testing::square(cut, 0.12, 0.02))));
      const Mesh mesh = make_mesh(sheet);
      const Matrix3Xd x = (1 + strain) * start_positions(sheet);
      const StableStep step =
          stable_step(mesh, mesh.mass.cwiseInverse(), IntegratorKind::kVerlet, 0, x);
      const double measured = testing::measured_step(mesh, x);
      page.row({"step", name_of(cut), number(strain), number(step.linear_bound), number(measured)});
      rows.push_back({name_of(cut), fmt::format("{:.0f} %", 100 * strain),
                      number(1e6 * step.linear_bound), number(1e6 * step.estimate),
                      number(1e6 * measured), fmt::format("{:.3f}", measured / step.linear_bound),
                      fmt::format("{:.3f}", measured / step.estimate)});
    }
  page.table({"mesh", "strain", "bound us", "estimate us", "measured us", "measured / bound",
              "measured / estimate"},
             rows);
}

// Of what weft-bench left there.
void speeds(Page& page, const std::filesystem::path& folder) {
  std::ifstream file(folder / "runs.json");
  if (!file) return;
  page.text("## Speed");
  std::vector<Cells> rows;
  for (const auto& run : nlohmann::json::parse(file).at("benchmarks"))
    if (run.value("aggregate_name", "median") == "median" &&
        run.value("name", "").starts_with("triangles"))
      rows.push_back({run.value("run_name", ""),
                      fmt::format("{:.1f}", 1e-6 * run.value("items_per_second", 0.0))});
  page.table({"benchmark", "million particle-substeps/s"}, rows);
}

}  // namespace

void mesh(const std::filesystem::path& folder, const std::string& commit, bool large) {
  Page page(folder, {"what", "mesh", "spacing_m", "found", "beside"});
  page.text("# Meshes of triangles");
  page.text("Made by `./dev bench mesh` on " + machine(commit) +
            ". Squares with equal or alternating diagonals, equilateral triangles, and a grid "
            "whose points are moved by up to 0.3 of its spacing.");
  cylinders(page, large);
  cantilevers(page, large);
  moduli(page);
  hung_sheets(page);
  energies(page, large);
  steps(page);
  speeds(page, folder);
  page.write();
}

}  // namespace weft::reports
