#include "client/render/lattice.h"

#include <algorithm>
#include <cmath>

#include "client/sheet_layout.h"

namespace weft::client {
namespace {

constexpr int kMostPieces = 6;
constexpr int kManyCells = 200'000;  // of a frame, as drawn
constexpr double kUsualSkin = 0.1;   // of the spacing, see Sheet.skin_m

// Numbers of a lattice, row by row.
struct Lattice {
  int rows = 0;
  int columns = 0;
  std::vector<double> values;

  double at(int row, int column) const {
    return values[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                  static_cast<std::size_t>(column)];
  }
};

Lattice transposed(const Lattice& lattice) {
  Lattice result{lattice.columns, lattice.rows, {}};
  result.values.reserve(lattice.values.size());
  for (int column = 0; column < lattice.columns; ++column)
    for (int row = 0; row < lattice.rows; ++row) result.values.push_back(lattice.at(row, column));
  return result;
}

// Between b and c at t; a and d are their neighbours.
double catmull_rom(double a, double b, double c, double d, double t) {
  return b + t / 2 * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
}

// Each step along the rows in so many pieces.
Lattice divided_along_rows(const Lattice& lattice, int pieces, bool smooth) {
  Lattice result{lattice.rows, (lattice.columns - 1) * pieces + 1, {}};
  for (int row = 0; row < lattice.rows; ++row) {
    for (int i = 0; i < result.columns; ++i) {
      const int column = std::min(i / pieces, lattice.columns - 2);
      const double t = static_cast<double>(i - column * pieces) / pieces;
      const double b = lattice.at(row, column);
      const double c = lattice.at(row, column + 1);
      if (!smooth) {
        result.values.push_back(b + t * (c - b));
        continue;
      }
      // straight on beyond the edges
      const double a = column > 0 ? lattice.at(row, column - 1) : 2 * b - c;
      const double d = column + 2 < lattice.columns ? lattice.at(row, column + 2) : 2 * c - b;
      result.values.push_back(t == 1 ? c : catmull_rom(a, b, c, d, t));
    }
  }
  return result;
}

// Along warp and weft, N m; core/model/mesh.cpp has them of a raw textile.
std::pair<double, double> rigidities_of(const v1::Textile& textile, double spacing_m) {
  const v1::MeasuredTextile& measured = textile.measured();
  if (textile.has_measured())
    return {measured.bend_rigidity_warp_n_m(), measured.bend_rigidity_weft_n_m()};
  const double rigidity = 1.5 * textile.raw().bend_n_m2() / spacing_m;
  return {rigidity, rigidity};
}

// Leads what lies between the particles out of bodies that these keep off.
void keep_off(Points& points, const v1::SheetLayout& sheet, int pieces,
              const std::vector<Body>& bodies, double skin_m, double spacing_m) {
  const auto columns = static_cast<std::size_t>((sheet.columns() - 1) * pieces + 1);
  const auto step = static_cast<std::size_t>(pieces);
  for (std::size_t i = 0; i < points.x.size(); ++i) {
    if (i / columns % step == 0 && i % columns % step == 0) continue;  // a particle
    for (const Body& body : bodies) {
      const Eigen::Vector3d place(points.x[i], points.y[i], points.z[i]);
      const Way way = way_out(body, place, spacing_m);
      if (way.distance >= skin_m || way.distance < -spacing_m) continue;
      const Eigen::Vector3d out = place + (skin_m - way.distance) * way.direction;
      points.x[i] = out.x();
      points.y[i] = out.y();
      points.z[i] = out.z();
    }
  }
}

}  // namespace

int pieces_of(const v1::StreamHeader& header) {
  double cells = 0;
  for (const auto& sheet : header.sheets()) cells += static_cast<double>(triangle_count(sheet)) / 2;
  return std::clamp(static_cast<int>(std::sqrt(kManyCells / cells)), 1, kMostPieces);
}

v1::SheetLayout divided(const v1::SheetLayout& sheet, int pieces) {
  v1::SheetLayout fine;
  fine.set_rows((sheet.rows() - 1) * pieces + 1);
  fine.set_columns((sheet.columns() - 1) * pieces + 1);
  return fine;
}

std::vector<double> divided(const v1::SheetLayout& sheet, std::vector<double> values, int pieces,
                            bool smooth) {
  const Lattice lattice{sheet.rows(), sheet.columns(), std::move(values)};
  const Lattice along_rows = divided_along_rows(lattice, pieces, smooth);
  return transposed(divided_along_rows(transposed(along_rows), pieces, smooth)).values;
}

Points divided(const v1::SheetLayout& layout, const v1::Sheet& sheet, const Points& points,
               int pieces, const std::vector<Body>& bodies) {
  Points fine{divided(layout, points.x, pieces, true), divided(layout, points.y, pieces, true),
              divided(layout, points.z, pieces, true)};
  const double spacing_m = sheet.grid().spacing_m();
  const double skin_m = sheet.has_skin_m() ? sheet.skin_m() : kUsualSkin * spacing_m;
  keep_off(fine, layout, pieces, bodies, skin_m, spacing_m);
  return fine;
}

std::vector<double> bending_of(const v1::SheetLayout& layout, const v1::Sheet& sheet,
                               const Points& points) {
  const double spacing_m = sheet.grid().spacing_m();
  const auto [warp, weft] = rigidities_of(sheet.textile(), spacing_m);
  const auto squared_curvature = [&](std::size_t a, std::size_t b, std::size_t c, std::size_t d) {
    double sum = 0;
    for (const std::vector<double>* axis : {&points.x, &points.y, &points.z})
      sum += std::pow((*axis)[a] - (*axis)[b] - (*axis)[c] + (*axis)[d], 2);
    return sum / std::pow(spacing_m, 4);
  };
  std::vector<double> energies(points.x.size());
  const auto rows = static_cast<std::size_t>(layout.rows());
  const auto columns = static_cast<std::size_t>(layout.columns());
  const auto is_inside = [](std::size_t i, std::size_t count) { return i > 0 && i + 1 < count; };
  for (std::size_t i = 0; i < energies.size(); ++i) {
    const std::size_t row = i / columns;
    const std::size_t column = i % columns;
    if (is_inside(column, columns)) energies[i] += warp / 2 * squared_curvature(i - 1, i, i, i + 1);
    if (is_inside(row, rows))
      energies[i] += weft / 2 * squared_curvature(i - columns, i, i, i + columns);
    if (row + 1 == rows || column + 1 == columns) continue;
    const double twist =
        (warp + weft) / 2 * squared_curvature(i, i + 1, i + columns, i + columns + 1);
    for (const std::size_t r : {row, row + 1}) {
      for (const std::size_t c : {column, column + 1}) {
        const int cells = (is_inside(r, rows) ? 2 : 1) * (is_inside(c, columns) ? 2 : 1);
        energies[r * columns + c] += twist / cells;
      }
    }
  }
  return energies;
}

}  // namespace weft::client
