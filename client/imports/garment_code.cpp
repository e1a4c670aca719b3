#include "client/imports/garment_code.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "client/imports/imported_mesh.h"
#include "client/output/text.h"

namespace weft::client {
namespace {

using Eigen::Quaterniond;

constexpr std::size_t kMostPieces = 256, kMostVertices = 4096;

Vector2d left_of(const Vector2d& along) { return {-along.y(), along.x()}; }

// An edge: control points, or the middle of an arc, and its end.
struct Line {
  std::vector<Vector2d> points;
  bool arc = false;
};

class PatternReading {
 public:
  PatternReading(const std::string& path, const Json& json) : path_(path), json_(json) {}

  ImportedPattern run() {
    read_properties();
    const Json& pattern = json_.at("pattern");
    const Json& panels = pattern.at("panels");
    if (panels.empty() || panels.size() > kMostPieces)
      fail("pattern.panels", fmt::format("has {} panels, not 1 to {}", panels.size(), kMostPieces));
    for (const auto& [name, panel] : panels.items()) read_panel(name, panel);
    if (pattern.contains("stitches")) read_stitches(pattern.at("stitches"));
    if (turned_ > 0)
      result_.notes.push_back(
          fmt::format("{} drawn from the back: mirrored, and placed as before",
                      turned_ == 1 ? "1 panel is" : fmt::format("{} panels are", turned_)));
    return std::move(result_);
  }

 private:
  [[noreturn]] void fail(const std::string& place, const std::string& why) const {
    throw malformed(path_, place + " " + why);
  }

  const Json& member(const Json& of, const char* name, const std::string& place) const {
    if (!of.is_object() || !of.contains(name)) fail(place, fmt::format("has no \"{}\"", name));
    return of.at(name);
  }
  double number(const Json& value, const std::string& place) const {
    if (!value.is_number() || !std::isfinite(value.get<double>()))
      fail(place, fmt::format("is {}, not a finite number", shown(value)));
    return value.get<double>();
  }
  int index(const Json& value, std::size_t count, const std::string& place) const {
    if (!value.is_number_integer() || value.get<double>() < 0 ||
        value.get<double>() >= static_cast<double>(count))
      fail(place, fmt::format("is {}, not one of 0 to {}", shown(value),
                              static_cast<std::int64_t>(count) - 1));
    return value.get<int>();
  }
  template <int N>
  Eigen::Matrix<double, N, 1> vector(const Json& value, const std::string& place) const {
    if (!value.is_array() || value.size() != N)
      fail(place, fmt::format("is {}, not {} numbers", shown(value), N));
    Eigen::Matrix<double, N, 1> result;
    for (std::size_t i = 0; i < N; ++i)
      result[static_cast<Eigen::Index>(i)] = number(value[i], place);
    return result;
  }
  static std::string shown(const Json& value) {
    constexpr std::size_t kMost = 40;
    const std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
    return text.size() <= kMost ? text : text.substr(0, kMost) + "...";
  }

  void read_properties() {
    const Json none = Json::object();
    const Json& properties = json_.contains("properties") ? json_.at("properties") : none;
    if (!properties.is_object()) fail("properties", "is no object");
    if (properties.contains("units_in_meter")) {
      const double units = number(properties.at("units_in_meter"), "properties.units_in_meter");
      if (!(units >= 1e-3 && units <= 1e6))
        fail("properties.units_in_meter", fmt::format("{} is not within 0.001 to 1e6", units));
      unit_ = 1 / units;
    } else {
      result_.notes.emplace_back("it has no properties.units_in_meter: taken as cm");
    }
    const auto word = properties.find("curvature_coords");
    absolute_ = word != properties.end() && *word == "absolute";
    const auto centred = properties.find("normalize_panel_translation");
    centred_ = centred != properties.end() && centred->is_boolean() && centred->get<bool>();
  }

