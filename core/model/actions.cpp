#include "core/model/actions.h"

#include <algorithm>

#include "core/model/text.h"

namespace weft {
namespace {

using Kind = Action::Kind;

const char* name_of(Kind kind) {
  switch (kind) {
    case Kind::kGrab:
      return "grab";
    case Kind::kDrag:
      return "drag";
    case Kind::kRelease:
      return "release";
    case Kind::kPin:
      return "pin";
    case Kind::kUnpin:
      return "unpin";
    case Kind::kMoveCollider:
      return "move_collider";
    case Kind::kPoseCollider:
      return "pose_collider";
    case Kind::kRelax:
      return "relax";
    case Kind::kLetGo:
      break;
  }
  return "let_go";
}

class ActionList {
 public:
  ActionList(const ActionContext& context, Constraints& constraints)
      : context_(context), constraints_(constraints) {}

  void apply(const Action& action, const std::string& place) {
    field_ = place + "." + name_of(action.kind);
    const auto wrong = weft::find_problems(action, field_);
    problems_.insert(problems_.end(), wrong.begin(), wrong.end());
    if (!wrong.empty()) return;
    if (action.kind == Kind::kLetGo) return let_go(action.hand);
    if (action.kind == Kind::kRelax) return;
    if (action.kind == Kind::kMoveCollider) return move_collider(action);
    if (action.kind == Kind::kPoseCollider) return pose_collider(action);
    const auto sheet = index_of(context_.scene.sheets, action.name, ".sheet", "sheets");
    if (!sheet) return;
    const SheetShape& shape = context_.scene.sheets[*sheet].shape;
    const int last = particle_count(shown(shape)) - 1;
    if (action.particle < 0 || action.particle > last)
      return problem(".particle", join(action.particle, " is not within 0 to ", last));
    const auto particle = simulated_particle(shape, action.particle);
    if (!particle)
      return problem(".particle",
                     join(action.particle,
                          " is not simulated, but lies between particles that are: "
                          "those in each row and column number ",
                          std::get<Grid>(shape).simulated_every, " from the first on"));
    apply(action, *sheet, *particle);
  }

  std::vector<Problem> take() { return std::move(problems_); }

 private:
  void problem(const char* field, std::string message) {
    problems_.push_back({field_ + field, std::move(message)});
  }

  void apply(const Action& action, std::size_t sheet, int particle) {
    const auto wrong = [&](const char* what) { problem(".particle", join(action.particle, what)); };
    const auto grip = find_grip(sheet, particle);
    const bool grabbed = grip != constraints_.grips.end();
    const auto holder = find_pin(sheet, particle);
    const bool pinned = grabbed ? grip->pinned : holder != constraints_.pins[sheet].end();

    if (action.kind == Kind::kGrab) {
      if (grabbed) return wrong(" is grabbed already");
      if (!is_near(".particle", offset_of(sheet, particle))) return;
      hold(sheet, particle);
      return constraints_.grips.push_back({sheet, particle, action.hand, pinned});
    }
    if (action.kind == Kind::kPin) {
      if (pinned) return wrong(" is pinned already");
      if (grabbed)
        grip->pinned = true;
      else if (is_near(".particle", offset_of(sheet, particle)))
        hold(sheet, particle);
      return;
    }
    if (action.kind == Kind::kUnpin) {
      if (!pinned) return wrong(" is not pinned");
      if (grabbed)
        grip->pinned = false;
      else
        free(sheet, particle);
      return;
    }
    if (!grabbed) return wrong(" is not grabbed");
    if (action.hand != 0 && action.hand != grip->hand)
      return wrong(" is grabbed by another stream or call");
    if (action.kind == Kind::kRelease) return release(grip);
    const Vector3d to = action.target - context_.start(sheet, particle);
    if (is_near(".target_m", to))
      lead(action, offset_at(holder->path, context_.time), to, holder->path);
  }

  // What is held has a path, bounded as those of a scene are.
  bool is_near(const char* field, const Vector3d& offset) {
    if (offset.cwiseAbs().maxCoeff() <= kMostOffset) return true;
    problem(field,
            join("lies ", offset.norm() / 1000, " km from the particle's start; a path reaches ",
                 kMostOffset / 1000, " km along each axis"));
    return false;
  }

  // The sheet or collider of that name, or the only one.
  template <class Named>
  std::optional<std::size_t> index_of(const std::vector<Named>& all, const std::string& name,
                                      const char* field, const char* what) {
    if (name.empty() && all.size() == 1) return 0;
    std::string names;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (all[i].name == name) return i;
      names += (i == 0 ? "" : ", ") + all[i].name;
    }
    problem(field, all.empty() ? join("\"", name, "\": the scene has no ", what)
                               : join("\"", name, "\" is none of the ", what, ": ", names));
    return std::nullopt;
  }

  void move_collider(const Action& action) {
    const auto index = index_of(context_.scene.colliders, action.name, ".collider", "colliders");
    if (!index) return;
    Path& path = constraints_.paths[*index];
    lead(action, offset_at(path, context_.time), action.target, path);
  }

