#include "core/cloth_contact/orientation.h"

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

namespace weft {
namespace {

int sign_of(double value) { return (value > 0) - (value < 0); }

// A sum of doubles without rounding: terms that do not overlap, the smallest first (Shewchuk 1997).
// Exact as long as nothing over- or underflows.
class ExactSum {
 public:
  void add(double value) {
    std::size_t kept = 0;
    for (const double term : terms_) {
      const double sum = value + term, virtual_term = sum - value;
      const double error = (value - (sum - virtual_term)) + (term - virtual_term);
      if (error != 0) terms_[kept++] = error;
      value = sum;
    }
    terms_.resize(kept);
    if (value != 0) terms_.push_back(value);
  }
  void add_product(double a, double b) {
    const double product = a * b;
    add(product);
    add(std::fma(a, b, -product));
  }
  void add_product(double a, double b, double c) {
    const double product = a * b;
    add_product(product, c);
    add_product(std::fma(a, b, -product), c);
  }
  int sign() const { return terms_.empty() ? 0 : weft::sign_of(terms_.back()); }

 private:
  std::vector<double> terms_;
};

// Of a, b and c as rows.
void add_determinant(const Vector3d& a, const Vector3d& b, const Vector3d& c, double factor,
                     ExactSum& sum) {
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::Index j = (i + 1) % 3, k = (i + 2) % 3;
    sum.add_product(factor * a[i], b[j], c[k]);
    sum.add_product(-factor * a[i], b[k], c[j]);
  }
}

// The component of (a - p) x (b - p) along an axis.
int normal_sign(const Vector3d& p, const Vector3d& a, const Vector3d& b, Eigen::Index axis) {
  const Eigen::Index j = (axis + 1) % 3, k = (axis + 2) % 3;
  ExactSum sum;
  for (const auto& [u, v] : {std::pair(a, b), std::pair(b, p), std::pair(p, a)}) {
    sum.add_product(u[j], v[k]);
    sum.add_product(-u[k], v[j]);
  }
  return sum.sign();
}

// On which side of the edge from a to b a line from p to q passes; where it meets the edge, on
// which it would if q lay a little farther along x, y and z, in this order of importance. So all
// that meet there agree.
int passing_side(const Vector3d& p, const Vector3d& q, const Vector3d& a, const Vector3d& b) {
  int found = orientation(p, a, b, q);
  for (Eigen::Index axis = 0; axis < 3 && found == 0; ++axis) found = normal_sign(p, a, b, axis);
  return found;
}

}  // namespace

int orientation(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  const Vector3d u = a - d, v = b - d, w = c - d;
  const double estimate = w.dot(u.cross(v));
  const Vector3d size = u.cwiseAbs(), other = v.cwiseAbs();
  const Vector3d products(size.y() * other.z() + size.z() * other.y(),
                          size.z() * other.x() + size.x() * other.z(),
                          size.x() * other.y() + size.y() * other.x());
  constexpr double kError = 1e-15;  // above (7 + 56 epsilon) epsilon, epsilon = 2^-53
  if (std::abs(estimate) > kError * products.dot(w.cwiseAbs())) return -sign_of(estimate);

  ExactSum sum;
  add_determinant(a, b, c, -1, sum);
  add_determinant(a, b, d, 1, sum);
  add_determinant(a, c, d, -1, sum);
  add_determinant(b, c, d, 1, sum);
  return sum.sign();
}

bool cuts(const Vector3d& p, const Vector3d& q, const Vector3d& a, const Vector3d& b,
          const Vector3d& c) {
  const int from = orientation(a, b, c, p), to = orientation(a, b, c, q);
  if (from * to >= 0) return false;
  const int one = passing_side(p, q, a, b);
  return one != 0 && passing_side(p, q, b, c) == one && passing_side(p, q, c, a) == one;
}

}  // namespace weft
