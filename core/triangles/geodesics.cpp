#include "core/triangles/geodesics.h"

#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

namespace weft {
namespace {

// How far c is from a point that is `from_a` and `from_b` from the ends of the edge a b, on its
// other side, if the way leads through the edge; infinity if not. m
double through_edge(const Vector2d& a, const Vector2d& b, const Vector2d& c, double from_a,
                    double from_b) {
  const double edge = (b - a).norm();
  const Vector2d u = (b - a) / edge;
  const double along_c = u.dot(c - a),
               height_c = std::abs(u.x() * (c - a).y() - u.y() * (c - a).x());
  const double along = (from_a * from_a - from_b * from_b + edge * edge) / (2 * edge);
  const double height2 = from_a * from_a - along * along;
  const double none = std::numeric_limits<double>::infinity();
  if (height2 < 0) return none;
  const double height = std::sqrt(height2);
  const double crossing = along + (along_c - along) * height / (height + height_c);
  if (crossing < 0 || crossing > edge) return none;
  return std::hypot(along_c - along, height_c + height);
}

// Dijkstra's order; lengths are handed on through edges and, unfolded, through triangles (Mitchell,
// Mount and Papadimitriou 1987, without their intervals).
void measure(const RestShape& shape, const Corners& corners, Attachment& attachment) {
  std::vector<double>& length = attachment.length;
  std::vector<int>& nearest = attachment.nearest;
  std::vector<bool> settled(length.size());
  using Waiting = std::pair<double, int>;
  std::priority_queue<Waiting, std::vector<Waiting>, std::greater<>> queue;
  const auto offer = [&](int particle, double way, int end) {
    const auto i = static_cast<std::size_t>(particle);
    if (way >= length[i]) return;
    length[i] = way;
    nearest[i] = end;
    queue.emplace(way, particle);
  };

  for (std::size_t k = 0; k < attachment.held.size(); ++k)
    offer(attachment.held[k], 0, static_cast<int>(k));
  while (!queue.empty()) {
    const int from = queue.top().second;
    queue.pop();
    const auto i = static_cast<std::size_t>(from);
    if (settled[i]) continue;
    settled[i] = true;
    for (const Corners::At* at = corners.begin(from); at != corners.end(from); ++at) {
      const auto t = static_cast<std::size_t>(at->triangle);
      const auto here = static_cast<std::size_t>(at->corner);
      for (const std::size_t k : {(here + 1) % 3, (here + 2) % 3}) {
        const std::size_t opposite = 3 - here - k;
        const int particle = shape.triangles[t][k], other = shape.triangles[t][opposite];
        const auto j = static_cast<std::size_t>(particle);
        const Vector2d &a = shape.corners[t][here], &b = shape.corners[t][k];
        offer(particle, length[i] + (b - a).norm(), nearest[i]);
        if (settled[j] && nearest[j] == nearest[i])
          offer(other, through_edge(a, b, shape.corners[t][opposite], length[i], length[j]),
                nearest[i]);
      }
    }
  }
}

}  // namespace

void measure_tethers(const RestShape& shape, Tethers& tethers) {
  const Corners corners(shape);
  for (Attachment& attachment : tethers) measure(shape, corners, attachment);
}

}  // namespace weft
