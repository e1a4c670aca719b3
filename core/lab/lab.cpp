#include "core/lab/lab.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/forces/elastic.h"
#include "core/lab/drape.h"
#include "core/lab/elastica.h"
#include "core/lab/specimen.h"
#include "core/model/text.h"

namespace weft {
namespace {

constexpr int kMostParticles = 6000;  // of a specimen: seconds of Newton's method
constexpr double kWidth = 0.025;      // of a strip, m: ASTM D1388

int steps_of(double length, double spacing) {
  return std::max(1, static_cast<int>(std::lround(length / spacing)));
}

Matrix3Xd forces(const Mesh& mesh, const Matrix3Xd& x) {
  Matrix3Xd force = Matrix3Xd::Zero(3, x.cols());
  add_elastic_forces(mesh, x, Matrix3Xd::Zero(3, x.cols()), force);
  return force;
}

// Strips of 200 x 50 mm between clamps, as ISO 13934-1 takes them, pulled by 1 %.
constexpr double kStrip = 0.2, kStripWidth = 0.05, kPull = 0.01;

void pull(const MeasuredTextile& textile, const LabOrder& order, double spacing,
          const std::stop_token& stop, LabReport& report) {
  const int rows = steps_of(kStripWidth, spacing) + 1, columns = steps_of(kStrip, spacing) + 1;
  Specimen specimen = cut(textile, order.bending, rows, columns, spacing);
  specimen.start.row(0) *= 1 + kPull;
  specimen.hold_column(0);
  specimen.hold_column(columns - 1);
  const double width = (rows - 1) * spacing;
  const auto modulus = [&](const Matrix3Xd& x) {
    const Matrix3Xd force = forces(specimen.mesh, x);
    double sum = 0;
    for (int r = 0; r < rows; ++r) sum -= force(0, specimen.at(r, columns - 1));
    return sum / width / kPull;
  };

  // nowhere free to narrow: the strip is stretched alike everywhere
  const double clamped = modulus(specimen.start);
  const double tolerance = 1e-9 * textile.tensile_warp * kPull * spacing;
  const Equilibrium rest = find_equilibrium(specimen.mesh, specimen.held, Vector3d::Zero(),
                                            specimen.start, tolerance, stop);
  note_unsettled(rest, tolerance, report);
  report.values.push_back(
      value("modulus, free width", "N/m", specimen, textile.tensile_warp, modulus(rest.x)));
  report.values.push_back(
      value("modulus, clamped width", "N/m", specimen, textile.tensile_warp, clamped));
}

LabReport tensile(const LabOrder& order, const LabWatch& watch) {
  const MeasuredTextile textile = along_warp(order);
  LabReport report;
  report.method =
      "A strip of 200 x 50 mm, both ends clamped, pulled by 1 %: force at a clamp over width and "
      "strain. Asked: the tensile stiffness given. Free: the strip may narrow between its clamps; "
      "clamped: its width is held.";
  const std::vector<double> spacings =
      order.spacings.empty() ? std::vector{0.025, 0.0125, 0.00625} : order.spacings;
  for_each_specimen(spacings, watch,
                    [&](double spacing) { pull(textile, order, spacing, watch.stop, report); });
  if (2 * textile.shear > 0.1 * textile.tensile_warp)
    report.notes.push_back(join("held at its width it measures E + 2 G, ",
                                textile.tensile_warp + 2 * textile.shear,
                                " N/m: the shear connections pull along with the threads"));
  return report;
}

// Frames of 0.1 m, hinged at the corners, sheared by 1 degree.
LabReport shear(const LabOrder& order, const LabWatch& watch) {
  constexpr double kSide = 0.1, kAngle = std::numbers::pi / 180;
  const MeasuredTextile textile = along_warp(order);
  LabReport report;
  report.method =
      "A frame of 100 mm, hinged at its corners, sheared by 1 degree: what its energy grows by "
      "over area and angle squared, times 2. Asked: the shear stiffness given.";
  const std::vector<double> spacings =
      order.spacings.empty() ? std::vector{0.02, 0.01, 0.005} : order.spacings;
  for_each_specimen(spacings, watch, [&](double spacing) {
    const int side = steps_of(kSide, spacing) + 1;
    Specimen specimen = cut(textile, order.bending, side, side, spacing);
    // rows lean, their length and that of the columns stay
    Matrix3Xd x = specimen.start;
    x.row(0) += std::sin(kAngle) * specimen.start.row(2);
    x.row(2) *= std::cos(kAngle);
    const double energy = elastic_energy(specimen.mesh, x);
    const double area = std::pow((side - 1) * spacing, 2);
    report.values.push_back(value("shear stiffness", "N/m per radian", specimen, textile.shear,
                                  2 * energy / (area * kAngle * kAngle)));
  });
  const auto* law = std::get_if<ChoiKo>(&order.bending);
  if (law != nullptr && law->diagonal_bend)
    report.notes.emplace_back(
        "the diagonal that shear shortens is a bend connection too and pushes back, up to its "
        "clamp, as if the textile were stiffer: the more so the finer the mesh. Without "
        "diagonal_bend, or with ISOMETRIC, it is not");
  return report;
}

// Figure 2 of the paper, for a connection of this textile along the specimen.
LabReport bending_curve(const LabOrder& order, const LabWatch& watch) {
  constexpr int kPoints = 201;
  const MeasuredTextile textile = along_warp(order);
  const auto& law = std::get<ChoiKo>(order.bending);
  LabReport report;
  report.method =
      "The force of one bend connection over r = l / L: f_b by the exact curve (eq. 3 and 4), f_b* "
      "with the clamp (eq. 5), and as the evaluator gives it. Asked: f_b* by the exact curve; "
      "found: the evaluator's, where they are farthest apart.";
  const std::vector<double> spacings = order.spacings.empty() ? std::vector{0.02} : order.spacings;
  for_each_specimen(spacings, watch, [&](double spacing) {
    const Specimen specimen = cut(textile, order.bending, 5, 5, spacing);
    const LatticeConstants k = lattice_constants(specimen.sheet);
    ChoiKo truth = law;
    truth.evaluator = Evaluator::kExact;
    truth.fold_clamp = false;
    const double rest = 2 * spacing, scale = k.bend_warp / (rest * rest);
    const BendingForce exact(truth, k.bend_warp, k.clamp_warp, rest);
    const BendingForce given(law, k.bend_warp, k.clamp_warp, rest);
    LabCurve curve{join("spacing ", 1000 * spacing, " mm"),
                   {"r", "f_b N", "f_b* N", "approximation N", "error N"},
                   {}};
    double farthest_asked = 0, farthest_found = 0;
    for (int p = 0; p < kPoints; ++p) {
      const double r = static_cast<double>(p) / (kPoints - 1);
      const auto force = [&](const BendingForce& law_of) {
        return std::visit([&](const auto& g) { return law_of.force(g, r * rest); },
                          law_of.function());
      };
      const double asked = force(exact), found = force(given);
      curve.rows.push_back({r, scale * ExactBending().value(r), asked, found, found - asked});
      if (p == 0 || std::abs(found - asked) > std::abs(farthest_found - farthest_asked))
        farthest_asked = asked, farthest_found = found;
    }
    report.values.push_back(
        value("f_b*, farthest off", "N", specimen, farthest_asked, farthest_found));
    report.curves.push_back(std::move(curve));
    if (exact.clamp_rules())
      report.notes.push_back(join("at a spacing of ", 1000 * spacing,
                                  " mm the clamp rules for every r: k_b has no effect"));
    else
      report.notes.push_back(join("at a spacing of ", 1000 * spacing,
                                  " mm it bends as f_b says above a curvature of ",
                                  exact.least_curvature(), " 1/m"));
  });
  return report;
}

// A strip over an edge. Its clamp acts half a spacing inside the last held column, so that
// (columns + 1/2) spacings make the overhang.
struct Cantilever {
  static constexpr int kHeld = 2;
  Specimen specimen;
  Eigen::Vector2d asked;  // place of the tip
  double tolerance;       // N
  int row, columns;       // the row that is looked at, free columns

