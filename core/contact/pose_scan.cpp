#include "core/contact/pose_scan.h"

#include <Eigen/Geometry>
#include <cmath>

// compiled again for every target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/contact/pose_scan.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/motion/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {

using LayerTag = hn::CappedTag<float, ScannedBlock::kLayer>;
using Floats = hn::Vec<LayerTag>;
using Points = Triple<Floats>;

HWY_INLINE Floats floats(double value) { return hn::Set(LayerTag(), static_cast<float>(value)); }
HWY_INLINE Points floats(const Vector3d& v) {
  return {floats(v.x()), floats(v.y()), floats(v.z())};
}

// From the origin to `end`.
struct Edge {
  Points end;
  Floats inverse;  // of the squared length
};
HWY_INLINE Edge edge_to(const Vector3d& end) {
  const double squared = end.squaredNorm();
  return {floats(end), floats(squared > 0 ? 1 / squared : 0)};
}
// The share of the edge that is nearest to a point, and the square of how far that is.
struct OnEdge {
  Floats share, squared;
};
HWY_INLINE OnEdge nearest_on(const Edge& edge, const Points& p) {
  const Floats share =
      hn::Min(hn::Max(hn::Mul(dot(p, edge.end), edge.inverse), floats(0.0)), floats(1.0));
  return {share, squared(minus_times(p, edge.end, share))};
}

void scan_all(std::span<const ScannedTriangle> triangles, const Vector3d& low, double cell,
              const std::array<int, 3>& counts, std::span<const std::int32_t> begin,
              std::span<ScannedBlock> blocks) {
  constexpr int kBlock = DistanceGrid::kBlock, kLayer = ScannedBlock::kLayer;
  const LayerTag tag;
  const hn::RebindToSigned<LayerTag> ints;
  const int lanes = static_cast<int>(hn::Lanes(tag));
  const Floats zero = floats(0.0), one = floats(1.0);
  const Vector3d to_middle = (kBlock - 1) * cell / 2 * Vector3d(1, 1, 0);  // of a layer
  alignas(64) float along_x[kLayer], along_y[kLayer];
  for (int i = 0; i < kLayer; ++i) {
    const int column = i % kBlock, row = i / kBlock;
    along_x[i] = static_cast<float>(column * cell);
    along_y[i] = static_cast<float>(row * cell);
  }

  for (const ScannedTriangle& t : triangles) {
    const Vector3d normal = t.ab.cross(t.ac);
    const double area = normal.squaredNorm(), inverse = area > 0 ? 1 / area : NAN;
    // coordinates along ab and ac; of a triangle without an area no numbers, so within nothing
    const Points to_v = floats(t.ac.cross(normal) * inverse),
                 to_w = floats(normal.cross(t.ab) * inverse),
                 up = floats(normal * std::sqrt(inverse));
    const Edge ab = edge_to(t.ab), ac = edge_to(t.ac), bc = edge_to(t.ac - t.ab);
    const Points b = floats(t.ab);
    const auto number = hn::Set(ints, t.number);
    const double most = t.reach + to_middle.norm();

    for (int z = t.first[2]; z <= t.last[2]; ++z) {
      for (int y = t.first[1] / kBlock; y <= t.last[1] / kBlock; ++y) {
        for (int x = t.first[0] / kBlock; x <= t.last[0] / kBlock; ++x) {
          const std::int32_t index =
              begin[static_cast<std::size_t>((z / kBlock * counts[1] + y) * counts[0] + x)];
          if (index < 0) continue;
          const Vector3d first = low + cell * Vector3d(x * kBlock, y * kBlock, z);
          if ((first + to_middle - t.middle).squaredNorm() > most * most) continue;
          ScannedBlock& block = blocks[static_cast<std::size_t>(index)];
          const Points from = floats(first - t.corner);
          for (int lane = 0; lane < kLayer; lane += lanes) {
            const Points p{hn::Add(from.x, hn::Load(tag, along_x + lane)),
                           hn::Add(from.y, hn::Load(tag, along_y + lane)), from.z};
            const Floats v = dot(p, to_v), w = dot(p, to_w), height = dot(p, up);
            const auto above =
                hn::And(hn::And(hn::Ge(v, zero), hn::Ge(w, zero)), hn::Le(hn::Add(v, w), one));
            const OnEdge on_ab = nearest_on(ab, p), on_ac = nearest_on(ac, p),
                         on_bc = nearest_on(bc, minus(p, b));
            const auto is_ab = hn::And(hn::Le(on_ab.squared, on_ac.squared),
                                       hn::Le(on_ab.squared, on_bc.squared)),
                       is_ac = hn::Le(on_ac.squared, on_bc.squared);
            const auto choose = [&](Floats inside, Floats of_ab, Floats of_ac,
                                    Floats of_bc) HWY_ATTR {
              return hn::IfThenElse(
                  above, inside, hn::IfThenElse(is_ab, of_ab, hn::IfThenElse(is_ac, of_ac, of_bc)));
            };
            const Floats found =
                choose(hn::Mul(height, height), on_ab.squared, on_ac.squared, on_bc.squared);

            const int at = z % kBlock * kLayer + lane;
            const Floats before = hn::Load(tag, block.squared + at);
            const auto nearer = hn::Lt(found, before);
            if (hn::AllFalse(tag, nearer)) continue;
            const auto put = [&](Floats value, float* to)
                                 HWY_ATTR { hn::BlendedStore(value, nearer, tag, to + at); };
            put(found, block.squared);
            put(choose(v, on_ab.share, zero, hn::Sub(one, on_bc.share)), block.v);
            put(choose(w, zero, on_ac.share, on_bc.share), block.w);
            hn::BlendedStore(number, hn::RebindMask(ints, nearer), ints, block.triangle + at);
          }
        }
      }
    }
  }
}

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace weft {

HWY_EXPORT(scan_all);

void scan(std::span<const ScannedTriangle> triangles, const Vector3d& low, double cell,
          const std::array<int, 3>& counts, std::span<const std::int32_t> begin,
          std::span<ScannedBlock> blocks) {
  HWY_DYNAMIC_DISPATCH(scan_all)(triangles, low, cell, counts, begin, blocks);
}

}  // namespace weft
#endif
