#include <fmt/format.h>

#include <filesystem>

#include "client/commands/commands.h"
#include "client/serve/live_server.h"

namespace weft::client {
namespace {

struct ServeOptions {
  std::string session;
  std::string http = "127.0.0.1:7312";
  std::string recordings = ".";
  bool insecure = false;
};

LiveOrder order_of(const ServeOptions& options) {
  auto [host, port] = read_address("--http", options.http, options.insecure);
  if (!std::filesystem::is_directory(options.recordings))
    throw unwritable(options.recordings, "it is no directory");
  return {std::move(host), port, options.recordings};
}

void run_serve(Context& context, const ServeOptions& options) {
  const LiveOrder order = order_of(options);
  if (context.embedded && options.session.empty())
    throw usage_problem("with --embedded there is no session yet: name a scene file");
  const std::string session =
      options.session.empty() ? "" : context.session_or_scene(options.session);
  const LiveServer server(context.connection(), order);
  const std::string page = session.empty() ? "" : '#' + session.substr(session.find('/') + 1);
  const std::string url = fmt::format("http://{}/{}", server.address(), page);
  context.answer({{"url", url}}, fmt::format("{} shows sessions, until Ctrl-C\n", url));

  context.await_stop();
}

}  // namespace

void add_serve(CLI::App& app, Context& context) {
  auto options = std::make_shared<ServeOptions>();
  CLI::App* command =
      app.add_subcommand("serve", "Show sessions in a browser and drive them there, until Ctrl-C");
  command
      ->add_option("SESSION", options->session,
                   "Session to show first (with --embedded: a scene file)")
      ->option_text(" ");
  command->add_option("--http", options->http, "Where the page is")
      ->type_name("HOST:PORT")
      ->capture_default_str();
  command
      ->add_option("--recordings", options->recordings, "Directory of recordings made in the page")
      ->type_name("DIR")
      ->capture_default_str();
  command->add_flag("--insecure", options->insecure,
                    "Allow a host other machines can reach, unencrypted");
  command->callback([&context, options] { run_serve(context, *options); });
}

}  // namespace weft::client