  Cantilever(const MeasuredTextile& textile, const BendingLaw& bending, double overhang, int free)
      : columns(free) {
    const double spacing = overhang / (columns + 0.5);
    constexpr int kMostRows = 13;
    const int rows = std::holds_alternative<Isometric>(bending)
                         ? 3  // nothing couples them but twist: width has no effect
                         : std::clamp(steps_of(kWidth, spacing) + 1, 5, kMostRows);
    specimen = cut(textile, bending, rows, columns + kHeld, spacing);
    row = rows / 2;
    for (int c = 0; c < kHeld; ++c) specimen.hold_column(c);
    tolerance = 1e-5 * textile.areal_density * spacing * spacing * kStandardGravity;

    // from the elastica's own shape, with the last held column at s = h / 2
    const Eigen::Matrix2Xd shape = overhang * heavy_elastica(kCantileverQ, 2 * columns + 2);
    asked = shape.col(2 * columns + 1);
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < columns + kHeld; ++c) {
        const int beyond = c - kHeld + 1;
        Eigen::Vector2d place((beyond + 0.5) * spacing, 0);
        if (beyond > 0) place = shape.col(2 * beyond + 1);
        specimen.start.col(specimen.at(r, c)).head<2>() = Eigen::Vector2d(place.x(), -place.y());
      }
  }

