#include "client/weft.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>

#include "client/commands/commands.h"
#include "client/context.h"

namespace weft::client {
namespace {

constexpr const char* kDescription = "weft: simulates textiles on a server";

constexpr const char* kFooter = R"(
A first run:
  weft scene new --template sphere -o scene.json
  weft session create scene.json --id drape
  weft serve drape
  weft record drape --run --until-rest -o drape.weft
  weft view drape.weft -o drape.html
  weft render drape.weft -o drape.png
  weft export drape.weft --format obj -o drape

With --embedded no server is needed: it lives within the command, and SESSION is
a scene file; so it is where a scene file is given and no --server (WEFT_SERVER)
is named, as for scene check, textile list and show, and lab. With --json every answer is one JSON document (watch: one a line),
on stderr {"error": ...}. Exit codes: weft help errors.)";

std::string problem_text(const Problem& problem) {
  const auto& violations = problem.violations;
  if (violations.empty()) return std::string(problem.what()) + '\n';
  if (violations.size() == 1) return violations[0].field + ": " + violations[0].description + '\n';
  std::size_t width = 0;
  for (const auto& violation : violations) width = std::max(width, violation.field.size());
  std::string text = std::string(problem.what()) + '\n';
  for (const auto& [field, description] : violations) {
    text += fmt::format("  {:{}}  {}\n", field, width, description);
  }
  return text;
}

// What the command line has too much of, by the command that stands before it.
Problem surplus(const CLI::App& app, const std::string& word) {
  const CLI::App* command = &app;
  std::string name = app.get_name();
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().front();
    name += ' ' + command->get_name();
  }
  const char* what = word.starts_with('-')                  ? "option"
                     : command->get_subcommands({}).empty() ? "further argument"
                                                            : "command";
  return usage_problem(fmt::format("{} has no {} {}; see {} --help", name, what, word, name));
}

// Fields of requests that options and arguments of other names stand for.
constexpr std::array kNames{
    std::pair{"start_frame", "--from"}, std::pair{"end_frame", "--to"},
    std::pair{"until_frame", "--to"},   std::pair{"target_m", "--to"},
    std::pair{"duration_s", "--over"},  std::pair{"session_id", "--id"},
    std::pair{"snapshot_id", "--id"},   std::pair{"name", "SNAPSHOT"},
    std::pair{"name", "SESSION"},       std::pair{"textile.preset", "--textile"}};

// What the command line has for a field of a request; else the field.
std::string given_name(const CLI::App& app, const std::string& field) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  // "target_m" of "actions[1].drag.target_m.x"
  std::string own = field;
  if (own.starts_with("actions[")) {
    own.erase(0, own.find('.', own.find('.') + 1) + 1);
    own.erase(std::min(own.find('.'), own.size()));
  }
  std::string same = "--" + own;
  std::replace(same.begin(), same.end(), '_', '-');
  if (command->get_option_no_throw(same) != nullptr) return same;
  for (const auto& [known, name] : kNames)
    if (own == known && command->get_option_no_throw(name) != nullptr) return name;
  return field;
}

// In the words of the command line.
Problem as_given(const CLI::App& app, const Problem& problem) {
  std::string message = problem.what();
  std::vector<Violation> violations = problem.violations;
  for (Violation& violation : violations) {
    const std::string name = given_name(app, violation.field);
    if (message.starts_with(violation.field + ':'))
      message.replace(0, violation.field.size(), name);
    violation.field = name;
  }
  Problem given(problem.exit, problem.code, problem.reason, message);
  given.violations = std::move(violations);
  return given;
}

int report(const Problem& problem, const Context& context) {
  const char* name = context.terminal.err_is_watched ? "\x1b[1;31mweft:\x1b[0m " : "weft: ";
  context.terminal.err << (context.json ? to_json(problem).dump() + '\n'
                                        : name + problem_text(problem))
                       << std::flush;
  return static_cast<int>(problem.exit);
}

