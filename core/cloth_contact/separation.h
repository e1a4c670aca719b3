#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/model/mesh.h"

namespace weft {

// A particle and a triangle, or two edges, that may come near each other; by places in a list of
// particles.
struct ContactCandidate {
  std::array<int, 4> place;
  bool edges;
  double thickness, friction;  // m, 1
};

// A particle on its way. Fourth components are 0.
struct Mover {
  Eigen::Vector4d way;      // that it has come since contact acted last, m
  Eigen::Vector4d in_step;  // displacement of the step to come, m
};

// Keeps pairs from passing through each other, and at their thickness.
//
// A pair acts along the line between its nearest points where it set out, while these were still on
// their own sides. Inelastic: it takes away the approach that has brought the pair nearer than its
// thickness, or would in the steps to come, and friction by Coulomb as much of its sliding as that
// allows. Pairs that are nearer all the same are moved apart without speed, some of the way each
// time. What a pair gives to one it takes from the other. Pairs follow one another in their order.
class Separation {
 public:
  // Finds the candidates that may have come nearer than their thickness on their way, as far as
  // they came less far than `most` (m). x: where movers set out, (3 x movers) m; 1/kg.
  void touch(std::span<const ContactCandidate> candidates, const Matrix3Xd& x,
             std::span<const double> inverse_mass, std::span<const Mover> movers, double most);
  bool empty() const { return contacts_.empty(); }
  // Of those found, m.
  double least_distance() const { return least_distance_; }
  // Of as many steps as are to come until contact acts again.
  void separate(double steps, std::span<Mover> movers);

 private:
  // Weights lead from the second one's nearest point to the first one's; shares are what particles
  // have of the pair's motion.
  struct Contact {
    std::array<int, 4> place;
    std::array<double, 4> weight, share;
    Eigen::Vector4d normal;
    double distance, thickness, friction;  // m, m, 1
    int looked_at;                         // when
  };

  void add(const ContactCandidate& candidate, const std::array<double, 4>& weight,
           const Vector3d& apart, double distance, std::span<const double> inverse_mass);
  double separate(double steps, const Contact& contact, std::span<Mover> movers) const;

  std::vector<Contact> contacts_;
  std::vector<double> come_;  // how far each mover came, m
  std::vector<int> changed_;  // when, of each mover
  double least_distance_ = 0;
};

}  // namespace weft
