#include "core/triangles/law.h"

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

#include "core/triangles/bending_rows.h"
#include "core/triangles/lists.h"
#include "core/triangles/near_order.h"

namespace weft {
namespace {

using Triangle = std::array<int, 3>;

std::size_t index(int i) { return static_cast<std::size_t>(i); }

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

// Of those at a particle the first that leads to another; null: none does.
const Spoke* find_spoke(const Spokes& spokes, int from, int to) {
  const auto own = spokes.at(from);
  const auto found = std::ranges::find(own, to, &Spoke::to);
  return found == own.end() ? nullptr : &*found;
}

// Those of the membrane and those that wind presses on are the same.
std::vector<Triangle> pulling(const Mesh& mesh) {
  if (mesh.surface.membrane.empty()) return mesh.triangles;
  std::vector<Triangle> corners;
  for (const MembraneElement& element : mesh.surface.membrane) corners.push_back(element.particle);
  return corners;
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

// Places within a patch.
class Nearby {
 public:
  explicit Nearby(int particles) : place_(index(particles)), patch_(index(particles), -1) {}

  void begin(int patch) {
    current_ = patch;
    count_ = 0;
  }
  // Whether i was not there yet.
  bool add(int i) {
    if (std::exchange(patch_[index(i)], current_) == current_) return false;
    place_[index(i)] = count_++;
    return true;
  }
  void skip(int count) { count_ += count; }
  int count() const { return count_; }
  int at(int i) const {
    assert(patch_[index(i)] == current_);
    return place_[index(i)];
  }

 private:
  std::vector<int> place_, patch_;
  int current_ = -1, count_ = 0;
};

// Puts a sheet into the order in which it is stepped.
template <class T>
class Packing {
 public:
  Packing(const Mesh& mesh, bool blows)
      : surface_(mesh.surface),
        blows_(blows),
        particles_(static_cast<int>(mesh.mass.size())),
        corners_(pulling(mesh)),
        spokes_(spokes_of(particles_, corners_)),
        near_(neighbours_of(particles_, spokes_, mesh)),
        far_(index(particles_)),
        nearby_(particles_),
        slot_(corners_.size()),
        slot_patch_(corners_.size(), -1) {
    law_.particles = particles_;
    law_.pushes = surface_.pushes;
    law_.bends = !surface_.fits.empty();
    if (law_.bends) find_far();
    find_order();
  }

  std::optional<TriangleLaw<T>> law() {
    if (!find_patches()) return {};
    allocate();
    for (const Patch& patch : law_.patches) fill(patch);
    return std::move(law_);
  }

 private:
  using Law = TriangleLaw<T>;
  using Patch = typename Law::Patch;
  using Entry = BendingRows::Entry;
  static constexpr int kLanes = Law::kLanes, kBlock = Law::kBlock;
  static constexpr int kStride = 4 * sizeof(T) / 8;  // of a particle, as Near counts

  void find_far() {
    BendingRows rows(surface_, particles_);
    for (int i = 0; i < particles_; ++i)
      for (const Entry& entry : rows.row(i))
        if (find_spoke(spokes_, i, entry.particle) == nullptr)
          far_[index(i)].push_back(entry.particle);
  }
  std::size_t reaches(int i) const { return (far_[index(i)].size() + 3) / 4; }

  // In windows, so that loops over neighbours run equally often.
  void find_order() {
    order_ = near_order(near_);
    const auto loops = [&](int i) { return std::pair(near_[index(i)].size(), reaches(i)); };
    for (std::size_t begin = 0; begin < order_.size(); begin += index(kBlock))
      std::stable_sort(order_.begin() + static_cast<std::ptrdiff_t>(begin),
                       order_.begin() + static_cast<std::ptrdiff_t>(
                                            std::min(order_.size(), begin + index(kBlock))),
                       [&](int i, int j) { return loops(i) < loops(j); });
    law_.place.resize(index(particles_));
    for (int k = 0; k < particles_; ++k) law_.place[index(order_[index(k)])] = k;
  }

  // Particles of a patch.
  std::pair<std::size_t, std::size_t> range(const Patch& patch) const {
    const std::size_t first = index(patch.block * kBlock);
    return {first, std::min(order_.size(), first + index(patch.blocks * kBlock))};
  }

  // Begins a patch with its own particles, and calls each with those around them: first those along
  // edges, whose number it returns.
  template <class F>
  std::size_t gather_around(int number, const Patch& patch, const F& each) {
    nearby_.begin(number);
    const auto [first, last] = range(patch);
    for (std::size_t k = first; k < last; ++k) nearby_.add(order_[k]);
    nearby_.skip(patch.blocks * kBlock - nearby_.count());
    const int own = nearby_.count();
    const auto add = [&](int i) {
      if (nearby_.add(i)) each(i);
    };
    for (std::size_t k = first; k < last; ++k)
      for (const int j : near_[index(order_[k])]) add(j);
    const int beside = nearby_.count();
    for (std::size_t k = first; k < last; ++k)
      for (const int j : far_[index(order_[k])]) add(j);
    return index(beside - own);
  }
  // Calls each with the triangles at a patch.
  template <class F>
  void gather_triangles(int number, const Patch& patch, const F& each) {
    const auto [first, last] = range(patch);
    for (std::size_t k = first; k < last; ++k)
      for (const Spoke& spoke : spokes_.at(order_[k]))
        if (std::exchange(slot_patch_[index(spoke.triangle)], number) != number)
          each(spoke.triangle);
  }

  bool find_patches() {
    constexpr int kBlocks = Law::kPatchBlocks;
    constexpr std::size_t kMost = std::numeric_limits<Near>::max();
    int number = 0;
    for (int block = 0; block < law_.blocks(); block += kBlocks, ++number) {
      Patch patch{block, std::min(kBlocks, law_.blocks() - block)};
      patch.around = around_.size();
      patch.group = groups_;
      patch.side = sides_, patch.reach = reaches_, patch.blown = blown_;
      patch.beside_count = gather_around(number, patch, [&](int i) {
        around_.push_back(static_cast<Offset>(4 * law_.place[index(i)]));
      });
      std::size_t triangles = 0;
      gather_triangles(number, patch, [&](int) { ++triangles; });
      const auto [first, last] = range(patch);
      for (std::size_t k = first; k < last; ++k) {
        const int i = order_[k];
        sides_ += near_[index(i)].size();
        reaches_ += reaches(i);
        blown_ += blows_ ? spokes_.at(i).size() / 2 : 0;
      }
      patch.around_count = around_.size() - patch.around;
      patch.group_count = (triangles + index(kLanes) - 1) / index(kLanes);
      groups_ += patch.group_count;
      law_.most_particles = std::max(law_.most_particles, index(nearby_.count()));
      law_.most_groups = std::max(law_.most_groups, patch.group_count);
      law_.patches.push_back(patch);
    }
    return law_.most_particles * kStride <= kMost &&
           (law_.most_groups * (blows_ ? std::max(3, kStride) : 3) + 1) * kLanes <= kMost;
  }

  void allocate() {
    law_.around = AlignedArray<Offset>(around_.size());
    std::copy(around_.begin(), around_.end(), law_.around.data());
    law_.corners = AlignedArray<Near>(groups_ * 3 * index(kLanes));
    law_.stiffness = AlignedArray<T>(groups_ * law_.constants() * index(kLanes));
    law_.triangles.assign(groups_ * index(kLanes), -1);
    law_.gathers = AlignedArray<Gather<T>>(index(law_.blocks() * kBlock));
    law_.sides = AlignedArray<Side>(sides_);
    law_.reaches = AlignedArray<Reaches<T>>(reaches_);
    law_.blown = AlignedArray<Near>(blown_);
  }

  Near near(int i) const { return static_cast<Near>(nearby_.at(i) * kStride); }

  void fill(const Patch& patch) {
    // none of those that find_patches() used
    const int number = static_cast<int>(&patch - law_.patches.data() + std::ssize(law_.patches));
    gather_around(number, patch, [](int) {});
    int triangles = 0;
    gather_triangles(number, patch, [&](int t) {
      slot_[index(t)] = triangles;
      put_triangle(t, patch.group + index(triangles / kLanes), index(triangles % kLanes));
      ++triangles;
    });
    Side* side = law_.sides.data() + patch.side;
    Reaches<T>* reach = law_.reaches.data() + patch.reach;
    Near* blown = law_.blown.data() + patch.blown;
    const auto [first, last] = range(patch);
    for (std::size_t k = first; k < last; ++k) {
      const int i = order_[k];
      Gather<T>& gather = law_.gathers.data()[k];
      side = fill_sides(i, gather, side);
      reach = fill_reaches(i, gather, reach);
      if (blows_) blown = fill_blown(i, gather, blown);
    }
  }

  void put_triangle(int t, std::size_t group, std::size_t lane) {
    for (std::size_t k = 0; k < 3; ++k)
      law_.corners.data()[(group * 3 + k) * index(kLanes) + lane] = near(corners_[index(t)][k]);
    law_.triangles[group * index(kLanes) + lane] = t;
  }

  // Tensions lie behind a group of zeros.
  Near tension(const Spoke& spoke) const {
    const int at = slot_[index(spoke.triangle)];
    return static_cast<Near>((at / kLanes * 3 + spoke.edge + 1) * kLanes + at % kLanes);
  }

  Side* fill_sides(int i, Gather<T>& gather, Side* side) {
    for (const int j : near_[index(i)]) {
      *side = {near(j), {0, 0}};
      std::size_t found = 0;
      for (const Spoke& spoke : spokes_.at(i)) {
        if (spoke.to != j) continue;
        assert(found < 2);
        side->tension[found++] = tension(spoke);
      }
      ++side;
    }
    gather.sides = static_cast<std::uint16_t>(near_[index(i)].size());
    return side;
  }

  Reaches<T>* fill_reaches(int i, Gather<T>& gather, Reaches<T>* reach) {
    const std::vector<int>& far = far_[index(i)];
    for (std::size_t n = 0; n < 4 * reaches(i); ++n) {
      reach[n / 4].particle[n % 4] = near(n < far.size() ? far[n] : i);
      reach[n / 4].stiffness[n % 4] = 0;
    }
    gather.reaches = static_cast<std::uint16_t>(reaches(i));
    return reach + reaches(i);
  }

  Near* fill_blown(int i, Gather<T>& gather, Near* blown) {
    for (const Spoke& spoke : spokes_.at(i)) {
      const auto& corner = corners_[index(spoke.triangle)];
      if (corner[index((spoke.edge + 1) % 3)] != i) continue;  // once of each triangle
      *blown++ = static_cast<Near>(slot_[index(spoke.triangle)] * kStride);
      ++gather.corners;
    }
    return blown;
  }

  const Surface& surface_;
  bool blows_;
  int particles_;
  std::vector<Triangle> corners_;
  Spokes spokes_;
  std::vector<std::vector<int>> near_;  // particles along edges
  std::vector<std::vector<int>> far_;   // that bend the sheet there, but those, ascending
  std::vector<int> order_;
  Nearby nearby_;
  std::vector<int> slot_, slot_patch_;  // of each triangle: its place in a patch
  std::vector<Offset> around_;
  std::size_t groups_ = 0, sides_ = 0, reaches_ = 0, blown_ = 0;
  Law law_;
};

// Sets what bends the sheet from farther away; returns what is left of rows of bending along the
// edges of each triangle, N/m.
template <class T>
std::vector<Vector3d> set_bending(const Mesh& mesh, TriangleLaw<T>& law) {
  const std::vector<Triangle> corners = pulling(mesh);
  std::vector<Vector3d> along(corners.size(), Vector3d::Zero());
  if (!law.bends) return along;
  const Spokes spokes = spokes_of(law.particles, corners);
  BendingRows rows(mesh.surface, law.particles);
  std::vector<int> order(index(law.particles));
  for (int i = 0; i < law.particles; ++i) order[index(law.place[index(i)])] = i;
  Reaches<T>* reach = law.reaches.data();
  for (int k = 0; k < law.particles; ++k) {
    const int i = order[index(k)];
    std::size_t n = 0;
    double sum = 0;
    for (const auto& [j, row] : rows.row(i)) {
      if (const Spoke* spoke = find_spoke(spokes, i, j)) {
        if (i < j) along[index(spoke->triangle)][spoke->edge] = row;
        continue;
      }
      sum += double{reach[n / 4].stiffness[n % 4] = static_cast<T>(row)};
      ++n;
    }
    Gather<T>& gather = law.gathers.data()[k];
    gather.reach_sum = static_cast<T>(sum);
    gather.reach_error = static_cast<T>(double{gather.reach_sum} - sum);
    reach += gather.reaches;
  }
  return along;
}

}  // namespace

template <class T>
std::optional<TriangleLaw<T>> make_triangle_law(const Mesh& mesh, bool blows) {
  std::optional<TriangleLaw<T>> law = Packing<T>(mesh, blows).law();
  if (law) law->set_constants(mesh);
  return law;
}

template <class T>
void TriangleLaw<T>::set_constants(const Mesh& mesh) {
  const Surface& surface = mesh.surface;
  const std::vector<Vector3d> bend = set_bending(mesh, *this);
  for (std::size_t at = 0; at < triangles.size(); ++at) {
    if (triangles[at] < 0) continue;
    const std::size_t t = index(triangles[at]), lanes = index(kLanes);
    T* const to = stiffness.data() + at / lanes * constants() * lanes + at % lanes;
    if (t < surface.membrane.size()) {
      const MembraneElement& element = surface.membrane[t];
      set_stiffness(element, surface.stretch[index(element.panel)], pushes, bend[t], to);
    } else {
      for (std::size_t k = 0; k < 3; ++k)
        to[(constants() - 3 + k) * lanes] = static_cast<T>(bend[t][static_cast<Eigen::Index>(k)]);
    }
  }
}

template <class T>
void TriangleLaw<T>::release() {
  around = {}, corners = {}, stiffness = {}, triangles = {}, gathers = {}, sides = {}, reaches = {},
  blown = {};
}

template <class T>
void TriangleLaw<T>::restore(const Mesh& mesh) {
  TriangleLaw<T> made = *make_triangle_law<T>(mesh, wind.blows);
  std::swap(around, made.around);
  std::swap(corners, made.corners);
  std::swap(stiffness, made.stiffness);
  std::swap(triangles, made.triangles);
  std::swap(gathers, made.gathers);
  std::swap(sides, made.sides);
  std::swap(reaches, made.reaches);
  std::swap(blown, made.blown);
}

template struct TriangleLaw<float>;
template struct TriangleLaw<double>;
template std::optional<TriangleLaw<float>> make_triangle_law(const Mesh&, bool);
template std::optional<TriangleLaw<double>> make_triangle_law(const Mesh&, bool);

}  // namespace weft
