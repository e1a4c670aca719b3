#include "client/scene_action.h"

#include <fmt/format.h>

#include <charconv>
#include <utility>

#include "client/problem.h"

namespace weft::client {
namespace {

using google::protobuf::Message;

// The one of that name, or the only one.
template <class Named>
const Named& named(const google::protobuf::RepeatedPtrField<Named>& all, const std::string& name,
                   const char* what) {
  std::string names;
  for (const Named& each : all) {
    if (each.name() == name || (name.empty() && all.size() == 1)) return each;
    names += (names.empty() ? "" : ", ") + each.name();
  }
  if (all.empty()) throw usage_problem(fmt::format("the scene has no {}", what));
  throw usage_problem(name.empty()
                          ? fmt::format("which {} is meant? there are {}", what, names)
                          : fmt::format("there is no {} \"{}\"; there are {}", what, name, names));
}

void set_target(const SceneAction& action, v1::Vector3* target, auto* led) {
  if (action.target_m) {
    target->set_x((*action.target_m)[0]);
    target->set_y((*action.target_m)[1]);
    target->set_z((*action.target_m)[2]);
  }
  if (action.duration_s) led->set_duration_s(*action.duration_s);
}

}  // namespace

int particle_number(const ParticlePlace& place, const v1::Sheet& sheet) {
  const v1::Grid& grid = sheet.grid();
  if (!place.number && sheet.has_grid()) {
    const bool there = place.row >= 0 && place.row < grid.rows() && place.column >= 0 &&
                       place.column < grid.columns();
    if (there) return place.row * grid.columns() + place.column;
    throw usage_problem(fmt::format("row {}, column {} is not on a sheet of {} x {} particles",
                                    place.row, place.column, grid.rows(), grid.columns()));
  }
  if (!place.number)
    throw usage_problem(fmt::format(
        "the sheet is of triangles, which have no rows and columns: give a particle's number, not "
        "{},{}",
        place.row, place.column));
  const v1::MeshData& data = sheet.triangles().data();
  const int particles = sheet.has_grid() ? grid.rows() * grid.columns()
                                         : static_cast<int>(data.positions_m().empty()
                                                                ? data.flat_m().size() / 8
                                                                : data.positions_m().size() / 12);
  if (*place.number >= 0 && (particles == 0 || *place.number < particles)) return *place.number;
  throw usage_problem(
      fmt::format("particle {} is not on a sheet of {} particles", *place.number, particles));
}

v1::Action to_action(const SceneAction& action, const v1::Scene& scene) {
  v1::Action to;
  if (action.kind == "relax") {
    to.mutable_relax();
    return to;
  }
  if (action.kind == "move_collider") {
    v1::MoveCollider* move = to.mutable_move_collider();
    move->set_collider(named(scene.colliders(), action.collider, "collider").name());
    set_target(action, move->mutable_offset_m(), move);
    return to;
  }
  if (action.kind == "pose_collider") {
    v1::PoseCollider* pose = to.mutable_pose_collider();
    pose->set_collider(named(scene.colliders(), action.collider, "collider").name());
    pose->set_pose_time_s(action.pose_time_s);
    if (action.speed_m_per_s) pose->set_speed_m_per_s(*action.speed_m_per_s);
    return to;
  }
  const auto* field = v1::Action::descriptor()->FindFieldByName(action.kind);
  Message* part = to.GetReflection()->MutableMessage(&to, field);
  const auto set = [&](const char* name, const auto& value, auto setter) {
    (part->GetReflection()->*setter)(part, part->GetDescriptor()->FindFieldByName(name), value);
  };
  const ParticlePlace& particle = action.particle;
  set("sheet", particle.sheet, &google::protobuf::Reflection::SetString);
  set("particle", particle_number(particle, named(scene.sheets(), particle.sheet, "sheet")),
      &google::protobuf::Reflection::SetInt32);
  if (to.has_drag()) set_target(action, to.mutable_drag()->mutable_target_m(), to.mutable_drag());
  return to;
}

ParticlePlace read_particle(const std::string& text) {
  ParticlePlace place;
  const std::size_t colon = text.rfind(':');
  const std::string where = colon == std::string::npos ? text : text.substr(colon + 1);
  if (colon != std::string::npos) place.sheet = text.substr(0, colon);
  const char* const end = where.data() + where.size();
  const auto first = std::from_chars(where.data(), end, place.row);
  if (first.ec == std::errc() && first.ptr == end) {
    place.number = std::exchange(place.row, 0);
    return place;
  }
  if (first.ec == std::errc() && *first.ptr == ',') {
    const auto column = std::from_chars(first.ptr + 1, end, place.column);
    if (column.ec == std::errc() && column.ptr == end) return place;
  }
  throw usage_problem(
      fmt::format("{}: write ROW,COLUMN or NUMBER, after SHEET: where there are several", text));
}

}  // namespace weft::client
