#include "client/render/stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/problem.h"
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

std::vector<double> divided(const v1::SheetLayout& sheet, std::vector<double> values, int pieces,
                            bool smooth) {
  const Lattice lattice{sheet.rows(), sheet.columns(), std::move(values)};
  const Lattice along_rows = divided_along_rows(lattice, pieces, smooth);
  return transposed(divided_along_rows(transposed(along_rows), pieces, smooth)).values;
}

// Of a cell along each side.
int pieces_of(const v1::StreamHeader& header) {
  double cells = 0;
  for (const auto& sheet : header.sheets())
    cells += static_cast<double>(sheet.rows() - 1) * (sheet.columns() - 1);
  return std::clamp(static_cast<int>(std::sqrt(kManyCells / cells)), 1, kMostPieces);
}

double distance(const Points& points, std::size_t i, const Points& others, std::size_t j) {
  return std::hypot(points.x[i] - others.x[j], points.y[i] - others.y[j],
                    points.z[i] - others.z[j]);
}

std::vector<double> strains_of(const v1::SheetLayout& sheet, const Points& points,
                               double spacing_m) {
  std::vector<double> strains(points.x.size());
  const auto columns = static_cast<std::size_t>(sheet.columns());
  const auto stretch = [&](std::size_t i, std::size_t j) {
    const double strain = distance(points, i, points, j) / spacing_m - 1;
    strains[i] = std::max(strains[i], strain);
    strains[j] = std::max(strains[j], strain);
  };
  for (std::size_t i = 0; i < strains.size(); ++i) {
    if (i % columns + 1 < columns) stretch(i, i + 1);
    if (i + columns < strains.size()) stretch(i, i + columns);
  }
  return strains;
}

// Along warp and weft, N m; core/model/mesh.cpp has them of a raw textile.
std::pair<double, double> rigidities_of(const v1::Textile& textile, double spacing_m) {
  const v1::MeasuredTextile& measured = textile.measured();
  if (textile.has_measured())
    return {measured.bend_rigidity_warp_n_m(), measured.bend_rigidity_weft_n_m()};
  const double rigidity = 1.5 * textile.raw().bend_n_m2() / spacing_m;
  return {rigidity, rigidity};
}

// Differences as in the isometric law; a particle's twist is the mean of its cells.
std::vector<double> bending_of(const v1::SheetLayout& sheet, const Points& points,
                               const v1::Textile& textile, double spacing_m) {
  const auto [warp, weft] = rigidities_of(textile, spacing_m);
  const auto squared_curvature = [&](std::size_t a, std::size_t b, std::size_t c, std::size_t d) {
    double sum = 0;
    for (const std::vector<double>* axis : {&points.x, &points.y, &points.z})
      sum += std::pow((*axis)[a] - (*axis)[b] - (*axis)[c] + (*axis)[d], 2);
    return sum / std::pow(spacing_m, 4);
  };
  std::vector<double> energies(points.x.size());
  const auto rows = static_cast<std::size_t>(sheet.rows());
  const auto columns = static_cast<std::size_t>(sheet.columns());
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

// What lies between the particles is led out of bodies that the particles themselves keep off.
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

Stage read_stage(RecordingReader& recording, std::int64_t number, Colouring colouring) {
  const v1::StreamHeader& header = recording.header();
  const v1::Frame frame = recording.read(number);
  v1::Frame before = frame;
  if (colouring == Colouring::kSpeed && number > recording.first_frame())
    before = recording.read(number - 1);
  const double step_s = frame.time_s() - before.time_s();

  Stage stage;
  stage.frame = number;
  stage.time_s = frame.time_s();
  stage.bodies = bodies_at(recording.scene(), stage.time_s);
  const int pieces = pieces_of(header);
  for (int i = 0; i < header.sheets_size(); ++i) {
    const v1::SheetLayout& layout = header.sheets(i);
    const v1::Sheet& sheet = recording.scene().sheets(i);
    const auto first = static_cast<std::size_t>(layout.first_particle());
    const std::size_t count = particle_count(layout);
    const Points points = read_points(frame.positions_m(), header, first, count);
    for (std::size_t k = 0; k < count; ++k) {
      if (!std::isfinite(points.x[k] + points.y[k] + points.z[k]))
        throw damaged(recording.path(),
                      fmt::format("a position of frame {} is not finite", number));
    }
    const double spacing_m = sheet.grid().spacing_m();
    std::vector<double> values(count);
    if (colouring == Colouring::kStrain) values = strains_of(layout, points, spacing_m);
    if (colouring == Colouring::kBending)
      values = bending_of(layout, points, sheet.textile(), spacing_m);
    if (colouring == Colouring::kSpeed && step_s > 0) {
      const Points others = read_points(before.positions_m(), header, first, count);
      for (std::size_t k = 0; k < count; ++k) values[k] = distance(points, k, others, k) / step_s;
    }

    Surface& surface = stage.surfaces.emplace_back();
    surface.points = {divided(layout, points.x, pieces, true),
                      divided(layout, points.y, pieces, true),
                      divided(layout, points.z, pieces, true)};
    const double skin_m = sheet.has_skin_m() ? sheet.skin_m() : kUsualSkin * spacing_m;
    keep_off(surface.points, layout, pieces, stage.bodies, skin_m, spacing_m);
    const std::vector<double> between = divided(layout, values, pieces, false);
    surface.values.assign(between.begin(), between.end());
    v1::SheetLayout fine;
    fine.set_rows((layout.rows() - 1) * pieces + 1);
    fine.set_columns((layout.columns() - 1) * pieces + 1);
    surface.triangles = triangles_of({fine});
    surface.normals = normals_of(surface.points, surface.triangles);
  }
  return stage;
}

}  // namespace weft::client
