#include <fmt/format.h>

#include <condition_variable>
#include <filesystem>
#include <mutex>

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
  const std::size_t colon = options.http.rfind(':');
  const std::string port = colon == std::string::npos ? "" : options.http.substr(colon + 1);
  const bool digits = !port.empty() && port.size() <= 5 &&
                      port.find_first_not_of("0123456789") == std::string::npos;
  if (colon == 0 || !digits || std::stoi(port) > 65535)
    throw usage_problem(fmt::format("--http {}: write HOST:PORT", options.http));
  std::string host = options.http.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  const bool loopback = host == "localhost" || host == "::1" || host.starts_with("127.");
  if (!loopback && !options.insecure) {
    throw usage_problem(
        fmt::format("--http is {}, which other machines can reach, and nothing is encrypted; add "
                    "--insecure if that is what you want",
                    options.http));
  }
  if (!std::filesystem::is_directory(options.recordings))
    throw unwritable(options.recordings, "it is no directory");
  return {host, static_cast<std::uint16_t>(std::stoi(port)), options.recordings};
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

  std::mutex mutex;
  std::unique_lock lock(mutex);
  std::condition_variable_any().wait(lock, context.stop, [] { return false; });
}

}  // namespace

void add_serve(CLI::App& app, Context& context) {
  auto options = std::make_shared<ServeOptions>();
  CLI::App* command = app.add_subcommand(
      "serve", "Show sessions in a browser while they run, and drive them there, until Ctrl-C");
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
