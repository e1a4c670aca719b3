#include "core/triangles/bending_rows.h"

#include <algorithm>

namespace weft {

BendingRows::BendingRows(const Surface& surface, int particles)
    : surface_(surface),
      uses_(particles,
            [&](const auto& add) {
              for (std::size_t f = 0; f < surface.fits.size(); ++f)
                for (std::size_t k = 0; k < surface.fits[f].particle.size(); ++k)
                  add(surface.fits[f].particle[k], Use{f, k});
            }),
      sum_(static_cast<std::size_t>(particles)),
      known_(static_cast<std::size_t>(particles), -1) {}

const std::vector<BendingRows::Entry>& BendingRows::row(int i) {
  entries_.clear();
  for (const auto& [f, at] : uses_.at(i)) {
    const CurvatureFit& fit = surface_.fits[f];
    const BendStiffness& bend = surface_.bend[static_cast<std::size_t>(fit.panel)];
    const auto& own = fit.weight[at];
    for (std::size_t k = 0; k < fit.particle.size(); ++k) {
      const int j = fit.particle[k];
      const auto& other = fit.weight[k];
      if (j == i) continue;
      if (known_[static_cast<std::size_t>(j)] != i) {
        known_[static_cast<std::size_t>(j)] = i;
        sum_[static_cast<std::size_t>(j)] = 0;
        entries_.push_back({j, 0});
      }
      sum_[static_cast<std::size_t>(j)] +=
          fit.area * (bend.warp * (own[0] * other[0]) + 2 * bend.twist * (own[1] * other[1]) +
                      bend.weft * (own[2] * other[2]));
    }
  }
  for (Entry& entry : entries_) entry.stiffness = sum_[static_cast<std::size_t>(entry.particle)];
  std::sort(entries_.begin(), entries_.end(),
            [](const Entry& a, const Entry& b) { return a.particle < b.particle; });
  return entries_;
}

}  // namespace weft
