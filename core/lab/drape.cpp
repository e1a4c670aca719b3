#include "core/lab/drape.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>

#include "core/model/text.h"

namespace weft {
namespace {

constexpr double kRadius = 0.15, kHeldRadius = 0.09;  // m
// Where none are given: until one changes the coefficient by less than so many points.
const std::vector<double> kSpacings = {0.015, 0.01, 0.008, 0.0065, 0.005};  // m
constexpr double kSettled = 2;
constexpr int kMargin = 2;  // particles of the square around the disc, so that no edge is near

int half_side(double radius, double spacing) {
  return static_cast<int>(std::ceil(radius / spacing)) + kMargin;
}

// The cells of a square lattice whose middles lie in a disc.
class Cells {
 public:
  Cells(double radius, double spacing)
      : radius_(radius / spacing), half_(half_side(radius, spacing)) {}

  int side() const { return 2 * half_ + 1; }  // particles
  bool within(int row, int column, double radius) const {
    return std::hypot(row + 0.5 - half_, column + 0.5 - half_) <= radius;
  }
  bool kept(int row, int column) const { return within(row, column, radius_); }

  // How much of what a connection from i to j carries inside a sheet is there.
  double share(int i, int j) const {
    const int row = i / side(), column = i % side();
    const int rows = j / side() - row, columns = j % side() - column;
    const int steps = std::max(std::abs(rows), std::abs(columns));
    const int down = rows / steps, right = columns / steps;  // of a step: -1, 0 or 1
    int cells = 0, there = 0;
    for (int k = 0; k < steps; ++k) {
      const int r = row + k * down, c = column + k * right;
      if (down != 0 && right != 0) {
        cells += 1;
        there += kept(r + std::min(down, 0), c + std::min(right, 0));
      } else {  // a cell on either side
        cells += 2;
        there += kept(r, c) + kept(r - (right != 0), c - (down != 0));
      }
    }
    return static_cast<double>(there) / cells;
  }

 private:
  double radius_;  // spacings
  int half_;
};

// A family with the connections that are there, one for each share.
void add_shares(const Family& family, const BendingLaw& bending, const Cells& cells,
                const Eigen::ArrayXi& place, Mesh& mesh) {
  std::map<double, Connections> by_share;
  for (const auto& [i, j] : family.connections)
    if (place[i] >= 0 && place[j] >= 0)
      if (const double share = cells.share(i, j); share > 0)
        by_share[share].add(place[i], place[j]);
  for (auto& [share, connections] : by_share) {
    Family part{family.kind,  family.rest_length,     share * family.stiffness,
                std::nullopt, std::move(connections), family.pushes};
    if (family.bend) {
      const BendingForce& bend = *family.bend;
      const double k_b = bend.scale() * bend.rest_length() * bend.rest_length();
      part.bend.emplace(std::get<ChoiKo>(bending), share * k_b, share * bend.clamp(),
                        bend.rest_length());
    }
    mesh.families.push_back(std::move(part));
  }
}

// The shadow of a sheet in light along y.
class Shadow {
 public:
  Shadow(const Mesh& mesh, const Matrix3Xd& x) : dark_(kSide * kSide) {
    for (const auto& [a, b, c] : mesh.triangles) darken(point(x, a), point(x, b), point(x, c));
  }

  double area() const {  // m^2
    return static_cast<double>(std::count(dark_.begin(), dark_.end(), 1)) * kPixel * kPixel;
  }
  double radius(double angle) const {  // m
    double radius = kHeldRadius;
    for (double r = radius; r < kHalf; r += kPixel / 2)
      if (dark(r * std::cos(angle), r * std::sin(angle))) radius = r;
    return radius;
  }

 private:
  static constexpr double kHalf = 1.1 * kRadius;
  static constexpr int kSide = 660;
  static constexpr double kPixel = 2 * kHalf / kSide;  // 0.5 mm

  using Point = Eigen::Vector2d;
  static Point point(const Matrix3Xd& x, int particle) { return {x(0, particle), x(2, particle)}; }
  static int pixel(double place) {
    return std::clamp(static_cast<int>(std::floor((place + kHalf) / kPixel)), 0, kSide - 1);
  }
  bool dark(double x, double z) const {
    return dark_[static_cast<std::size_t>(pixel(z) * kSide + pixel(x))] != 0;
  }

