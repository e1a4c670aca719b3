#include "tests/support/core/triangle_meshes.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <compare>
#include <random>

#include "core/forces/elastic.h"
#include "core/motion/sheet_solver.h"
#include "tests/support/core/scenes.h"

namespace weft::testing {

RestShape scattered(int columns, double spacing) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> jitter(-0.3 * spacing, 0.3 * spacing);
  std::vector<Vector2d> points;
  for (int r = 0; r < columns; ++r)
    for (int c = 0; c < columns; ++c) {
      Vector2d& point = points.emplace_back(c * spacing, r * spacing);
      if (c > 0 && c + 1 < columns) point.x() += jitter(random);
      if (r > 0 && r + 1 < columns) point.y() += jitter(random);
    }
  std::vector<std::array<int, 3>> triangles;
  for (int r = 0; r + 1 < columns; ++r)
    for (int c = 0; c + 1 < columns; ++c) {
      const int a = r * columns + c, b = a + 1, d = a + columns, e = d + 1;
      triangles.push_back({a, b, e});
      triangles.push_back({a, e, d});
    }
  const auto at = [&](int i) { return points[static_cast<std::size_t>(i)]; };
  const auto twice_area = [&](int i, int j, int k) {
    const Vector2d a = at(j) - at(i), b = at(k) - at(i);
    return a.x() * b.y() - b.x() * a.y();
  };
  // whether d lies in the circle through a, b and c
  const auto inside = [&](int a, int b, int c, int d) {
    Eigen::Matrix3d rows;
    for (int k = 0; const int i : {a, b, c}) {
      const Vector2d away = at(i) - at(d);
      rows.row(k++) << away.x(), away.y(), away.squaredNorm();
    }
    return rows.determinant() > 1e-9 * std::pow(spacing, 4);
  };

  // edges are flipped until none wants to be (Lawson 1977)
  struct Side {
    int low, high, triangle, corner;
    auto operator<=>(const Side&) const = default;
  };
  for (bool flipped = true; flipped;) {
    flipped = false;
    std::vector<Side> sides;
    for (int t = 0; t < static_cast<int>(triangles.size()); ++t)
      for (int k = 0; k < 3; ++k) {
        const auto& corner = triangles[static_cast<std::size_t>(t)];
        const auto [low, high] = std::minmax(corner[static_cast<std::size_t>((k + 1) % 3)],
                                             corner[static_cast<std::size_t>((k + 2) % 3)]);
        sides.push_back({low, high, t, k});
      }
    std::sort(sides.begin(), sides.end());
    std::vector<bool> changed(triangles.size());
    for (std::size_t s = 0; s + 1 < sides.size(); ++s) {
      const Side &one = sides[s], &other = sides[s + 1];
      if (one.low != other.low || one.high != other.high) continue;
      const auto t = static_cast<std::size_t>(one.triangle);
      const auto u = static_cast<std::size_t>(other.triangle);
      if (changed[t] || changed[u]) continue;
      const auto k = static_cast<std::size_t>(one.corner);
      const int c = triangles[t][k], a = triangles[t][(k + 1) % 3], b = triangles[t][(k + 2) % 3];
      const int d = triangles[u][static_cast<std::size_t>(other.corner)];
      if (!inside(a, b, c, d) || twice_area(a, d, c) <= 0 || twice_area(d, b, c) <= 0) continue;
      triangles[t] = {a, d, c};
      triangles[u] = {d, b, c};
      changed[t] = changed[u] = flipped = true;
    }
  }
  return rest_shape(points, triangles);
}

double measured_step(const Mesh& mesh, const Matrix3Xd& x) {
  Dynamics dynamics;
  dynamics.inverse_mass = mesh.mass.cwiseInverse();
  dynamics.gravity.setZero();
  // forces about the strained shape, which is then at rest
  Matrix3Xd held = Matrix3Xd::Zero(3, x.cols());
  add_elastic_forces(mesh, x, Matrix3Xd::Zero(3, x.cols()), held);
  dynamics.force = [&](double, const Matrix3Xd& at, const Matrix3Xd& v, Matrix3Xd& force) {
    force = -held;
    add_elastic_forces(mesh, at, v, force);
  };
  const auto grows = [&](double dt) {
    const auto solver = make_plain_solver(dynamics, IntegratorKind::kVerlet);
    const Matrix3Xd start = x + 1e-9 * noise(static_cast<int>(x.cols()));
    solver->start(start, Matrix3Xd::Zero(3, x.cols()), 0, dt);
    Matrix3Xd now;
    for (int k = 0; k < 1500; ++k) {
      solver->advance(k * dt, 1, calling_thread());
      if (k % 50 != 0) continue;
      solver->positions(now);
      if (!((now - x).cwiseAbs().maxCoeff() < 1e-6)) return true;
    }
    return false;
  };
  double low = 1e-6, high = 1e-2;
  while (high / low > 1.003) {
    const double middle = std::sqrt(low * high);
    (grows(middle) ? high : low) = middle;
  }
  return low;
}

}  // namespace weft::testing
