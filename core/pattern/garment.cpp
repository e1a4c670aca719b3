#include "core/pattern/garment.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <set>

#include "core/model/text.h"
#include "core/pattern/borders.h"
#include "core/pattern/creases.h"
#include "core/pattern/folded_panel.h"
#include "core/pattern/overlaps.h"
#include "core/pattern/panel_mesher.h"
#include "core/pattern/sets.h"

namespace weft {
namespace {

constexpr double kMostParticles = 100'000;
constexpr double kGoodHeight = 0.35;  // edges

class Builder {
 public:
  Builder(const Pattern& pattern, double edge, const std::string& field,
          const std::string& edge_field)
      : pattern_(pattern), edge_(edge), field_(field), edge_field_(edge_field) {}

  std::variant<Garment, std::vector<Problem>> run() {
    problems_ = find_problems(pattern_, edge_, field_, edge_field_);
    if (!problems_.empty()) return std::move(problems_);
    borders_ = cut_borders(pattern_, edge_, field_);
    problems_ = std::move(borders_.problems);
    check_borders();
    if (!problems_.empty()) return std::move(problems_);
    for (std::size_t p = 0; p < borders_.panels.size(); ++p)
      meshes_.push_back(mesh_panel(borders_.panels[p].lines, pattern_.panels[p].grain, edge_));
    number_points();
    part_doubles();
    if (!problems_.empty()) return std::move(problems_);
    note_corners();
    place_panels();
    make_sheet();
    note_narrow();
    garment_.notes.insert(garment_.notes.begin(), borders_.notes.begin(), borders_.notes.end());
    return std::move(garment_);
  }

 private:
  std::string at_panel(std::size_t p) const { return join(field_, ".panels[", p, "]"); }
  static std::string place(const Vector2d& point) {
    return join("(", point.x(), ", ", point.y(), ")");
  }

  void check_borders() {
    double particles = 0;
    for (std::size_t p = 0; p < borders_.panels.size(); ++p) {
      const auto& points = borders_.panels[p].lines.border;
      const double area = area_within(points), count = static_cast<double>(points.size());
      particles += count / 2 + std::max(0.0, area) / (edge_ * edge_ * std::numbers::sqrt3 / 2);
      if (const auto crossing = find_crossing({.border = points}))
        tell_crossing(p, *crossing);
      else if (area <= 0)
        problems_.push_back(
            {at_panel(p) + ".edges", "run clockwise around panel " + pattern_.panels[p].name +
                                         "; list them anticlockwise, from the last to the first"});
    }
    if (particles > kMostParticles)
      problems_.push_back(
          {edge_field_, join("of ", edge_, " m makes about ", static_cast<long>(particles),
                             " particles, more than ", static_cast<long>(kMostParticles))});
    if (!problems_.empty()) return;
    for (std::size_t p = 0; p < borders_.panels.size(); ++p) {
      auto found = crease_problems(pattern_.panels[p], borders_.panels[p], edge_, at_panel(p));
      std::move(found.begin(), found.end(), std::back_inserter(problems_));
    }
  }

  void tell_crossing(std::size_t p, const std::pair<int, int>& lines) {
    const Border& border = borders_.panels[p];
    const std::vector<Vector2d>& points = border.lines.border;
    const auto edge_of = [&](int line) {
      const int next = (line + 1) % static_cast<int>(points.size());
      for (std::size_t e = 0; e < border.edges.size(); ++e)
        for (std::size_t i = 0; i + 1 < border.edges[e].size(); ++i)
          if (border.edges[e][i] == line && border.edges[e][i + 1] == next) return e;
      return border.edges.size();
    };
    const std::size_t first = edge_of(lines.first), second = edge_of(lines.second);
    problems_.push_back({at_panel(p) + ".edges",
                         join("cross or touch in panel ", pattern_.panels[p].name, ": edge ", first,
                              " and ", first == second ? "itself" : join("edge ", second), " near ",
                              place(points[as_index(lines.first)]),
                              " m, where they are followed by lines of ", edge_, " m")});
  }

  // Points of all panels one after the other; those that are sewn together are one particle.
  void number_points() {
    first_.push_back(0);
    for (const PanelMesh& mesh : meshes_)
      first_.push_back(first_.back() + static_cast<int>(mesh.points.size()));
    Sets sets(as_index(first_.back()));
    for (const auto& [a, b] : borders_.sewn)
      sets.join(first_[as_index(a.panel)] + a.point, first_[as_index(b.panel)] + b.point);
    particle_.resize(meshes_.size());
    std::vector<int> number(as_index(first_.back()));
    for (std::size_t p = 0; p < meshes_.size(); ++p)
      for (int i = first_[p]; i < first_[p + 1]; ++i) {
        const int root = sets.find(i);
        if (root == i) number[as_index(i)] = particles_++;
        particle_[p].push_back(number[as_index(root)]);
      }
  }

  struct Side {
    std::size_t panel;
    int a, b;  // points
    int triangles;
  };

