#include "core/pattern/borders.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>

#include "core/model/text.h"
#include "core/pattern/creases.h"
#include "core/pattern/sets.h"
#include "core/pattern/symmetry.h"

namespace weft {
namespace {

constexpr double kMiddle = 0.5;       // of an edge
constexpr double kNegligible = 0.25;  // what is shorter may become a point, in edges of triangles

// Between neighbouring breaks of an edge.
struct Piece {
  int panel, edge;
  double from, to;        // shares of the edge's length
  double length;          // m
  double turning;         // rad
  int count = -1;         // of lines; 0: a point
  int partner = -1;       // the piece that it is sewn to
  bool reversed = false;  // against it
  double fold = 0;        // of the seam, rad
};

// A break of a side of a seam.
struct Break {
  int run;       // that it belongs to, or begins
  double share;  // of its edge
  double along;  // of the side's length, 0 to 1
};

// Two places that are sewn together, as shares of both sides' lengths.
using SewnPlaces = std::pair<double, double>;

// Where both sides are cut: breaks that lie next to each other, by that share at most, are sewn
// together; each other one to what lies between those as it does.
std::vector<SewnPlaces> pair_breaks(const std::vector<Break>& first,
                                    const std::vector<Break>& second, double near) {
  std::vector<SewnPlaces> pairs;
  for (std::size_t i = 0, j = 0; i < first.size() && j < second.size();) {
    const double apart = second[j].along - first[i].along;
    const bool both_ends = (i + 1 == first.size()) == (j + 1 == second.size());
    if (std::abs(apart) <= near && both_ends)
      pairs.emplace_back(first[i++].along, second[j++].along);
    else
      ++(apart > 0 ? i : j);
  }
  std::vector<SewnPlaces> all = pairs;
  const auto add_others = [&](const std::vector<Break>& breaks, double SewnPlaces::*own,
                              double SewnPlaces::*other) {
    std::size_t at = 0;
    for (const Break& each : breaks) {
      while (pairs[at + 1].*own < each.along && at + 2 < pairs.size()) ++at;
      const SewnPlaces &before = pairs[at], &after = pairs[at + 1];
      if (each.along == before.*own || each.along == after.*own) continue;
      const double part = (each.along - before.*own) / (after.*own - before.*own);
      SewnPlaces& added = all.emplace_back();
      added.*own = each.along;
      added.*other = before.*other + part * (after.*other - before.*other);
    }
  };
  add_others(first, &SewnPlaces::first, &SewnPlaces::second);
  add_others(second, &SewnPlaces::second, &SewnPlaces::first);
  std::sort(all.begin(), all.end());
  return all;
}

class Cutter {
 public:
  Cutter(const Pattern& pattern, double edge, std::string field)
      : pattern_(pattern), edge_(edge), field_(std::move(field)) {
    for (std::size_t p = 0; p < pattern.panels.size(); ++p) {
      panel_numbers_[pattern.panels[p].name] = static_cast<int>(p);
      outlines_.push_back(outline_of(pattern.panels[p]));
      breaks_.emplace_back(outlines_[p].size());
      middles_.emplace_back(outlines_[p].size());
      for (const int e : mirrored_onto_themselves(outlines_[p], pattern.panels[p].grain)) {
        middles_[p][as_index(e)] = true;
        breaks_[p][as_index(e)] = {kMiddle};
      }
    }
    end_creases();
    pieces_of_.resize(outlines_.size());
    for (std::size_t p = 0; p < outlines_.size(); ++p) pieces_of_[p].resize(outlines_[p].size());
  }

  Borders run() {
    for (std::size_t s = 0; s < pattern_.seams.size(); ++s) sew(pattern_.seams[s], at_seam(s));
    add_free_pieces();
    order_pieces();
    count_lines();
    make_points();
    make_creases();
    turn_panels();
    note_edges();
    return std::move(borders_);
  }

 private:
  std::string at_seam(std::size_t s) const { return join(field_, ".seams[", s, "]"); }
  const Curve& curve(int panel, int edge) const {
    return outlines_[as_index(panel)][as_index(edge)];
  }
  const Curve& curve(const EdgeRun& run) const {
    return curve(panel_numbers_.at(run.panel), run.edge);
  }
  void note(const char* code, const std::string& field, const std::string& message) {
    borders_.notes.push_back({code, field, message});
  }
  std::string name(int panel, int edge) const {
    const std::string& label = pattern_.panels[as_index(panel)].edges[as_index(edge)].label;
    return join("panel ", pattern_.panels[as_index(panel)].name, ", edge ", edge,
                label.empty() ? "" : " (" + label + ")");
  }