  void darken(const Point& a, const Point& b, const Point& c) {
    const auto cross = [](const Point& u, const Point& v) { return u.x() * v.y() - u.y() * v.x(); };
    const double area = cross(b - a, c - a);
    if (area == 0) return;
    const Point low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
    for (int row = pixel(low.y()); row <= pixel(high.y()); ++row) {
      for (int column = pixel(low.x()); column <= pixel(high.x()); ++column) {
        const Point p((column + 0.5) * kPixel - kHalf, (row + 0.5) * kPixel - kHalf);
        const double u = cross(b - p, c - p) / area, v = cross(c - p, a - p) / area;
        if (u >= 0 && v >= 0 && u + v <= 1)
          dark_[static_cast<std::size_t>(row * kSide + column)] = 1;
      }
    }
  }

  std::vector<std::uint8_t> dark_;
};

// Bulges of an outline, of radii relative to those of the flat disc: where it rises above its mean
// and falls below it by 2 %.
int folds(const std::vector<double>& radii) {
  constexpr double kBulge = 0.02;
  double mean = 0;
  for (const double radius : radii) mean += radius / static_cast<double>(radii.size());
  int count = 0;
  bool outside = false, known = false;
  for (std::size_t turn = 0; turn < 2; ++turn) {  // the first turn finds how the second begins
    count = 0;
    for (const double radius : radii) {
      if (radius > mean + kBulge) {
        if (!outside && known) ++count;
        outside = known = true;
      } else if (radius < mean - kBulge) {
        outside = false;
        known = true;
      }
    }
  }
  return count;
}

// What light from above shows of a disc at rest: its drape coefficient, %.
double look(const Specimen& disc, const Matrix3Xd& rest, LabReport& report) {
  constexpr int kAngles = 360;
  const Shadow shadow(disc.mesh, rest), flat(disc.mesh, disc.start);
  const double held = std::numbers::pi * kHeldRadius * kHeldRadius;
  LabCurve outline{join(1000 * disc.spacing, " mm"), {"x m", "z m"}, {}};
  std::vector<double> radii;
  for (int k = 0; k <= kAngles; ++k) {
    const double angle = 2 * std::numbers::pi * k / kAngles, radius = shadow.radius(angle);
    if (k < kAngles) radii.push_back(radius / flat.radius(angle));
    outline.rows.push_back({radius * std::cos(angle), radius * std::sin(angle)});
  }
  const double coefficient = 100 * (shadow.area() - held) / (flat.area() - held);
  report.values.push_back(value("drape coefficient", "%", disc, std::nullopt, coefficient));
  report.values.push_back(value("folds", "", disc, std::nullopt, folds(radii)));
  report.curves.push_back(std::move(outline));
  return coefficient;
}

// Returns the drape coefficient, %.
double hang(const LabOrder& order, double spacing, const std::stop_token& stop, LabReport& report) {
  const MeasuredTextile textile = along_warp(order);
  const bool isometric = std::holds_alternative<Isometric>(order.bending);
  Specimen disc = order.mesh
                      ? cut_disc(textile, order.bending, *order.mesh, kRadius, kHeldRadius, spacing)
                      : cut_disc(textile, order.bending, kRadius, kHeldRadius, spacing);
  // no direction is preferred where it begins to fold
  for (Eigen::Index i = 0; i < disc.held.size(); ++i) {
    const double r = std::hypot(disc.start(0, i), disc.start(2, i));
    const double angle = std::atan2(disc.start(2, i), disc.start(0, i));
    double ripple = 0;
    for (int n = 2; n <= 12; ++n) ripple += std::cos(n * (angle + n));
    if (disc.held[i] == 0) disc.start(1, i) = -1e-3 * (r - kHeldRadius) * (1 + ripple);
  }
  const double tolerance = 1e-4 * textile.areal_density * spacing * spacing * kStandardGravity;
  const auto settle = [&](const Specimen& from, const Matrix3Xd& start) {
    return find_equilibrium(from.mesh, from.held, {0, -kStandardGravity, 0}, start, tolerance,
                            stop);
  };
  Matrix3Xd start = disc.start;
  if (!isometric)  // its smooth energy leads near
    start = settle(cut_disc(textile, Isometric{}, kRadius, kHeldRadius, spacing), start).x;
  const Equilibrium rest = settle(disc, start);
  note_unsettled(rest, tolerance, report);
  return look(disc, rest.x, report);
}

}  // namespace

Specimen cut_disc(const MeasuredTextile& textile, const BendingLaw& bending, double radius,
                  double held_radius, double spacing) {
  const Cells cells(radius, spacing);
  const int side = cells.side();
  const Specimen square = cut(textile, bending, side, side, spacing);
  const auto corners = [&](int row, int column) {
    const int i = row * side + column;
    return std::array{i, i + 1, i + side, i + side + 1};
  };

  Eigen::ArrayXi there = Eigen::ArrayXi::Zero(side * side), held = there;
  VectorXd mass = VectorXd::Zero(side * side);
  const double clamp = held_radius / spacing + 0.25;
  for (int row = 0; row + 1 < side; ++row) {
    for (int column = 0; column + 1 < side; ++column) {
      if (!cells.kept(row, column)) continue;
      for (const int i : corners(row, column)) {
        there[i] = 1;
        held[i] = held[i] | static_cast<int>(cells.within(row, column, clamp));
        mass[i] += textile.areal_density * spacing * spacing / 4;
      }
    }
  }

  Specimen disc;
  disc.sheet = square.sheet;
  Eigen::ArrayXi place = Eigen::ArrayXi::Constant(side * side, -1);
  const int count = there.sum();
  disc.sheet.shape = Grid{1, count, spacing};
  disc.spacing = spacing;
  disc.start.resize(3, count);
  disc.held.resize(count);
  disc.mesh.mass.resize(count);
  const Vector3d middle = square.start.col(square.at(side / 2, side / 2));
  for (int i = 0, next = 0; i < side * side; ++i) {
    if (there[i] == 0) continue;
    disc.start.col(next) = square.start.col(i) - middle;
    disc.held[next] = held[i];
    disc.mesh.mass[next] = mass[i];
    place[i] = next++;
  }

  for (const Family& family : square.mesh.families)
    add_shares(family, bending, cells, place, disc.mesh);
  for (Stencil stencil : square.mesh.stencils) {
    const double share = cells.share(stencil.particle[0], stencil.particle[3]);
    for (int& particle : stencil.particle) particle = place[particle];
    if (share == 0 || *std::min_element(stencil.particle.begin(), stencil.particle.end()) < 0)
      continue;
    stencil.stiffness *= share;
    disc.mesh.stencils.push_back(stencil);
  }
  for (int row = 0; row + 1 < side; ++row) {
    for (int column = 0; column + 1 < side; ++column) {
      if (!cells.kept(row, column)) continue;
      const auto [a, b, c, d] = corners(row, column);
      disc.mesh.triangles.push_back({place[a], place[b], place[c]});
      disc.mesh.triangles.push_back({place[d], place[c], place[b]});
    }
  }
  return disc;
}

Specimen cut_disc(const MeasuredTextile& textile, const BendingLaw& bending, Cut mesh,
                  double radius, double held_radius, double spacing) {
  Specimen disc = cut(textile, bending, cut_disc(mesh, radius, spacing), spacing);
  for (Eigen::Index i = 0; i < disc.held.size(); ++i)
    disc.held[i] = disc.start.col(i).norm() <= held_radius + spacing ? 1 : 0;
  return disc;
}

double drape_particles(double spacing) {
  return std::numbers::pi * std::pow(kRadius / spacing + 1, 2);
}

LabReport drape(const LabOrder& order, const LabWatch& watch) {
  LabReport report;
  report.method =
      "ISO 9073-9 (Cusick): a disc of 300 mm held between discs of 180 mm hangs under its weight. "
      "The drape coefficient is the share of the free ring that light from above cannot pass; "
      "folds are the bulges of the shadow's outline. No theory has an answer; compare with a "
      "measured one. A sheet has many shapes at rest: this one is reached from the flat disc.";
  const bool refines = order.spacings.empty();
  LabWatch until = watch;
  std::stop_source enough;
  const std::stop_callback stopped(watch.stop, [&] { enough.request_stop(); });
  until.stop = enough.get_token();
  std::optional<double> before;
  double change = 0;
  for_each_specimen(refines ? kSpacings : order.spacings, until, [&](double spacing) {
    const double found = hang(order, spacing, watch.stop, report);
    if (before) change = std::abs(found - *before);
    if (refines && before && change < kSettled) enough.request_stop();
    before = found;
  });
  if (refines && !watch.stop.stop_requested())
    report.notes.push_back(
        join("refined until the next spacing changes the coefficient by less than ", kSettled,
             " points: the last one by ", change,
             change < kSettled ? "" : ", which is more; give finer ones as spacings_m"));
  report.notes.emplace_back(
      "without the friction inside cloth it hangs limper than cloth of the same measured rigidity; "
      "folds pass through each other where they touch");
  return report;
}

}  // namespace weft
