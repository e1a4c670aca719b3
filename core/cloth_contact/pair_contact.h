#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <span>

namespace weft {

// A particle on its way. Fourth components are 0.
struct alignas(64) Mover {
  Eigen::Vector4d way;      // that it has come since contact acted last, m
  Eigen::Vector4d in_step;  // displacement of the step to come, m
};

// Two nearest points of cloth that keep each other at a thickness: of a particle and a triangle, or
// of two edges.
struct alignas(64) PairContact {
  // Of the pair's motion: along its normal, at least 0; by friction.
  struct Change {
    double along = 0;
    Eigen::Vector4d sliding = Eigen::Vector4d::Zero();
  };
  static constexpr int kNever = std::numeric_limits<int>::max();

  // Weights lead from the second one's nearest point to the first one's; shares are what particles
  // have of the pair's motion.
  std::array<int, 4> particle = {};
  std::array<double, 4> weight = {};
  int looked_at = -2;  // when; kNever: it is not looked at again
  bool edges = false;
  double room = 0;  // to its thickness, where it set out, m
  std::array<double, 4> share = {};
  Eigen::Vector4d normal = {};
  double thickness = 0, friction = 0;  // m, 1
  double most_given = 0;               // along the normal, m
  Change way = {}, in_step = {};       // that it has given, m
};

// All particles of a cloth.
struct Movers {
  std::span<Mover> each;
  std::span<int> changed;  // when; 0: by little, or before the first turn; less: never
};

// Moves the particles of a contact by what it has given.
void give(const PairContact& contact, const Movers& movers);
// Answers contacts whose particles others have moved since they were looked at, one after the
// other, for as many steps as are to come. now: counts those that moved theirs by what others must
// answer.
void answer(std::span<PairContact> contacts, double steps, const Movers& movers, int& now);

}  // namespace weft
