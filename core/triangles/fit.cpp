#include "core/triangles/fit.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

namespace weft {
namespace {

// Places and turns in the plane, as complex numbers.
using Plane2 = std::complex<double>;

struct Neighbour {
  int particle;
  Plane2 offset;    // from the particle, m
  Plane2 turn = 1;  // of its frame against the particle's
};

// The triangles around a particle, laid flat beside each other in the frame of the first.
struct Fan {
  std::vector<Neighbour> ring;  // by particle
  std::vector<Plane2> turns;    // of each triangle, in order of Corners, against its own frame
  bool turned = false;          // some of them are
};

class Fans {
 public:
  explicit Fans(const RestShape& shape) : shape_(shape), corners_(shape) {
    fans_.reserve(static_cast<std::size_t>(shape.particles));
    for (int i = 0; i < shape.particles; ++i) fans_.push_back(lay(i));
  }

  const Fan& at(int i) const { return fans_[static_cast<std::size_t>(i)]; }
  const Corners& corners() const { return corners_; }

  std::vector<Neighbour> ring(int i) const {
    std::vector<Neighbour> ring = at(i).ring;
    for (Neighbour& each : ring) each.turn = turn_between(i, each.particle);
    return ring;
  }

  // With those neighbours of its neighbours that at least so many of them have.
  std::vector<Neighbour> widened(int i, int least) const {
    const std::vector<Neighbour> near = ring(i);
    std::vector<Neighbour> wide = near;
    std::vector<int> times(near.size(), least);
    for (const auto& [j, offset, turn] : near) {
      for (const Neighbour& each : at(j).ring) {
        const int k = each.particle;
        if (k == i) continue;
        std::size_t known = 0;
        while (known < wide.size() && wide[known].particle != k) ++known;
        if (known == wide.size()) {
          wide.push_back({k, offset + turn * each.offset, turn * turn_between(j, k)});
          times.push_back(0);
        }
        ++times[known];
      }
    }
    std::size_t kept = 0;
    for (std::size_t n = 0; n < wide.size(); ++n)
      if (times[n] >= least) wide[kept++] = wide[n];
    wide.resize(kept);
    return wide;
  }

 private:
  // From triangle t's corner k to the one after it, or the one after that.
  Plane2 side(int t, int k, int to) const {
    const auto& corner = shape_.corners[static_cast<std::size_t>(t)];
    const Vector2d d =
        corner[static_cast<std::size_t>((k + to) % 3)] - corner[static_cast<std::size_t>(k)];
    return {d.x(), d.y()};
  }
  int particle(int t, int k) const {
    return shape_.triangles[static_cast<std::size_t>(t)][static_cast<std::size_t>(k % 3)];
  }

  Fan lay(int i) const {
    const Corners::At* const begin = corners_.begin(i);
    const auto count = static_cast<std::size_t>(corners_.end(i) - begin);
    Fan fan;
    fan.turns.resize(count);
    std::vector<bool> laid(count);
    const auto place_of = [&](int j) {
      return std::find_if(fan.ring.begin(), fan.ring.end(),
                          [&](const Neighbour& each) { return each.particle == j; });
    };
    for (std::size_t done = 0; done < count; ++done) {
      // next to those that lie, else by itself
      std::size_t next = count;
      Plane2 turn = 1;
      for (std::size_t n = 0; n < count; ++n) {
        if (laid[n]) continue;
        const auto [t, k] = begin[n];
        for (const int to : {1, 2}) {
          const auto beside = place_of(particle(t, k + to));
          if (beside == fan.ring.end()) continue;
          const Plane2 own = side(t, k, to);
          next = n;
          constexpr double kSame = 1e-9;
          if (std::abs(beside->offset - own) > kSame * std::abs(own)) {
            turn = beside->offset / own;
            turn /= std::abs(turn);
          }
          break;
        }
        if (next != count) break;
      }
      if (next == count)
        next = static_cast<std::size_t>(std::find(laid.begin(), laid.end(), false) - laid.begin());
      const auto [t, k] = begin[next];
      for (const int to : {1, 2})
        if (const int j = particle(t, k + to); place_of(j) == fan.ring.end())
          fan.ring.push_back({j, turn * side(t, k, to)});
      laid[next] = true;
      fan.turns[next] = turn;
      fan.turned |= turn != Plane2(1);
    }
    std::sort(fan.ring.begin(), fan.ring.end(),
              [](const Neighbour& a, const Neighbour& b) { return a.particle < b.particle; });
    return fan;
  }

