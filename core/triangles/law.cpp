#include "core/triangles/law.h"

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <utility>

namespace weft {
namespace {

using Triangle = std::array<int, 3>;

std::size_t index(int i) { return static_cast<std::size_t>(i); }

// Lists of what each particle has, one after the other.
template <class A>
class Lists {
 public:
  // Calls each(add) twice, with add(i, value).
  template <class F>
  Lists(int particles, const F& each) : first_(index(particles) + 1) {
    each([&](int i, const A&) { ++first_[index(i) + 1]; });
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    all_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    each([&](int i, const A& value) { all_[next[index(i)]++] = value; });
  }
  struct List {
    const A *first, *last;
    const A* begin() const { return first; }
    const A* end() const { return last; }
    std::size_t size() const { return static_cast<std::size_t>(last - first); }
  };
  List at(int i) const {
    return {all_.data() + first_[index(i)], all_.data() + first_[index(i) + 1]};
  }

 private:
  std::vector<std::size_t> first_;
  std::vector<A> all_;
};

// Edge `edge` of a triangle, opposite to its corner of that number, leads to a particle.
struct Spoke {
  int to, triangle, edge;
};
using Spokes = Lists<Spoke>;

Spokes spokes_of(int particles, const std::vector<Triangle>& triangles) {
  return Spokes(particles, [&](const auto& add) {
    for (std::size_t t = 0; t < triangles.size(); ++t)
      for (int k = 0; k < 3; ++k) {
        const int a = triangles[t][index((k + 1) % 3)], b = triangles[t][index((k + 2) % 3)];
        add(a, Spoke{b, static_cast<int>(t), k});
        add(b, Spoke{a, static_cast<int>(t), k});
      }
  });
}

// Of each particle, the other ends of its edges and of connections that damp it, ascending.
std::vector<std::vector<int>> neighbours_of(int particles, const Spokes& spokes, const Mesh& mesh) {
  std::vector<std::vector<int>> near(index(particles));
  for (int i = 0; i < particles; ++i)
    for (const Spoke& spoke : spokes.at(i)) near[index(i)].push_back(spoke.to);
  for (const Family& family : mesh.families)
    for (const auto& [i, j] : family.connections) {
      near[index(i)].push_back(j);
      near[index(j)].push_back(i);
    }
  for (auto& each : near) {
    std::sort(each.begin(), each.end());
    each.erase(std::unique(each.begin(), each.end()), each.end());
  }
  return near;
}

// Rows of the matrix of the bending energy: N/m by particle, without the diagonal, for rows sum up
// to 0.
class BendingRows {
 public:
  BendingRows(const Surface& surface, int particles)
      : surface_(surface),
        uses_(particles,
              [&](const auto& add) {
                for (std::size_t f = 0; f < surface.fits.size(); ++f)
                  for (std::size_t k = 0; k < surface.fits[f].particle.size(); ++k)
                    add(surface.fits[f].particle[k], Use{f, k});
              }),
        sum_(index(particles)),
        known_(index(particles), -1) {}

  struct Entry {
    int particle;
    double stiffness;
  };
  // Of particle i, by particle.
  const std::vector<Entry>& row(int i) {
    entries_.clear();
    for (const auto& [f, at] : uses_.at(i)) {
      const CurvatureFit& fit = surface_.fits[f];
      const BendStiffness& bend = surface_.bend[index(fit.panel)];
      const auto& own = fit.weight[at];
      for (std::size_t k = 0; k < fit.particle.size(); ++k) {
        const int j = fit.particle[k];
        const auto& other = fit.weight[k];
        if (j == i) continue;
        if (known_[index(j)] != i) {
          known_[index(j)] = i;
          sum_[index(j)] = 0;
          entries_.push_back({j, 0});
        }
        sum_[index(j)] +=
            fit.area * (bend.warp * (own[0] * other[0]) + 2 * bend.twist * (own[1] * other[1]) +
                        bend.weft * (own[2] * other[2]));
      }
    }
    for (Entry& entry : entries_) entry.stiffness = sum_[index(entry.particle)];
    std::sort(entries_.begin(), entries_.end(),
              [](const Entry& a, const Entry& b) { return a.particle < b.particle; });
    return entries_;
  }