  // Where creases end by the outline: at an end of an edge or of a run, or in the middle, where
  // that is near.
  void end_creases() {
    std::vector<std::vector<std::vector<double>>> ends(breaks_);
    for (auto& panel : ends)
      for (auto& edge : panel) edge.insert(edge.end(), {0, 1});
    for (const PatternSeam& seam : pattern_.seams)
      for (const auto* runs : {&seam.first, &seam.second})
        for (const EdgeRun& run : *runs) {
          auto& known = ends[as_index(panel_numbers_.at(run.panel))][as_index(run.edge)];
          known.insert(known.end(), {run.begin, run.end});
        }
    crease_ends_.resize(outlines_.size());
    for (std::size_t p = 0; p < outlines_.size(); ++p)
      for (const PatternCrease& crease : pattern_.panels[p].creases)
        for (const Vector2d& end : {crease.points.front(), crease.points.back()}) {
          auto& place =
              crease_ends_[p].emplace_back(nearest_place(outlines_[p], end, edge_ * kNegligible));
          if (!place) continue;
          auto& known = ends[p][as_index(place->edge)];
          const double near = edge_ * kNegligible / outlines_[p][as_index(place->edge)].length();
          const auto apart = [&](double share) { return std::abs(share - place->share); };
          const double nearest = *std::ranges::min_element(known, {}, apart);
          if (apart(nearest) < near) {
            place->share = nearest;
            continue;
          }
          known.push_back(place->share);
          breaks_[p][as_index(place->edge)].push_back(place->share);
        }
    for (auto& panel : breaks_)
      for (auto& edge : panel) std::sort(edge.begin(), edge.end());
  }

  // Breaks of an edge between two shares of it.
  std::vector<double> breaks_between(int panel, int edge, double from, double to) const {
    constexpr double kClear = 0.02;  // a middle is no break so near to an end
    std::vector<double> found;
    for (const double share : breaks_[as_index(panel)][as_index(edge)]) {
      const double clear = share == kMiddle ? kClear : kRunGap;
      if (share > from + clear && share < to - clear) found.push_back(share);
    }
    return found;
  }

  // Ends of runs, middles of edges that a panel's mirror axis passes, and ends of creases.
  std::vector<Break> breaks_of(const std::vector<EdgeRun>& runs, bool backwards) const {
    double whole = 0, along = 0;
    for (const EdgeRun& run : runs) whole += curve(run).length() * (run.end - run.begin);
    std::vector<Break> breaks;
    for (std::size_t r = 0; r < runs.size(); ++r) {
      const EdgeRun& run = runs[r];
      const double length = curve(run).length() * (run.end - run.begin);
      const double begin = backwards ? run.end : run.begin, end = backwards ? run.begin : run.end;
      const int number = static_cast<int>(r);
      breaks.push_back({number, begin, along / whole});
      std::vector<double> inner =
          breaks_between(panel_numbers_.at(run.panel), run.edge, run.begin, run.end);
      if (backwards) std::reverse(inner.begin(), inner.end());
      for (const double share : inner)
        breaks.push_back(
            {number, share, (along + length * (share - begin) / (end - begin)) / whole});
      along += length;
    }
    breaks.push_back({static_cast<int>(runs.size()), 0, 1});
    return breaks;
  }

  double length_of(const std::vector<EdgeRun>& runs) const {
    double sum = 0;
    for (const EdgeRun& run : runs) sum += curve(run).length() * (run.end - run.begin);
    return sum;
  }