  // Lines across a panel that seams make one with another, or join at both ends, get a point in
  // their middle.
  void part_doubles() {
    constexpr int kMostRounds = 8;
    for (int round = 0; round < kMostRounds; ++round) {
      std::map<std::pair<int, int>, std::vector<Side>> lines;  // by particles
      for (std::size_t p = 0; p < meshes_.size(); ++p) {
        std::map<std::pair<int, int>, int> own;
        for (const auto& triangle : meshes_[p].triangles)
          for (std::size_t k = 0; k < 3; ++k)
            ++own[std::minmax(triangle[k], triangle[(k + 1) % 3])];
        for (const auto& [ends, count] : own) {
          const auto [a, b] = ends;
          lines[std::minmax(particle_[p][as_index(a)], particle_[p][as_index(b)])].push_back(
              {p, a, b, count});
        }
      }
      std::vector<std::vector<std::pair<int, int>>> parted(meshes_.size());
      for (const auto& [ends, sides] : lines)
        for (const Side& side : sides)
          if (side.triangles == 2 && (sides.size() > 1 || ends.first == ends.second))
            parted[side.panel].emplace_back(side.a, side.b);
      bool more = false;
      for (std::size_t p = 0; p < meshes_.size(); ++p)
        for (const auto& [a, b] : parted[p]) part(p, a, b), more = true;
      if (!more) return;
    }
    problems_.push_back({edge_field_, join("of ", edge_,
                                           " m is too long for the narrowest panels: sewn, their "
                                           "triangles would be one")});
  }

  void part(std::size_t p, int a, int b) {
    PanelMesh& mesh = meshes_[p];
    const int middle = static_cast<int>(mesh.points.size());
    mesh.points.emplace_back((mesh.points[as_index(a)] + mesh.points[as_index(b)]) / 2);
    particle_[p].push_back(particles_++);
    const std::size_t count = mesh.triangles.size();
    for (std::size_t t = 0; t < count; ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const auto triangle = mesh.triangles[t];
        const int from = triangle[k], to = triangle[(k + 1) % 3], tip = triangle[(k + 2) % 3];
        if (std::minmax(from, to) != std::minmax(a, b)) continue;
        mesh.triangles[t] = {from, middle, tip};
        mesh.triangles.push_back({middle, to, tip});
        break;
      }
    for (std::vector<int>& crease : borders_.panels[p].lines.creases)
      for (std::size_t i = 1; i < crease.size(); ++i)
        if (std::minmax(crease[i - 1], crease[i]) == std::minmax(a, b)) {
          crease.insert(crease.begin() + static_cast<std::ptrdiff_t>(i), middle);
          break;
        }
  }

  void note_corners() {
    for (std::size_t p = 0; p < meshes_.size(); ++p) {
      const auto& points = borders_.panels[p].lines.border;
      const auto& edges = borders_.panels[p].edges;
      const std::size_t count = points.size();
      std::set<int> told;
      for (std::size_t e = 0; e < edges.size(); ++e) {
        const int corner = edges[e].front();
        const Vector2d& at = points[as_index(corner)];
        const Vector2d next = points[(as_index(corner) + 1) % count] - at,
                       before = points[(as_index(corner) + count - 1) % count] - at;
        const double turn =
            std::atan2(next.x() * before.y() - next.y() * before.x(), next.dot(before));
        const double degrees =
            (turn < 0 ? turn + 2 * std::numbers::pi : turn) * 180 / std::numbers::pi;
        constexpr double kSharp = 25;
        if (degrees >= kSharp || !told.insert(corner).second) continue;
        sharp_.insert(p);
        borders_.notes.push_back(
            {"CORNER_SHARP", join(at_panel(p), ".edges[", e, "]"),
             join("panel ", pattern_.panels[p].name, " begins edge ", e, " in a corner of ",
                  degrees, " degrees: triangles there are low, and shorten the step")});
      }
    }
  }

  void place_panels() {
    for (const PatternPanel& panel : pattern_.panels) origins_.push_back(panel.origin);
    for (const auto& [first, second, way] : draw_apart(pattern_, meshes_, origins_))
      borders_.notes.push_back(
          {"PANELS_OVERLAP", at_panel(second),
           join("panels ", pattern_.panels[first].name, " and ", pattern_.panels[second].name,
                " are placed into each other in one plane: they start ", way * 1e3,
                " mm farther apart")});
  }