 private:
  struct Use {
    std::size_t fit, at;
  };
  const Surface& surface_;
  Lists<Use> uses_;
  std::vector<double> sum_;
  std::vector<int> known_;
  std::vector<Entry> entries_;
};

// The strains e_uu, e_vv and g of a triangle as sums of its l^2 - L^2, one a column, and its L^2.
struct Measure {
  Eigen::Matrix3d strains;
  Vector3d rest;  // m^2
};
Measure measure(const MembraneElement& element) {
  // (u, v) of corners 1 and 2 from corner 0
  Eigen::Matrix2d gradients;
  gradients << element.du[1], element.du[2], element.dv[1], element.dv[2];
  const Eigen::Matrix2d corners = gradients.inverse();
  const Vector2d one = corners.row(0).transpose(), two = corners.row(1).transpose();
  const Vector2d edge[] = {two - one, two, one};
  Eigen::Matrix3d lengths;  // l^2 - L^2 of each strain
  Vector3d rest;
  for (int k = 0; k < 3; ++k) {
    const double u = edge[k].x(), v = edge[k].y();
    lengths.row(k) << 2 * u * u, 2 * v * v, 2 * u * v;
    rest[k] = u * u + v * v;
  }
  return {lengths.inverse(), rest};
}

// Constants of one triangle, in place.
template <class T>
void set_stiffness(const MembraneElement& element, const MembraneStiffness& stiffness, bool pushes,
                   const Vector3d& bend, T* to) {
  constexpr int kLanes = TriangleLaw<T>::kLanes;
  const auto put = [&](int k, double value) {
    return double{to[k * kLanes] = static_cast<T>(value)};
  };
  const auto [strains, rest] = measure(element);
  if (pushes) {
    Eigen::Matrix3d law;
    law << stiffness.warp, stiffness.coupling, 0, stiffness.coupling, stiffness.weft, 0, 0, 0,
        stiffness.shear;
    Eigen::Matrix3d tension = 2 * element.area * strains.transpose() * law * strains;
    constexpr int kAt[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    // what is left of no strain by rounded constants is taken off with the rest
    for (int k = 0; k < 3; ++k)
      for (int j = 0; j < 3; ++j) tension(k, j) = put(kAt[k][j], tension(k, j));
    for (int k = 0; k < 3; ++k) put(6 + k, tension.row(k).dot(rest) + bend[k]);
    return;
  }
  const double by[] = {stiffness.warp, stiffness.weft, stiffness.shear};
  for (int mode = 0; mode < 3; ++mode) {
    const Vector3d a = std::sqrt(2 * element.area * by[mode]) * strains.row(mode).transpose();
    double least = 0;
    for (int k = 0; k < 3; ++k) least += put(4 * mode + k, a[k]) * rest[k];
    put(4 * mode + 3, least);
  }
  for (int k = 0; k < 3; ++k) put(12 + k, bend[k]);
}

// Halves a sheet across its length, again and again: what lies near is then near in memory.
class Halving {
 public:
  explicit Halving(const std::vector<std::vector<int>>& near)
      : near_(near), part_(near.size()), order_(near.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    halve(0, order_.size());
  }
  const std::vector<int>& order() const { return order_; }

 private:
  void halve(std::size_t begin, std::size_t end) {
    constexpr std::size_t kBlock = TriangleLaw<float>::kBlock;
    if (end - begin <= kBlock) return;
    // from one end, which is farthest from any particle, to the other
    spread(begin, end);
    std::swap(order_[begin], order_[end - 1]);
    spread(begin, end);
    const std::size_t middle = begin + ((end - begin) / 2 + kBlock - 1) / kBlock * kBlock;
    halve(begin, middle);
    halve(middle, end);
  }
  // Orders a part by how many edges lead there from its first particle.
  void spread(std::size_t begin, std::size_t end) {
    const int mine = ++parts_, seen = ++parts_;
    for (std::size_t k = begin; k < end; ++k) part_[index(order_[k])] = mine;
    found_.clear();
    for (std::size_t k = begin; k < end; ++k) {
      visit(order_[k], mine, seen);
      for (std::size_t at = found_.size() - 1; at < found_.size(); ++at)
        for (const int j : near_[index(found_[at])]) visit(j, mine, seen);
      if (found_.size() == end - begin) break;
    }
    std::copy(found_.begin(), found_.end(), order_.begin() + static_cast<std::ptrdiff_t>(begin));
  }
  void visit(int i, int mine, int seen) {
    if (part_[index(i)] != mine) return;
    part_[index(i)] = seen;
    found_.push_back(i);
  }

  const std::vector<std::vector<int>>& near_;
  std::vector<int> part_, order_, found_;
  int parts_ = 0;
};

}  // namespace

std::vector<int> near_order(const std::vector<std::vector<int>>& neighbours) {
  return Halving(neighbours).order();
}

template <class T>
TriangleLaw<T> make_triangle_law(const Mesh& mesh, bool blows) {
  constexpr int kLanes = TriangleLaw<T>::kLanes, kBlock = TriangleLaw<T>::kBlock;
  const int particles = static_cast<int>(mesh.mass.size());
  const Surface& surface = mesh.surface;
  TriangleLaw<T> law;
  law.particles = particles;
  law.pushes = surface.pushes;
  law.bends = !surface.fits.empty();

  // those of the membrane and those that wind presses on are the same
  std::vector<Triangle> corners = mesh.triangles;
  if (!surface.membrane.empty()) {
    corners.clear();
    for (const MembraneElement& element : surface.membrane) corners.push_back(element.particle);
  }
  const Spokes spokes = spokes_of(particles, corners);
  const std::vector<std::vector<int>> near = neighbours_of(particles, spokes, mesh);

  // rows of bending, of which those along edges go to triangles
  std::vector<Vector3d> bend(corners.size(), Vector3d::Zero());
  using Entry = BendingRows::Entry;
  std::vector<std::vector<Entry>> far(index(particles));
  if (law.bends) {
    BendingRows rows(surface, particles);
    for (int i = 0; i < particles; ++i)
      for (const Entry& entry : rows.row(i)) {
        const auto own = spokes.at(i);
        const auto spoke = std::find_if(
            own.begin(), own.end(), [&](const Spoke& each) { return each.to == entry.particle; });
        if (spoke == own.end())
          far[index(i)].push_back(entry);
        else if (i < entry.particle)
          bend[index(spoke->triangle)][spoke->edge] = entry.stiffness;
      }
  }
  const auto reaches = [&](int i) { return (far[index(i)].size() + 3) / 4; };

  // order: in windows, so that loops over neighbours run equally often
  std::vector<int> order = near_order(near);
  const auto loops = [&](int i) { return std::pair(near[index(i)].size(), reaches(i)); };
  for (std::size_t begin = 0; begin < order.size(); begin += index(kBlock))
    std::stable_sort(
        order.begin() + static_cast<std::ptrdiff_t>(begin),
        order.begin() + static_cast<std::ptrdiff_t>(std::min(order.size(), begin + index(kBlock))),
        [&](int i, int j) { return loops(i) < loops(j); });
  law.place.resize(index(particles));
  for (int k = 0; k < particles; ++k) law.place[index(order[index(k)])] = k;
  const auto offset = [&](int i) { return static_cast<Offset>(4 * law.place[index(i)]); };

  // triangles, in order of their first particle
  std::vector<int> triangles(corners.size());
  std::iota(triangles.begin(), triangles.end(), 0);
  const auto first = [&](int t) {
    const auto& [a, b, c] = corners[index(t)];
    return std::min({offset(a), offset(b), offset(c)});
  };
  std::stable_sort(triangles.begin(), triangles.end(),
                   [&](int s, int t) { return first(s) < first(t); });
  law.groups = static_cast<int>((triangles.size() + index(kLanes) - 1) / index(kLanes));
  const auto groups = index(law.groups);
  law.corners = AlignedArray<Offset>(groups * 3 * index(kLanes));
  law.stiffness = AlignedArray<T>(groups * index(law.constants() * kLanes));
  std::vector<int> slot(triangles.size());
  for (std::size_t at = 0; at < triangles.size(); ++at) {
    const auto t = index(triangles[at]);
    const std::size_t group = at / index(kLanes), lane = at % index(kLanes);
    slot[t] = static_cast<int>(at);
    for (std::size_t k = 0; k < 3; ++k)
      law.corners.data()[(group * 3 + k) * index(kLanes) + lane] = offset(corners[t][k]);
    T* const constants = law.stiffness.data() + group * index(law.constants() * kLanes) + lane;
    if (t < surface.membrane.size()) {
      const MembraneElement& element = surface.membrane[t];
      set_stiffness(element, surface.stretch[index(element.panel)], law.pushes, bend[t], constants);
    } else {
      for (int k = 0; k < 3; ++k)
        constants[(law.constants() - 3 + k) * kLanes] = static_cast<T>(bend[t][k]);
    }
  }
  const auto tension = [&](const Spoke& spoke) {
    const int at = slot[index(spoke.triangle)];
    return static_cast<Offset>((at / kLanes * 3 + spoke.edge) * kLanes + at % kLanes);
  };
  const auto none = static_cast<Offset>(groups * 3 * index(kLanes));

  // what each particle gathers
  std::size_t side_count = 0, reach_count = 0, corner_count = 0;
  for (int i = 0; i < particles; ++i) {
    side_count += near[index(i)].size();
    reach_count += 4 * reaches(i);
    corner_count += blows ? spokes.at(i).size() / 2 : 0;
  }
  law.blocks.resize(index((particles + kBlock - 1) / kBlock));
  law.gathers = AlignedArray<Gather<T>>(law.blocks.size() * index(kBlock));
  law.sides = AlignedArray<Side>(side_count);
  law.reaches = AlignedArray<Reach<T>>(reach_count);
  law.blown = AlignedArray<Offset>(corner_count);
  std::size_t side = 0, reach = 0, blown = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const int i = order[k];
    if (k % index(kBlock) == 0) law.blocks[k / index(kBlock)] = {side, reach, blown, 0};
    Gather<T>& gather = law.gathers.data()[k];
    for (const int j : near[index(i)]) {
      Side& made = law.sides.data()[side++] = {offset(j), {none, none}};
      std::size_t found = 0;
      for (const Spoke& spoke : spokes.at(i)) {
        if (spoke.to != j) continue;
        assert(found < 2);
        made.tension[found++] = tension(spoke);
      }
      ++gather.sides;
    }
    double sum = 0;
    for (const Entry& entry : far[index(i)]) {
      const T stiffness = static_cast<T>(entry.stiffness);
      law.reaches.data()[reach++] = {offset(entry.particle), stiffness};
      sum += double{stiffness};
    }
    gather.reach_sum = static_cast<T>(sum);
    gather.reach_error = static_cast<T>(double{gather.reach_sum} - sum);
    for (std::size_t n = far[index(i)].size(); n < 4 * reaches(i); ++n)
      law.reaches.data()[reach++] = {offset(i), T(0)};
    gather.reaches = static_cast<std::uint32_t>(reaches(i));
    if (!blows) continue;
    for (const Spoke& spoke : spokes.at(i)) {
      const auto& corner = corners[index(spoke.triangle)];
      if (corner[index((spoke.edge + 1) % 3)] != i) continue;  // once of each triangle
      law.blown.data()[blown++] = static_cast<Offset>(4 * slot[index(spoke.triangle)]);
      ++gather.corners;
    }
  }
  for (std::size_t b = 0, at = 0; b < law.blocks.size(); ++b) {
    while (at < triangles.size() && first(triangles[at]) < 4 * (b + 1) * index(kBlock)) ++at;
    law.blocks[b].groups = static_cast<int>((at + index(kLanes) - 1) / index(kLanes));
  }
  return law;
}

template <class T>
void TriangleLaw<T>::release() {
  corners = {}, stiffness = {}, gathers = {}, sides = {}, reaches = {}, blown = {};
}

template <class T>
void TriangleLaw<T>::restore(const Mesh& mesh) {
  TriangleLaw<T> made = make_triangle_law<T>(mesh, wind.blows);
  std::swap(corners, made.corners);
  std::swap(stiffness, made.stiffness);
  std::swap(gathers, made.gathers);
  std::swap(sides, made.sides);
  std::swap(reaches, made.reaches);
  std::swap(blown, made.blown);
}

template struct TriangleLaw<float>;
template struct TriangleLaw<double>;
template TriangleLaw<float> make_triangle_law(const Mesh&, bool);
template TriangleLaw<double> make_triangle_law(const Mesh&, bool);

}  // namespace weft