  // Of the frame of j's fan against that of i's, by a triangle that they share.
  Plane2 turn_between(int i, int j) const {
    const Fan &here = at(i), &there = at(j);
    if (!here.turned && !there.turned) return 1;  // of one panel
    for (const Corners::At* a = corners_.begin(i); a != corners_.end(i); ++a)
      for (const Corners::At* b = corners_.begin(j); b != corners_.end(j); ++b)
        if (a->triangle == b->triangle)
          return here.turns[static_cast<std::size_t>(a - corners_.begin(i))] /
                 there.turns[static_cast<std::size_t>(b - corners_.begin(j))];
    return 1;
  }

  const RestShape& shape_;
  Corners corners_;
  std::vector<Fan> fans_;
};

// (3 x 3) uu, uv and vv in a frame that is turned, by those in the one it is turned against.
Eigen::Matrix3d into(Plane2 turn) {
  const double c = turn.real(), s = turn.imag();
  Eigen::Matrix3d turned;
  turned << c * c, 2 * c * s, s * s, -c * s, c * c - s * s, c * s, s * s, -2 * c * s, c * c;
  return turned;
}

// A quadratic through a particle, by least squares over those near it.
struct Quadratic {
  std::vector<Neighbour> near;
  double area = 0;                                 // that belongs to the particle, m^2
  Eigen::Matrix<double, 2, Eigen::Dynamic> slope;  // what each weighs in u and v, 1/m
  Eigen::Matrix3Xd weights;                        // and in uu, uv, vv, 1/m^2
  VectorXd importance;                             // of each, the square root
  Eigen::MatrixXd basis;  // (near x 5) orthonormal, of all quadratics by their importance
  double mean = 0;        // distance, m
};

Quadratic quadratic(std::vector<Neighbour> near) {
  const auto count = static_cast<Eigen::Index>(near.size());
  Quadratic fit;
  for (const Neighbour& each : near) fit.mean += std::abs(each.offset) / static_cast<double>(count);
  const double mean = fit.mean;  // by which all lengths are divided

  Eigen::MatrixXd terms(count, 5);
  fit.importance.resize(count);
  for (Eigen::Index row = 0; row < count; ++row) {
    constexpr double kNearest = 0.3;  // of what lies nearer no more is made
    const Plane2 d = near[static_cast<std::size_t>(row)].offset / mean;
    const double u = d.real(), v = d.imag();
    fit.importance[row] = 1 / std::pow(std::max(std::abs(d), kNearest), 3);
    terms.row(row) << u, v, u * u / 2, u * v, v * v / 2;
    terms.row(row) *= fit.importance[row];
  }
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> qr;
  qr.setThreshold(1e-6);
  qr.compute(terms);
  const Eigen::MatrixXd inverse = qr.pseudoInverse() * fit.importance.asDiagonal();  // (5 x count)
  fit.slope = inverse.topRows<2>() / mean;
  fit.weights = inverse.bottomRows<3>() / (mean * mean);
  fit.basis = qr.householderQ() * Eigen::MatrixXd::Identity(count, qr.rank());
  fit.near = std::move(near);
  return fit;
}

// What no quadratic has of values around each particle, scattered back: the matrix of Balance. It
// is solved for a few digits, which single precision has.
class FreeParts {
 public:
  explicit FreeParts(const std::vector<Quadratic>& fits) {
    std::size_t members = 0;
    for (const Quadratic& fit : fits) members += fit.near.size();
    members_.reserve(members);
    counts_.reserve(fits.size());
    for (const Quadratic& fit : fits) {
      counts_.push_back(fit.near.size());
      const double scale = std::sqrt(fit.area) / (fit.mean * fit.mean);
      for (std::size_t k = 0; k < fit.near.size(); ++k) {
        const auto row = static_cast<Eigen::Index>(k);
        const double root = scale * fit.importance[row];
        Member& member = members_.emplace_back();
        member.particle = fit.near[k].particle;
        member.weight = static_cast<float>(root * root);
        for (Eigen::Index q = 0; q < fit.basis.cols(); ++q)
          member.basis[static_cast<std::size_t>(q)] = static_cast<float>(root * fit.basis(row, q));
        if (fit.near[k].turn == Plane2(1)) continue;
        member.turned = static_cast<int>(turns_.size());
        turns_.emplace_back(into(fit.near[k].turn).cast<float>());
        turns_.emplace_back(into(std::conj(fit.near[k].turn)).cast<float>());
      }
    }
  }

