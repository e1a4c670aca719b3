#include "core/cloth_contact/small_boxes.h"

// compiled again for every target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/cloth_contact/small_boxes.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using SideTag = hn::CappedTag<float, 8>;
constexpr std::size_t kLanes = hn::MaxLanes(SideTag());

// What no side of a box that is near lies beyond.
class Surroundings {
 public:
  HWY_INLINE Surroundings(const SmallBox& box, float reach) {
    for (std::size_t k = 0; k < 8; ++k) most_[k] = reach - box.side[(k + 4) % 8];
  }
  HWY_INLINE std::size_t has(const SmallBox& box) const {
    const SideTag d;
    auto all = hn::Le(hn::Load(d, box.side.data()), hn::Load(d, most_));
    for (std::size_t k = kLanes; k < 8; k += kLanes)
      all = hn::And(all, hn::Le(hn::Load(d, box.side.data() + k), hn::Load(d, most_ + k)));
    return hn::AllTrue(d, all) ? 1 : 0;
  }
  // Of a side.
  HWY_INLINE const float* most(std::size_t side) const { return most_ + side; }

 private:
  HWY_ALIGN float most_[8];
};

using CornerTag = hn::CappedTag<float, 4>;
constexpr std::size_t kOfCorner = hn::MaxLanes(CornerTag());

// Without branches, which nothing foretells.
template <int kEach>
HWY_INLINE std::size_t choose_parts(const SmallBoxes::Parts& parts, const float* places,
                                    const SmallBox& near, float reach, int* number, SmallBox* box) {
  const CornerTag d;
  const Surroundings around(near, reach);
  std::size_t n = 0;
  for (int part = 0; part < parts.count; ++part) {
    const int* const particle = parts.particles + std::ptrdiff_t{kEach} * part;
    auto all = hn::FirstN(d, kOfCorner);
    for (std::size_t k = 0; k < 4; k += kOfCorner) {
      const auto place = [&](int i) HWY_ATTR {
        return hn::Load(d, places + std::ptrdiff_t{4} * particle[i] + k);
      };
      auto low = place(0);
      auto high = low;
      for (int i = 1; i < kEach; ++i) {
        low = hn::Min(low, place(i));
        high = hn::Max(high, place(i));
      }
      const auto minus_high = hn::Neg(high);
      hn::Store(low, d, box[n].side.data() + k);
      hn::Store(minus_high, d, box[n].side.data() + 4 + k);
      all = hn::And(all, hn::And(hn::Le(low, hn::Load(d, around.most(k))),
                                 hn::Le(minus_high, hn::Load(d, around.most(4 + k)))));
    }
    number[n] = parts.first + part;
    n += hn::AllTrue(d, all) ? 1 : 0;
  }
  return n;
}

std::size_t choose_boxes(const SmallBoxes::Parts& parts, const float* places, const SmallBox& near,
                         float reach, int* number, SmallBox* box) {
  switch (parts.of_each) {
    case 1:
      return choose_parts<1>(parts, places, near, reach, number, box);
    case 2:
      return choose_parts<2>(parts, places, near, reach, number, box);
    default:
      return choose_parts<3>(parts, places, near, reach, number, box);
  }
}

std::size_t meet_boxes(const SmallBoxes::Chosen& some, const SmallBoxes::Chosen& others,
                       bool ascending, float reach, ClothPair* met) {
  std::size_t n = 0;
  for (std::size_t k = 0; k < some.size; ++k) {
    const Surroundings around(some.box[k], reach);
    const int number = some.number[k];
    for (std::size_t l = ascending ? k + 1 : 0; l < others.size; ++l) {
      met[n] = {number, others.number[l]};
      n += around.has(others.box[l]);
    }
  }
  return n;
}

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace weft {

HWY_EXPORT(choose_boxes);
HWY_EXPORT(meet_boxes);

void SmallBoxes::choose(const Parts& parts, const float* places, const SmallBox& near,
                        float reach) {
  if (number_.size() < static_cast<std::size_t>(parts.count)) {
    number_.resize(static_cast<std::size_t>(parts.count));
    box_.resize(static_cast<std::size_t>(parts.count));
  }
  size_ =
      HWY_DYNAMIC_DISPATCH(choose_boxes)(parts, places, near, reach, number_.data(), box_.data());
}

std::span<const ClothPair> SmallBoxes::meet(const SmallBoxes& others, bool ascending, float reach,
                                            std::vector<ClothPair>& met) const {
  const std::size_t most = size_ * others.size_;
  if (met.size() < most) met.resize(most);
  const std::size_t size = HWY_DYNAMIC_DISPATCH(meet_boxes)(
      {number_.data(), box_.data(), size_},
      {others.number_.data(), others.box_.data(), others.size_}, ascending, reach, met.data());
  return std::span(met).first(size);
}

}  // namespace weft
#endif
