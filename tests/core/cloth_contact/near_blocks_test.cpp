#include "core/cloth_contact/near_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/cloth_contact/block_motion.h"
#include "core/cloth_contact/pair_lists.h"
#include "core/cloth_contact/pairs.h"
#include "core/contact/nearest.h"
#include "core/triangles/cut.h"
#include "tests/support/core/scenes.h"
#include "tests/support/core/triangle_meshes.h"

namespace weft::testing {
namespace {

SheetDefinition sheet_of(const RestShape& shape) {
  SheetDefinition sheet = flat_sheet(2, 2);
  sheet.shape = complete(triangle_mesh(shape));
  return sheet;
}

// Rolled up about z so often within its length, and rough.
Matrix3Xd rolled(const SheetDefinition& sheet, double turns, double roughness) {
  Matrix3Xd x = start_positions(sheet);
  const double length = x.row(0).maxCoeff();
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const double angle = 2 * 3.14159 * turns * x(0, i) / length;
    const double radius = length / (2 * 3.14159 * turns) * (1 + 0.02 * angle);
    x(0, i) = radius * std::sin(angle);
    x(1, i) = radius * (1 - std::cos(angle));
  }
  return x + roughness * noise(static_cast<int>(x.cols()));
}

std::size_t size(const std::vector<ClothPairs>& lists) {
  std::size_t sum = 0;
  for (const ClothPairs& pairs : lists) sum += pairs.corners.size() + pairs.edges.size();
  return sum;
}

TEST(NearBlocks, HaveEveryPairWithinReach) {
  const std::vector<SheetDefinition> sheets = {flat_sheet(17, 17, 0.01),
                                               sheet_of(square(Cut::kIrregular, 0.16, 0.01)),
                                               sheet_of(cut_disc(Cut::kAlternating, 0.08, 0.01))};
  for (const SheetDefinition& sheet : sheets) {
    const Cloth cloth({sheet});
    NearBlocks near(cloth);
    const std::map<BlockPair, ClothPairs> all = all_pairs(cloth);
    const double thickest = sheet.thickness_or_default();
    std::size_t most = 0;
    for (const double turns : {0.01, 0.2, 0.5, 1.0, 3.0}) {
      for (const double reach : {0.0, 1e-3, 4e-3}) {
        SCOPED_TRACE(::testing::Message() << turns << " turns, reach " << reach);
        const Matrix3Xd x = rolled(sheet, turns, 3e-4);
        const auto within = [&](const ClothPairs& list, double most_apart) {
          ClothPairs some;
          for (const auto& [i, t] : list.corners)
            if (near_corner(cloth, x, i, t, most_apart)) some.corners.push_back({i, t});
          for (const auto& [e, f] : list.edges)
            if (near_edges(cloth, x, e, f, most_apart)) some.edges.push_back({e, f});
          return some;
        };
        std::vector<ClothPairs> expected;
        for (const auto& [blocks, list] : all) {
          const ClothPairs some = within(list, reach);
          if (!some.empty()) expected.push_back(some);
        }
        std::vector<ClothPairs> found;
        near.set(x);
        NearBlocks::Search search;
        for (const BlockPair& blocks : near.meet(thickest + reach)) {
          if (near.distance(blocks) > thickest + reach) continue;
          double others = reach + 2e-3;
          const ClothPairs some = find_pairs(cloth, near, blocks, x, reach, others, search);
          if (!some.empty()) found.push_back(some);
          EXPECT_GE(others, reach);
          EXPECT_TRUE(within(all.at(blocks), others - 1e-9) == some);
          if (others < reach + 2e-3) {
            EXPECT_FALSE(within(all.at(blocks), others + 1e-9) == some);
          }
        }
        EXPECT_TRUE(found == expected) << size(found) << " of " << size(expected);
        most = std::max(most, size(expected));
      }
    }
    EXPECT_GT(most, 1000u);
  }
}

TEST(BlockMotion, IsNoLessThanWhatAnyTwoParticlesMovedBy) {
  const Cloth cloth({flat_sheet(17, 17, 0.01)});
  const NearBlocks near(cloth);
  BlockMotion moved(near);
  const Matrix3Xd from = start_positions(flat_sheet(17, 17, 0.01)).colwise() + Vector3d(3, -2, 7),
                  to = from + 2e-3 * noise(cloth.particles());
  moved.set(from, to, calling_thread());
  for (int a = 0; a < near.blocks(); ++a)
    for (int b = a; b < near.blocks(); ++b) {
      double most = 0;
      for (const int i : near.particles(a))
        for (const int j : near.particles(b))
          most = std::max(most, (to.col(i) - from.col(i) - to.col(j) + from.col(j)).norm());
      const double found = moved.between(near.number(a), near.number(b));
      EXPECT_GE(found, most);
      EXPECT_LT(found, 2e-3 * 2 * std::sqrt(3.0));
    }
}

TEST(NearBlocks, AreKnownToBeApartWhereClothLiesFlat) {
  const SheetDefinition sheet = flat_sheet(65, 65, 0.01);
  const Cloth cloth({sheet});
  NearBlocks near(cloth);
  const auto unknown = [&](double turns) {
    const Matrix3Xd x = rolled(sheet, turns, 0);
    near.set(x);
    int count = 0;
    for (const BlockPair& blocks : near.meet(4e-3)) count += near.distance(blocks) < 4e-3 ? 1 : 0;
    return count;
  };
  EXPECT_EQ(unknown(0.2), 0);
  EXPECT_GT(unknown(3), 0);
}

// The least distance of what shares no particle, of each two blocks, m.
std::map<BlockPair, double> least_distances(const Cloth& cloth, const Matrix3Xd& x) {
  std::map<BlockPair, double> least;
  for (const auto& [blocks, list] : all_pairs(cloth)) {
    double squared = std::numeric_limits<double>::infinity();
    for (const auto& [p, t] : list.corners) {
      const auto& [a, b, c] = cloth.triangles[static_cast<std::size_t>(t)];
      const auto [u, v, w] = nearest_in_triangle(x.col(p), x.col(a), x.col(b), x.col(c));
      squared =
          std::min(squared, (x.col(p) - u * x.col(a) - v * x.col(b) - w * x.col(c)).squaredNorm());
    }
    for (const auto& [e, f] : list.edges) {
      const auto& [a, b] = cloth.edges[static_cast<std::size_t>(e)];
      const auto& [c, d] = cloth.edges[static_cast<std::size_t>(f)];
      const auto [s, t] = nearest_on_edges(x.col(a), x.col(b), x.col(c), x.col(d));
      const Vector3d one = (1 - s) * x.col(a) + s * x.col(b),
                     other = (1 - t) * x.col(c) + t * x.col(d);
      squared = std::min(squared, (one - other).squaredNorm());
    }
    least[blocks] = std::sqrt(squared);
  }
  return least;
}

TEST(NearBlocks, KnowsNoTwoNodesToBeFartherApartThanTheyAreWhereTheyLieFlat) {
  for (const SheetDefinition& sheet :
       {flat_sheet(17, 17, 0.01), sheet_of(cut_disc(Cut::kAlternating, 0.08, 0.01))}) {
    const Cloth cloth({sheet});
    NearBlocks near(cloth);
    std::vector<NearBlocks::Node> nodes = {near.root()};
    for (std::size_t k = 0; k < nodes.size(); ++k)
      for (const int which : {0, 1})
        if (nodes[k].count() > 1) nodes.push_back(NearBlocks::Node(nodes[k]).half(which));
    int flat = 0;
    for (const double turns : {0.01, 0.1, 0.2, 0.5, 3.0}) {
      for (const double away : {0.0, 20.0}) {
        SCOPED_TRACE(::testing::Message() << turns << " turns, " << away << " m away");
        const Matrix3Xd x = rolled(sheet, turns, 2e-4).colwise() + Vector3d(away, -away, 0.1);
        near.set(x);
        const std::map<BlockPair, double> least = least_distances(cloth, x);
        for (const NearBlocks::Node& one : nodes)
          for (const NearBlocks::Node& other : nodes) {
            // nodes lie in each other or beside each other
            if (one.first > other.first || (one.last > other.first && one.number != other.number))
              continue;
            const double found = near.distance_if_flat(one, other);
            if (one.number == other.number && found > 0) ++flat;
            for (const auto& [blocks, distance] : least)
              if (blocks.one >= one.first && blocks.one < one.last && blocks.other >= other.first &&
                  blocks.other < other.last) {
                ASSERT_LE(found, distance);
              }
          }
      }
    }
    EXPECT_GT(flat, 20);
  }
}

TEST(PairLists, TellNoLongerWayThanSheetsHaveUntilTheyAreNear) {
  constexpr double kApart = 0.006, kWay = 0.0003;  // m
  std::vector<SheetDefinition> sheets(24, flat_sheet(5, 5, 0.01));
  std::vector<Matrix3Xd> x;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    sheets[s].origin = {0, kApart * static_cast<double>(s), 0};
    x.push_back(start_positions(sheets[s]));
  }
  const Cloth cloth(sheets);
  PairLists lists(cloth);
  int empty = 0, foreseen = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    // each moves as a whole
    const Matrix3Xd from = cloth.positions(x),
                    way = kWay * noise(static_cast<int>(sheets.size()), seed);
    double least = kApart;
    for (std::size_t s = 1; s < sheets.size(); ++s)
      least = std::min(least, x[s](1, 0) - x[s - 1](1, 0));
    for (std::size_t s = 0; s < sheets.size(); ++s)
      x[s].colwise() += Vector3d(way.col(static_cast<Eigen::Index>(s)));
    lists.update(from, cloth.positions(x), calling_thread());
    if (!lists.empty()) continue;
    ++empty;
    EXPECT_LE(lists.lasts(), least - cloth.thickest);
    EXPECT_GT(lists.lasts(), 0);
    // and as they go on
    for (double times = 1; times < 20; times += 0.25) {
      double left = kApart;
      for (std::size_t s = 1; s < sheets.size(); ++s) {
        const auto above = static_cast<Eigen::Index>(s);
        left = std::min(
            left, x[s](1, 0) - x[s - 1](1, 0) + (times - 1) * (way(1, above) - way(1, above - 1)));
      }
      const double beside = lists.lasts_beside(times);
      if (beside >= 0) {
        ++foreseen;
        EXPECT_LE(beside, left - cloth.thickest) << times;
      }
    }
  }
  EXPECT_GT(empty, 3);
  EXPECT_GT(foreseen, 30);
}

}  // namespace
}  // namespace weft::testing
