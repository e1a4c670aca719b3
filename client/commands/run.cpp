#include <fmt/format.h>

#include "client/commands/commands.h"
#include "client/frame_feed.h"
#include "client/output/status.h"
#include "client/output/text.h"

namespace weft::client {
namespace {

struct RunOptions {
  std::string session;
  std::optional<double> time_scale;
  std::optional<std::int64_t> until_frame;
  bool until_rest = false;
  bool relax = false;
  bool wait = false;
};

// Hears of the session's progress, without its frames, until it no longer runs.
v1::Progress wait_for_end(Context& context, const std::string& session) {
  constexpr std::int64_t kNever = std::int64_t{1} << 62;
  v1::StreamFramesRequest request;
  request.set_session(session);
  request.set_start_frame(kNever);
  FrameFeed feed(context.connection(), request, std::chrono::seconds(60));
  Status status(context.terminal.err, context.terminal.err_is_watched);
  while (const auto message = feed.next()) {
    if (!message->has_progress()) continue;
    const v1::Progress& progress = message->progress();
    if (progress.state() != v1::SESSION_STATE_RUNNING &&
        progress.state() != v1::SESSION_STATE_RESTORING) {
      return progress;
    }
    std::string line = fmt::format("running: frame {}", progress.latest_frame());
    if (progress.frame_share() > 0)
      line += fmt::format(", {:.0f} % of the next", 100 * progress.frame_share());
    status.show({line});
  }
  throw interrupted();
}

void run_freely(Context& context, const RunOptions& options) {
  v1::RunSessionRequest request;
  request.set_name(context.session_or_scene(options.session));
  if (options.time_scale) request.set_time_scale(*options.time_scale);
  if (options.until_frame) request.set_until_frame(*options.until_frame);
  request.set_until_rest(options.until_rest);
  if (options.relax) context.connection().relax(request.name());
  const auto response = context.connection().call(&Sessions::RunSession, request);
  if (!options.wait && !context.embedded) {
    context.answer(to_json(response),
                   fmt::format("runs from frame {}\n", response.applied_frame()));
    return;
  }

  wait_for_end(context, request.name());
  const v1::Session session = context.connection().get_session(request.name());
  if (session.state() == v1::SESSION_STATE_FAILED) {
    throw Problem(Exit::kRefused, "FAILED_PRECONDITION", "SOLVER_FAILED", session.failure());
  }
  context.answer({{"applied_frame", response.applied_frame()},
                  {"frame", session.frame()},
                  {"time_s", session.time_s()},
                  {"at_rest", session.at_rest()},
                  {"residual", session.has_residual() ? Json(session.residual()) : Json()}},
                 fmt::format("{} at frame {}, {}{}\n", state_text(session), session.frame(),
                             seconds_text(session.time_s()),
                             session.at_rest() ? ", at rest" + residual_text(session) : ""));
}

}  // namespace

void add_run(CLI::App& app, Context& context) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command = app.add_subcommand("run", "Let a session advance by itself");
  add_session_or_scene_argument(*command, options->session);
  command
      ->add_option("--time-scale", options->time_scale,
                   "Simulated seconds a second; else as fast as it goes")
      ->type_name("X");
  command->add_option("--until-frame", options->until_frame, "Pause after this frame")
      ->type_name("N");
  command->add_flag("--until-rest", options->until_rest, "Pause at rest");
  add_relax(*command, options->relax);
  command->add_flag("--wait", options->wait,
                    "Wait until it is paused again (always with --embedded)");
  command->callback([&context, options] { run_freely(context, *options); });
}

}  // namespace weft::client
