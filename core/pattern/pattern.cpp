#include "core/pattern/pattern.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/model/text.h"
#include "core/pattern/curve.h"

namespace weft {
namespace {

constexpr std::size_t kMostPanels = 256, kMostEdges = 1024, kMostSeams = 1024, kMostRuns = 64;
constexpr std::size_t kMostCreases = 64, kMostCreasePoints = 64;
constexpr double kMostCoordinate = 100, kLeastLength = 1e-5;  // m
constexpr double kMostGrain = 7;                              // rad
constexpr double kMostLines = 10'000;  // around a panel: they are compared in pairs

bool is_name(const std::string& text) {
  return text.size() <= 63 &&
         text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_-") == std::string::npos;
}

class PatternCheck {
 public:
  PatternCheck(const Pattern& pattern, double edge, const std::string& field,
               const std::string& edge_field)
      : pattern_(pattern), edge_(edge), field_(field), edge_field_(edge_field) {}

  std::vector<Problem> run() {
    number(edge_field_, edge_, kLeastPatternEdge, kMostPatternEdge, " m");
    const std::size_t panels = pattern_.panels.size();
    if (panels < 1 || panels > kMostPanels)
      problem(field_ + ".panels", "has ", panels, " panels, not 1 to ", kMostPanels);
    else
      for (std::size_t p = 0; p < panels; ++p) check_panel(p);
    if (pattern_.seams.size() > kMostSeams)
      problem(field_ + ".seams", "has ", pattern_.seams.size(), " seams, more than ", kMostSeams);
    else
      for (std::size_t s = 0; s < pattern_.seams.size(); ++s) check_seam(s);
    if (problems_.empty()) check_overlaps();
    return std::move(problems_);
  }

 private:
  template <class... Parts>
  void problem(const std::string& field, const Parts&... message) {
    problems_.push_back({field, join(message...)});
  }
  bool number(const std::string& field, double value, double low, double high, const char* unit) {
    if (value >= low && value <= high) return true;  // false for NaN
    problem(field, value, unit, " is not within ", exact(low), " to ", exact(high), unit);
    return false;
  }

  void check_panel(std::size_t p) {
    const PatternPanel& panel = pattern_.panels[p];
    const std::string at = join(field_, ".panels[", p, "]");
    if (panel.name.empty() || !is_name(panel.name))
      problem(at + ".name", "\"", panel.name.substr(0, 80),
              "\" is not 1 to 63 characters of a-z, 0-9, - and _");
    else if (!numbers_.emplace(panel.name, p).second)
      problem(at + ".name", "\"", panel.name, "\" is taken");
    number(at + ".grain_rad", panel.grain, -kMostGrain, kMostGrain, " rad");
    check_placement(panel, at + ".placement");
    check_creases(panel, at);
    if (panel.edges.size() < 2 || panel.edges.size() > kMostEdges)
      return problem(at + ".edges", "has ", panel.edges.size(), " edges, not 2 to ", kMostEdges);
    bool good = true;
    for (std::size_t e = 0; e < panel.edges.size(); ++e)
      good &= check_edge(panel.edges[e], join(at, ".edges[", e, "]"));
    if (!good) return;
    const std::vector<Curve> outline = outline_of(panel);
    double length = 0;
    for (const Curve& curve : outline) length += curve.length();
    if (length > kMostLines * edge_)
      problem(edge_field_, "of ", edge_, " m makes about ", std::floor(length / edge_),
              " lines around panel ", panel.name, ", more than ", kMostLines);
    for (std::size_t e = 0; e < outline.size(); ++e)
      if (outline[e].is_broken())
        problem(join(at, ".edges[", e, "].arc"),
                "is through a point that lies on the line of its ends, and not between them");
      else if (!(outline[e].length() >= kLeastLength))
        problem(at + ".edges", "edge ", e, " has a length of ", outline[e].length(),
                " m; it needs ", kLeastLength, " m or more");
  }

  void check_placement(const PatternPanel& panel, const std::string& field) {
    constexpr double kMostOffset = 1e4, kMostPart = 1e6, kLeastNorm = 1e-9;
    constexpr std::array kAxes = {"x", "y", "z"};
    bool good = number(field + ".rotation.w", panel.rotation.w(), -kMostPart, kMostPart, "");
    for (Eigen::Index k = 0; k < 3; ++k) {
      const char* axis = kAxes[static_cast<std::size_t>(k)];
      number(field + ".origin_m." + axis, panel.origin[k], -kMostOffset, kMostOffset, " m");
      good &=
          number(field + ".rotation." + axis, panel.rotation.vec()[k], -kMostPart, kMostPart, "");
    }
    if (good && panel.rotation.norm() < kLeastNorm)
      problem(field + ".rotation", "has a length of ", panel.rotation.norm(), "; it must not be 0");
  }

