#include "core/cloth_contact/pair_contact.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <random>
#include <vector>

namespace weft::testing {
namespace {

struct Heap {
  std::vector<PairContact> contacts;
  std::vector<Mover> movers;
  std::vector<int> changed;
};

// Particles of equal mass that come towards each other at random, in contacts at random.
Heap heap(int particles, int contacts) {
  std::mt19937 random(1);
  const auto within = [&](double low, double high) {
    return std::uniform_real_distribution(low, high)(random);
  };
  const auto vector = [&] {
    return Eigen::Vector4d(within(-1, 1), within(-1, 1), within(-1, 1), 0);
  };
  Heap made;
  made.changed.assign(static_cast<std::size_t>(particles), -1);
  for (int i = 0; i < particles; ++i) made.movers.push_back({1e-3 * vector(), 1e-4 * vector()});
  for (int k = 0; k < contacts; ++k) {
    PairContact& contact = made.contacts.emplace_back();
    const int first = std::uniform_int_distribution(0, particles - 8)(random);
    contact.particle = {first, first + 2, first + 3, first + 7};
    contact.edges = k % 2 == 1;
    const double s = within(0, 1), t = within(0, 1);
    if (contact.edges)
      contact.weight = {1 - s, s, t - 1, -t};
    else
      contact.weight = {1, -s * t, -(1 - s) * t, t - 1};
    double moves = 0;
    for (const double weight : contact.weight) moves += weight * weight;
    for (std::size_t n = 0; n < 4; ++n) contact.share[n] = contact.weight[n] / moves;
    contact.normal = vector().normalized();
    contact.room = within(-1e-4, 1e-3);
    contact.thickness = 1e-3;
    contact.friction = 0.3;
    contact.most_given = k % 16 == 0 ? 2e-4 : 1;
  }
  return made;
}

void answer(Heap& heap, int passes) {
  int now = 0;
  for (int pass = 0; pass < passes; ++pass)
    answer(heap.contacts, 3, {heap.movers, heap.changed}, now);
}

Eigen::Vector4d motion_of(const PairContact& contact, const Heap& heap,
                          Eigen::Vector4d Mover::*motion) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (std::size_t n = 0; n < 4; ++n)
    sum += contact.weight[n] * (heap.movers[static_cast<std::size_t>(contact.particle[n])].*motion);
  return sum;
}

TEST(PairContacts, AreAnsweredToTheSameBitsInVectorsAndOneByOne) {
  const auto answered = [](std::int64_t target) {
    hwy::SetSupportedTargetsForTest(target);
    Heap made = heap(60, 200);
    answer(made, 12);
    hwy::SetSupportedTargetsForTest(0);
    return made;
  };
  const Heap wanted = answered(HWY_STATIC_TARGET);
  for (const std::int64_t target : {HWY_AVX2, HWY_AVX3}) {
    if ((hwy::SupportedTargets() & target) == 0) continue;
    const Heap found = answered(target);
    EXPECT_EQ(found.changed, wanted.changed) << hwy::TargetName(target);
    for (std::size_t i = 0; i < wanted.movers.size(); ++i) {
      EXPECT_EQ(found.movers[i].way, wanted.movers[i].way) << hwy::TargetName(target);
      EXPECT_EQ(found.movers[i].in_step, wanted.movers[i].in_step) << hwy::TargetName(target);
    }
  }
}

TEST(PairContacts, EndNoNearerThanTheirThicknessNorComeNearerInTheStepsToCome) {
  Heap made = heap(2000, 60);
  for (PairContact& contact : made.contacts) contact.most_given = 1;
  answer(made, 200);
  for (const PairContact& contact : made.contacts) {
    const double come = motion_of(contact, made, &Mover::way).dot(contact.normal),
                 to_come = 3 * motion_of(contact, made, &Mover::in_step).dot(contact.normal);
    EXPECT_GE(come, -std::max(contact.room, 0.0) - 1e-6);
    EXPECT_GE(come + to_come, std::min(-contact.room, come) - 1e-6);
  }
}

TEST(PairContacts, TakeFromOneSideWhatTheyGiveToTheOther) {
  Heap made = heap(60, 200);
  const auto sum = [&](Eigen::Vector4d Mover::*motion) {
    Eigen::Vector4d all = Eigen::Vector4d::Zero();
    for (const Mover& mover : made.movers) all += mover.*motion;
    return all;
  };
  const Eigen::Vector4d way = sum(&Mover::way), in_step = sum(&Mover::in_step);
  const Heap before = made;
  answer(made, 12);
  EXPECT_NE(made.movers[30].way, before.movers[30].way);
  EXPECT_LT((sum(&Mover::way) - way).norm(), 1e-15);
  EXPECT_LT((sum(&Mover::in_step) - in_step).norm(), 1e-15);
}

TEST(PairContacts, ThatGiveMoreThanAnyThatSettlesTakeItBack) {
  Heap made = heap(60, 1);
  PairContact& contact = made.contacts[0];
  contact.room = -1e-3;
  contact.most_given = 1e-5;
  const Heap before = made;
  answer(made, 12);
  EXPECT_EQ(contact.looked_at, PairContact::kNever);
  for (std::size_t i = 0; i < made.movers.size(); ++i) {
    EXPECT_LT((made.movers[i].way - before.movers[i].way).norm(), 1e-18);
    EXPECT_LT((made.movers[i].in_step - before.movers[i].in_step).norm(), 1e-18);
  }
}

}  // namespace
}  // namespace weft::testing