  void read_panel(const std::string& given, const Json& panel) {
    const std::string place = "panel " + plain_name(given);
    const Json& listed = member(panel, "vertices", place);
    if (!listed.is_array() || listed.size() < 2 || listed.size() > kMostVertices)
      fail(place, fmt::format("has {} vertices, not 2 to {}", listed.size(), kMostVertices));
    std::vector<Vector2d> vertices;
    Vector2d middle = Vector2d::Zero();
    for (std::size_t i = 0; i < listed.size(); ++i) {
      vertices.emplace_back(unit_ * vector<2>(listed[i], fmt::format("{}, vertex {}", place, i)));
      middle += vertices.back() / static_cast<double>(listed.size());
    }
    if (!centred_) middle.setZero();
    for (Vector2d& each : vertices) each -= middle;

    std::vector<Line> lines = read_edges(member(panel, "edges", place), vertices, place);
    v1::PatternPanel* to = result_.pattern.add_panels();
    to->set_name(free_name(given));
    names_[given] = {to->name(), lines.size()};
    // outlines run anticlockwise seen from outside
    const bool turned = area_of(lines) < 0;
    turned_ += turned ? 1 : 0;
    const Json& edges = panel.at("edges");
    for (std::size_t e = 0; e < lines.size(); ++e) {
      v1::PatternEdge* edge = to->add_edges();
      for (const Vector2d& point : lines[e].points) {
        edge->add_points_m(rounded(turned ? -point.x() : point.x()));
        edge->add_points_m(rounded(point.y()));
      }
      edge->set_arc(lines[e].arc);
      if (edges[e].contains("label")) read_label(edges[e].at("label"), *edge);
    }
    place_panel(panel, place, middle, turned, *to->mutable_placement());
  }

  // What GarmentCode holds up it calls lower_interface.
  static void read_label(const Json& given, v1::PatternEdge& edge) {
    if (!given.is_string()) return;
    const std::string label = given.get<std::string>();
    if (!label.empty()) edge.set_label(label == "lower_interface" ? "waist" : plain_name(label));
  }

  std::string free_name(const std::string& given) {
    const std::string plain = plain_name(given).substr(0, 56);
    std::string name = plain;
    for (int n = 2; !taken_.insert(name).second; ++n) name = fmt::format("{}-{}", plain, n);
    return name;
  }

  // To a tenth of a micrometre, which people can read.
  static double rounded(double value) { return std::round(value * 1e7) / 1e7 + 0.0; }

  std::vector<Line> read_edges(const Json& edges, const std::vector<Vector2d>& vertices,
                               const std::string& panel) const {
    if (!edges.is_array() || edges.size() < 2) fail(panel, "has no edges, or a single one");
    std::vector<Line> lines;
    std::vector<std::pair<int, int>> ends;
    for (std::size_t e = 0; e < edges.size(); ++e) {
      const std::string place = fmt::format("{}, edge {}", panel, e);
      const Json& endpoints = member(edges[e], "endpoints", place);
      if (!endpoints.is_array() || endpoints.size() != 2)
        fail(place, fmt::format("has the endpoints {}, not 2 vertices", shown(endpoints)));
      const int from = index(endpoints[0], vertices.size(), place + ", endpoint 0"),
                to = index(endpoints[1], vertices.size(), place + ", endpoint 1");
      if (!ends.empty() && ends.back().second != from)
        fail(place, fmt::format("begins at vertex {}, where edge {} ends at vertex {}", from, e - 1,
                                ends.back().second));
      ends.emplace_back(from, to);
      const Vector2d &a = vertices[as_index(from)], &b = vertices[as_index(to)];
      lines.push_back(edges[e].contains("curvature") ? curve(edges[e].at("curvature"), a, b, place)
                                                     : Line{{b}});
    }
    if (ends.back().second != ends.front().first)
      fail(fmt::format("{}, edge {}", panel, edges.size() - 1),
           fmt::format("ends at vertex {}, and edge 0 begins at vertex {}", ends.back().second,
                       ends.front().first));
    return lines;
  }

  Line curve(const Json& given, const Vector2d& a, const Vector2d& b,
             const std::string& place) const {
    const auto control = [&](const Json& point, const char* which) {
      const Vector2d at = vector<2>(point, fmt::format("{}, {}", place, which));
      if (absolute_) return Vector2d(unit_ * at);
      return Vector2d(a + at.x() * (b - a) + at.y() * left_of(b - a));
    };
    if (given.is_array()) return {{control(given, "curvature"), b}};
    const Json& type = member(given, "type", place + ", curvature");
    const Json& params = member(given, "params", place + ", curvature");
    const std::size_t wanted = type == "quadratic" ? 1 : type == "cubic" ? 2 : 3;
    if (type != "quadratic" && type != "cubic" && type != "circle")
      fail(place, fmt::format("has a curvature of type {}, which is none of quadratic, cubic and "
                              "circle",
                              shown(type)));
    if (!params.is_array() || params.size() != wanted)
      fail(place, fmt::format("has the params {}, not {}", shown(params), wanted));
    if (type == "circle") return arc(params, a, b, place);
    Line line;
    for (const Json& point : params) line.points.push_back(control(point, "params"));
    line.points.push_back(b);
    return line;
  }

