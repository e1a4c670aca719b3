#include "client/render/stage.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "client/assets.h"
#include "client/problem.h"
#include "client/recording/cloth.h"
#include "client/render/lattice.h"
#include "client/sheet_layout.h"

namespace weft::client {
namespace {

double distance(const Points& points, std::size_t i, const Points& others, std::size_t j) {
  return std::hypot(points.x[i] - others.x[j], points.y[i] - others.y[j],
                    points.z[i] - others.z[j]);
}

// A sheet of a frame, on its way to be drawn.
struct Piece {
  const v1::SheetLayout& layout;
  const v1::Sheet& sheet;
  const ClothMesh& mesh;
  Points points;
};

std::vector<double> values_of(const Piece& piece, const Points& before, double step_s,
                              Colouring colouring) {
  switch (colouring) {
    case Colouring::kStrain:
      return strains_of(piece.mesh, piece.points, Strain::kLargest);
    case Colouring::kWarp:
      return strains_of(piece.mesh, piece.points, Strain::kWarp);
    case Colouring::kWeft:
      return strains_of(piece.mesh, piece.points, Strain::kWeft);
    case Colouring::kShear:
      return strains_of(piece.mesh, piece.points, Strain::kShear);
    case Colouring::kBending:
      return is_grid(piece.layout) ? bending_of(piece.layout, piece.sheet, piece.points)
                                   : bending_of(piece.mesh, piece.points);
    case Colouring::kCloth:
    case Colouring::kPanels:
    case Colouring::kSpeed:
      break;
  }
  std::vector<double> values(piece.points.x.size());
  if (colouring == Colouring::kSpeed && step_s > 0)
    for (std::size_t k = 0; k < values.size(); ++k)
      values[k] = distance(piece.points, k, before, k) / step_s;
  return values;
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
  const auto& led = frame.stats().pose_times_s();
  stage.bodies = bodies_at(with_bodies(recording.scene(), recording.assets()), stage.time_s,
                           {led.begin(), led.end()});
  const int pieces = pieces_of(header);
  const std::vector<ClothMesh> meshes = cloth_of(recording);
  int panels = 0;
  for (int i = 0; i < header.sheets_size(); ++i) {
    const v1::SheetLayout& layout = header.sheets(i);
    const auto first = static_cast<std::size_t>(layout.first_particle());
    const std::size_t count = particle_count(layout);
    const Piece piece{layout, recording.scene().sheets(i), meshes[static_cast<std::size_t>(i)],
                      read_points(frame.positions_m(), header, first, count)};
    const Points& points = piece.points;
    for (std::size_t k = 0; k < count; ++k) {
      if (!std::isfinite(points.x[k] + points.y[k] + points.z[k]))
        throw damaged(recording.path(),
                      fmt::format("a position of frame {} is not finite", number));
    }
    std::vector<double> values = values_of(
        piece, read_points(before.positions_m(), header, first, count), step_s, colouring);

    Surface& surface = stage.surfaces.emplace_back();
    if (is_grid(layout)) {
      surface.points = divided(layout, piece.sheet, points, pieces, stage.bodies);
      values = divided(layout, std::move(values), pieces, false);
      surface.triangles = triangles_of({divided(layout, pieces)});
      surface.panels.assign(surface.triangles.size() / 3, panels++);
    } else {
      surface.points = points;
      for (const Triangle& triangle : piece.mesh.triangles)
        surface.triangles.insert(surface.triangles.end(), triangle.begin(), triangle.end());
      for (const ClothPanel& panel : piece.mesh.panels)
        surface.panels.insert(surface.panels.end(), panel.count, panels++);
    }
    surface.values.assign(values.begin(), values.end());
    surface.normals = normals_of(surface.points, surface.triangles);
  }
  return stage;
}

}  // namespace weft::client
