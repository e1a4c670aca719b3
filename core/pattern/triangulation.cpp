#include "core/pattern/triangulation.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>

#include "core/cloth_contact/orientation.h"
#include "core/pattern/curve.h"

namespace weft {

int orientation(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  const auto in_space = [](const Vector2d& p) { return Vector3d(p.x(), p.y(), 0); };
  return orientation(in_space(a), in_space(b), in_space(c), Vector3d(a.x(), a.y(), 1));
}

Triangulation::Triangulation(std::vector<Vector2d> polygon)
    : points_(std::move(polygon)), polygon_(points_.size()) {
  clip_ears();
  link();
  restore_all();
}

// Cuts off triangles that hold no other corner (Meisters 1975).
void Triangulation::clip_ears() {
  const int count = static_cast<int>(points_.size());
  std::vector<int> next(points_.size()), before(points_.size());
  for (int i = 0; i < count; ++i) {
    next[as_index(i)] = (i + 1) % count;
    before[as_index(i)] = (i + count - 1) % count;
  }
  const auto after = [&](int i) -> int& { return next[as_index(i)]; };
  const auto ahead = [&](int i) -> int& { return before[as_index(i)]; };
  const auto turn_at = [&](int i) { return orientation(at(ahead(i)), at(i), at(after(i))); };
  std::vector<int> turn(points_.size()), hollow;  // corners that may lie in an ear
  for (int i = 0; i < count; ++i)
    if ((turn[as_index(i)] = turn_at(i)) <= 0) hollow.push_back(i);

  const auto is_ear = [&](int i) {
    if (turn[as_index(i)] <= 0) return false;
    const int a = ahead(i), b = after(i);
    const Vector2d low = at(a).cwiseMin(at(i)).cwiseMin(at(b)),
                   high = at(a).cwiseMax(at(i)).cwiseMax(at(b));
    return std::none_of(hollow.begin(), hollow.end(), [&](int h) {
      const Vector2d& p = at(h);
      return p.x() >= low.x() && p.y() >= low.y() && p.x() <= high.x() && p.y() <= high.y() &&
             next[as_index(h)] >= 0 && h != a && h != i && h != b &&
             orientation(at(a), at(i), p) >= 0 && orientation(at(i), at(b), p) >= 0 &&
             orientation(at(b), at(a), p) >= 0;
    });
  };
  int left = count, i = 0, tried = 0;
  while (left > 3 && tried <= left) {
    ++tried;
    if (!is_ear(i)) {
      i = after(i);
      continue;
    }
    const int a = ahead(i), b = after(i);
    triangles_.push_back({{a, i, b}, {-1, -1, -1}});
    after(a) = b, ahead(b) = a;
    after(i) = -1;
    for (const int beside : {a, b}) turn[as_index(beside)] = turn_at(beside);
    --left, tried = 0;
    i = after(b);  // not at once beside it, so that ears are not all of one point
  }
  if (left == 3) triangles_.push_back({{ahead(i), i, after(i)}, {-1, -1, -1}});
}

void Triangulation::link() {
  std::map<std::pair<int, int>, Side> sides;
  for (int t = 0; t < static_cast<int>(triangles_.size()); ++t)
    for (int k = 0; k < 3; ++k) {
      const auto& corner = triangle(t).corner;
      const int a = corner[as_index(k)];
      const int b = corner[as_index((k + 1) % 3)];
      const auto found = sides.find({b, a});
      if (found == sides.end()) {
        sides[{a, b}] = {t, k};
        continue;
      }
      triangle(t).beside[as_index(k)] = found->second.triangle;
      triangle(found->second.triangle).beside[as_index(found->second.k)] = t;
    }
}

std::vector<std::array<int, 3>> Triangulation::triangles() const {
  std::vector<std::array<int, 3>> corners;
  for (const Triangle& each : triangles_) corners.push_back(each.corner);
  return corners;
}

// The triangle that has the point, or -1: walks there from the last one, and where the polygon is
// in the way looks at all.
int Triangulation::find(const Vector2d& point) const {
  const auto outside = [&](int t, int k) {
    const auto& corner = triangle(t).corner;
    return orientation(at(corner[as_index(k)]), at(corner[as_index((k + 1) % 3)]), point) < 0;
  };
  int t = last_;
  for (std::size_t steps = 0; t >= 0 && steps < triangles_.size(); ++steps) {
    int way = -1;
    for (int k = 0; k < 3 && way < 0; ++k)
      if (outside(t, k)) way = k;
    if (way < 0) return last_ = t;
    t = triangle(t).beside[as_index(way)];
  }
  for (t = 0; t < static_cast<int>(triangles_.size()); ++t)
    if (!outside(t, 0) && !outside(t, 1) && !outside(t, 2)) return last_ = t;
  return -1;
}

void Triangulation::replace_neighbour(int t, int old, int now) {
  if (t < 0) return;
  for (int& beside : triangle(t).beside)
    if (beside == old) {
      beside = now;
      return;
    }
}

bool Triangulation::insert(const Vector2d& point) {
  const int t = find(point);
  if (t < 0) return false;
  int on = -1;  // a side
  for (int k = 0; k < 3; ++k) {
    const int a = triangle(t).corner[as_index(k)];
    const int b = triangle(t).corner[as_index((k + 1) % 3)];
    if (at(a) == point) return false;
    if (orientation(at(a), at(b), point) == 0) on = k;
  }
  const int p = static_cast<int>(points_.size()), count = static_cast<int>(triangles_.size());
  if (on >= 0) {
    const int other = triangle(t).beside[as_index(on)];
    if (other < 0) return false;
    const auto& corner = triangle(t).corner;
    if (is_kept(corner[as_index(on)], corner[as_index((on + 1) % 3)])) return false;
    points_.push_back(point);
    // each of both triangles in two
    const auto turned_to = [](const Triangle& from, int k) {
      Triangle to{};
      for (std::size_t i = 0; i < 3; ++i) {
        to.corner[i] = from.corner[(as_index(k) + i) % 3];
        to.beside[i] = from.beside[(as_index(k) + i) % 3];
      }
      return to;
    };
    int there = 0;
    while (triangle(other).beside[as_index(there)] != t) ++there;
    const Triangle one = turned_to(triangle(t), on), two = turned_to(triangle(other), there);
    const auto [a, b, c] = one.corner;  // the side runs from a to b
    const int d = two.corner[2], t2 = count, other2 = count + 1;
    triangle(t) = {{a, p, c}, {other2, t2, one.beside[2]}};
    triangles_.push_back({{p, b, c}, {other, one.beside[1], t}});
    triangle(other) = {{b, p, d}, {t2, other2, two.beside[2]}};
    triangles_.push_back({{p, a, d}, {t, two.beside[1], other}});
    replace_neighbour(one.beside[1], t, t2);
    replace_neighbour(two.beside[1], other, other2);
    restore({{t, 2}, {t2, 1}, {other, 2}, {other2, 1}});
    return true;
  }
  points_.push_back(point);
  const auto [corner, beside] = triangle(t);
  triangle(t) = {{corner[0], corner[1], p}, {beside[0], count, count + 1}};
  triangles_.push_back({{corner[1], corner[2], p}, {beside[1], count + 1, t}});
  triangles_.push_back({{corner[2], corner[0], p}, {beside[2], t, count}});
  replace_neighbour(beside[1], t, count);
  replace_neighbour(beside[2], t, count + 1);
  restore({{t, 0}, {count, 0}, {count + 1, 0}});
  return true;
}

Triangulation::Quad Triangulation::across(const Side& side) const {
  const Triangle& one = triangle(side.triangle);
  const auto k = as_index(side.k);
  const int other = one.beside[k];
  const Triangle& two = triangle(other);
  std::size_t j = 0;
  while (two.beside[j] != side.triangle) ++j;
  return {one.corner[k], one.corner[(k + 1) % 3], one.corner[(k + 2) % 3], two.corner[(j + 2) % 3],
          other,         static_cast<int>(j)};
}

double Triangulation::excess(const Quad& quad) const {
  // minus the sine of the sum of the angles that the diagonal is seen under from both sides
  const Vector2d ca = at(quad.a) - at(quad.c), cb = at(quad.b) - at(quad.c),
                 da = at(quad.a) - at(quad.d), db = at(quad.b) - at(quad.d);
  const double sum = cross2(ca, cb) * da.dot(db) + ca.dot(cb) * cross2(db, da);
  return -sum / (ca.norm() * cb.norm() * da.norm() * db.norm());
}

bool Triangulation::is_convex(const Quad& quad) const {
  return orientation(at(quad.c), at(quad.a), at(quad.d)) > 0 &&
         orientation(at(quad.d), at(quad.b), at(quad.c)) > 0;
}

void Triangulation::flip(const Side& side, const Quad& quad) {
  const auto& [a, b, c, d, other, back] = quad;
  const int t = side.triangle;
  const auto k = as_index(side.k), j = as_index(back);
  const auto one = triangle(t).beside, two = triangle(other).beside;
  const int bc = one[(k + 1) % 3], ca = one[(k + 2) % 3];
  const int ad = two[(j + 1) % 3], db = two[(j + 2) % 3];
  triangle(t) = {{a, d, c}, {ad, other, ca}};
  triangle(other) = {{d, b, c}, {db, bc, t}};
  replace_neighbour(ad, other, t);
  replace_neighbour(bc, t, other);
}

// Lawson's flips (1977), each of which lessens a sum over all triangles.
void Triangulation::restore(std::vector<Side> sides) {
  constexpr double kRounding = 1e-9;
  while (!sides.empty()) {
    const Side side = sides.back();
    sides.pop_back();
    if (triangle(side.triangle).beside[as_index(side.k)] < 0) continue;
    const Quad quad = across(side);
    if (is_kept(quad.a, quad.b) || excess(quad) < kRounding || !is_convex(quad)) continue;
    flip(side, quad);
    for (const int t : {side.triangle, quad.other})
      for (const int k : {0, 1, 2}) sides.push_back({t, k});
  }
}

// Around a point of the mesh.
std::vector<int> Triangulation::triangles_at(int point) const {
  std::vector<int> found = {find(at(point))};
  const auto beside = [&](int t, std::size_t step) {
    return triangle(t).beside[(corner_of(t, point) + step) % 3];
  };
  for (const std::size_t step : {std::size_t{2}, std::size_t{0}})
    for (int t = beside(found[0], step); t >= 0; t = beside(t, step)) {
      if (t == found[0]) return found;
      found.push_back(t);
    }
  return found;
}

std::size_t Triangulation::corner_of(int t, int point) const {
  const auto& corner = triangle(t).corner;
  return static_cast<std::size_t>(std::find(corner.begin(), corner.end(), point) - corner.begin());
}

// The sides that a line between two points crosses, by their points on its right and on its left.
std::vector<std::pair<int, int>> Triangulation::sides_across(int a, int b) const {
  Side side{-1, 0};
  for (const int t : triangles_at(a)) {
    const std::size_t k = corner_of(t, a);
    const auto& corner = triangle(t).corner;
    const int right = corner[(k + 1) % 3], left = corner[(k + 2) % 3];
    if (right == b || left == b) return {};
    if (orientation(at(a), at(b), at(right)) < 0 && orientation(at(a), at(b), at(left)) > 0)
      side = {t, static_cast<int>((k + 1) % 3)};
  }
  std::vector<std::pair<int, int>> sides;
  while (side.triangle >= 0 && triangle(side.triangle).beside[as_index(side.k)] >= 0) {
    const Quad quad = across(side);
    sides.emplace_back(quad.a, quad.b);
    if (quad.d == b) break;
    const bool on_left = orientation(at(a), at(b), at(quad.d)) > 0;
    side = {quad.other, (quad.back + (on_left ? 1 : 2)) % 3};
  }
  return sides;
}

// Turns diagonals in the way until none is (Sloan 1993).
void Triangulation::keep(int a, int b) {
  const std::vector<std::pair<int, int>> across_it = sides_across(a, b);
  std::deque<std::pair<int, int>> waiting(across_it.begin(), across_it.end());
  const std::size_t most = 16 * across_it.size() * across_it.size();  // far more than it takes
  for (std::size_t tries = 0; !waiting.empty() && tries < most; ++tries) {
    const auto [from, to] = waiting.front();
    waiting.pop_front();
    for (const int t : triangles_at(from)) {
      const Side side{t, static_cast<int>(corner_of(t, from))};
      if (triangle(t).corner[(as_index(side.k) + 1) % 3] != to) continue;
      const Quad quad = across(side);
      const auto& [p, q, c, d, other, back] = quad;
      const bool convex = is_convex(quad);
      if (convex) flip(side, quad);
      if (!convex)
        waiting.emplace_back(from, to);
      else if (c != a && c != b && d != a && d != b &&
               orientation(at(a), at(b), at(c)) * orientation(at(a), at(b), at(d)) < 0)
        waiting.emplace_back(c, d);
      break;
    }
  }
  kept_.insert(std::minmax(a, b));
}

void Triangulation::keep(const std::vector<int>& line) {
  for (std::size_t i = 0; i + 1 < line.size(); ++i) keep(line[i], line[i + 1]);
  restore_all();
}

void Triangulation::restore_all() {
  std::vector<Side> sides;
  for (int t = 0; t < static_cast<int>(triangles_.size()); ++t)
    for (const int k : {0, 1, 2}) sides.push_back({t, k});
  restore(std::move(sides));
}

void Triangulation::move(const std::vector<Vector2d>& points) {
  std::vector<Vector2d> moved = points_;
  for (std::size_t i = polygon_; i < points_.size(); ++i) moved[i] = points[i];
  // what would turn a triangle over stays where it is
  for (bool more = true; more;) {
    more = false;
    for (const Triangle& each : triangles_) {
      const auto place = [&](std::size_t k) -> Vector2d& {
        return moved[as_index(each.corner[k])];
      };
      if (orientation(place(0), place(1), place(2)) > 0) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        more |= place(k) != at(each.corner[k]);
        place(k) = at(each.corner[k]);
      }
    }
  }
  points_ = std::move(moved);
  restore_all();
}

