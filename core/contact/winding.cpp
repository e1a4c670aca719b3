#include "core/contact/winding.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace weft {
namespace {

using Eigen::Vector2d;

// Twice the area of a, b and p in the plane of y and z, anticlockwise positive. The same to the
// bit, but for its sign, whichever way an edge runs: no parallel slips through between two
// triangles.
double twice_area(const Vector2d& a, const Vector2d& b, const Vector2d& p) {
  if (std::tie(b.x(), b.y()) < std::tie(a.x(), a.y())) return -twice_area(b, a, p);
  const Vector2d ab = b - a, ap = p - a;
  return ab.x() * ap.y() - ab.y() * ap.x();
}

// On which side of a b the point lies, if on none the one moved by (e, e^2), e very small.
int side(double area, const Vector2d& a, const Vector2d& b) {
  const double beside = area != 0 ? area : a.y() != b.y() ? a.y() - b.y() : b.x() - a.x();
  return (beside > 0) - (beside < 0);
}

}  // namespace

WindingNumbers::WindingNumbers(const BodyMesh& mesh, const Vector3d& low, double step, int rows,
                               int layers)
    : begin_(static_cast<std::size_t>(rows) * static_cast<std::size_t>(layers) + 1), rows_(rows) {
  std::vector<std::pair<std::size_t, Crossing>> found;
  for (const auto& triangle : mesh.triangles) {
    Vector3d corners[3];
    Vector2d flat[3];
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = mesh.vertices[static_cast<std::size_t>(triangle[k])];
      flat[k] = corners[k].tail<2>() - low.tail<2>();
    }
    const Vector2d least = flat[0].cwiseMin(flat[1]).cwiseMin(flat[2]) / step;
    const Vector2d most = flat[0].cwiseMax(flat[1]).cwiseMax(flat[2]) / step;
    const auto first = [](double v) { return std::max(0, static_cast<int>(std::ceil(v))); };
    const auto last = [](double v, int count) {
      return std::min(count - 1, static_cast<int>(std::floor(v)));
    };
    for (int k = first(least.y()); k <= last(most.y(), layers); ++k)
      for (int j = first(least.x()); j <= last(most.x(), rows); ++j) {
        const Vector2d p(j * step, k * step);
        double opposite[3], all = 0;
        int sides = 0;
        for (std::size_t i = 0; i < 3; ++i) {
          const Vector2d &a = flat[(i + 1) % 3], &b = flat[(i + 2) % 3];
          opposite[i] = twice_area(a, b, p);
          sides += side(opposite[i], a, b);
          all += opposite[i];
        }
        if (std::abs(sides) != 3) continue;
        double x = 0;
        for (std::size_t i = 0; i < 3; ++i)
          x += all != 0 ? opposite[i] / all * corners[i].x() : corners[i].x() / 3;
        const auto line = static_cast<std::size_t>(k) * static_cast<std::size_t>(rows) +
                          static_cast<std::size_t>(j);
        found.push_back({line, {x, sides > 0 ? -1 : 1}});
      }
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
    return std::tie(a.first, a.second.x, a.second.change) <
           std::tie(b.first, b.second.x, b.second.change);
  });
  for (const auto& [line, crossing] : found) {
    crossings_.push_back(crossing);
    ++begin_[line + 1];
  }
  for (std::size_t line = 1; line < begin_.size(); ++line) begin_[line] += begin_[line - 1];
}

int WindingNumbers::at(double x, int j, int k) const {
  const auto line =
      static_cast<std::size_t>(k) * static_cast<std::size_t>(rows_) + static_cast<std::size_t>(j);
  int number = 0;
  for (std::size_t i = begin_[line]; i < begin_[line + 1] && crossings_[i].x < x; ++i)
    number += crossings_[i].change;
  return number;
}

}  // namespace weft