  // Adds what they are of `values` to sums, by particle.
  void add(const Matrix3Xd& values, Matrix3Xd& sums) const {
    Eigen::Matrix4Xf from = Eigen::Matrix4Xf::Zero(4, values.cols()), to = from;
    from.topRows<3>() = values.cast<float>();
    std::vector<Tensor> around;
    const Member* member = members_.data();
    for (std::size_t i = 0; i < counts_.size(); member += counts_[i], ++i) {
      const auto own = static_cast<Eigen::Index>(i);
      around.resize(std::max(around.size(), counts_[i]));
      std::array<Tensor, 5> quadratics;
      quadratics.fill(Tensor::Zero());
      for (std::size_t k = 0; k < counts_[i]; ++k) {
        const Member& each = member[k];
        Tensor value = from.col(each.particle);
        if (each.turned >= 0) turn(each.turned + 1, value);
        value -= from.col(own);
        for (std::size_t q = 0; q < 5; ++q) quadratics[q] += each.basis[q] * value;
        around[k] = value;
      }
      Tensor sum = Tensor::Zero();
      for (std::size_t k = 0; k < counts_[i]; ++k) {
        const Member& each = member[k];
        Tensor part = each.weight * around[k];
        for (std::size_t q = 0; q < 5; ++q) part -= each.basis[q] * quadratics[q];
        sum += part;
        if (each.turned >= 0) turn(each.turned, part);
        to.col(each.particle) += part;
      }
      to.col(own) -= sum;
    }
    sums += to.topRows<3>().cast<double>();
  }

 private:
  using Tensor = Eigen::Vector4f;  // uu, uv, vv and 0
  struct Member {
    int particle;
    int turned = -1;  // at which of the turns, into the particle's own frame; the next leads back
    float weight;
    std::array<float, 5> basis{};
  };

  void turn(int by, Tensor& tensor) const {
    const Eigen::Vector3f turned = turns_[static_cast<std::size_t>(by)] * tensor.head<3>();
    tensor.head<3>() = turned;
  }

  std::vector<std::size_t> counts_;  // of each particle's members
  std::vector<Member> members_;
  std::vector<Eigen::Matrix3f> turns_;
};

// Fits are right about a sheet that is bent evenly, and still it would not keep that shape under an
// even moment where the mesh is uneven: it would find one of less energy, and be too limp. It keeps
// it where the mean curvature of all depends on the slopes at the border alone, as in the plane the
// integral of a second derivative does: sums over the fits of area times weight are then given for
// every particle, 0 inside. What is added to the weights is the least that does it, and adds
// nothing for quadratics. By conjugate gradients for the multipliers of those sums.
class Balance {
 public:
  Balance(const RestShape& shape, const Fans& fans, std::vector<Quadratic>& fits)
      : shape_(shape), fans_(fans), fits_(fits) {}

