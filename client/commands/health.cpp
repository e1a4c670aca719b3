#include <fmt/format.h>

#include "client/commands/commands.h"

namespace weft::client {
namespace {

void run_health(Context& context) {
  if (!context.connection().is_serving())
    throw Problem(Exit::kRefused, "UNAVAILABLE", "NOT_SERVING", "the server is draining");
  context.answer({{"status", "SERVING"}}, "SERVING\n");
}

}  // namespace

void add_health(CLI::App& app, Context& context) {
  app.add_subcommand("health", "Ask whether the server takes calls")->callback([&context] {
    run_health(context);
  });
}

}  // namespace weft::client