  // Cuts both sides at each other's breaks.
  void sew(const PatternSeam& seam, const std::string& field) {
    const std::vector<Break> first = breaks_of(seam.first, false),
                             second = breaks_of(seam.second, !seam.same_direction);
    const double lengths[2] = {length_of(seam.first), length_of(seam.second)};
    note_unequal(seam, field, lengths[0], lengths[1]);
    const std::vector<SewnPlaces> places =
        pair_breaks(first, second, edge_ / 2 / std::max(lengths[0], lengths[1]));
    for (std::size_t k = 0; k + 1 < places.size(); ++k) {
      const int a = add_piece(seam.first, first, false, places[k].first, places[k + 1].first);
      const int b = add_piece(seam.second, second, !seam.same_direction, places[k].second,
                              places[k + 1].second);
      pieces_[as_index(a)].partner = b, pieces_[as_index(b)].partner = a;
      pieces_[as_index(a)].reversed = pieces_[as_index(b)].reversed = !seam.same_direction;
      pieces_[as_index(a)].fold = seam.fold;
      links_.push_back(
          {pieces_[as_index(a)].panel, pieces_[as_index(b)].panel, seam.same_direction, field});
    }
  }

  // The piece of a side between two places along it, which lie in one run.
  int add_piece(const std::vector<EdgeRun>& runs, const std::vector<Break>& breaks, bool backwards,
                double from, double to) {
    const double middle = (from + to) / 2;
    std::size_t at = 0;
    while (at + 2 < breaks.size() && breaks[at + 1].along <= middle) ++at;
    const EdgeRun& run = runs[as_index(breaks[at].run)];
    const auto share_at = [&](double along) {
      // between breaks of one run, the last of which has its end
      const Break &begin = breaks[at], &next = breaks[at + 1];
      const double end = next.run == begin.run ? next.share : backwards ? run.begin : run.end;
      if (along == begin.along) return begin.share;
      if (along == next.along) return end;
      return begin.share + (along - begin.along) / (next.along - begin.along) * (end - begin.share);
    };
    double a = share_at(from), b = share_at(to);
    if (backwards) std::swap(a, b);
    return add_piece(panel_numbers_.at(run.panel), run.edge, a, b);
  }

  int add_piece(int panel, int edge, double from, double to) {
    const Curve& line = curve(panel, edge);
    const int number = static_cast<int>(pieces_.size());
    pieces_.push_back({panel, edge, from, to, line.length() * (to - from), line.turning(from, to)});
    pieces_of_[as_index(panel)][as_index(edge)].push_back(number);
    return number;
  }

  void note_unequal(const PatternSeam& seam, const std::string& field, double first,
                    double second) {
    constexpr double kEqual = 0.02;
    const double ratio = std::max(first, second) / std::min(first, second);
    if (ratio <= 1 + kEqual) return;
    const auto side = [&](const std::vector<EdgeRun>& runs) {
      return name(panel_numbers_.at(runs[0].panel), runs[0].edge) +
             (runs.size() > 1 ? join(" and ", runs.size() - 1, " more") : "");
    };
    note("SEAM_UNEQUAL", field,
         join("sides of ", first * 1e3, " mm (", side(seam.first), ") and ", second * 1e3, " mm (",
              side(seam.second), "), a ratio of ", ratio, ": the longer one is gathered"));
  }

  void add_free_pieces() {
    for (std::size_t p = 0; p < outlines_.size(); ++p)
      for (std::size_t e = 0; e < outlines_[p].size(); ++e) {
        std::vector<std::pair<double, double>> taken;
        for (const int k : pieces_of_[p][e])
          taken.emplace_back(pieces_[as_index(k)].from, pieces_[as_index(k)].to);
        std::sort(taken.begin(), taken.end());
        taken.emplace_back(1, 1);
        double at = 0;
        for (const auto& [from, to] : taken) {
          if (from - at > kRunGap) add_free(static_cast<int>(p), static_cast<int>(e), at, from);
          at = to;
        }
      }
  }

  void add_free(int panel, int edge, double from, double to) {
    for (const double share : breaks_[as_index(panel)][as_index(edge)])
      if (share > from && share < to) {
        add_piece(panel, edge, from, share);
        from = share;
      }
    add_piece(panel, edge, from, to);
  }

  // Around each panel.
  void order_pieces() {
    around_.resize(outlines_.size());
    place_.resize(pieces_.size());
    for (std::size_t p = 0; p < outlines_.size(); ++p)
      for (auto& of_edge : pieces_of_[p]) {
        std::sort(of_edge.begin(), of_edge.end(), [&](int a, int b) {
          return pieces_[as_index(a)].from < pieces_[as_index(b)].from;
        });
        for (const int k : of_edge) {
          place_[as_index(k)] = around_[p].size();
          around_[p].push_back(k);
        }
      }
  }

