#include <fmt/format.h>

#include "client/commands/commands.h"

namespace weft::client {
namespace {

void run_pause(Context& context, const std::string& session) {
  v1::PauseSessionRequest request;
  request.set_name(context.session_name(session));
  const auto response = context.connection().call(&Sessions::PauseSession, request);
  context.answer(to_json(response),
                 fmt::format("paused before frame {}\n", response.applied_frame()));
}

}  // namespace

void add_pause(CLI::App& app, Context& context) {
  auto session = std::make_shared<std::string>();
  CLI::App* command =
      app.add_subcommand("pause", "Stop a running session after the frame it computes");
  add_session_argument(*command, *session);
  command->callback([&context, session] { run_pause(context, *session); });
}

}  // namespace weft::client
