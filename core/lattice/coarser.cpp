#include "core/lattice/coarser.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/lattice/lattice.h"

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

// Weights of the values at -1, 0, 1 and 2 for one at 0 <= t <= 1 (Catmull-Rom).
std::array<double, 4> cubic(double t) {
  return {((2 - t) * t - 1) * t / 2, ((3 * t - 5) * t * t + 2) / 2, ((4 - 3 * t) * t + 1) * t / 2,
          (t - 1) * t * t / 2};
}

// Along one side: which values a particle is made of, and by what weights.
struct Sample {
  std::array<int, 4> at;
  std::array<double, 4> weight;
};
std::vector<Sample> samples(int from, int to) {
  std::vector<Sample> made;
  for (int i = 0; i < to; ++i) {
    const double place = static_cast<double>(i) * (from - 1) / (to - 1);
    const int first = std::min(static_cast<int>(place), from - 2);
    Sample sample{{first - 1, first, first + 1, first + 2}, cubic(place - first)};
    auto& [at, weight] = sample;
    if (at[0] < 0) {  // 2 x_0 - x_1
      weight[1] += 2 * weight[0];
      weight[2] -= weight[0];
      weight[0] = at[0] = 0;
    }
    if (at[3] >= from) {
      weight[2] += 2 * weight[3];
      weight[1] -= weight[3];
      weight[3] = at[3] = 0;
    }
    made.push_back(sample);
  }
  return made;
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

Matrix3Xd resample(const Matrix3Xd& values, const Grid& from, const Grid& to) {
  const std::vector<Sample> columns = samples(from.columns, to.columns);
  Matrix3Xd rows_kept(3, from.rows * to.columns);
  for (int r = 0; r < from.rows; ++r)
    for (int c = 0; c < to.columns; ++c) {
      const auto& [at, weight] = columns[static_cast<std::size_t>(c)];
      Vector3d sum = Vector3d::Zero();
      for (std::size_t k = 0; k < 4; ++k) sum += weight[k] * values.col(r * from.columns + at[k]);
      rows_kept.col(r * to.columns + c) = sum;
    }
  Matrix3Xd made(3, to.rows * to.columns);
  int i = 0;
  for (const auto& [at, weight] : samples(from.rows, to.rows))
    for (int c = 0; c < to.columns; ++c) {
      Vector3d sum = Vector3d::Zero();
      for (std::size_t k = 0; k < 4; ++k) sum += weight[k] * rows_kept.col(at[k] * to.columns + c);
      made.col(i++) = sum;
    }
  return made;
}

}  // namespace weft