  // Lines of a piece, and of what it is sewn to: as many as suit the mean of both.
  int lines_for(const Piece& piece) const {
    constexpr double kMostTurn = std::numbers::pi / 4;  // of a line against the next, rad
    constexpr double kRounding = 1e-6;                  // so that equal turns have equal counts
    double length = piece.length, turning = piece.turning;
    if (piece.partner >= 0) {
      const Piece& other = pieces_[as_index(piece.partner)];
      length = std::sqrt(length * other.length);
      turning = std::max(turning, other.turning);
    }
    const double by_length = parts_of(length, edge_);
    const double by_turn = std::min(std::ceil(turning / kMostTurn - kRounding),
                                    std::ceil(2 * length / edge_ - kRounding));
    return static_cast<int>(std::max({1.0, by_length, by_turn}));
  }

  void set_count(int piece, int count) {
    pieces_[as_index(piece)].count = count;
    if (const int other = pieces_[as_index(piece)].partner; other >= 0)
      pieces_[as_index(other)].count = count;
  }

  // Whether it may become a point, with what has become one beside it.
  bool is_negligible(int piece) const {
    const double most = edge_ * kNegligible;
    const auto all = [&](int k) {
      const auto& ring = around_[as_index(pieces_[as_index(k)].panel)];
      const Piece& own = pieces_[as_index(k)];
      const bool halved = middles_[as_index(own.panel)][as_index(own.edge)];
      double sum = halved ? curve(own.panel, own.edge).length() : own.length;
      for (const std::size_t step : {std::size_t{1}, ring.size() - 1})
        for (std::size_t i = (place_[as_index(k)] + step) % ring.size(), n = 0;
             n < ring.size() && pieces_[as_index(ring[i])].count == 0;
             i = (i + step) % ring.size(), ++n)
          sum += pieces_[as_index(ring[i])].length;
      return sum;
    };
    const int partner = pieces_[as_index(piece)].partner;
    return all(piece) < most && (partner < 0 || all(partner) < most);
  }

  void count_lines() {
    for (std::size_t k = 0; k < pieces_.size(); ++k) {
      const int piece = static_cast<int>(k);
      if (pieces_[k].count >= 0) continue;
      set_count(piece, is_negligible(piece) ? 0 : lines_for(pieces_[k]));
    }
    for (const auto& ring : around_) give_three_lines(ring);
    part_doubles();
  }

  void give_three_lines(const std::vector<int>& ring) {
    for (;;) {
      int sum = 0, longest = ring[0];
      for (const int k : ring) {
        sum += pieces_[as_index(k)].count;
        const auto length = [&](int i) {
          return pieces_[as_index(i)].length / (pieces_[as_index(i)].count + 1);
        };
        if (length(k) > length(longest)) longest = k;
      }
      if (sum >= 3) return;
      set_count(longest, pieces_[as_index(longest)].count + 1);
    }
  }

  // Lines that begin and end in the same particles are one, so each but seams get a point between.
  void part_doubles() {
    std::vector<int> first(outlines_.size());  // break of each panel
    int breaks = 0;
    for (std::size_t p = 0; p < outlines_.size(); ++p)
      first[p] = breaks, breaks += static_cast<int>(around_[p].size());
    const auto ends = [&](int k) {
      const auto p = as_index(pieces_[as_index(k)].panel);
      const std::size_t at = place_[as_index(k)];
      return std::pair(first[p] + static_cast<int>(at),
                       first[p] + static_cast<int>((at + 1) % around_[p].size()));
    };
    Sets sets(as_index(breaks));
    for (int k = 0; k < static_cast<int>(pieces_.size()); ++k) {
      const auto [a, b] = ends(k);
      if (pieces_[as_index(k)].count == 0) sets.join(a, b);
      if (const int other = pieces_[as_index(k)].partner; other >= 0) {
        const auto [c, d] = ends(other);
        sets.join(a, pieces_[as_index(k)].reversed ? d : c);
        sets.join(b, pieces_[as_index(k)].reversed ? c : d);
      }
    }
    std::map<std::pair<int, int>, std::vector<int>> single;  // pieces of one line, by their ends
    for (int k = 0; k < static_cast<int>(pieces_.size()); ++k) {
      const Piece& piece = pieces_[as_index(k)];
      if (piece.partner >= 0 && piece.partner < k) continue;  // the same line
      const auto [a, b] = ends(k);
      const int from = sets.find(a), to = sets.find(b);
      if (from == to && piece.count > 0) set_count(k, std::max(piece.count, 3));
      if (piece.count == 1) single[std::minmax(from, to)].push_back(k);
    }
    for (const auto& [between, all] : single)
      if (all.size() > 1)
        for (const int k : all) set_count(k, 2);
  }