  Equilibrium settle(const std::stop_token& stop, LabReport& report) const {
    Equilibrium rest = find_equilibrium(specimen.mesh, specimen.held, {0, -kStandardGravity, 0},
                                        specimen.start, tolerance, stop);
    note_unsettled(rest, tolerance, report);
    return rest;
  }
  LabValue angle(const Equilibrium& rest) const {
    const Vector3d tip = rest.x.col(specimen.at(row, columns + kHeld - 1));
    return value("chord angle", "degrees", specimen, chord_angle(asked.x(), asked.y()),
                 chord_angle(tip.x(), -tip.y()));
  }
};

void hang_over(const MeasuredTextile& textile, const LabOrder& order, double overhang, int columns,
               const std::stop_token& stop, LabReport& report) {
  Cantilever strip(textile, order.bending, overhang, columns);
  const Equilibrium rest = strip.settle(stop, report);
  report.values.push_back(strip.angle(rest));
  LabCurve curve{
      join("spacing ", 1000 * strip.specimen.sheet.spacing(), " mm"), {"x m", "drop m"}, {}};
  for (int c = Cantilever::kHeld - 1; c < columns + Cantilever::kHeld; ++c) {
    const Vector3d x = rest.x.col(strip.specimen.at(strip.row, c));
    curve.rows.push_back({x.x(), -x.y()});
  }
  report.curves.push_back(std::move(curve));
}

double overhang_of(const MeasuredTextile& textile) {
  return std::cbrt(kCantileverQ * textile.bend_rigidity_warp /
                   (textile.areal_density * kStandardGravity));
}

// Free columns of the cantilever: from a quarter of the overhang down to 1 mm.
std::vector<int> cantilever_columns(const LabOrder& order, double overhang) {
  // interlaced connections are far off long before, and slow to settle
  const bool isometric = std::holds_alternative<Isometric>(order.bending);
  const double finest = std::max(0.001, overhang / (isometric ? 60 : 12));
  std::vector<int> columns;
  const auto add = [&](double spacing) {
    const int count = std::max(1, static_cast<int>(std::lround(overhang / spacing - 0.5)));
    if (std::find(columns.begin(), columns.end(), count) == columns.end()) columns.push_back(count);
  };
  if (!order.spacings.empty()) {
    for (const double spacing : order.spacings) add(spacing);
    return columns;
  }
  for (double spacing = overhang / 4; spacing > 1.4 * finest; spacing /= 2) add(spacing);
  add(finest);
  return columns;
}

LabReport cantilever(const LabOrder& order, const LabWatch& watch) {
  const MeasuredTextile textile = along_warp(order);
  const double overhang = overhang_of(textile);
  LabReport report;
  report.method = join(
      "ASTM D1388: a strip over an edge, of the overhang (8 B / w)^(1/3) = ", 1000 * overhang,
      " mm that its bending rigidity and weight call for. Asked: the angle of the chord from edge "
      "to tip by the heavy elastica, without stretch. The edge lies half a spacing inside the last "
      "column held, and the spacing divides the overhang.");
  for_each_specimen(cantilever_columns(order, overhang), watch, [&](int columns) {
    hang_over(textile, order, overhang, columns, watch.stop, report);
  });
  if (watch.stop.stop_requested()) return report;
  report.curves.push_back({"heavy elastica", {"x m", "drop m"}, {}});
  const Eigen::Matrix2Xd shape = heavy_elastica(kCantileverQ, 101);
  for (const Eigen::Vector2d point : shape.colwise())
    report.curves.back().rows.push_back({overhang * point.x(), overhang * point.y()});
  if (std::holds_alternative<ChoiKo>(order.bending)) {
    const LabValue& finest = *std::min_element(
        report.values.begin(), report.values.end(),
        [](const LabValue& a, const LabValue& b) { return a.spacing < b.spacing; });
    if (finest.found - finest.asked.value_or(finest.found) > 3)
      report.notes.push_back(join("at ", 1000 * finest.spacing,
                                  " mm the strip hangs too limp: interlaced connections lose their "
                                  "bending on fine meshes. ISOMETRIC does not"));
  }
  return report;
}

// Threads 0.3 m long between hooks 0.24 m apart.
LabReport chain(const LabOrder& order, const LabWatch& watch) {
  constexpr double kLength = 0.3, kSpan = 0.24;
  MeasuredTextile threads = along_warp(order);
  threads.shear = threads.bend_rigidity_warp = threads.bend_rigidity_weft = 0;
  LabReport report;
  report.method =
      "Threads of 300 mm between hooks 240 mm apart, with the textile's weight and tensile "
      "stiffness alone. Asked: the sag of the elastic catenary.";
  const std::vector<double> spacings =
      order.spacings.empty() ? std::vector{0.06, 0.03, 0.015, 0.0075} : order.spacings;
  for_each_specimen(spacings, watch, [&](double wanted) {
    const int pairs = std::max(1, static_cast<int>(std::lround(kLength / wanted / 2)));
    const double spacing = kLength / (2 * pairs);
    Specimen specimen = cut(threads, Isometric{}, 2, 2 * pairs + 1, spacing);
    const double width = spacing;  // of two edge threads, half a spacing each
    const double weight = threads.areal_density * kStandardGravity * width;
    const Eigen::Matrix2Xd shape =
        elastic_catenary(threads.tensile_warp * width, weight, kLength, kSpan, 2 * pairs + 1);
    for (int r = 0; r < 2; ++r)
      for (int c = 0; c < specimen.columns(); ++c)
        specimen.start.col(specimen.at(r, c)).head<2>() =
            Eigen::Vector2d(shape(0, c), -shape(1, c));
    specimen.hold_column(0);
    specimen.hold_column(2 * pairs);
    const double tolerance = 1e-7 * weight * spacing;
    const Equilibrium rest =
        find_equilibrium(specimen.mesh, specimen.held, {0, -kStandardGravity, 0}, specimen.start,
                         tolerance, watch.stop);
    note_unsettled(rest, tolerance, report);
    report.values.push_back(
        value("sag", "m", specimen, shape(1, pairs), -rest.x(1, specimen.at(0, pairs))));
  });
  return report;
}

// The most particles that a specimen of this spacing may have.
double particles_of(const LabOrder& order, double spacing) {
  switch (order.test) {
    case LabTest::kTensile:
      return (kStrip / spacing + 1) * (kStripWidth / spacing + 1);
    case LabTest::kShear:
      return std::pow(0.1 / spacing + 1, 2);
    case LabTest::kCantilever:
      return (overhang_of(along_warp(order)) / spacing + 2) *
             std::clamp(kWidth / spacing + 1, 5.0, 26.0);
    case LabTest::kChain:
      return 2 * (0.3 / spacing + 1);
    case LabTest::kDrape:
      return drape_particles(spacing);
    case LabTest::kBending:
      break;
  }
  return 25;
}

}  // namespace