  void make_sheet() {
    TriangleMesh& mesh = garment_.mesh;
    mesh.start.assign(as_index(particles_), Vector3d::Zero());
    std::vector<int> shares(as_index(particles_));
    for (std::size_t p = 0; p < meshes_.size(); ++p) {
      const PatternPanel& panel = pattern_.panels[p];
      const PanelMesh& from = meshes_[p];
      const std::vector<Vector3d> placed = points_as_placed(p);
      const Eigen::Matrix3d rotation = panel.rotation.normalized().toRotationMatrix();
      const double mirrored = borders_.turned[p] ? -1 : 1;
      const int first = static_cast<int>(mesh.flat.size());
      for (std::size_t i = 0; i < from.points.size(); ++i) {
        const Vector2d& point = from.points[i];
        const int particle = particle_[p][i];
        mesh.start[as_index(particle)] += origins_[p] + rotation * placed[i];
        ++shares[as_index(particle)];
        mesh.flat.emplace_back(mirrored * point.x(), point.y());
      }
      for (auto triangle : from.triangles) {
        if (borders_.turned[p]) std::swap(triangle[1], triangle[2]);
        std::array<int, 3> corners{}, particles{};
        for (std::size_t k = 0; k < 3; ++k) {
          corners[k] = first + triangle[k];
          particles[k] = particle_[p][as_index(triangle[k])];
        }
        mesh.triangles.push_back(particles);
        mesh.flat_triangles.push_back(corners);
      }
      mesh.panels.push_back(
          {panel.name, static_cast<int>(from.triangles.size()), mirrored * panel.grain});
      add_edges(p);
    }
    for (std::size_t i = 0; i < mesh.start.size(); ++i) mesh.start[i] /= shares[i];
    for (const auto& [panel, points, angle] : borders_.folds)
      add_fold(particles_of(as_index(panel), points), angle);
    for (std::size_t p = 0; p < meshes_.size(); ++p) add_creases(p);
    if (mesh.flat_triangles == mesh.triangles) mesh.flat_triangles.clear();
  }

  // From its origin, in its own axes, m.
  std::vector<Vector3d> points_as_placed(std::size_t p) const {
    const PatternPanel& panel = pattern_.panels[p];
    const Border& border = borders_.panels[p];
    if (starts_folded(panel))
      return folded_points(panel, border.lines.creases, meshes_[p], border.edges[0].front(),
                           borders_.turned[p]);
    std::vector<Vector3d> points;
    for (const Vector2d& point : meshes_[p].points) points.emplace_back(point.x(), point.y(), 0);
    return points;
  }

  // One with that before it where it goes on from there.
  void add_fold(const std::vector<int>& particles, double angle) {
    std::vector<Fold>& folds = garment_.mesh.folds;
    if (!folds.empty() && folds.back().angle == angle &&
        folds.back().particles.back() == particles.front())
      folds.back().particles.insert(folds.back().particles.end(), particles.begin() + 1,
                                    particles.end());
    else
      folds.push_back({particles, angle});
  }

  void add_creases(std::size_t p) {
    const auto& creases = borders_.panels[p].lines.creases;
    for (std::size_t c = 0; c < creases.size(); ++c) {
      const GarmentCrease& crease = garment_.creases.emplace_back(
          GarmentCrease{static_cast<int>(p), static_cast<int>(c), particles_of(p, creases[c])});
      if (const double angle = pattern_.panels[p].creases[c].angle; angle != 0)
        add_fold(crease.particles, angle);
    }
  }

  std::vector<int> particles_of(std::size_t p, const std::vector<int>& points) const {
    std::vector<int> particles;
    for (const int i : points) particles.push_back(particle_[p][as_index(i)]);
    return particles;
  }

  void add_edges(std::size_t p) {
    const std::vector<Curve> outline = outline_of(pattern_.panels[p]);
    for (std::size_t e = 0; e < outline.size(); ++e) {
      GarmentEdge& edge = garment_.edges.emplace_back();
      edge.panel = static_cast<int>(p);
      edge.edge = static_cast<int>(e);
      edge.particles = particles_of(p, borders_.panels[p].edges[e]);
      edge.length = outline[e].length();
    }
  }

  void note_narrow() {
    garment_.least_height = std::numeric_limits<double>::infinity();
    for (std::size_t p = 0; p < meshes_.size(); ++p) {
      double least = std::numeric_limits<double>::infinity();
      Vector2d where = Vector2d::Zero();
      for (const auto& [a, b, c] : meshes_[p].triangles) {
        const auto& points = meshes_[p].points;
        const std::array corners{points[as_index(a)], points[as_index(b)], points[as_index(c)]};
        const double height = least_height(corners);
        if (height < least) least = height, where = (corners[0] + corners[1] + corners[2]) / 3;
      }
      garment_.least_height = std::min(garment_.least_height, least);
      if (least < kGoodHeight * edge_ && !sharp_.contains(p))
        garment_.notes.push_back({"PANEL_NARROW", at_panel(p),
                                  join("panel ", pattern_.panels[p].name, " has a triangle ",
                                       least * 1e3, " mm high near ", place(where),
                                       " m, where its outline leaves no more room for "
                                       "triangles of ",
                                       edge_ * 1e3, " mm; it shortens the step")});
    }
  }

  const Pattern& pattern_;
  double edge_;
  const std::string &field_, &edge_field_;
  std::vector<Problem> problems_;
  Borders borders_;
  std::vector<PanelMesh> meshes_;
  std::vector<int> first_;                  // point of each panel
  std::vector<std::vector<int>> particle_;  // of each point of each panel
  int particles_ = 0;
  std::vector<Vector3d> origins_;  // of the panels as they start, m
  std::set<std::size_t> sharp_;    // panels with sharp corners
  Garment garment_;
};

}  // namespace

std::variant<Garment, std::vector<Problem>> build_garment(const Pattern& pattern, double edge,
                                                          const std::string& field,
                                                          const std::string& edge_field) {
  return Builder(pattern, edge, field, edge_field).run();
}

}  // namespace weft
