#include "client/scene_action.h"

#include <fmt/format.h>

#include <charconv>

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

int particle_of(const SceneAction& action, const v1::Scene& scene) {
  const v1::Grid& grid = named(scene.sheets(), action.name, "sheet").grid();
  const bool there = action.row >= 0 && action.row < grid.rows() && action.column >= 0 &&
                     action.column < grid.columns();
  if (there) return action.row * grid.columns() + action.column;
  throw usage_problem(fmt::format("row {}, column {} is not on a sheet of {} x {} particles",
                                  action.row, action.column, grid.rows(), grid.columns()));
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

v1::Action to_action(const SceneAction& action, const v1::Scene& scene) {
  v1::Action to;
  if (action.kind == "move_collider") {
    v1::MoveCollider* move = to.mutable_move_collider();
    move->set_collider(named(scene.colliders(), action.name, "collider").name());
    set_target(action, move->mutable_offset_m(), move);
    return to;
  }
  const auto* field = v1::Action::descriptor()->FindFieldByName(action.kind);
  Message* part = to.GetReflection()->MutableMessage(&to, field);
  const auto set = [&](const char* name, const auto& value, auto setter) {
    (part->GetReflection()->*setter)(part, part->GetDescriptor()->FindFieldByName(name), value);
  };
  set("sheet", action.name, &google::protobuf::Reflection::SetString);
  set("particle", particle_of(action, scene), &google::protobuf::Reflection::SetInt32);
  if (to.has_drag()) set_target(action, to.mutable_drag()->mutable_target_m(), to.mutable_drag());
  return to;
}

void read_particle(const std::string& text, SceneAction& action) {
  const std::size_t colon = text.rfind(':');
  const std::string place = colon == std::string::npos ? text : text.substr(colon + 1);
  if (colon != std::string::npos) action.name = text.substr(0, colon);
  const char* const end = place.data() + place.size();
  const auto row = std::from_chars(place.data(), end, action.row);
  if (row.ec == std::errc() && row.ptr != end && *row.ptr == ',') {
    const auto column = std::from_chars(row.ptr + 1, end, action.column);
    if (column.ec == std::errc() && column.ptr == end) return;
  }
  throw usage_problem(fmt::format("{}: write ROW,COLUMN or SHEET:ROW,COLUMN", text));
}

}  // namespace weft::client