  void restore() {
    Matrix3Xd residual = border_slopes();
    for (std::size_t i = 0; i < fits_.size(); ++i)
      scatter(i, -fits_[i].area * fits_[i].weights, residual);
    const Matrix3Xd weights = area_weights();
    const double enough = kEnough * kEnough * product(weights, weights);
    const VectorXd diagonal = diagonals();
    const FreeParts free_parts(fits_);
    Matrix3Xd multiplier = Matrix3Xd::Zero(3, residual.cols());
    Matrix3Xd along = multiplier, scaled = multiplier, sums = multiplier;
    double before = 0;
    for (int k = 0; k < kMost && product(residual, residual) > enough; ++k) {
      scaled = residual * diagonal.cwiseInverse().asDiagonal();
      const double now = product(residual, scaled);
      along *= before > 0 ? now / before : 0;
      along += scaled;
      before = now;
      sums = along * (kSlight * diagonal).asDiagonal();
      free_parts.add(along, sums);
      const double step = now / product(along, sums);
      multiplier += step * along;
      residual -= step * sums;
    }
    for (std::size_t i = 0; i < fits_.size(); ++i) fits_[i].weights += free_part(i, multiplier);
  }

 private:
  static constexpr double kEnough = 1e-3;  // of the weights
  static constexpr double kSlight = 1e-3;  // where fits are free to give nothing
  static constexpr int kMost = 60;

  // of tensors uu, uv, vv
  static double product(const Matrix3Xd& a, const Matrix3Xd& b) {
    return a.cwiseProduct(b).rowwise().sum().dot(Vector3d(1, 2, 1));
  }

  Matrix3Xd area_weights() const {
    Matrix3Xd all(3, static_cast<Eigen::Index>(fits_.size()));
    for (std::size_t i = 0; i < fits_.size(); ++i)
      all.col(static_cast<Eigen::Index>(i)) =
          fits_[i].area * fits_[i].weights.rowwise().sum().cwiseAbs();
    return all;
  }

  // What a fit weighs its neighbours and itself by, each in its own frame.
  void scatter(std::size_t i, const Matrix3Xd& weights, Matrix3Xd& sums) const {
    const auto& near = fits_[i].near;
    for (std::size_t k = 0; k < near.size(); ++k) {
      const Vector3d weight = weights.col(static_cast<Eigen::Index>(k));
      sums.col(near[k].particle) +=
          near[k].turn == Plane2(1) ? weight : Vector3d(into(near[k].turn) * weight);
    }
    sums.col(static_cast<Eigen::Index>(i)) -= weights.rowwise().sum();
  }

  // The part of the multipliers around a particle that no quadratic has (3 x near).
  Matrix3Xd free_part(std::size_t i, const Matrix3Xd& multiplier) const {
    const Quadratic& fit = fits_[i];
    Matrix3Xd values(3, fit.importance.size());
    for (std::size_t k = 0; k < fit.near.size(); ++k) {
      const auto& [j, offset, turn] = fit.near[k];
      Vector3d value = multiplier.col(j);
      if (turn != Plane2(1)) value = into(std::conj(turn)) * value;
      const auto column = static_cast<Eigen::Index>(k);
      values.col(column) =
          fit.importance[column] * (value - multiplier.col(static_cast<Eigen::Index>(i)));
    }
    values -= (values * fit.basis) * fit.basis.transpose();
    return values * fit.importance.asDiagonal() / std::pow(fit.mean, 4);
  }

  // Above those of what conjugate gradients solve.
  VectorXd diagonals() const {
    VectorXd all = VectorXd::Zero(static_cast<Eigen::Index>(fits_.size()));
    for (std::size_t i = 0; i < fits_.size(); ++i) {
      const Quadratic& fit = fits_[i];
      const VectorXd each =
          fit.area / std::pow(fit.mean, 4) * fit.importance.array().square().matrix();
      for (std::size_t k = 0; k < fit.near.size(); ++k)
        all[fit.near[k].particle] += each[static_cast<Eigen::Index>(k)];
      all[static_cast<Eigen::Index>(i)] += each.sum();
    }
    return all;
  }

