#pragma once

#include <span>
#include <vector>

#include "core/cloth_contact/pair_lists.h"
#include "core/moving_sheet.h"

namespace weft {

// Keeps cloth from passing through cloth: particles from triangles and edges from edges, of one
// sheet or of two, by what each pair gives to one and takes from the other.
//
// A pair acts along the line between its nearest points at the begin of the step, while these were
// still on their own sides. Inelastic: it takes away the approach that would bring the pair nearer
// than its thickness, and friction by Coulomb as much of its sliding as that allows. Pairs that are
// nearer all the same are moved apart without speed, some of the way in each step. Pairs follow one
// another, in an order of their own, so what comes of them does not depend on who computes them.
class ClothContact {
 public:
  // Holds on to the scene.
  explicit ClothContact(const Scene& scene);

  // Sheets may be anywhere now, or be held otherwise. Nothing that was found before is used, nor
  // kept in memory.
  void forget();
  // Of sheets that have taken a step.
  void resolve(std::span<MovingSheet> sheets);

 private:
  // How near pairs are looked for beyond their thickness, m, and how much of it relative motion may
  // have used up.
  struct Slack {
    double reach = -1, used = 0;
    bool lasts(double margin) const { return used + margin <= reach; }
  };
  // A particle on its way through a step; fourth components are 0.
  struct Mover {
    Eigen::Vector4d in_step, way;  // displacement of the step, and where it led, m
    double inverse_mass;           // 1/kg
  };
  // A pair that may act in this step. Weights lead from the second one's nearest point to the first
  // one's; shares are what particles have of the pair's motion.
  struct Contact {
    std::array<int, 4> place;
    std::array<double, 4> weight, share;
    Eigen::Vector4d normal;
    double distance, thickness, friction;  // m, m, 1
  };
  struct Candidate {
    std::array<int, 4> place;
    bool edges;
    double thickness, friction;
  };

  void list(std::span<MovingSheet> sheets, double margin);
  void read_begin(std::span<MovingSheet> sheets);
  void prune(std::span<MovingSheet> sheets, double margin);
  void take(const std::vector<ClothPairs>& lists);
  template <class F>
  void for_each_run(const F& f) const;
  void read(std::span<MovingSheet> sheets);
  void touch(double margin);
  void separate();
  double separate(const Contact& contact);
  Mover& mover(const Contact& contact, std::size_t n) {
    return movers_[static_cast<std::size_t>(contact.place[n])];
  }
  void write(std::span<MovingSheet> sheets);

  const Scene& scene_;
  Cloth cloth_;
  PairLists lists_;
  Slack listed_, pruned_;
  // farthest that a particle came by the last step, and that it was moved then, m
  double moved_before_ = 0, corrected_ = 0;

  Matrix3Xd begin_;         // of the step when last looked at, (3 x particles) m
  std::vector<int> every_;  // 0 ... particles - 1
  std::vector<Candidate> candidates_;
  std::vector<int> place_;       // of each particle among particles_, or -1
  std::vector<int> particles_;   // that candidates have, ascending
  std::vector<int> own_number_;  // in their sheets
  Matrix3Xd x_, d_;              // of these at the begin of the step, and in it, m
  std::vector<Mover> movers_;
  std::vector<int> moved_;  // of a sheet, by its own numbers
  std::vector<Contact> contacts_;
};

}  // namespace weft
