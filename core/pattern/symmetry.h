#pragma once

#include <optional>
#include <vector>

#include "core/pattern/curve.h"

namespace weft {

inline constexpr double kMicrometre = 1e-6;  // m: points that close are the same

// A line u = axis, about which points around an outline are each other's mirror images: point i
// and point `sum` - i, counted around.
struct Mirror {
  double axis = 0;  // m
  int sum = 0;

  int image(int i, std::size_t count) const {
    const int n = static_cast<int>(count);
    return ((sum - i) % n + n) % n;
  }
  Vector2d image(const Vector2d& point) const { return {2 * axis - point.x(), point.y()}; }
};

// About which an outline of points is symmetric, to a micrometre.
std::optional<Mirror> find_mirror(const std::vector<Vector2d>& points);

// Edges of a symmetric outline whose middle lies on its axis; none where the grain is not along it
// or across.
std::vector<int> mirrored_onto_themselves(const std::vector<Curve>& outline, double grain);

// Whether the grain is along the line u = constant, or across it.
bool is_square(double grain);

}  // namespace weft
