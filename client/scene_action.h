#pragma once

#include <array>
#include <optional>
#include <string>

#include "weft/v1/session.pb.h"

namespace weft::client {

// A particle, as people say it: on a grid by row and column, on any sheet by its number.
struct ParticlePlace {
  std::string sheet{};  // empty: the only one
  std::optional<int> number{};
  int row = 0;
  int column = 0;

  auto operator<=>(const ParticlePlace&) const = default;
};

// Its number. Throws where the sheet has no such particle, as far as can be said: of a mesh that is
// an asset the server knows.
int particle_number(const ParticlePlace& place, const v1::Sheet& sheet);

// What is done to a particle or a collider, as people say it.
struct SceneAction {
  std::string kind;        // field of weft.v1.Action, "grab"
  std::string collider{};  // empty: the only one
  ParticlePlace particle{};
  std::optional<std::array<double, 3>> target_m{};  // of a collider as an offset from its start
  std::optional<double> duration_s{};
  double pose_time_s = 0;  // where a body is led to among its poses
  std::optional<double> speed_m_per_s{};
};

// Throws where the scene has no such particle or collider.
v1::Action to_action(const SceneAction& action, const v1::Scene& scene);

// "drape:3,5", "drape:17", "3,5" or "17": sheet, and row and column or number.
ParticlePlace read_particle(const std::string& text);

}  // namespace weft::client
