#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "client/commands/commands.h"
#include "client/problem.h"

namespace weft::client {

std::string help_of(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* command = &app;
  std::string name = app.get_name();
  for (const std::string& word : words) {
    const auto below = command->get_subcommands({});
    const auto next = std::find_if(below.begin(), below.end(),
                                   [&](const CLI::App* each) { return each->get_name() == word; });
    if (next == below.end()) {
      throw usage_problem(
          fmt::format("there is no command \"{}\"; weft --help lists them", fmt::join(words, " ")));
    }
    command = *next;
    name += ' ' + word;
  }
  return app.get_formatter()->make_help(command, name, CLI::AppFormatMode::Normal);
}

void add_help(CLI::App& app) {
  app.add_subcommand("help", "Show the help of a command, such as: help scene new");
}

}  // namespace weft::client
