#include "core/pattern/symmetry.h"

#include <cmath>
#include <limits>

#include "core/pattern/sets.h"

namespace weft {
namespace {

double middle(const std::vector<Vector2d>& points) {
  double least = std::numeric_limits<double>::infinity(), most = -least;
  for (const Vector2d& point : points)
    least = std::min(least, point.x()), most = std::max(most, point.x());
  return (least + most) / 2;
}

bool are_same(const Vector2d& a, const Vector2d& b) {
  return (a - b).lpNorm<Eigen::Infinity>() <= kMicrometre;
}

// With the sum for which all points are each other's images and `holds`.
template <class Holds>
std::optional<Mirror> find_mirror(const std::vector<Vector2d>& points, double axis,
                                  const Holds& holds) {
  const int count = static_cast<int>(points.size());
  for (int sum = 0; sum < count; ++sum) {
    const Mirror mirror{axis, sum};
    bool good = true;
    for (int i = 0; i < count && good; ++i)
      good = are_same(mirror.image(points[as_index(i)]),
                      points[as_index(mirror.image(i, points.size()))]);
    if (good && holds(mirror)) return mirror;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Mirror> find_mirror(const std::vector<Vector2d>& points) {
  return find_mirror(points, middle(points), [](const Mirror&) { return true; });
}

bool is_square(double grain) {
  constexpr double kRounding = 1e-9;
  return std::abs(std::sin(2 * grain)) < kRounding;
}

std::vector<int> mirrored_onto_themselves(const std::vector<Curve>& outline, double grain) {
  if (!is_square(grain)) return {};
  std::vector<Vector2d> corners, all;
  for (const Curve& curve : outline) {
    corners.push_back(curve.at(0));
    for (const double share : {0.0, 0.25, 0.5, 0.75}) all.push_back(curve.at(share));
  }
  const std::size_t count = outline.size();
  // an edge's image ends where the image of its start is
  const auto image = [&](const Mirror& mirror, int edge) { return mirror.image(edge + 1, count); };
  const auto holds = [&](const Mirror& mirror) {
    for (std::size_t e = 0; e < count; ++e)
      for (const double share : {0.25, 0.5, 0.75})
        if (!are_same(mirror.image(outline[e].at(share)),
                      outline[as_index(image(mirror, static_cast<int>(e)))].at(1 - share)))
          return false;
    return true;
  };
  const auto mirror = find_mirror(corners, middle(all), holds);
  std::vector<int> found;
  for (int e = 0; mirror && e < static_cast<int>(count); ++e)
    if (image(*mirror, e) == e) found.push_back(e);
  return found;
}

}  // namespace weft
