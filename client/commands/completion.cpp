#include <algorithm>
#include <cstdlib>
#include <span>

#include "client/commands/commands.h"
#include "client/problem.h"

namespace weft::client {
namespace {

// Both ask `weft completion words` for what may stand for the last word; for nothing at all the
// shell names files.
constexpr const char* kBash = R"sh(_weft() {
  mapfile -t COMPREPLY < <("$1" completion words "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)
}
complete -o default -F _weft weft
)sh";
constexpr const char* kZsh = R"sh(_weft() {
  local -a found
  found=("${(@f)$("${words[1]}" completion words "${(@)words[2,CURRENT]}" 2>/dev/null)}")
  if [[ -n "$found" ]]; then compadd -a found; else _files; fi
}
compdef _weft weft
)sh";

// "obj|pc2|csv, REQUIRED" as its parts.
std::vector<std::string> values_of(const CLI::Option& option) {
  std::string text = option.get_option_text();
  if (text.empty()) text = option.get_type_name();
  text = text.substr(0, text.find_first_of(" ,"));
  if (text.find('|') == std::string::npos) return {};
  return CLI::detail::split(text, '|');
}

// The option of the command, or of those above it, that is written so.
const CLI::Option* find_option(const CLI::App* command, const std::string& word) {
  for (; command != nullptr; command = command->get_parent()) {
    if (word.starts_with('-'))
      if (const CLI::Option* option = command->get_option_no_throw(word)) return option;
  }
  return nullptr;
}

bool takes_value(const CLI::Option* option) {
  return option != nullptr && option->get_items_expected_max() > 0;
}

bool names_session(const CLI::App& command) {
  const auto options = command.get_options();
  return std::any_of(options.begin(), options.end(),
                     [](const CLI::Option* option) { return option->get_name() == "SESSION"; });
}

// As parsing does, for options that are not given.
void take_environment(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    const char* value = std::getenv(option->get_envname().c_str());
    if (value == nullptr || *value == 0) continue;
    option->add_result(value);
    option->run_callback();
  }
}

std::vector<std::string> sessions(Context& context) {
  std::vector<std::string> names;
  try {
    const v1::ListSessionsResponse all = list_sessions(context.connection());
    for (const v1::Session& session : all.sessions())
      names.push_back(session.name().substr(session.name().find('/') + 1));
  } catch (const Problem&) {
    names.clear();  // without a server there are none
  }
  return names;
}

std::vector<std::string> candidates(const CLI::App& app, std::span<const std::string> words,
                                    Context& context) {
  const bool helps = words.size() > 1 && words[0] == "help";
  if (helps) words = words.subspan(1);
  const CLI::App* command = &app;
  const CLI::Option* option = nullptr;  // whose value comes next
  for (const std::string& word : words.first(words.size() - 1)) {
    const bool is_value = takes_value(option);
    option = is_value ? nullptr : find_option(command, word);
    if (is_value || option != nullptr) continue;
    const auto below = command->get_subcommands({});
    const auto next = std::find_if(below.begin(), below.end(),
                                   [&](const CLI::App* each) { return each->get_name() == word; });
    if (next != below.end()) command = *next;
  }
  if (takes_value(option)) return values_of(*option);

  std::vector<std::string> found;
  if (words.back().starts_with('-')) {
    for (const CLI::App* each = command; each != nullptr; each = each->get_parent())
      for (const CLI::Option* known : each->get_options())
        for (const std::string& name : known->get_lnames()) found.push_back("--" + name);
    return found;
  }
  for (const CLI::App* each : command->get_subcommands({})) found.push_back(each->get_name());
  if (names_session(*command) && !helps) return sessions(context);
  if (helps && command == &app) {
    if (words.size() > 1) return {};  // below a topic
    for (const std::string& topic : help_topics()) found.push_back(topic);
  }
  return found;
}

}  // namespace

std::string completions(CLI::App& app, std::vector<std::string> words, Context& context) {
  take_environment(app);
  if (words.empty()) words.emplace_back();
  std::vector<std::string> found = candidates(app, words, context);
  std::erase_if(found, [&](const std::string& each) { return !each.starts_with(words.back()); });
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  std::string lines;
  for (const std::string& each : found) lines += each + '\n';
  return lines;
}

void add_completion(CLI::App& app, Context& context) {
  CLI::App* command =
      add_group(app, "completion", "Write what makes a shell complete commands, options and names");
  const auto add = [&](const char* shell, const char* description, const char* script) {
    command->add_subcommand(shell, description)->callback([&context, script] {
      context.answer({{"script", script}}, script);
    });
  };
  add("bash", "For ~/.bashrc: source <(weft completion bash)", kBash);
  add("zsh", "For ~/.zshrc, after compinit: source <(weft completion zsh)", kZsh);
}

}  // namespace weft::client
