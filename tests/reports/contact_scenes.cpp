#include "tests/reports/contact_scenes.h"

#include <cmath>
#include <functional>
#include <numbers>
#include <variant>

#include "core/contact/body.h"
#include "core/triangles/cut.h"
#include "tests/reports/trial.h"
#include "tests/support/core/bodies.h"
#include "tests/support/core/scenes.h"

namespace weft::reports {
namespace {

constexpr double kPi = std::numbers::pi;

SheetDefinition sheet_of(const std::string& name, const SheetShape& shape) {
  SheetDefinition sheet;
  sheet.name = name;
  sheet.shape = shape;
  MeasuredTextile wool = kWool;
  wool.air_drag = 0;
  sheet.textile = {wool, 2e-5, 0.3};
  sheet.bending = Isometric{};
  return sheet;
}

SheetDefinition rectangle(const std::string& name, double length, double width, double spacing) {
  return sheet_of(
      name, complete(triangle_mesh(cut_rectangle(Cut::kAlternating, length, width, spacing))));
}

Scene with_contact(std::vector<SheetDefinition> sheets) {
  Scene scene;
  scene.sheets = std::move(sheets);
  scene.cloth_contact = true;
  return scene;
}

void start_at(SheetDefinition& sheet, const std::function<Vector3d(const Vector3d&)>& place) {
  Matrix3Xd x = start_positions(sheet);
  for (auto column : x.colwise()) column = place(Vector3d(column));
  sheet.start_positions = testing::values(x);
}

Collider ball(double radius) {
  Collider ball = testing::solid(testing::ball_mesh(radius, 4));
  ball.name = "ball";
  return ball;
}

// Every particle of which `held` says so follows way(its start, time).
void lead(SheetDefinition& sheet, const std::function<bool(const Vector3d&)>& held,
          const std::function<Vector3d(const Vector3d&, double)>& way, double seconds) {
  constexpr double kKeyStep = 0.01;  // s
  const Matrix3Xd x = start_positions(sheet);
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const Vector3d start = x.col(i);
    if (!held(start)) continue;
    Pin& pin = sheet.pins.emplace_back();
    pin.particles = {static_cast<int>(i)};
    const int keys = static_cast<int>(std::lround(seconds / kKeyStep));
    for (int k = 0; k <= keys; ++k)
      pin.path.push_back({seconds * k / keys, way(start, seconds * k / keys) - start});
  }
}

// A tube about the x axis, closed by a seam, whose ends turn against each other and back.
Scene twisted_tube(double turns, double seconds) {
  constexpr double kLength = 0.4, kRadius = 0.08;
  constexpr int kAround = 50, kAlong = 40;
  TriangleMesh mesh;
  const double side = 2 * kPi * kRadius / kAround, step = kLength / kAlong;
  for (int i = 0; i <= kAlong; ++i)
    for (int j = 0; j <= kAround; ++j) {
      mesh.flat.emplace_back(i * step, j * side);
      const double angle = 2 * kPi * j / kAround;
      if (j < kAround)
        mesh.start.emplace_back(i * step, kRadius * std::cos(angle), kRadius * std::sin(angle));
    }
  const auto corner = [](int i, int j) { return i * (kAround + 1) + j; };
  const auto particle = [](int i, int j) { return i * kAround + j % kAround; };
  const auto add = [&](std::array<std::array<int, 2>, 3> at) {
    std::array<int, 3> corners{}, particles{};
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = corner(at[k][0], at[k][1]);
      particles[k] = particle(at[k][0], at[k][1]);
    }
    mesh.flat_triangles.push_back(corners);
    mesh.triangles.push_back(particles);
  };
  for (int i = 0; i < kAlong; ++i)
    for (int j = 0; j < kAround; ++j) {
      if ((i + j) % 2 == 0) {
        add({{{i, j}, {i + 1, j}, {i + 1, j + 1}}});
        add({{{i, j}, {i + 1, j + 1}, {i, j + 1}}});
      } else {
        add({{{i, j}, {i + 1, j}, {i, j + 1}}});
        add({{{i + 1, j}, {i + 1, j + 1}, {i, j + 1}}});
      }
    }
  SheetDefinition tube = sheet_of("tube", complete(std::move(mesh)));
  lead(
      tube, [&](const Vector3d& x) { return x.x() < step / 2 || x.x() > kLength - step / 2; },
      [&](const Vector3d& x, double t) {
        const double share = 1 - std::abs(1 - 2 * t / seconds), end = x.x() < step ? -1 : 1;
        const double angle = end * kPi * turns * share;
        return Vector3d(x.x() - end * 0.05 * share,
                        x.y() * std::cos(angle) - x.z() * std::sin(angle),
                        x.y() * std::sin(angle) + x.z() * std::cos(angle));
      },
      seconds);
  Scene scene = with_contact({tube});
  scene.environment.gravity.setZero();
  return scene;
}

