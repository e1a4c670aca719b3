#include "core/motion/tethers.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

namespace weft {
namespace {

// The first of what hangs together with each held particle, by edges of triangles.
class HeldGroups {
 public:
  explicit HeldGroups(const SheetDefinition& sheet)
      : parent_(static_cast<std::size_t>(sheet.particle_count()), kFree) {
    for (const Pin& pin : sheet.pins)
      for (const int i : pin.particles) parent(i) = i;
    for (const auto& [a, b, c] : triangles_of(sheet.shape)) {
      join(a, b);
      join(b, c);
      join(c, a);
    }
  }

  bool holds(int particle) const { return parent_[static_cast<std::size_t>(particle)] != kFree; }
  int first(int particle) {
    while (parent(particle) != particle) particle = parent(particle) = parent(parent(particle));
    return particle;
  }

 private:
  static constexpr int kFree = -1;
  int& parent(int particle) { return parent_[static_cast<std::size_t>(particle)]; }
  void join(int one, int other) {
    if (!holds(one) || !holds(other)) return;
    const auto [first_one, last_one] = std::minmax({first(one), first(other)});
    parent(last_one) = first_one;
  }

  std::vector<int> parent_;
};

}  // namespace

Tethers find_attachments(const SheetDefinition& sheet) {
  if (sheet.pins.empty()) return {};
  HeldGroups groups(sheet);
  std::vector<std::pair<int, int>> held;  // first of its group, particle
  std::size_t count = 0;
  for (int i = 0; i < sheet.particle_count(); ++i) {
    if (!groups.holds(i)) continue;
    held.emplace_back(groups.first(i), i);
    count += groups.first(i) == i ? 1 : 0;
  }
  std::sort(held.begin(), held.end());

  // neighbours are mostly near in this order, too
  Tethers tethers(std::min(count, kMostAttachments));
  std::size_t group = 0;
  for (std::size_t k = 0; k < held.size(); ++k) {
    if (k > 0 && held[k].first != held[k - 1].first) ++group;
    tethers[group * tethers.size() / count].held.push_back(held[k].second);
  }
  const auto particles = static_cast<std::size_t>(sheet.particle_count());
  for (Attachment& attachment : tethers) {
    attachment.nearest.resize(particles);
    attachment.length.assign(particles, std::numeric_limits<double>::infinity());
  }
  return tethers;
}

double pull_back(const Moved& end, double length, double inward, Moved& particle) {
  const Vector3d apart = particle.x - end.x;
  const double distance = apart.norm();
  if (!(distance > length)) return 0;
  const Vector3d out = apart / distance;
  const double away = (particle.d - end.d).dot(out);
  const double back = std::clamp(away + inward, 0.0, distance - length);
  particle.x -= back * out;
  particle.d -= back * out;
  return back;
}

}  // namespace weft
