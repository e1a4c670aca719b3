#pragma once

#include <array>
#include <optional>
#include <string>

#include "weft/v1/session.pb.h"

namespace weft::client {

// What is done to a particle or a collider, as people say it.
struct SceneAction {
  std::string kind;    // field of weft.v1.Action, "grab"
  std::string name{};  // of the sheet or collider; empty: the only one
  int row = 0;         // of the particle
  int column = 0;
  std::optional<std::array<double, 3>> target_m{};  // of a collider as an offset from its start
  std::optional<double> duration_s{};
};

// Throws where the scene has no such particle or collider.
v1::Action to_action(const SceneAction& action, const v1::Scene& scene);

// "drape:3,5", or "3,5", as sheet, row and column.
void read_particle(const std::string& text, SceneAction& action);

}  // namespace weft::client
