#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>

#include "core/cloth_contact/pair_contact.h"
#include "core/model/mesh.h"

namespace weft {

// Nearest points of many pairs of a particle and a triangle, or of many pairs of edges, side by
// side in vectors.
class PairBatch {
 public:
  static constexpr std::size_t kMost = 64;

  // Of particles at x, (3 x particles) m, which outlives it.
  PairBatch(bool edges, const Matrix3Xd& x) : edges_(edges), x_(x.data()) {}

  bool edges() const { return edges_; }
  bool full() const { return size_ == kMost; }
  std::size_t size() const { return size_; }
  void clear() { size_ = 0; }
  // A particle and the corners of a triangle, or the ends of two edges; come: how far they came in
  // relation to each other at most, m. Precondition: not full.
  void add(const std::array<int, 4>& particles, double thickness = 0,
           double come = std::numeric_limits<double>::infinity()) {
    thickness_[size_] = thickness;
    within_[size_] = thickness + come;
    particles_[size_++] = particles;
  }

  // The same, or nothing, where find_met() is not asked.
  void add_if(bool wanted, const std::array<int, 4>& particles) {
    particles_[size_] = particles;
    size_ += wanted ? 1 : 0;
  }

  // As nearest_in_triangle() and nearest_on_edges(), of all that were added.
  void solve();
  // Of a pair: weights that lead from the second one's nearest point to the first one's; the way
  // between these, m; its squared length, m^2.
  std::array<double, 4> weights(std::size_t k) const {
    return {weights_[0][k], weights_[1][k], weights_[2][k], weights_[3][k]};
  }
  Vector3d apart(std::size_t k) const { return {apart_[0][k], apart_[1][k], apart_[2][k]}; }
  double squared(std::size_t k) const { return squared_[k]; }

  // Finds which may have come nearer than their thickness, as far as all particles of the one side
  // moved from all of the other at most, but do not touch.
  void find_met(std::span<const Mover> movers);
  std::size_t met_size() const { return met_size_; }
  // Of the n-th: which it is; its distance, m; how far its sides move from each other in a step,
  // squared, m^2.
  std::size_t met(std::size_t n) const { return met_[n]; }
  double distance(std::size_t n) const { return distance_[n]; }
  double squared_in_step(std::size_t n) const { return squared_in_step_[n]; }

  // Of vectors: kMost values each.
  struct Planes {
    const double* x;
    const std::array<int, 4>* particles;
    double (*weights)[kMost];
    double (*apart)[kMost];
    double* squared;
    std::size_t size;
  };
  struct Motions {
    bool edges;
    const Mover* movers;
    const std::array<int, 4>* particles;
    double *way, *in_step;
    std::size_t size;
  };

 private:
  using Particles = std::array<std::array<int, 4>, kMost>;
  static void fill(Particles& particles, std::size_t size);

  bool edges_;
  const double* x_;
  std::size_t size_ = 0, met_size_ = 0;
  Particles particles_, met_particles_;
  std::array<double, kMost> thickness_, within_, distance_;
  std::array<std::size_t, kMost> met_;
  alignas(64) double weights_[4][kMost];
  alignas(64) double apart_[3][kMost];
  alignas(64) double squared_[kMost];
  alignas(64) double squared_way_[kMost], squared_in_step_[kMost];
};

}  // namespace weft
