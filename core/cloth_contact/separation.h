#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/cloth_contact/pair_batch.h"
#include "core/cloth_contact/pair_contact.h"
#include "core/cloth_contact/pairs.h"
#include "core/cloth_contact/untangling.h"
#include "core/motion/thread_pool.h"

namespace weft {

// Candidates that may come near each other.
struct NearCloth {
  std::span<const Candidate> corners, edges;
  double friction;  // 1
  double come;      // no farther in relation to each other, m
};

// Keeps pairs from passing through each other, and at their thickness.
//
// A pair acts along the line between its nearest points where it set out, while these were still on
// their own sides. Inelastic: it takes away the approach that has brought the pair nearer than its
// thickness, or would in the steps to come, and friction by Coulomb as much of its sliding as that
// allows. Pairs that are nearer all the same are moved apart without speed, some of the way each
// time. Where all but a corner is held, which the nearest points hardly follow, a pair does not
// act; nor does one that has given more than any that settles, for it stands against others, as
// where held cloth is led through held cloth. What a pair gives to one it takes from the other.
// Pairs follow one another in their order, again and again, and take back what others have made
// needless; they begin with what they gave the last time, which in cloth that lies still is what
// they will give.
class Separation {
 public:
  // Where particles set out, where they are now, and their displacement in the last step, (3 x
  // particles) m; 1/kg.
  struct Ways {
    const Matrix3Xd &from, &to, &in_step;
    std::span<const double> inverse_mass;
  };
  // Finds the candidates that may have come nearer than their thickness on their way, without those
  // that are led apart.
  // layers: how many may fall onto one, which gives for all, as many thicknesses at most.
  void touch(std::span<const NearCloth> near, const Untangling& untangling, const Ways& ways,
             int layers, ThreadPool& pool);
  bool empty() const {
    return std::ranges::all_of(found_, [](const Found& found) { return found.contacts.empty(); });
  }
  // In how many steps like the last none of those found comes nearer by more than half its
  // distance, nor slides that far.
  double most_steps() const { return most_steps_; }
  // Of as many steps as are to come until contact acts again.
  void separate(double steps);
  // Whether separate() moved a particle, and where to.
  bool has_moved(int particle) const { return changed_[static_cast<std::size_t>(particle)] >= 0; }
  const Mover& mover(int particle) const { return movers_[static_cast<std::size_t>(particle)]; }
  // Has pairs begin with nothing the next time.
  void forget_given();

 private:
  struct Given {
    std::array<int, 4> particle;
    bool edges;
    PairContact::Change way, in_step;
  };
  struct Surroundings {
    const Untangling& untangling;
    const Ways& ways;
    std::span<const Mover> movers;
    double layers;
  };
  struct Found {
    std::vector<PairContact> contacts;
    double most_steps = 0;
  };

  static void touch(bool edges, std::span<const NearCloth> near, const Surroundings& around,
                    Found& found);
  static void add(const Candidate& candidate, double friction, const PairBatch& batch,
                  std::size_t met, const Surroundings& around, Found& found);
  void set_out(const Ways& ways, ThreadPool& pool);
  template <class F>
  void for_each_contact(const F& f) {
    for (Found& found : found_) std::ranges::for_each(found.contacts, f);
  }
  std::size_t find_given(const PairContact& contact, std::size_t next) const;
  void keep_given();

  std::vector<Given> given_;          // the last time, of pairs that gave something
  std::vector<std::uint32_t> place_;  // in given_ and one more, by hash of the pair; 0: none
  std::vector<Found> found_;          // in their order: corners in shares, edges in shares
  std::vector<Mover> movers_;         // all particles
  std::vector<int> changed_;          // when, the same; 0: by little, or before the first turn
  double most_steps_ = 0;
};

}  // namespace weft