Scene poured(double width) {
  SheetDefinition sheet = rectangle("sheet", width, width, 0.01);
  start_at(sheet, [](const Vector3d& x) {
    return Vector3d(x.x(), x.z() + 0.01,
                    0.02 * std::sin(20 * x.z()) + 1e-3 * std::sin(200 * x.x()));
  });
  Scene scene = with_contact({sheet});
  scene.colliders.push_back({"floor", Plane{}, 0.5, {}});
  return scene;
}

// A ribbon along a loose overhand knot, whose ends are pulled apart.
Scene knotted() {
  constexpr double kLength = 1.2, kWidth = 0.03;
  SheetDefinition ribbon = rectangle("ribbon", kLength, kWidth, 0.0075);
  // three crossings of a trefoil, opened; by arc length
  const auto curve = [](double s) {
    const double t = 2 * kPi * (s - 0.5) * 0.92 + kPi;
    return Vector3d(0.06 * (std::sin(t) + 2 * std::sin(2 * t)), 0.06 * 1.2 * -std::sin(3 * t),
                    0.06 * (std::cos(t) - 2 * std::cos(2 * t)));
  };
  constexpr int kParts = 4000;
  std::vector<double> length = {0};
  for (int k = 1; k <= kParts; ++k)
    length.push_back(length.back() + (curve(1.0 * k / kParts) - curve((k - 1.0) / kParts)).norm());
  const double scale = kLength / length.back();
  const auto at = [&](double s) {
    const auto k = static_cast<std::size_t>(
        std::lower_bound(length.begin(), length.end(), s / scale) - length.begin());
    return static_cast<double>(std::min<std::size_t>(k, kParts)) / kParts;
  };
  start_at(ribbon, [&](const Vector3d& x) {
    const double s = at(x.x()), e = 1e-3;
    const Vector3d along = (curve(s + e) - curve(s - e)).normalized();
    const Vector3d across = along.cross(Vector3d::UnitY()).normalized();
    return Vector3d(scale * curve(s) + (x.z() - kWidth / 2) * across);
  });
  const Matrix3Xd x = start_positions(ribbon);
  const Vector3d first = x.col(0), last = x.col(x.cols() - 1);
  const Vector3d apart = (last - first).normalized();
  const Matrix3Xd flat = start_positions(rectangle("ribbon", kLength, kWidth, 0.0075));
  for (Eigen::Index i = 0; i < flat.cols(); ++i) {
    const double end = flat(0, i) < 1e-9 ? -1 : flat(0, i) > kLength - 1e-9 ? 1 : 0;
    if (end == 0) continue;
    Pin& pin = ribbon.pins.emplace_back();
    pin.particles = {static_cast<int>(i)};
    pin.path = {{0, Vector3d::Zero()}, {2, Vector3d(end * 0.25 * apart)}};
  }
  Scene scene = with_contact({ribbon});
  scene.environment.gravity.setZero();
  return scene;
}