  // By radius, whether it is the larger arc, and whether it lies to the right.
  Line arc(const Json& params, const Vector2d& a, const Vector2d& b,
           const std::string& place) const {
    const double radius = unit_ * number(params[0], place + ", radius");
    const bool large = number(params[1], place + ", large arc") != 0,
               right = number(params[2], place + ", right") != 0;
    const double half = (b - a).norm() / 2;
    constexpr double kRounding = 1e-6;
    if (!(radius >= half * (1 - kRounding)) || half == 0)
      fail(place, fmt::format("has an arc with a radius of {:.4g} m between ends {:.4g} m apart",
                              radius, 2 * half));
    const double root = std::sqrt(std::max(0.0, radius * radius - half * half));
    const double rise = large ? radius + root : radius - root;
    const Vector2d aside = left_of(b - a) / (2 * half) * (right ? -rise : rise);
    return {{(a + b) / 2 + aside, b}, true};
  }

  // About twice the area within, below 0 where lines run clockwise.
  static double area_of(const std::vector<Line>& lines) {
    double twice = 0;
    Vector2d at = lines.back().points.back();
    for (const Line& line : lines) {
      // a Bezier curve lies within its control points; an arc is followed in its middle
      for (const Vector2d& next : line.points) {
        twice += at.x() * next.y() - at.y() * next.x();
        at = next;
      }
    }
    return twice;
  }

  // Turned about x, y and z, in this order.
  void place_panel(const Json& panel, const std::string& place, const Vector2d& middle, bool turned,
                   v1::Placement& to) const {
    Vector3d origin(middle.x(), middle.y(), 0), angles = Vector3d::Zero();
    if (panel.contains("translation"))
      origin += unit_ * vector<3>(panel.at("translation"), place + ", translation");
    if (panel.contains("rotation"))
      angles = vector<3>(panel.at("rotation"), place + ", rotation") * std::numbers::pi / 180;
    Quaterniond rotation = Eigen::AngleAxisd(angles.z(), Vector3d::UnitZ()) *
                           Eigen::AngleAxisd(angles.y(), Vector3d::UnitY()) *
                           Eigen::AngleAxisd(angles.x(), Vector3d::UnitX());
    // what was mirrored in the panel is turned about v
    if (turned) rotation = rotation * Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitY());
    to.mutable_origin_m()->set_x(rounded(origin.x()));
    to.mutable_origin_m()->set_y(rounded(origin.y()));
    to.mutable_origin_m()->set_z(rounded(origin.z()));
    to.mutable_rotation()->set_w(rounded(rotation.w()));
    to.mutable_rotation()->set_x(rounded(rotation.x()));
    to.mutable_rotation()->set_y(rounded(rotation.y()));
    to.mutable_rotation()->set_z(rounded(rotation.z()));
  }

  void read_stitches(const Json& stitches) {
    if (!stitches.is_array()) fail("pattern.stitches", "is no list");
    for (std::size_t s = 0; s < stitches.size(); ++s) {
      const std::string place = fmt::format("stitch {}", s);
      const Json& stitch = stitches[s];
      if (!stitch.is_array() || stitch.size() < 2 || stitch.size() > 3)
        fail(place, fmt::format("is {}, not two edges", shown(stitch)));
      v1::PatternSeam* seam = result_.pattern.add_seams();
      read_side(stitch[0], place, *seam->add_first_side());
      read_side(stitch[1], place, *seam->add_second_side());
      if (stitch.size() < 3) continue;
      if (stitch[2] != "right_wrong")
        fail(place, fmt::format("has {} as its third item, not \"right_wrong\"", shown(stitch[2])));
      seam->set_same_direction(true);
    }
  }

  void read_side(const Json& side, const std::string& place, v1::EdgeRun& run) const {
    const Json& panel = member(side, "panel", place);
    const auto found = panel.is_string() ? names_.find(panel.get<std::string>()) : names_.end();
    if (found == names_.end())
      fail(place, fmt::format("names a panel {} that is none", shown(panel)));
    run.set_panel(found->second.name);
    run.set_edge(index(member(side, "edge", place), found->second.edges,
                       fmt::format("{}, edge of panel {}", place, found->second.name)));
  }

  struct Named {
    std::string name;
    std::size_t edges;
  };

  const std::string& path_;
  const Json& json_;
  double unit_ = 0.01;  // m
  bool absolute_ = false, centred_ = false;
  std::map<std::string, Named> names_;  // of panels, by what they are called in the file
  std::set<std::string> taken_;
  int turned_ = 0;
  ImportedPattern result_;
};

}  // namespace

bool is_garment_code(const Json& json) {
  return json.is_object() && json.contains("pattern") && json.at("pattern").is_object() &&
         json.at("pattern").contains("panels") && json.at("pattern").at("panels").is_object();
}

ImportedPattern read_garment_code(const std::string& path, const Json& json) {
  return PatternReading(path, json).run();
}

}  // namespace weft::client
