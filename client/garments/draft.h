#pragma once

#include <Eigen/Geometry>
#include <initializer_list>
#include <string>
#include <vector>

#include "weft/v1/garment.pb.h"

namespace weft::client {

using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

// An outline drawn edge by edge, anticlockwise, m.
class Outline {
 public:
  explicit Outline(Vector2d start) : start_(start) {}

  Outline& line(const char* label, Vector2d end) { return curve(label, {end}); }
  // Control points, then the end.
  Outline& curve(const char* label, std::initializer_list<Vector2d> points);

  // As in a mirror at u = 0, drawn anticlockwise again. Edges keep their labels.
  Outline mirrored() const;
  // Of the edge with that label; 0 where there is none. m
  double length(const std::string& label) const;
  double least_v() const;
  double most_v() const;
  double most_u() const;  // of either side

 private:
  friend class Draft;
  struct Edge {
    std::string label;
    std::vector<Vector2d> points;
  };
  Vector2d start_;
  std::vector<Edge> edges_;
};

// Where a panel is before it is sewn.
struct PanelPlace {
  Vector3d origin = Vector3d::Zero();
  Quaterniond rotation = Quaterniond::Identity();
};

// The place of a panel drawn as seen from behind, mirrored: behind the body at that depth.
PanelPlace behind(const PanelPlace& place, double z);
// Of a mirrored panel, on the other side of the body.
PanelPlace mirrored(const PanelPlace& place);

// A pattern in the making; edges are named by their labels.
class Draft {
 public:
  void add(const std::string& name, const Outline& outline, const PanelPlace& place,
           double grain_rad = 0);
  // Along a line of a panel, pressed to an angle, at which it may start.
  void crease(const std::string& panel, std::initializer_list<Vector2d> points, double fold_rad,
              double start_rad);

  struct Side {
    std::string panel;
    std::vector<std::string> labels;  // along the seam
  };
  // Sides that run against each other, as panels do that lie side by side, pressed to an angle.
  void sew(const Side& first, const Side& second, double fold_rad = 0);

  v1::Pattern take() { return std::move(pattern_); }

 private:
  v1::PatternPanel& panel(const std::string& name);
  void add_runs(const Side& side, google::protobuf::RepeatedPtrField<v1::EdgeRun>& runs);

  v1::Pattern pattern_;
};

}  // namespace weft::client
