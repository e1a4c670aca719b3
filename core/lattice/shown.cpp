#include "core/lattice/shown.h"

#include <algorithm>
#include <array>

namespace weft {
namespace {

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

Eigen::Index particles_of(const std::vector<SheetShape>& sheets) {
  Eigen::Index particles = 0;
  for (const SheetShape& sheet : sheets) particles += particle_count(sheet);
  return particles;
}

}  // namespace

Planes resample(const Planes& values, const Grid& from, const Grid& to) {
  const std::vector<Sample> columns = samples(from.columns, to.columns);
  const std::vector<Sample> rows = samples(from.rows, to.rows);
  const Eigen::Index width = to.columns;
  Planes made(values.rows(), to.rows * width);
  Planes rows_kept(from.rows, width);
  for (Eigen::Index plane = 0; plane < values.rows(); ++plane) {
    for (int r = 0; r < from.rows; ++r)
      for (int c = 0; c < to.columns; ++c) {
        const auto& [at, weight] = columns[static_cast<std::size_t>(c)];
        double sum = 0;
        for (std::size_t k = 0; k < 4; ++k)
          sum += weight[k] * values(plane, r * from.columns + at[k]);
        rows_kept(r, c) = sum;
      }
    Eigen::Index first = 0;
    for (const auto& [at, weight] : rows) {
      auto row = made.row(plane).segment(first, width);
      row = weight[0] * rows_kept.row(at[0]);
      for (std::size_t k = 1; k < 4; ++k) row += weight[k] * rows_kept.row(at[k]);
      first += width;
    }
  }
  return made;
}

std::vector<SheetShape> shown(const std::vector<SheetShape>& sheets) {
  std::vector<SheetShape> all;
  for (const SheetShape& sheet : sheets) all.push_back(shown(sheet));
  return all;
}

std::vector<double> shown_values(const std::vector<double>& planes,
                                 const std::vector<SheetShape>& sheets) {
  const Eigen::Index simulated = particles_of(sheets), all = particles_of(shown(sheets));
  const Eigen::Index count = std::ssize(planes) / simulated;
  std::vector<double> values(static_cast<std::size_t>(count * all));
  const Eigen::Map<const Planes> from(planes.data(), count, simulated);
  Eigen::Map<Planes> to(values.data(), count, all);
  Eigen::Index first = 0, first_shown = 0;
  for (const SheetShape& sheet : sheets) {
    const auto of_sheet = from.middleCols(first, particle_count(sheet));
    const SheetShape wanted = shown(sheet);
    auto shown_of_sheet = to.middleCols(first_shown, particle_count(wanted));
    if (is_interpolated(sheet))
      shown_of_sheet = resample(of_sheet, std::get<Grid>(sheet), std::get<Grid>(wanted));
    else
      shown_of_sheet = of_sheet;
    first += of_sheet.cols();
    first_shown += shown_of_sheet.cols();
  }
  return values;
}

}  // namespace weft
