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

 private:
  HWY_ALIGN float most_[8];
};

// Without branches, which nothing foretells.
std::size_t choose_boxes(std::span<const SmallBox> boxes, int first, const SmallBox& near,
                         float reach, int* number, SmallBox* box) {
  const Surroundings around(near, reach);
  std::size_t n = 0;
  for (std::size_t k = 0; k < boxes.size(); ++k) {
    number[n] = first + static_cast<int>(k);
    box[n] = boxes[k];
    n += around.has(boxes[k]);
  }
  return n;
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

void SmallBoxes::choose(std::span<const SmallBox> boxes, int first, const SmallBox& near,
                        float reach) {
  if (number_.size() < boxes.size()) {
    number_.resize(boxes.size());
    box_.resize(boxes.size());
  }
  size_ =
      HWY_DYNAMIC_DISPATCH(choose_boxes)(boxes, first, near, reach, number_.data(), box_.data());
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
