#pragma once

#include <Eigen/Core>

namespace weft {

// A heavy inextensible strip of length 1, clamped level at one end: B theta'' = -q (1 - s) cos
// theta, q = w l^3 / B, in units of its length. (2 x points) x and drop at equal steps of s from
// the clamp to the tip.
Eigen::Matrix2Xd heavy_elastica(double q, int points);

// The overhang at which the chord from clamp to tip points 41.5 degrees down (ASTM D1388): l^3 = 8
// B / w, and the chord's angle there, degrees.
inline constexpr double kCantileverQ = 8;
double chord_angle(double x, double drop);  // degrees

// An elastic chain of stretch stiffness E (N) and weight w (N/m) between two points one level and
// `span` apart, length m at rest: (2 x points) x and drop, m, at equal steps of the length.
Eigen::Matrix2Xd elastic_catenary(double stiffness, double weight, double length, double span,
                                  int points);

}  // namespace weft
