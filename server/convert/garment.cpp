#include "server/convert/garment.h"

#include <algorithm>
#include <iterator>

#include "core/model/text.h"
#include "core/pattern/held.h"
#include "server/convert/mesh.h"

namespace weft {
namespace {

constexpr double kDefaultEdge = 0.01;  // m

// Reads a pattern, and collects what cannot be said in core's words.
class PatternReader {
 public:
  Pattern read(const v1::Pattern& from) {
    Pattern pattern;
    for (int p = 0; p < from.panels_size(); ++p)
      pattern.panels.push_back(panel(from.panels(p), join("pattern.panels[", p, "]")));
    for (const v1::PatternSeam& seam : from.seams())
      pattern.seams.push_back({runs(seam.first_side()), runs(seam.second_side()),
                               seam.same_direction(), seam.fold_rad()});
    return pattern;
  }

  std::vector<Problem> take_problems() { return std::move(problems_); }

 private:
  PatternPanel panel(const v1::PatternPanel& from, const std::string& at) {
    PatternPanel panel;
    panel.name = from.name();
    panel.grain = from.grain_rad();
    for (int e = 0; e < from.edges_size(); ++e)
      panel.edges.push_back(edge(from.edges(e), join(at, ".edges[", e, "]")));
    for (int c = 0; c < from.creases_size(); ++c)
      panel.creases.push_back({points(from.creases(c).points_m(), join(at, ".creases[", c, "]")),
                               from.creases(c).fold_rad(), from.creases(c).start_rad()});
    const v1::Vector3& origin = from.placement().origin_m();
    panel.origin = {origin.x(), origin.y(), origin.z()};
    if (from.placement().has_rotation()) {
      const v1::Rotation& turn = from.placement().rotation();
      panel.rotation = {turn.w(), turn.x(), turn.y(), turn.z()};
    }
    if (from.has_textile()) check_textile(from.textile(), at + ".textile");
    return panel;
  }

  PatternEdge edge(const v1::PatternEdge& from, const std::string& at) {
    return {.points = points(from.points_m(), at), .arc = from.arc(), .label = from.label()};
  }

  std::vector<Vector2d> points(const google::protobuf::RepeatedField<double>& numbers,
                               const std::string& at) {
    if (numbers.size() % 2 != 0)
      problems_.push_back(
          {at + ".points_m", join("has ", numbers.size(), " numbers; each point has 2")});
    std::vector<Vector2d> points;
    for (int i = 0; i + 1 < numbers.size(); i += 2) points.emplace_back(numbers[i], numbers[i + 1]);
    return points;
  }

  static std::vector<EdgeRun> runs(
      const google::protobuf::RepeatedPtrField<v1::EdgeRun>& messages) {
    std::vector<EdgeRun> runs;
    for (const v1::EdgeRun& run : messages)
      runs.push_back({run.panel(), run.edge(), run.has_begin() ? run.begin() : 0,
                      run.has_end() ? run.end() : 1});
    return runs;
  }

  void check_textile(const v1::Textile& textile, const std::string& at) {
    if (textile.has_raw())
      return problems_.push_back(
          {at + ".raw", "is for grids; of triangles give a preset or measured"});
    auto read = to_textile(textile, at);
    if (auto* found = std::get_if<std::vector<Problem>>(&read))
      std::move(found->begin(), found->end(), std::back_inserter(problems_));
  }

  std::vector<Problem> problems_;
};

v1::BuildGarmentResponse to_proto(Garment garment, const v1::Pattern& pattern, double edge) {
  v1::BuildGarmentResponse to;
  to.set_least_height(garment.least_height / edge);
  for (const Warning& note : garment.notes) {
    v1::Warning* added = to.add_notes();
    added->set_code(note.code);
    added->set_field(note.field);
    added->set_message(note.message);
  }
  for (const GarmentEdge& each : garment.edges) {
    v1::BuiltEdge* added = to.add_edges();
    const v1::PatternPanel& panel = pattern.panels(each.panel);
    added->set_panel(panel.name());
    added->set_edge(each.edge);
    added->set_label(panel.edges(each.edge).label());
    added->mutable_particles()->Assign(each.particles.begin(), each.particles.end());
    added->set_length_m(each.length);
  }
  for (const GarmentCrease& each : garment.creases) {
    v1::BuiltCrease* added = to.add_creases();
    added->set_panel(pattern.panels(each.panel).name());
    added->set_crease(each.crease);
    added->mutable_particles()->Assign(each.particles.begin(), each.particles.end());
  }
  v1::MeshData* mesh = to.mutable_sheet()->mutable_triangles()->mutable_data();
  *mesh = to_proto(complete(std::move(garment.mesh)));
  for (int p = 0; p < pattern.panels_size(); ++p)
    if (pattern.panels(p).has_textile())
      *mesh->mutable_panels(p)->mutable_textile() = pattern.panels(p).textile();
  return to;
}

}  // namespace

Converted<v1::BuildGarmentResponse> build_garment(const v1::BuildGarmentRequest& request) {
  PatternReader reader;
  const Pattern pattern = reader.read(request.pattern());
  const double edge = request.has_edge_m() ? request.edge_m() : kDefaultEdge;
  std::vector<Problem> problems = reader.take_problems();
  if (!problems.empty()) {
    auto more = find_problems(pattern, edge, "pattern", "edge_m");
    std::move(more.begin(), more.end(), std::back_inserter(problems));
    return problems;
  }
  auto built = build_garment(pattern, edge, "pattern", "edge_m");
  if (auto* found = std::get_if<std::vector<Problem>>(&built)) return std::move(*found);
  Garment& garment = std::get<Garment>(built);
  const std::vector<int> held = held_particles(pattern, garment);
  v1::BuildGarmentResponse response = to_proto(std::move(garment), request.pattern(), edge);
  v1::Dressing* dressing = response.mutable_dressing();
  if (!held.empty()) dressing->add_holds()->mutable_particles()->Assign(held.begin(), held.end());
  return response;
}

}  // namespace weft