  void check_creases(const PatternPanel& panel, const std::string& at) {
    if (panel.creases.size() > kMostCreases)
      return problem(at + ".creases", "has ", panel.creases.size(), " creases, more than ",
                     kMostCreases);
    double whole = 0;
    for (std::size_t c = 0; c < panel.creases.size(); ++c) {
      const auto& [points, angle, start_angle] = panel.creases[c];
      const std::string place = join(at, ".creases[", c, "]");
      number(place + ".fold_rad", angle, -kMostFold, kMostFold, " rad");
      number(place + ".start_rad", start_angle, -kMostFold, kMostFold, " rad");
      if (points.size() < 2 || points.size() > kMostCreasePoints) {
        problem(place + ".points_m", "has ", points.size(), " points, not 2 to ",
                kMostCreasePoints);
        continue;
      }
      if (!check_points(points, place)) continue;
      double length = 0;
      for (std::size_t i = 0; i + 1 < points.size(); ++i)
        length += (points[i + 1] - points[i]).norm();
      if (!(length >= kLeastLength))
        problem(place + ".points_m", "make a line of ", length, " m; it needs ", kLeastLength,
                " m or more");
      whole += length;
    }
    if (whole > kMostLines * edge_)
      problem(edge_field_, "of ", edge_, " m makes about ", std::floor(whole / edge_),
              " lines along creases of panel ", panel.name, ", more than ", kMostLines);
  }

  bool check_points(const std::vector<Vector2d>& points, const std::string& at) {
    bool good = true;
    for (const Vector2d& point : points)
      for (const double value : point)
        good &= number(at + ".points_m", value, -kMostCoordinate, kMostCoordinate, " m");
    return good;
  }

  bool check_edge(const PatternEdge& edge, const std::string& at) {
    const std::size_t before = problems_.size();
    if (edge.points.empty() || edge.points.size() > 3)
      problem(at + ".points_m", "has ", edge.points.size(), " points, not 1 to 3");
    else if (edge.arc && edge.points.size() != 2)
      problem(at + ".arc", "is for 2 points; there are ", edge.points.size());
    check_points(edge.points, at);
    if (!is_name(edge.label))
      problem(at + ".label", "\"", edge.label.substr(0, 80),
              "\" is not up to 63 characters of a-z, 0-9, - and _");
    return problems_.size() == before;
  }

  void check_seam(std::size_t s) {
    const PatternSeam& seam = pattern_.seams[s];
    const std::string at = join(field_, ".seams[", s, "]");
    check_side(seam.first, at + ".first_side");
    check_side(seam.second, at + ".second_side");
    number(at + ".fold_rad", seam.fold, -kMostFold, kMostFold, " rad");
  }

  void check_side(const std::vector<EdgeRun>& runs, const std::string& at) {
    if (runs.empty() || runs.size() > kMostRuns)
      return problem(at, "has ", runs.size(), " runs of edges, not 1 to ", kMostRuns);
    for (std::size_t r = 0; r < runs.size(); ++r) {
      const EdgeRun& run = runs[r];
      const std::string place = join(at, "[", r, "]");
      bool good = number(place + ".begin", run.begin, 0, 1, "");
      good &= number(place + ".end", run.end, 0, 1, "");
      if (good && !(run.end - run.begin > kRunGap))
        problem(place + ".end", run.end, " is not more than begin, ", run.begin);
      const auto panel = numbers_.find(run.panel);
      if (panel == numbers_.end()) {
        problem(place + ".panel", "no panel is called \"", run.panel.substr(0, 80), "\"");
        continue;
      }
      const std::size_t edges = pattern_.panels[panel->second].edges.size();
      if (run.edge < 0 || static_cast<std::size_t>(run.edge) >= edges)
        problem(place + ".edge", run.edge, " is not within 0 to ", edges - 1,
                ", the edges of panel ", run.panel);
    }
  }

  // Parts of an edge in two seams.
  void check_overlaps() {
    struct Use {
      const EdgeRun* run;
      std::size_t seam;
      std::string place;
    };
    std::map<std::pair<std::string, int>, std::vector<Use>> uses;
    for (std::size_t s = 0; s < pattern_.seams.size(); ++s)
      for (const bool first : {true, false}) {
        const auto& runs = first ? pattern_.seams[s].first : pattern_.seams[s].second;
        for (std::size_t r = 0; r < runs.size(); ++r)
          uses[{runs[r].panel, runs[r].edge}].push_back(
              {&runs[r], s,
               join(field_, ".seams[", s, "].", first ? "first" : "second", "_side[", r, "]")});
      }
    for (auto& [edge, all] : uses) {
      std::stable_sort(all.begin(), all.end(),
                       [](const Use& a, const Use& b) { return a.run->begin < b.run->begin; });
      for (std::size_t i = 1; i < all.size(); ++i)
        if (all[i].run->begin < all[i - 1].run->end - kRunGap)
          problem(all[i].place, "panel ", edge.first, ", edge ", edge.second, " from ",
                  all[i].run->begin, " to ", all[i].run->end, " is sewn twice: seam ",
                  all[i - 1].seam, " has it from ", all[i - 1].run->begin, " to ",
                  all[i - 1].run->end);
    }
  }

  const Pattern& pattern_;
  double edge_;
  const std::string &field_, &edge_field_;
  std::map<std::string, std::size_t> numbers_;  // of panels
  std::vector<Problem> problems_;
};

}  // namespace

std::vector<Problem> find_problems(const Pattern& pattern, double edge, const std::string& field,
                                   const std::string& edge_field) {
  return PatternCheck(pattern, edge, field, edge_field).run();
}

}  // namespace weft