void Triangulation::settle_ties(double grain, double axis) {
  constexpr double kTie = 1e-6;
  constexpr int kRounds = 3;
  const Vector2d along(-std::sin(grain), std::cos(grain)), aside(along.y(), -along.x());
  // by the diagonal's upper end, or that of both which is nearer
  const auto far = [&](int a, int b) {
    const double level = kTie * (at(a) - at(b)).norm(), rise = (at(a) - at(b)).dot(along);
    const double one = std::abs(at(a).dot(aside) - axis), two = std::abs(at(b).dot(aside) - axis);
    return rise > level ? one : rise < -level ? two : std::min(one, two);
  };
  for (int round = 0; round < kRounds; ++round) {
    bool changed = false;
    for (int t = 0; t < static_cast<int>(triangles_.size()); ++t)
      for (int k = 0; k < 3; ++k) {
        const Side side{t, k};
        if (triangle(t).beside[as_index(k)] < t) continue;
        const Quad quad = across(side);
        const auto& [a, b, c, d, other, back] = quad;
        if (is_kept(a, b) || std::abs(excess(quad)) > kTie || !is_convex(quad)) continue;
        if (far(c, d) > far(a, b) - kTie * (at(a) - at(b)).norm()) continue;
        flip(side, quad);
        changed = true;
      }
    if (!changed) return;
  }
}

}  // namespace weft
