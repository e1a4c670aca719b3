#include "core/cloth_contact/pair_contact.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

// compiled again for every target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/cloth_contact/pair_contact.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Of thickness: what others need not answer. The next window begins with what was given in this
// one.
constexpr double kSmall = 1e-4;
constexpr double kDepthShare = 0.2;  // of its depth that a pair is moved apart

// Four components. Sums are the same to the bit for all targets, so nothing is multiplied and added
// at once.
using FourTag = hn::CappedTag<double, 4>;
constexpr std::size_t kLanes = hn::MaxLanes(FourTag()), kParts = 4 / kLanes;
struct Four {
  hn::Vec<FourTag> part[kParts];
};
template <class F, std::size_t... k>
HWY_INLINE Four parts(const F& f, std::index_sequence<k...>) {
  return {{f(k)...}};
}
template <class F>
HWY_INLINE Four parts(const F& f) {
  return parts(f, std::make_index_sequence<kParts>());
}
HWY_INLINE Four plus(const Four& a, const Four& b) {
  return parts([&](std::size_t k) HWY_ATTR { return hn::Add(a.part[k], b.part[k]); });
}
HWY_INLINE Four minus(const Four& a, const Four& b) {
  return parts([&](std::size_t k) HWY_ATTR { return hn::Sub(a.part[k], b.part[k]); });
}
HWY_INLINE Four times(const Four& a, double by) {
  const auto all = hn::Set(FourTag(), by);
  return parts([&](std::size_t k) HWY_ATTR { return hn::Mul(a.part[k], all); });
}
HWY_INLINE Four load(const Eigen::Vector4d& from) {
  return parts([&](std::size_t k)
                   HWY_ATTR { return hn::LoadU(FourTag(), from.data() + k * kLanes); });
}
HWY_INLINE void store(const Four& four, Eigen::Vector4d& to) {
  for (std::size_t k = 0; k < kParts; ++k)
    hn::StoreU(four.part[k], FourTag(), to.data() + k * kLanes);
}
HWY_INLINE double dot(const Four& a, const Four& b) {
  const Four product = parts([&](std::size_t k) HWY_ATTR { return hn::Mul(a.part[k], b.part[k]); });
#if HWY_TARGET == HWY_SCALAR
  const auto value = [&](std::size_t k) { return hn::GetLane(product.part[k]); };
  return (value(0) + value(2)) + (value(1) + value(3));
#else
  const auto sum = [&]() HWY_ATTR {
    if constexpr (kParts == 2)
      return hn::Add(product.part[0], product.part[kParts - 1]);
    else
      return hn::Add(hn::LowerHalf(product.part[0]),
                     hn::UpperHalf(hn::Half<FourTag>(), product.part[0]));
  }();
  return hn::GetLane(sum) + hn::ExtractLane(sum, 1);
#endif
}
HWY_INLINE void add(const Four& by, Eigen::Vector4d& to) { store(plus(load(to), by), to); }

// What a motion lacks to be at least `least` along the normal, and without sliding as far as
// friction by what is given beyond `free` holds that; some of what was given may be taken back. m
HWY_INLINE Four lacks(const Four& motion, double along, const Four& normal, double least,
                      double friction, double free, PairContact::Change& given) {
  const double before = given.along;
  given.along = std::max(before + least - along, 0.0);
  const Four slid = load(given.sliding);
  Four sliding = minus(slid, minus(motion, times(normal, along)));
  const double most = friction * std::max(given.along - free, 0.0),
               length = std::sqrt(dot(sliding, sliding));
  if (length > most) sliding = times(sliding, most / length);
  store(sliding, given.sliding);
  return minus(plus(times(normal, given.along - before), sliding), slid);
}

HWY_INLINE void move(const PairContact& contact, const Four& way, const Four& in_step,
                     const Movers& movers) {
  for (std::size_t n = 0; n < 4; ++n) {
    const auto at = static_cast<std::size_t>(contact.particle[n]);
    add(times(way, contact.share[n]), movers.each[at].way);
    add(times(in_step, contact.share[n]), movers.each[at].in_step);
    movers.changed[at] = std::max(movers.changed[at], 0);
  }
}

// 1: gives it again; -1: takes it back.
void give_times(double count, const PairContact& contact, const Movers& movers) {
  const Four normal = load(contact.normal);
  const auto all = [&](const PairContact::Change& given) HWY_ATTR {
    return times(plus(times(normal, given.along), load(given.sliding)), count);
  };
  move(contact, all(contact.way), all(contact.in_step), movers);
}

// Returns how far it was from what it is to be, m.
HWY_INLINE double answer(PairContact& contact, double steps, const Movers& movers) {
  Four way = load(Eigen::Vector4d::Zero()), in_step = way;
  for (std::size_t n = 0; n < 4; ++n) {
    const Mover& mover = movers.each[static_cast<std::size_t>(contact.particle[n])];
    way = plus(way, times(load(mover.way), contact.weight[n]));
    in_step = plus(in_step, times(load(mover.in_step), contact.weight[n]));
  }

  const Four normal = load(contact.normal);
  const double missing = kDepthShare * std::max(-contact.room, 0.0),
               least = missing - std::max(contact.room, 0.0);
  // no nearer than the thickness, or than where it set out, and from there on out
  const double come = dot(way, normal), speed = dot(in_step, normal);
  const auto allowed = [&](double come_by) {
    return -std::max(contact.room + come_by, 0.0) / steps;
  };
  const double pushed_before = contact.way.along, braked_before = contact.in_step.along;
  if (come >= least && speed >= allowed(come) && pushed_before == 0 && braked_before == 0) return 0;
  const Four by = lacks(way, come, normal, least, contact.friction, missing, contact.way);
  const double pushed = contact.way.along - pushed_before;
  // nor in the steps to come
  const Four braked =
      lacks(in_step, speed, normal, allowed(come + pushed), contact.friction, 0, contact.in_step);
  move(contact, by, braked, movers);
  return std::max(std::abs(pushed), std::abs(contact.in_step.along - braked_before) * steps);
}

void answer_all(std::span<PairContact> contacts, double steps, const Movers& movers, int& now) {
  for (PairContact& contact : contacts) {
    int changed = 0;
    for (const int i : contact.particle)
      changed = std::max(changed, movers.changed[static_cast<std::size_t>(i)]);
    if (changed <= contact.looked_at) continue;
    const double by = answer(contact, steps, movers);
    const bool gives_up = std::max(contact.way.along, contact.in_step.along) > contact.most_given;
    if (gives_up) {
      give_times(-1, contact, movers);
      contact.way = contact.in_step = {};
    }
    if (gives_up || by > kSmall * contact.thickness) {
      ++now;
      for (const int i : contact.particle) movers.changed[static_cast<std::size_t>(i)] = now;
    }
    contact.looked_at = gives_up ? PairContact::kNever : now;
  }
}

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace weft {

HWY_EXPORT(give_times);
HWY_EXPORT(answer_all);

void give(const PairContact& contact, const Movers& movers) {
  HWY_DYNAMIC_DISPATCH(give_times)(1, contact, movers);
}
void answer(std::span<PairContact> contacts, double steps, const Movers& movers, int& now) {
  HWY_DYNAMIC_DISPATCH(answer_all)(contacts, steps, movers, now);
}

}  // namespace weft
#endif
