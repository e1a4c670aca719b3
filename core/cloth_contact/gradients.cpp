#include "core/cloth_contact/gradients.h"

#include <algorithm>
#include <limits>

// compiled again for every target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/cloth_contact/gradients.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/motion/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {

using GradientTag = hn::CappedTag<float, 8>;
using Row = hn::Vec<GradientTag>;
constexpr std::size_t kLanes = hn::MaxLanes(GradientTag());

#if HWY_TARGET == HWY_SCALAR
HWY_INLINE Triple<Row> load_places(const float* places, const int* particle) {
  const GradientTag d;
  const float* place = places + std::ptrdiff_t{4} * *particle;
  return {hn::Set(d, place[0]), hn::Set(d, place[1]), hn::Set(d, place[2])};
}
#else
HWY_INLINE Triple<Row> load_places(const float* places, const int* particle) {
  const GradientTag d;
  // of the first particle, the fifth, ...; of the second, ...
  const auto fours = [&](std::size_t at) HWY_ATTR {
    return load_parts(d,
                      [&](std::size_t k) { return places + std::ptrdiff_t{4} * particle[at + k]; });
  };
  const Row a = fours(0), b = fours(1), c = fours(2), e = fours(3);
  const Row ac = hn::InterleaveLower(d, a, c), be = hn::InterleaveLower(d, b, e);
  return {hn::InterleaveLower(d, ac, be), hn::InterleaveUpper(d, ac, be),
          hn::InterleaveLower(d, hn::InterleaveUpper(d, a, c), hn::InterleaveUpper(d, b, e))};
}
#endif

// Has `sum` have those of all, over u, then over v.
void set_gradients(std::span<const Gradients::Triangles> triangles, const float* places,
                   Gradients::Rows* rows, float* sum) {
  const GradientTag d;
  const Row zero = hn::Zero(d);
  Triple<Row> all[2] = {{zero, zero, zero}, {zero, zero, zero}};
  for (const Gradients::Triangles& eight : triangles) {
    for (std::size_t k = 0; k < 8; k += kLanes) {
      const Triple<Row> from = load_places(places, eight.corner[0].data() + k),
                        one = minus(load_places(places, eight.corner[1].data() + k), from),
                        other = minus(load_places(places, eight.corner[2].data() + k), from);
      const auto is_one = hn::FirstN(d, eight.count > k ? eight.count - k : 0);
      for (std::size_t over = 0; over < 2; ++over) {
        const Row a = hn::Load(d, eight.inverse[over][0].data() + k),
                  b = hn::Load(d, eight.inverse[over][1].data() + k);
        const Triple<Row> gradient = plus_times(times(one, a), other, b);
        hn::Store(gradient.x, d, rows->over[over][0].data() + k);
        hn::Store(gradient.y, d, rows->over[over][1].data() + k);
        hn::Store(gradient.z, d, rows->over[over][2].data() + k);
        all[over] = plus(all[over], {hn::IfThenElseZero(is_one, gradient.x),
                                     hn::IfThenElseZero(is_one, gradient.y),
                                     hn::IfThenElseZero(is_one, gradient.z)});
      }
    }
    ++rows;
  }
  for (const Triple<Row>& each : all)
    for (const Row& row : {each.x, each.y, each.z}) *sum++ = hn::GetLane(hn::SumOfLanes(d, row));
}

// low, high: of both ways over u, then over v.
void bound_gradients(const Gradients::Rows* all, std::span<const std::size_t> first,
                     std::span<const int> blocks, const Eigen::Matrix<float, 3, 2>& ways,
                     float* low, float* high) {
  const GradientTag d;
  const auto way = [&](Eigen::Index k) HWY_ATTR -> Triple<Row> {
    return {hn::Set(d, ways(0, k)), hn::Set(d, ways(1, k)), hn::Set(d, ways(2, k))};
  };
  const Triple<Row> along[2] = {way(0), way(1)};
  Row least[4], most[4];
  for (std::size_t n = 0; n < 4; ++n) {
    least[n] = hn::Set(d, std::numeric_limits<float>::infinity());
    most[n] = hn::Neg(least[n]);
  }
  for (const int block : blocks) {
    const auto b = static_cast<std::size_t>(block);
    for (const Gradients::Rows& rows : std::span(all + first[b], all + first[b + 1]))
      for (std::size_t k = 0; k < 8; k += kLanes)
        for (std::size_t n = 0; n < 4; ++n) {
          const auto& row = rows.over[n / 2];
          const Row by =
              dot(Triple<Row>{hn::Load(d, row[0].data() + k), hn::Load(d, row[1].data() + k),
                              hn::Load(d, row[2].data() + k)},
                  along[n % 2]);
          least[n] = hn::Min(least[n], by);
          most[n] = hn::Max(most[n], by);
        }
  }
  for (std::size_t n = 0; n < 4; ++n) {
    low[n] = hn::GetLane(hn::MinOfLanes(d, least[n]));
    high[n] = hn::GetLane(hn::MaxOfLanes(d, most[n]));
  }
}

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace weft {

HWY_EXPORT(set_gradients);
HWY_EXPORT(bound_gradients);

Gradients::Gradients(const Cloth& cloth) {
  first_.push_back(0);
  for (std::size_t b = 0; b + 1 < cloth.first_block.size(); ++b) {
    const int begin = cloth.first_block[b], end = cloth.first_block[b + 1];
    for (int first = begin; first < end; first += 8) {
      Triangles& eight = triangles_.emplace_back();
      eight.count = static_cast<std::size_t>(std::min(end - first, 8));
      for (std::size_t k = 0; k < 8; ++k) {
        const auto t = static_cast<std::size_t>(std::min(first + static_cast<int>(k), end - 1));
        const auto& flat = cloth.flat[t];
        Eigen::Matrix2d sides;
        sides << flat[1] - flat[0], flat[2] - flat[0];
        const Eigen::Matrix2f inverse = sides.inverse().cast<float>();
        for (std::size_t n = 0; n < 3; ++n) eight.corner[n][k] = cloth.triangles[t][n];
        for (std::size_t over = 0; over < 2; ++over)
          for (std::size_t side = 0; side < 2; ++side)
            eight.inverse[over][side][k] =
                inverse(static_cast<Eigen::Index>(side), static_cast<Eigen::Index>(over));
      }
    }
    first_.push_back(triangles_.size());
  }
  rows_.resize(triangles_.size());
  sum_.resize(first_.size() - 1);
}

void Gradients::set(int block, const Eigen::Matrix4Xf& places) {
  const auto b = static_cast<std::size_t>(block);
  const std::size_t first = first_[b], count = first_[b + 1] - first;
  HWY_DYNAMIC_DISPATCH(set_gradients)
  (std::span(triangles_).subspan(first, count), places.data(), rows_.data() + first,
   sum_[b].data());
}

Gradients::Bounds Gradients::along(const Eigen::Matrix<float, 3, 2>& ways,
                                   std::span<const int> blocks) const {
  Bounds bounds;
  HWY_DYNAMIC_DISPATCH(bound_gradients)
  (rows_.data(), first_, blocks, ways, bounds.low.data(), bounds.high.data());
  return bounds;
}

}  // namespace weft
#endif