void add_options(CLI::App& app, Context& context) {
  CLI::Option* server = app.add_option("--server", context.server, "Address of weftd")
                            ->type_name("ADDRESS")
                            ->envname("WEFT_SERVER")
                            ->capture_default_str();
  app.parse_complete_callback([server, &context] { context.server_named = server->count() > 0; });
  Credentials& own = context.credentials;
  if (const char* token = std::getenv("WEFT_TOKEN")) own.token = token;
  const auto file = [&](const char* flag, std::string& path, const char* variable,
                        const char* help) {
    app.add_option(flag, path, help)->type_name("FILE")->envname(variable);
  };
  file("--tls-ca", own.tls_ca, "WEFT_TLS_CA", "Use TLS with a server that one of these signed");
  file("--tls-cert", own.tls_cert, "WEFT_TLS_CERT", "Certificate to show the server");
  file("--tls-key", own.tls_key, "WEFT_TLS_KEY", "Its key");
  file("--token-file", own.token_file, "WEFT_TOKEN_FILE",
       "Token to show the server; or WEFT_TOKEN");
  app.add_flag("--embedded", context.embedded, "Use a server within this command instead");
  app.add_flag("--json", context.json, "Answer in JSON");
  app.set_version_flag("--version", WEFT_VERSION);
}

void add_commands(CLI::App& app, Context& context) {
  add_scene(app, context);
  add_body(app, context);
  add_garment(app, context);
  add_drape(app, context);
  add_session(app, context);
  add_textile(app, context);
  add_lab(app, context);
  add_run(app, context);
  add_pause(app, context);
  add_step(app, context);
  add_act(app, context);
  add_watch(app, context);
  add_top(app, context);
  add_record(app, context);
  add_info(app, context);
  add_verify(app, context);
  add_diff(app, context);
  add_cut(app, context);
  add_join(app, context);
  add_replay(app, context);
  add_export(app, context);
  add_plot(app, context);
  add_render(app, context);
  add_view(app, context);
  add_serve(app, context);
  add_script(app, context);
  add_health(app, context);
  add_token(app, context);
  add_load(app, context);
  add_demo(app, context);
  add_completion(app, context);
  add_help(app);
}

}  // namespace

int run_weft(std::vector<std::string> arguments, const Terminal& terminal,
             const std::stop_token& stop) {
  Context context(terminal, stop);
  context.json = std::find(arguments.begin(), arguments.end(), "--json") !=
                 arguments.end();  // for usage errors too
  CLI::App app(kDescription, "weft");
  app.fallthrough();
  app.formatter(help_formatter());
  app.footer("--server, --token-file, --tls-ca, --embedded and --json: see weft --help");
  add_options(app, context);
  add_commands(app, context);
  app.footer(topics_text() + kFooter);  // the commands keep the line above

  try {
    if (arguments.size() > 1 && arguments[0] == "completion" && arguments[1] == "words") {
      terminal.out << completions(app, {arguments.begin() + 2, arguments.end()}, context);
      return static_cast<int>(Exit::kDone);
    }
    if (!arguments.empty() && arguments[0] == "help") {
      const auto options = std::find_if(arguments.begin(), arguments.end(),
                                        [](const auto& word) { return word.starts_with('-'); });
      terminal.out << help_of(app, {arguments.begin() + 1, options});
      return static_cast<int>(Exit::kDone);
    }
    std::reverse(arguments.begin(), arguments.end());  // as CLI11 wants them
    app.parse(std::move(arguments));
    if (app.get_subcommands().empty()) throw usage_problem("which command? see weft --help");
    return static_cast<int>(Exit::kDone);
  } catch (const CLI::ExtrasError&) {
    return report(surplus(app, app.remaining(true).front()), context);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error, terminal.out, terminal.err);
    // what stands before a word that a command is called
    if (const auto left = app.remaining(); !left.empty() && !left.front().starts_with('-'))
      return report(usage_problem("weft has no command " + left.front() + "; see weft --help"),
                    context);
    return report(usage_problem(std::string(error.what()) + "; see --help"), context);
  } catch (const Problem& problem) {
    return report(as_given(app, problem), context);
  } catch (const std::exception& error) {
    return report({Exit::kRefused, "INTERNAL", "INTERNAL", error.what()}, context);
  }
}

}  // namespace weft::client