  void make_points() {
    borders_.panels.resize(outlines_.size());
    points_of_.resize(pieces_.size());
    for (std::size_t p = 0; p < outlines_.size(); ++p) {
      Border& border = borders_.panels[p];
      const auto& ring = around_[p];
      // begins where a line does
      std::size_t begin = 0;
      while (pieces_[as_index(ring[(begin + ring.size() - 1) % ring.size()])].count == 0) ++begin;
      for (std::size_t n = 0; n < ring.size(); ++n) {
        const std::size_t at = (begin + n) % ring.size();
        const Piece& piece = pieces_[as_index(ring[at])];
        const Piece& before = pieces_[as_index(ring[(at + ring.size() - 1) % ring.size()])];
        if (before.count > 0) border.lines.border.push_back(without_dust(joint(ring, at)));
        auto& own = points_of_[as_index(ring[at])];
        own.push_back(static_cast<int>(border.lines.border.size()) - 1);
        const Curve& line = curve(piece.panel, piece.edge);
        for (int i = 1; i < piece.count; ++i) {
          const double part = static_cast<double>(i) / piece.count;
          own.push_back(static_cast<int>(border.lines.border.size()));
          border.lines.border.push_back(
              without_dust(line.at(piece.from + part * (piece.to - piece.from))));
        }
      }
      const int count = static_cast<int>(border.lines.border.size());
      for (const int k : ring)
        if (pieces_[as_index(k)].count > 0)
          points_of_[as_index(k)].push_back((points_of_[as_index(k)].back() + 1) % count);
      for (const auto& of_edge : pieces_of_[p]) {
        std::vector<int>& line = border.edges.emplace_back();
        for (const int k : of_edge)
          for (const int i : points_of_[as_index(k)])
            if (line.empty() || line.back() != i) line.push_back(i);
      }
    }
    for (std::size_t k = 0; k < pieces_.size(); ++k) {
      const Piece& piece = pieces_[k];
      if (piece.partner < static_cast<int>(k)) continue;
      const Piece& other = pieces_[as_index(piece.partner)];
      std::vector<int> there = points_of_[as_index(piece.partner)];
      if (piece.reversed) std::reverse(there.begin(), there.end());
      for (std::size_t i = 0; i < there.size(); ++i)
        borders_.sewn.push_back({{piece.panel, points_of_[k][i]}, {other.panel, there[i]}});
      if (piece.fold != 0 && piece.count > 0)
        borders_.folds.push_back({piece.panel, points_of_[k], piece.fold});
    }
  }

  // The border's point where a crease ends.
  int point_at(std::size_t p, const OutlinePlace& place) const {
    int nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (const int k : pieces_of_[p][as_index(place.edge)]) {
      const Piece& piece = pieces_[as_index(k)];
      for (const auto& [share, point] : {std::pair(piece.from, points_of_[as_index(k)].front()),
                                         std::pair(piece.to, points_of_[as_index(k)].back())})
        if (std::abs(share - place.share) < least)
          least = std::abs(share - place.share), nearest = point;
    }
    return nearest;
  }

  void make_creases() {
    for (std::size_t p = 0; p < outlines_.size(); ++p) {
      const PatternPanel& panel = pattern_.panels[p];
      if (panel.creases.empty()) continue;
      PanelLines& lines = borders_.panels[p].lines;
      const auto mirror = is_square(panel.grain) ? find_mirror(lines.border) : std::nullopt;
      const auto axis = mirror ? std::optional(mirror->axis) : std::nullopt;
      for (std::size_t c = 0; c < panel.creases.size(); ++c) {
        const auto &first = crease_ends_[p][2 * c], &last = crease_ends_[p][2 * c + 1];
        std::vector<Vector2d> points = panel.creases[c].points;
        std::vector<int>& crease = lines.creases.emplace_back();
        if (first) {
          crease.push_back(point_at(p, *first));
          points.front() = lines.point(crease[0]);
        }
        const int end = last ? point_at(p, *last) : -1;
        if (last) points.back() = lines.point(end);
        points = follow(points, edge_, axis);
        const std::size_t count = points.size() - (last ? 1 : 0);
        for (std::size_t i = crease.size(); i < count; ++i) {
          crease.push_back(static_cast<int>(lines.border.size() + lines.inside.size()));
          lines.inside.push_back(without_dust(points[i]));
        }
        if (last) crease.push_back(end);
      }
    }
  }

