#include "core/lab/lab.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/forces/curvature.h"
#include "core/forces/elastic.h"
#include "core/lab/drape.h"
#include "core/lab/elastica.h"
#include "core/lab/specimen.h"
#include "core/model/text.h"

namespace weft {
namespace {

constexpr int kLargestSpecimen = 6000;  // of a specimen: seconds of Newton's method
constexpr double kWidth = 0.025;        // of a strip, m: ASTM D1388

int steps_of(double length, double spacing) {
  return std::max(1, static_cast<int>(std::lround(length / spacing)));
}

Matrix3Xd forces(const Mesh& mesh, const Matrix3Xd& x) {
  Matrix3Xd force = Matrix3Xd::Zero(3, x.cols());
  add_elastic_forces(mesh, x, Matrix3Xd::Zero(3, x.cols()), force);
  return force;
}

// Strips of 200 x 50 mm between clamps, as ISO 13934-1 takes them, pulled by 1 %; of triangles by
// 0.2 %, for their law stiffens by 1.5 times the strain.
constexpr double kStrip = 0.2, kStripWidth = 0.05, kPull = 0.01, kPullOfTriangles = 0.002;

void pull(const LabOrder& order, double spacing, const std::stop_token& stop, LabReport& report) {
  const MeasuredTextile textile = along_warp(order);
  const double pulled = order.mesh ? kPullOfTriangles : kPull;
  Specimen specimen = cut_rectangle(order, kStrip, kStripWidth, spacing);
  const double width = specimen.start.row(2).maxCoeff(), end = specimen.start.row(0).maxCoeff();
  specimen.hold_at(0);
  const Eigen::ArrayXi left = specimen.held;
  specimen.hold_at(end);
  const Eigen::ArrayXi right = specimen.held - left;
  specimen.start.row(0) *= 1 + pulled;
  const auto modulus = [&](const Matrix3Xd& x) {
    const Matrix3Xd force = forces(specimen.mesh, x);
    return -force.row(0).dot(right.cast<double>().matrix()) / width / pulled;
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
      join("A strip of 200 x 50 mm, both ends clamped, pulled by ",
           100 * (order.mesh ? kPullOfTriangles : kPull),
           " %: force at a clamp over width and strain. Asked: the tensile stiffness given. Free: "
           "the strip may narrow between its clamps; clamped: its width is held.");
  const std::vector<double> spacings =
      order.spacings.empty() ? std::vector{0.025, 0.0125, 0.00625} : order.spacings;
  for_each_specimen(spacings, watch,
                    [&](double spacing) { pull(order, spacing, watch.stop, report); });
  if (order.mesh)
    report.notes.emplace_back(
        "St Venant-Kirchhoff's law stiffens as it is stretched: pulled by 1 % it measures 1.5 % "
        "more");
  else if (2 * textile.shear > 0.1 * textile.tensile_warp)
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
    const Specimen specimen = cut_rectangle(order, kSide, kSide, spacing);
    // rows lean, their length and that of the columns stay
    Matrix3Xd x = specimen.start;
    x.row(0) += std::sin(kAngle) * specimen.start.row(2);
    x.row(2) *= std::cos(kAngle);
    const double energy = elastic_energy(specimen.mesh, x);
    const double area = std::pow(specimen.start.row(2).maxCoeff(), 2);
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
  LabCurve curve{join("spacing ", 1000 * strip.specimen.spacing, " mm"), {"x m", "drop m"}, {}};
  for (int c = Cantilever::kHeld - 1; c < columns + Cantilever::kHeld; ++c) {
    const Vector3d x = rest.x.col(strip.specimen.at(strip.row, c));
    curve.rows.push_back({x.x(), -x.y()});
  }
  report.curves.push_back(std::move(curve));
}

// Two equal strips, joined by a column of squares across the edge that they hang over, so that no
// clamp cuts through the curvatures that are fitted.
RestShape double_strip(const RestShape& strip, double gap) {
  const std::vector<Vector2d> half = points_of(strip);
  std::vector<Vector2d> points;
  for (const double side : {1, -1})
    for (const Vector2d& point : half) points.emplace_back(side * (point.x() + gap / 2), point.y());
  std::vector<std::array<int, 3>> triangles = strip.triangles;
  const int n = strip.particles;
  for (const auto& [a, b, c] : strip.triangles) triangles.push_back({b + n, a + n, c + n});
  std::vector<int> end;
  for (int i = 0; i < n; ++i)
    if (half[static_cast<std::size_t>(i)].x() == 0) end.push_back(i);
  for (std::size_t k = 0; k + 1 < end.size(); ++k) {
    triangles.push_back({end[k] + n, end[k], end[k + 1]});
    triangles.push_back({end[k] + n, end[k + 1], end[k + 1] + n});
  }
  return rest_shape(points, triangles);
}

void hang_on_both_sides(const LabOrder& order, double overhang, int columns,
                        const std::stop_token& stop, LabReport& report) {
  const MeasuredTextile textile = along_warp(order);
  const double step = overhang / (columns + 0.5), spacing = step / column_step(*order.mesh);
  constexpr int kMostRows = 12;
  const double width = spacing * std::min(steps_of(kWidth, spacing), kMostRows);
  const RestShape half = cut_rectangle(*order.mesh, columns * step, width, spacing);
  Specimen strip = cut(textile, order.bending, double_strip(half, step), spacing);

  // from the elastica's own shape
  constexpr int kFine = 1000;
  const Eigen::Matrix2Xd shape = overhang * heavy_elastica(kCantileverQ, kFine + 1);
  const Matrix3Xd flat = strip.start;
  std::vector<Eigen::Index> middle;  // particles, of one side
  Eigen::Index end = 0;              // the one at its tip
  for (Eigen::Index i = 0; i < flat.cols(); ++i) {
    const double along = std::abs(flat(0, i)), off = std::abs(flat(2, i) - width / 2);
    strip.held[i] = along < 0.6 * step ? 1 : 0;
    const auto at = static_cast<Eigen::Index>(std::lround(along / overhang * kFine));
    if (strip.held[i] == 0)
      strip.start.col(i).head<2>() =
          Eigen::Vector2d(std::copysign(shape(0, at), flat(0, i)), -shape(1, at));
    if (flat(0, i) >= 0 && off < 0.51 * spacing) middle.push_back(i);
    const auto beyond = [&](Eigen::Index k) {
      return 100 * flat(0, k) - std::abs(flat(2, k) - width / 2);
    };
    if (beyond(i) > beyond(end)) end = i;
  }
  std::sort(middle.begin(), middle.end(),
            [&](Eigen::Index a, Eigen::Index b) { return flat(0, a) < flat(0, b); });
  const double tolerance = 1e-5 * textile.areal_density * spacing * spacing * kStandardGravity;
  const Equilibrium rest = find_equilibrium(strip.mesh, strip.held, {0, -kStandardGravity, 0},
                                            strip.start, tolerance, stop);
  note_unsettled(rest, tolerance, report);
  const Vector3d tip = rest.x.col(end);
  report.values.push_back(value("chord angle", "degrees", strip,
                                chord_angle(shape(0, kFine), shape(1, kFine)),
                                chord_angle(tip.x(), -tip.y())));
  LabCurve curve{join("spacing ", 1000 * spacing, " mm"), {"x m", "drop m"}, {}};
  for (const Eigen::Index i : middle) curve.rows.push_back({rest.x(0, i), -rest.x(1, i)});
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
    const double step = spacing * (order.mesh ? column_step(*order.mesh) : 1);
    const int count = std::max(1, static_cast<int>(std::lround(overhang / step - 0.5)));
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
      "to tip by the heavy elastica, without stretch. ",
      order.mesh ? "It hangs alike on both sides of the edge and is held half a spacing from it; "
                   "the spacing divides the overhang."
                 : "The edge lies half a spacing inside the last column held, and the spacing "
                   "divides the overhang.");
  for_each_specimen(cantilever_columns(order, overhang), watch, [&](int columns) {
    if (order.mesh)
      hang_on_both_sides(order, overhang, columns, watch.stop, report);
    else
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
    LabOrder of_threads = order;
    of_threads.textile = threads;
    of_threads.weft = false;
    of_threads.bending = Isometric{};
    Specimen specimen = cut_rectangle(of_threads, kLength, spacing, spacing);
    const double width = spacing;  // of two edge threads, half a spacing each
    const double weight = threads.areal_density * kStandardGravity * width;
    constexpr int kFine = 3000;
    const Eigen::Matrix2Xd shape =
        elastic_catenary(threads.tensile_warp * width, weight, kLength, kSpan, kFine + 1);
    specimen.hold_at(0);
    specimen.hold_at(specimen.start.row(0).maxCoeff());
    for (auto place : specimen.start.colwise()) {
      const auto at = static_cast<Eigen::Index>(std::lround(place.x() / kLength * kFine));
      place.head<2>() = Eigen::Vector2d(shape(0, at), -shape(1, at));
    }
    const double tolerance = 1e-7 * weight * spacing;
    const Equilibrium rest =
        find_equilibrium(specimen.mesh, specimen.held, {0, -kStandardGravity, 0}, specimen.start,
                         tolerance, watch.stop);
    note_unsettled(rest, tolerance, report);
    report.values.push_back(
        value("sag", "m", specimen, shape(1, kFine / 2), -rest.x.row(1).minCoeff()));
  });
  return report;
}

// Squares rolled onto cylinders of radius 1 m, whose axes lie at angles to the threads.
LabReport cylinders(const LabOrder& order, const LabWatch& watch) {
  constexpr double kSide = 0.2, kCurvature = 1;  // m, 1/m
  LabReport report;
  report.method =
      "A square of 200 mm, bent onto a cylinder of radius 1 m: its energy over area and curvature "
      "squared, times 2, by the angle from the warp to where it is bent. Asked: B_u c^4 + B_v s^4 "
      "+ 2 B_t c^2 s^2 with the rigidities given and their mean for twist.";
  const std::vector<double> spacings =
      order.spacings.empty() ? std::vector{0.02, 0.01, 0.005} : order.spacings;
  for_each_specimen(spacings, watch, [&](double spacing) {
    const Specimen specimen = cut_rectangle(order, kSide, kSide, spacing);
    const BendStiffness& bend = specimen.mesh.surface.bend[0];
    for (const int degrees : {0, 30, 45, 90}) {
      const double angle = degrees * std::numbers::pi / 180;
      const double c = std::cos(angle), s = std::sin(angle);
      Matrix3Xd x = specimen.start;
      for (auto place : x.colwise()) {
        const double along = c * place.x() + s * place.z(), across = c * place.z() - s * place.x();
        place = Vector3d(std::sin(kCurvature * along) / kCurvature,
                         -std::cos(kCurvature * along) / kCurvature, across);
      }
      const double energy = curvature_energy(specimen.mesh.surface, x);
      const double asked =
          bend.warp * std::pow(c, 4) + bend.weft * std::pow(s, 4) + 2 * bend.twist * c * c * s * s;
      report.values.push_back(value(join("rigidity at ", degrees, " degrees"), "N m", specimen,
                                    asked, 2 * energy / (kSide * kSide * kCurvature * kCurvature)));
    }
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
      return (order.mesh ? 2 : 1) * (overhang_of(along_warp(order)) / spacing + 2) *
             std::clamp(kWidth / spacing + 1, 5.0, 26.0);
    case LabTest::kChain:
      return 2 * (0.3 / spacing + 1);
    case LabTest::kDrape:
      return drape_particles(spacing);
    case LabTest::kBending:
      if (order.mesh) return std::pow(0.2 / spacing + 1, 2);
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
  if (order.mesh && std::holds_alternative<ChoiKo>(order.bending))
    problems.push_back(
        {"bending", "is CHOI_KO, which is tested on a lattice alone; on triangles ISOMETRIC is"});
  if (order.test == LabTest::kBending && !order.mesh &&
      !std::holds_alternative<ChoiKo>(order.bending))
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
    else if (particles_of(order, spacing) > kLargestSpecimen)
      problems.push_back({field, join(spacing, " m makes a specimen of more than ",
                                      kLargestSpecimen, " particles")});
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
      return order.mesh ? cylinders(order, watch) : bending_curve(order, watch);
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