std::vector<Problem> find_problems(const LabOrder& order) {
  // what a scene would say of its sheet
  Scene scene;
  scene.sheets.resize(1);
  scene.sheets[0].name = "specimen";
  scene.sheets[0].shape = Grid{.spacing = 0.01};
  scene.sheets[0].textile.model = order.textile;
  scene.sheets[0].bending = order.bending;
  std::vector<Problem> problems = find_problems(scene);
  for (Problem& problem : problems) problem.field.erase(0, std::string("sheets[0].").size());
  if (!problems.empty()) return problems;
  const MeasuredTextile textile = along_warp(order);
  const std::string along = order.weft ? "weft" : "warp";
  if (order.test == LabTest::kBending && !std::holds_alternative<ChoiKo>(order.bending))
    problems.push_back({"bending", "is ISOMETRIC, which has no curve; the test is of CHOI_KO"});
  const bool bends = order.test == LabTest::kBending || order.test == LabTest::kCantilever;
  if (bends && textile.bend_rigidity_warp < 1e-9)
    problems.push_back({"textile.measured.bend_rigidity_" + along + "_n_m",
                        join(textile.bend_rigidity_warp,
                             " N m is below 1e-09 N m, the least that "
                             "this test bends")});
  if (order.test != LabTest::kShear && textile.tensile_warp < 1)
    problems.push_back(
        {"textile.measured.tensile_" + along + "_n_per_m",
         join(textile.tensile_warp, " N/m is below 1 N/m, the least that this test holds")});
  if (!problems.empty()) return problems;

  constexpr std::size_t kMostSpacings = 16;
  if (order.spacings.size() > kMostSpacings)
    problems.push_back({"spacings_m", join("has ", order.spacings.size(), " values; at most ",
                                           kMostSpacings, " are run")});
  for (std::size_t k = 0; k < order.spacings.size(); ++k) {
    const double spacing = order.spacings[k];
    const std::string field = join("spacings_m[", k, "]");
    if (!(spacing >= 1e-5 && spacing <= 0.1))
      problems.push_back({field, join(spacing, " m is not within 1e-05 to 0.1 m")});
    else if (particles_of(order, spacing) > kMostParticles)
      problems.push_back({field, join(spacing, " m makes a specimen of more than ", kMostParticles,
                                      " particles")});
  }
  return problems;
}

LabReport run_lab(const LabOrder& order, const LabWatch& watch) {
  switch (order.test) {
    case LabTest::kTensile:
      return tensile(order, watch);
    case LabTest::kShear:
      return shear(order, watch);
    case LabTest::kBending:
      return bending_curve(order, watch);
    case LabTest::kChain:
      return chain(order, watch);
    case LabTest::kDrape:
      return drape(order, watch);
    case LabTest::kCantilever:
      break;
  }
  return cantilever(order, watch);
}

}  // namespace weft
