#include <fmt/format.h>

#include "client/commands/commands.h"
#include "client/scene_action.h"

namespace weft::client {
namespace {

struct ActOptions {
  std::string session;
  std::string particle;  // "sheet:0,5", or "sheet:17"
  SceneAction action;
  std::vector<double> target_m;
};

void run_act(Context& context, ActOptions options) {
  if (!options.particle.empty()) options.action.particle = read_particle(options.particle);
  if (options.target_m.empty() && options.action.duration_s)
    throw usage_problem("--over says how long --to takes; give both");
  if (!options.target_m.empty())
    options.action.target_m = {options.target_m[0], options.target_m[1], options.target_m[2]};
  v1::ApplyActionsRequest request;
  request.set_name(context.session_name(options.session));
  const v1::Scene scene = context.connection().get_session(request.name()).scene();
  *request.add_actions() = to_action(options.action, scene);
  if (options.action.kind == "grab" && options.action.target_m) {
    options.action.kind = "drag";
    *request.add_actions() = to_action(options.action, scene);
  }
  const auto response = context.connection().call(&Sessions::ApplyActions, request);
  context.answer(to_json(response),
                 fmt::format("applied from frame {}\n", response.applied_frame()));
}

}  // namespace

void add_act(CLI::App& app, Context& context) {
  CLI::App* act = add_group(
      app, "act", "Grab, drag, release and pin particles, move and pose colliders, and relax");
  const auto add = [&](const char* name, const char* kind, const char* description) {
    auto options = std::make_shared<ActOptions>();
    options->action.kind = kind;
    CLI::App* command = act->add_subcommand(name, description);
    add_session_argument(*command, options->session);
    command->callback([&context, options] { run_act(context, *options); });
    return std::pair(command, options);
  };
  const auto add_particle = [&](const char* kind, const char* description) {
    auto added = add(kind, kind, description);
    added.first
        ->add_option("PARTICLE", added.second->particle,
                     "ROW,COLUMN on a grid, or its number; SHEET:... of several")
        ->option_text(" ")
        ->required();
    return added;
  };
  const auto add_target = [&](const auto& added, const char* description) {
    const auto& [command, options] = added;
    command
        ->add_option("--over", options->action.duration_s,
                     "How long it takes, at 20 m/s at most; else a frame or longer")
        ->type_name("SECONDS");
    return command->add_option("--to", options->target_m, description)
        ->option_text("X,Y,Z")
        ->delimiter(',')
        ->expected(3);
  };
  add_target(add_particle("grab", "Hold a particle where it is, or lead it from there"),
             "Where to, m; else it stays");
  add_target(add_particle("drag", "Lead a grabbed particle"), "Where to, m")->required();
  add_particle("release", "Let a grabbed particle go");
  add_particle("pin", "Hold a particle where it is, or will be released");
  add_particle("unpin", "End a pin, of the scene too");
  add("relax", "relax", "Come to rest on the shortest way, instead of moving in time");
  const auto move = add("move", "move_collider", "Move a collider");
  move.first
      ->add_option("COLLIDER", move.second->action.collider, "Its name, where there are several")
      ->option_text(" ");
  add_target(move, "Where to, as an offset from its start, m")->required();
  const auto pose =
      add("pose", "pose_collider", "Lead a body through its poses, and let it stay there");
  SceneAction& posed = pose.second->action;
  pose.first->add_option("COLLIDER", posed.collider, "Its name, where there are several")
      ->option_text(" ");
  pose.first->add_option("--to", posed.pose_time_s, "Where to, among the times of its poses")
      ->type_name("SECONDS")
      ->required();
  pose.first
      ->add_option("--speed", posed.speed_m_per_s, "Of its fastest vertex, m/s, 0.01 to 20; else 1")
      ->type_name("NUMBER");
}

}  // namespace weft::client