  // Slopes at the border, by the normals and lengths of the edges there: 0 inside.
  Matrix3Xd border_slopes() const {
    Matrix3Xd sums = Matrix3Xd::Zero(3, static_cast<Eigen::Index>(fits_.size()));
    for (std::size_t i = 0; i < fits_.size(); ++i) {
      const auto particle = static_cast<int>(i);
      const Corners::At* const begin = fans_.corners().begin(particle);
      Plane2 normal = 0;  // m
      for (const Corners::At* at = begin; at != fans_.corners().end(particle); ++at) {
        const auto& corner = shape_.corners[static_cast<std::size_t>(at->triangle)];
        const Vector2d opposite = corner[static_cast<std::size_t>((at->corner + 1) % 3)] -
                                  corner[static_cast<std::size_t>((at->corner + 2) % 3)];
        normal += fans_.at(particle).turns[static_cast<std::size_t>(at - begin)] *
                  Plane2(opposite.y(), -opposite.x()) / 2.0;
      }
      if (std::abs(normal) < 1e-9 * fits_[i].mean) continue;
      Eigen::Matrix<double, 3, 2> along;
      along << normal.real(), 0, normal.imag() / 2, normal.real() / 2, 0, normal.imag();
      scatter(i, along * fits_[i].slope, sums);
    }
    return sums;
  }

  const RestShape& shape_;
  const Fans& fans_;
  std::vector<Quadratic>& fits_;
};

// A part of a particle's area whose warp lies in one direction.
struct Share {
  int panel;
  Plane2 turn;
  double area;
};

std::vector<Share> shares(const RestShape& shape, const Fans& fans, int i) {
  std::vector<Share> all;
  const Corners::At* const begin = fans.corners().begin(i);
  for (const Corners::At* at = begin; at != fans.corners().end(i); ++at) {
    const auto t = static_cast<std::size_t>(at->triangle);
    const Plane2 turn = fans.at(i).turns[static_cast<std::size_t>(at - begin)];
    const double part = area(shape.corners[t]) / 3;
    const auto same = std::find_if(all.begin(), all.end(), [&](const Share& each) {
      return each.panel == panel_of(shape, t) && std::abs(each.turn - turn) < 1e-6;
    });
    if (same != all.end())
      same->area += part;
    else
      all.push_back({panel_of(shape, t), turn, part});
  }
  return all;
}

CurvatureFit fit_along(int i, const Quadratic& quadratic, const Share& share) {
  const std::vector<Neighbour>& near = quadratic.near;
  const Eigen::Matrix3d turned = into(share.turn);
  CurvatureFit fit;
  fit.area = share.area;
  fit.panel = share.panel;
  fit.particle.reserve(near.size() + 1);
  fit.weight.reserve(near.size() + 1);
  fit.particle.push_back(i);
  fit.weight.push_back({0, 0, 0});
  for (std::size_t k = 0; k < near.size(); ++k) {
    const Vector3d weight = turned * quadratic.weights.col(static_cast<Eigen::Index>(k));
    fit.particle.push_back(near[k].particle);
    fit.weight.push_back({weight[0], weight[1], weight[2]});
    for (std::size_t d = 0; d < 3; ++d) fit.weight[0][d] -= fit.weight.back()[d];
  }
  return fit;
}

}  // namespace

std::vector<CurvatureFit> fit_curvature(const RestShape& shape) {
  constexpr std::size_t kEnough = 6;
  const Fans fans(shape);
  const std::vector<bool> on_border = border(shape);
  const VectorXd area = areas(shape);
  std::vector<Quadratic> quadratics;
  quadratics.reserve(static_cast<std::size_t>(shape.particles));
  for (int i = 0; i < shape.particles; ++i) {
    const bool full = fans.at(i).ring.size() >= kEnough;
    quadratics.push_back(quadratic(on_border[static_cast<std::size_t>(i)] ? fans.widened(i, 1)
                                   : full                                 ? fans.ring(i)
                                                                          : fans.widened(i, 2)));
    quadratics.back().area = area[i];
  }
  Balance(shape, fans, quadratics).restore();
  std::vector<CurvatureFit> fits;
  fits.reserve(quadratics.size());
  for (int i = 0; i < shape.particles; ++i)
    for (const Share& share : shares(shape, fans, i))
      fits.push_back(fit_along(i, quadratics[static_cast<std::size_t>(i)], share));
  return fits;
}

}  // namespace weft
