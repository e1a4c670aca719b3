#include <fmt/format.h>

#include "client/commands/commands.h"
#include "client/replay/replay_server.h"

namespace weft::client {
namespace {

struct ReplayOptions {
  std::string file;
  std::string listen = kDefaultServer;
  double time_scale = 1;
  bool paused = false;
  bool insecure = false;
};

void run_replay(Context& context, const ReplayOptions& options) {
  read_address("--listen", options.listen, options.insecure);
  const ReplayServer server(options.file, options.listen, options.paused ? 0 : options.time_scale);
  context.answer({{"address", server.address()},
                  {"session", server.session()},
                  {"first_frame", server.first_frame()},
                  {"last_frame", server.last_frame()}},
                 fmt::format("{} replays {}, frames {} to {}, until Ctrl-C\n", server.address(),
                             server.session(), server.first_frame(), server.last_frame()));
  context.await_stop();
}

}  // namespace

void add_replay(CLI::App& app, Context& context) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App* command =
      app.add_subcommand("replay", "Serve a recording as the session it was, until Ctrl-C");
  command->add_option("FILE", options->file, "Recording")->option_text(" ")->required();
  command->add_option("--listen", options->listen, "Where it is served, instead of by weftd")
      ->type_name("HOST:PORT")
      ->capture_default_str();
  command
      ->add_option("--time-scale", options->time_scale,
                   "Recorded seconds per second, 0.001 to 1000")
      ->type_name("X")
      ->check(CLI::Range(1e-3, 1000.0))
      ->capture_default_str();
  command->add_flag("--paused", options->paused,
                    "Wait at the first frame until somebody runs or steps it");
  command->add_flag("--insecure", options->insecure,
                    "Allow a host other machines can reach, unencrypted");
  command->footer(
      "What reads a session reads it: weft watch, record and serve, and clients in any\n"
      "language. It can be run, paused and stepped; what would change it is refused\n"
      "(REPLAY).");
  command->callback([&context, options] { run_replay(context, *options); });
}

}  // namespace weft::client
