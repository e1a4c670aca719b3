#include "client/garments/draft.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace weft::client {
namespace {

// To a hundredth of a millimetre, which people can read.
double rounded(double value) { return std::round(value * 1e5) / 1e5 + 0.0; }

Vector2d bezier(std::vector<Vector2d> points, double t) {
  for (std::size_t left = points.size(); left > 1; --left)
    for (std::size_t i = 0; i + 1 < left; ++i) points[i] = (1 - t) * points[i] + t * points[i + 1];
  return points[0];
}

Vector2d image(const Vector2d& point) { return {-point.x(), point.y()}; }

}  // namespace

Outline& Outline::curve(const char* label, std::initializer_list<Vector2d> points) {
  edges_.push_back({label, points});
  return *this;
}

Outline Outline::mirrored() const {
  Outline result(image(start_));
  for (auto edge = edges_.rbegin(); edge != edges_.rend(); ++edge) {
    Edge reversed{edge->label, {}};
    for (auto point = edge->points.rbegin() + 1; point != edge->points.rend(); ++point)
      reversed.points.push_back(image(*point));
    const bool first = edge + 1 == edges_.rend();
    reversed.points.push_back(image(first ? start_ : (edge + 1)->points.back()));
    result.edges_.push_back(std::move(reversed));
  }
  return result;
}

double Outline::length(const std::string& label) const {
  constexpr int kParts = 200;
  Vector2d start = start_;
  for (const Edge& edge : edges_) {
    if (edge.label == label) {
      std::vector<Vector2d> points{start};
      points.insert(points.end(), edge.points.begin(), edge.points.end());
      double length = 0;
      for (int i = 0; i < kParts; ++i)
        length += (bezier(points, static_cast<double>(i + 1) / kParts) -
                   bezier(points, static_cast<double>(i) / kParts))
                      .norm();
      return length;
    }
    start = edge.points.back();
  }
  return 0;
}

double Outline::least_v() const {
  double least = start_.y();
  for (const Edge& edge : edges_) least = std::min(least, edge.points.back().y());
  return least;
}

double Outline::most_v() const {
  double most = start_.y();
  for (const Edge& edge : edges_) most = std::max(most, edge.points.back().y());
  return most;
}

double Outline::most_u() const {
  double most = std::abs(start_.x());
  for (const Edge& edge : edges_) most = std::max(most, std::abs(edge.points.back().x()));
  return most;
}

PanelPlace behind(const PanelPlace& place, double z) {
  PanelPlace result = place;
  result.origin.z() = z;
  result.rotation = place.rotation * Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitY());
  return result;
}

PanelPlace mirrored(const PanelPlace& place) {
  const Quaterniond& turn = place.rotation;
  return {{-place.origin.x(), place.origin.y(), place.origin.z()},
          {turn.w(), turn.x(), -turn.y(), -turn.z()}};
}

void Draft::add(const std::string& name, const Outline& outline, const PanelPlace& place,
                double grain_rad) {
  v1::PatternPanel* panel = pattern_.add_panels();
  panel->set_name(name);
  for (const Outline::Edge& edge : outline.edges_) {
    v1::PatternEdge* added = panel->add_edges();
    for (const Vector2d& point : edge.points)
      for (const double value : point) added->add_points_m(rounded(value));
    added->set_label(edge.label);
  }
  panel->set_grain_rad(grain_rad);
  v1::Vector3* origin = panel->mutable_placement()->mutable_origin_m();
  origin->set_x(rounded(place.origin.x()));
  origin->set_y(rounded(place.origin.y()));
  origin->set_z(rounded(place.origin.z()));
  if (place.rotation.isApprox(Quaterniond::Identity())) return;
  v1::Rotation* rotation = panel->mutable_placement()->mutable_rotation();
  rotation->set_w(rounded(place.rotation.w()));
  rotation->set_x(rounded(place.rotation.x()));
  rotation->set_y(rounded(place.rotation.y()));
  rotation->set_z(rounded(place.rotation.z()));
}

v1::PatternPanel& Draft::panel(const std::string& name) {
  auto& panels = *pattern_.mutable_panels();
  const auto panel = std::ranges::find(panels, name, &v1::PatternPanel::name);
  if (panel == panels.end()) throw std::logic_error("no panel " + name);
  return *panel;
}

void Draft::crease(const std::string& panel, std::initializer_list<Vector2d> points,
                   double fold_rad, double start_rad) {
  v1::PatternCrease* crease = this->panel(panel).add_creases();
  for (const Vector2d& point : points)
    for (const double value : point) crease->add_points_m(rounded(value));
  crease->set_fold_rad(fold_rad);
  crease->set_start_rad(start_rad);
}

void Draft::add_runs(const Side& side, google::protobuf::RepeatedPtrField<v1::EdgeRun>& runs) {
  const auto& edges = panel(side.panel).edges();
  for (const std::string& label : side.labels) {
    const auto edge = std::ranges::find(edges, label, &v1::PatternEdge::label);
    if (edge == edges.end()) throw std::logic_error("no edge " + label);
    v1::EdgeRun* run = runs.Add();
    run->set_panel(side.panel);
    run->set_edge(static_cast<int>(edge - edges.begin()));
  }
}

void Draft::sew(const Side& first, const Side& second, double fold_rad) {
  v1::PatternSeam* seam = pattern_.add_seams();
  add_runs(first, *seam->mutable_first_side());
  add_runs(second, *seam->mutable_second_side());
  seam->set_fold_rad(fold_rad);
}

}  // namespace weft::client