// A cloth that is drawn from under three napkins, which lie on it.
Scene drawn_away() {
  SheetDefinition cloth = rectangle("cloth", 0.6, 0.5, 0.01);
  std::vector<SheetDefinition> sheets;
  lead(
      cloth, [](const Vector3d& x) { return x.x() > 0.6 - 1e-9; },
      [](const Vector3d& x, double t) { return Vector3d(x + Vector3d(0.8 * t * t, 0, 0)); }, 1.0);
  sheets.push_back(cloth);
  for (int k = 0; k < 3; ++k) {
    SheetDefinition napkin = rectangle("napkin " + std::to_string(k + 1), 0.1, 0.1, 0.01);
    napkin.origin = {0.06 + 0.15 * k, 0.003, 0.2};
    sheets.push_back(napkin);
  }
  Scene scene = with_contact(sheets);
  scene.colliders.push_back({"table", Box{{0.3, -0.052, 0.25}, {0.35, 0.05, 0.3}}, 0.2, {}});
  return scene;
}

// Two layers on a ball that goes to and fro.
Scene two_layers(int n) {
  Scene scene = stacked(n);
  scene.sheets.resize(2);
  Path& path = scene.colliders[0].path;
  for (int k = 0; k <= 300; ++k) {
    const double t = 0.01 * k;
    path.push_back(
        {t, t < 1 ? Vector3d(0, 0, 0) : Vector3d(0.1 * std::sin(2 * kPi * (t - 1)), 0, 0)});
  }
  return scene;
}

}  // namespace

Scene hung(int n, bool lattice, double drag) {
  const double width = 0.01 * (n - 1);
  SheetDefinition sheet =
      lattice ? sheet_of("sheet", Grid{n, n, 0.01}) : rectangle("sheet", width, width, 0.01);
  auto& textile = std::get<MeasuredTextile>(sheet.textile.model);
  textile.air_drag = drag * textile.areal_density;
  const Matrix3Xd x = start_positions(sheet);
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    if (x(0, i) < 1e-9 && (x(2, i) < 1e-9 || x(2, i) > width - 1e-9)) {
      sheet.pins.emplace_back().particles = {static_cast<int>(i)};
    }
  return with_contact({sheet});
}

Scene draped(int n) {
  SheetDefinition sheet = rectangle("sheet", 0.01 * (n - 1), 0.01 * (n - 1), 0.01);
  const double half = 0.005 * (n - 1);
  sheet.origin = {-half + 0.013, 0.155, -half + 0.007};
  Scene scene = with_contact({sheet});
  scene.colliders.push_back(ball(0.15));
  return scene;
}

Scene stacked(int n) {
  std::vector<SheetDefinition> sheets;
  const double half = 0.005 * (n - 1);
  for (int s = 0; s < 10; ++s) {
    SheetDefinition sheet =
        rectangle("sheet " + std::to_string(s + 1), 0.01 * (n - 1), 0.01 * (n - 1), 0.01);
    sheet.origin = {-half + 1e-3 * s, 0.16 + 0.006 * s, -half + 2e-3 * s};
    sheets.push_back(sheet);
  }
  Scene scene = with_contact(sheets);
  scene.colliders.push_back(ball(0.15));
  return scene;
}

std::vector<ContactScene> contact_scenes(bool large) {
  const int n = large ? 51 : 31;
  const double turns = large ? 4 : 2;
  return {{"heap", "a sheet is poured into a heap", poured(large ? 0.5 : 0.3), 1.5, 1.5},
          {"twist",
           large ? "a tube is twisted by four turns in 4 s and back"
                 : "a tube is twisted by two turns in 2 s and back",
           twisted_tube(turns, 2 * turns), 2 * turns + 0.2, turns},
          {"knot", "a ribbon along a knot is pulled", knotted(), 2.5, 2.5},
          {"cloth-pulled", "a cloth is drawn from under three napkins", drawn_away(), 1.2, 0.6},
          {"layers", "two layers on a ball that moves", two_layers(n), 3, 3},
          {"ball", "a sheet falls onto a ball", draped(2 * n - 1), 1, 1},
          {"stack", "ten sheets fall onto a ball", stacked(n), 1, 1}};
}

}  // namespace weft::reports
