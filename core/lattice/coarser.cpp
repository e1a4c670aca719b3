#include "core/lattice/coarser.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/lattice/lattice.h"
#include "core/lattice/shown.h"

namespace weft {
namespace {

// Fewer rows and columns than these are fast enough.
constexpr int kFew = 29;

// Cells along both sides, as close to half as the ratio of the sides allows.
Grid coarser_grid(const Grid& grid) {
  const double rows = grid.rows - 1, columns = grid.columns - 1;
  Grid best;
  double least = std::numeric_limits<double>::infinity();
  const auto half = static_cast<int>(std::lround(rows / 2));
  const int slack = half / 8;
  for (int r = half - slack; r <= half + slack; ++r) {
    const double by = rows / r;
    const double c = std::round(columns / by);
    const double mismatch = std::abs(c * by / columns - 1) + 1e-3 * std::abs(r - half) / half;
    if (mismatch >= least) continue;
    least = mismatch;
    best = {r + 1, static_cast<int>(c) + 1, grid.spacing * (by + columns / c) / 2};
  }
  return best;
}

Textile scaled(Textile textile, double by) {
  if (auto* raw = std::get_if<RawTextile>(&textile.model)) {
    raw->particle_mass *= by * by;
    raw->air_drag *= by * by;
    raw->bend *= by;  // k_b = 2/3 B h
  }
  return textile;
}

// Those nearest to the pinned ones, where they are.
std::vector<Pin> coarser_pins(const std::vector<Pin>& pins, const Grid& from, const Grid& to) {
  std::vector<int> held;
  const auto place = [](int at, int from_last, int to_last) {
    return static_cast<int>(std::lround(static_cast<double>(at) * to_last / from_last));
  };
  for (const Pin& pin : pins)
    for (const int i : pin.particles)
      held.push_back(place(i / from.columns, from.rows - 1, to.rows - 1) * to.columns +
                     place(i % from.columns, from.columns - 1, to.columns - 1));
  std::sort(held.begin(), held.end());
  held.erase(std::unique(held.begin(), held.end()), held.end());
  if (held.empty()) return {};
  return {{std::move(held), {}}};
}

}  // namespace

std::optional<Scene> coarser_scene(const Scene& scene, const std::vector<Matrix3Xd>& x,
                                   double time) {
  if (scene.cloth_contact) return std::nullopt;
  Scene coarser = scene;
  coarser.solver.substep.reset();
  coarser.dressing.reset();
  for (Collider& collider : coarser.colliders) {
    if (collider.poses) return std::nullopt;
    if (!collider.path.empty()) collider.path = {{0, offset_at(collider.path, time)}};
  }
  for (std::size_t s = 0; s < x.size(); ++s) {
    SheetDefinition& sheet = coarser.sheets[s];
    const auto* grid = std::get_if<Grid>(&sheet.shape);
    if (grid == nullptr || std::min(grid->rows, grid->columns) < kFew) return std::nullopt;
    const Grid fine = *grid, coarse = coarser_grid(fine);
    sheet.textile = scaled(sheet.textile, coarse.spacing / fine.spacing);
    sheet.pins = coarser_pins(sheet.pins, fine, coarse);
    sheet.shape = coarse;
    const Matrix3Xd start = resample(x[s], fine, coarse);
    sheet.start_positions.assign(start.data(), start.data() + start.size());
    sheet.start_velocities.clear();
  }
  return coarser;
}

}  // namespace weft