  // Where the piece begins, and those before it that are points: in the mean of their ends.
  Vector2d joint(const std::vector<int>& ring, std::size_t at) const {
    const auto start = [&](std::size_t i) {
      const Piece& piece = pieces_[as_index(ring[i % ring.size()])];
      return curve(piece.panel, piece.edge).at(piece.from);
    };
    // what follows, too, where it is one
    Vector2d sum = start(at);
    int count = 1;
    for (std::size_t i = at; pieces_[as_index(ring[i % ring.size()])].count == 0; ++i, ++count)
      sum += start(i + 1);
    return sum / count;
  }

  // Of panels that hang together the first lies as it is.
  void turn_panels() {
    std::vector<int> side(outlines_.size());  // 1 or -1; 0: not known
    for (std::size_t p = 0; p < side.size(); ++p) {
      if (side[p] == 0) side[p] = 1;
      for (bool more = true; more;) {
        more = false;
        for (const Link& link : links_) {
          int &a = side[as_index(link.first)], &b = side[as_index(link.second)];
          const int turn = link.turns ? -1 : 1;
          if ((a == 0) == (b == 0)) continue;
          (a == 0 ? a : b) = turn * (a == 0 ? b : a);
          more = true;
        }
      }
    }
    std::set<std::string> told;
    for (const Link& link : links_)
      if (side[as_index(link.first)] * (link.turns ? -1 : 1) != side[as_index(link.second)] &&
          told.insert(link.field).second)
        borders_.problems.push_back(
            {link.field + ".same_direction",
             join("panels ", pattern_.panels[as_index(link.first)].name, " and ",
                  pattern_.panels[as_index(link.second)].name, " would be sewn ",
                  link.turns ? "face to back" : "face to face",
                  ", but other seams sew them the other way: the sheet would have one side "
                  "alone")});
    for (std::size_t p = 0; p < side.size(); ++p) {
      borders_.turned.push_back(side[p] < 0);
      if (side[p] < 0)
        note("PANEL_TURNED", join(field_, ".panels[", p, "]"),
             join("panel ", pattern_.panels[p].name,
                  " is turned over by its seams; its flat shape is mirrored"));
    }
  }

  void note_edges() {
    for (std::size_t p = 0; p < outlines_.size(); ++p)
      for (std::size_t e = 0; e < outlines_[p].size(); ++e) {
        const double length = outlines_[p][e].length();
        if (length >= edge_ / 2) continue;
        const bool gone = borders_.panels[p].edges[e].size() == 1;
        note("EDGE_SHORT", join(field_, ".panels[", p, "].edges[", e, "]"),
             join(name(static_cast<int>(p), static_cast<int>(e)), " has ", length * 1e3,
                  " mm, less than half of edge_m: ",
                  gone ? "it is one point" : "triangles there are small"));
      }
  }

  struct Link {
    int first, second;
    bool turns;
    std::string field;
  };

  const Pattern& pattern_;
  double edge_;
  std::string field_;
  std::map<std::string, int> panel_numbers_;
  std::vector<std::vector<Curve>> outlines_;
  std::vector<std::vector<std::vector<double>>> breaks_;  // of each edge within it, by shares
  std::vector<std::vector<bool>> middles_;                // edges that are broken in the middle
  std::vector<std::vector<std::optional<OutlinePlace>>> crease_ends_;  // two of each crease
  std::vector<Piece> pieces_;
  std::vector<std::vector<std::vector<int>>> pieces_of_;  // of each edge of each panel
  std::vector<std::vector<int>> around_;                  // of each panel
  std::vector<std::vector<int>> points_of_;               // of each piece, from start to end
  std::vector<std::size_t> place_;                        // of each piece in around_
  std::vector<Link> links_;
  Borders borders_;
};

}  // namespace

Borders cut_borders(const Pattern& pattern, double edge, const std::string& field) {
  return Cutter(pattern, edge, field).run();
}

}  // namespace weft
