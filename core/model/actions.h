#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/model/scene.h"

namespace weft {

// The fastest that actions move particles and colliders, m/s.
inline constexpr double kMostSpeed = 20;

// Something that is done to a scene between two frames.
struct Action {
  enum class Kind {
    kGrab,          // a hand holds the particle where it is
    kDrag,          // the hand leads it to the target in a straight line
    kRelease,       // it flies on, or stays where it is if it is pinned
    kPin,           // it is held where it is, in a hand or not
    kUnpin,         // only a hand holds it, if any
    kMoveCollider,  // instead of its path, to the target
    kPoseCollider,  // a body is led through its poses
    kLetGo,         // a hand releases all that it holds
    kRelax,         // the scene comes to rest on its shortest way, see core/motion/relaxation.h
  };
  Kind kind = Kind::kGrab;
  std::string name{};  // of the sheet, empty where there is one; of the collider
  int particle = 0;    // index in what frames show of the sheet
  Vector3d target =
      Vector3d::Zero();              // of a particle; of a collider as an offset from its start, m
  std::optional<double> duration{};  // s; absent: a frame step, or longer for kMostSpeed
  double pose_time = 0;              // where a body is led to, among the times of its poses, s
  double pose_speed = 1;             // of its fastest vertex on the way there, m/s
  int hand = 0;                      // 0 may drag and release what any hand holds
};

// What is wrong with an action whatever the scene; `field` is its path.
std::vector<Problem> find_problems(const Action& action, const std::string& field);

// A particle held by a hand. It has a pin of its own.
struct Grip {
  std::size_t sheet = 0;
  int particle = 0;
  int hand = 0;
  bool pinned = false;  // stays when the hand lets go
};

// What holds particles and moves colliders: at first as the scene says, then as actions change it.
struct Constraints {
  std::vector<std::vector<Pin>> pins;          // of each sheet
  std::vector<Path> paths;                     // of each collider
  std::vector<std::optional<PoseLead>> leads;  // of each collider
  std::vector<Grip> grips;
};

// When actions meet a scene, and where its particles are then.
struct ActionContext {
  const Scene& scene;
  double time = 0;  // s
  // Of a sheet's particle, m.
  std::function<Vector3d(std::size_t sheet, int particle)> start, position;
};

// Does one action after the other. Answers what is wrong with them, with paths such as
// "actions[0].drag.target_m.x"; then `constraints` is to be thrown away.
std::vector<Problem> apply(const std::vector<Action>& actions, const ActionContext& context,
                           Constraints& constraints);

// Whether the same particles are held by the same pins and grips, wherever those lead.
bool hold_the_same(const Constraints& one, const Constraints& other);

}  // namespace weft