  // Through its poses at one rate, from now on.
  void pose_collider(const Action& action) {
    const auto index = index_of(context_.scene.colliders, action.name, ".collider", "colliders");
    if (!index) return;
    const Collider& collider = context_.scene.colliders[*index];
    if (!collider.poses || collider.poses->times.size() < 2)
      return problem(".collider", join("\"", collider.name, "\" has no poses to be led through"));
    const Poses& poses = *collider.poses;
    const double first = poses.times.front(), last = poses.times.back(), to = action.pose_time;
    if (!(to >= first && to <= last))
      return problem(".pose_time_s",
                     join(to, " s is not within its poses, ", first, " to ", last, " s"));
    const auto& dressing = context_.scene.dressing;
    if (dressing && dressing->deflate > 0)
      if (const double full = dressing->close + dressing->settle; context_.time < full)
        return problem(".collider",
                       join("\"", collider.name, "\" has dressing.deflate_m to grow back by until ",
                            full, " s, and is not to move before; it is ", context_.time, " s"));
    Collider led = collider;
    led.lead = constraints_.leads[*index];
    const double from = std::clamp(pose_time(led, context_.time), first, last);
    const double speed = fastest(poses, std::min(from, to), std::max(from, to));
    const double duration = std::abs(to - from) * speed / action.pose_speed;
    constraints_.leads[*index] = {context_.time, context_.time + duration, from, to};
  }

  // A straight path, from now on.
  void lead(const Action& action, const Vector3d& from, const Vector3d& to, Path& path) {
    constexpr double kRounding = 1e-9;
    const double way = (to - from).norm();
    const double least = way / kMostSpeed;
    const double duration =
        action.duration.value_or(std::max(context_.scene.solver.frame_step, least));
    if (duration < (1 - kRounding) * least)
      return problem(".duration_s", join(duration, " s is too short for ", way, " m: at ",
                                         kMostSpeed, " m/s, the most, they take ", least, " s"));
    path = {{context_.time, from}, {context_.time + duration, to}};
  }

  std::vector<Grip>::iterator find_grip(std::size_t sheet, int particle) {
    auto& grips = constraints_.grips;
    return std::find_if(grips.begin(), grips.end(), [&](const Grip& grip) {
      return grip.sheet == sheet && grip.particle == particle;
    });
  }

  std::vector<Pin>::iterator find_pin(std::size_t sheet, int particle) {
    auto& pins = constraints_.pins[sheet];
    return std::find_if(pins.begin(), pins.end(), [&](const Pin& pin) {
      return std::find(pin.particles.begin(), pin.particles.end(), particle) != pin.particles.end();
    });
  }

  // Where it is now, from its start.
  Vector3d offset_of(std::size_t sheet, int particle) {
    const auto pin = find_pin(sheet, particle);
    if (pin != constraints_.pins[sheet].end()) return offset_at(pin->path, context_.time);
    return context_.position(sheet, particle) - context_.start(sheet, particle);
  }

  // Where it is, by a pin of its own.
  void hold(std::size_t sheet, int particle) {
    const Vector3d offset = offset_of(sheet, particle);
    free(sheet, particle);
    constraints_.pins[sheet].push_back({{particle}, {{context_.time, offset}}});
  }

  void free(std::size_t sheet, int particle) {
    const auto pin = find_pin(sheet, particle);
    if (pin == constraints_.pins[sheet].end()) return;
    std::erase(pin->particles, particle);
    if (pin->particles.empty()) constraints_.pins[sheet].erase(pin);
  }

  void release(std::vector<Grip>::iterator grip) {
    if (grip->pinned)
      hold(grip->sheet, grip->particle);
    else
      free(grip->sheet, grip->particle);
    constraints_.grips.erase(grip);
  }

  void let_go(int hand) {
    for (std::size_t i = constraints_.grips.size(); i-- > 0;) {
      const auto grip = constraints_.grips.begin() + static_cast<std::ptrdiff_t>(i);
      if (grip->hand == hand) release(grip);
    }
  }

  const ActionContext& context_;
  Constraints& constraints_;
  std::string field_;  // of the action that is being done
  std::vector<Problem> problems_;
};

}  // namespace

std::vector<Problem> apply(const std::vector<Action>& actions, const ActionContext& context,
                           Constraints& constraints) {
  ActionList list(context, constraints);
  for (std::size_t i = 0; i < actions.size(); ++i) list.apply(actions[i], join("actions[", i, "]"));
  return list.take();
}

bool hold_the_same(const Constraints& one, const Constraints& other) {
  const auto same_particles = [](const Pin& a, const Pin& b) { return a.particles == b.particles; };
  const auto same_pins = [&](const std::vector<Pin>& a, const std::vector<Pin>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), same_particles);
  };
  const auto same_grip = [](const Grip& a, const Grip& b) { return a.pinned == b.pinned; };
  return std::equal(one.pins.begin(), one.pins.end(), other.pins.begin(), same_pins) &&
         std::equal(one.grips.begin(), one.grips.end(), other.grips.begin(), other.grips.end(),
                    same_grip);
}

}  // namespace weft
