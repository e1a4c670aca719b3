#include <fmt/format.h>

#include "client/commands/commands.h"
#include "client/output/text.h"

namespace weft::client {
namespace {

struct StepOptions {
  std::string session;
  std::int64_t frames = 1;
  std::optional<std::int64_t> expected_frame;
};

// The answer; a step that is interrupted is ended.
v1::StepSessionResponse step(Connection& connection, const v1::StepSessionRequest& request) try {
  return connection.call(&Sessions::StepSession, request);
} catch (const Problem& problem) {
  if (problem.exit == Exit::kInterrupted) {
    v1::PauseSessionRequest pause;
    pause.set_name(request.name());
    connection.call(&Sessions::PauseSession, pause, std::stop_token());
  }
  throw;
}

void run_step(Context& context, const StepOptions& options) {
  v1::StepSessionRequest request;
  request.set_name(context.session_or_scene(options.session));
  request.set_frames(options.frames);
  if (options.expected_frame) request.set_expected_frame(*options.expected_frame);
  const auto response = step(context.connection(), request);
  context.answer(to_json(response),
                 fmt::format("frame {}, {}{}\n", response.frame(), seconds_text(response.time_s()),
                             response.at_rest() ? ", at rest" : ""));
}

}  // namespace

void add_step(CLI::App& app, Context& context) {
  auto options = std::make_shared<StepOptions>();
  CLI::App* command =
      app.add_subcommand("step", "Compute frames of a paused session and wait for them");
  add_session_or_scene_argument(*command, options->session);
  command->add_option("--frames", options->frames, "How many")
      ->type_name("N")
      ->capture_default_str();
  command
      ->add_option("--expected-frame", options->expected_frame,
                   "Refuse unless this is the newest frame")
      ->type_name("N");
  command->callback([&context, options] { run_step(context, *options); });
}

}  // namespace weft::client
