#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/context.h"
#include "client/figures/dress_form.h"
#include "client/recording/frame_range.h"

namespace weft::client {

// Each adds one command to the command line; parsing runs it.
void add_body(CLI::App& app, Context& context);
void add_garment(CLI::App& app, Context& context);
void add_drape(CLI::App& app, Context& context);
void add_scene(CLI::App& app, Context& context);
void add_session(CLI::App& app, Context& context);
void add_textile(CLI::App& app, Context& context);
void add_lab(CLI::App& app, Context& context);
void add_run(CLI::App& app, Context& context);
void add_pause(CLI::App& app, Context& context);
void add_step(CLI::App& app, Context& context);
void add_act(CLI::App& app, Context& context);
void add_top(CLI::App& app, Context& context);
void add_watch(CLI::App& app, Context& context);
void add_record(CLI::App& app, Context& context);
void add_info(CLI::App& app, Context& context);
void add_replay(CLI::App& app, Context& context);
void add_verify(CLI::App& app, Context& context);
void add_diff(CLI::App& app, Context& context);
void add_cut(CLI::App& app, Context& context);
void add_join(CLI::App& app, Context& context);
void add_export(CLI::App& app, Context& context);
void add_plot(CLI::App& app, Context& context);
void add_render(CLI::App& app, Context& context);
void add_view(CLI::App& app, Context& context);
void add_serve(CLI::App& app, Context& context);
void add_script(CLI::App& app, Context& context);
void add_token(CLI::App& app, Context& context);
void add_health(CLI::App& app, Context& context);
void add_load(CLI::App& app, Context& context);
void add_demo(CLI::App& app, Context& context);
void add_completion(CLI::App& app, Context& context);
void add_help(CLI::App& app);
// What `weft scene new --help` says, of the words "scene", "new"; or of a topic. Throws where there
// is neither.
std::string help_of(const CLI::App& app, const std::vector<std::string>& words);
std::vector<std::string> help_topics();
std::string topics_text();  // their list
// Fits 80 columns.
std::shared_ptr<CLI::FormatterBase> help_formatter();
// What may stand for the last of the words after "weft", a line each.
std::string completions(CLI::App& app, std::vector<std::string> words, Context& context);

using Sessions = v1::SessionService::Stub;
using Servers = v1::ServerService::Stub;
using Textiles = v1::TextileService::Stub;

// A command that only holds others.
CLI::App* add_group(CLI::App& app, const char* name, const char* description);

// Takes the names of a map, and says which there are where it is given another.
template <class Value>
CLI::Validator one_of(const std::map<std::string, Value>& values) {
  const auto find = [values](std::string& text) {
    const auto found = values.find(text);
    if (found != values.end()) {
      text = std::to_string(static_cast<int>(found->second));
      return std::string();
    }
    std::string names;
    for (const auto& [name, value] : values) names += (names.empty() ? "" : ", ") + name;
    return '"' + text + "\" is none of " + names;
  };
  return {find, "", ""};
}

// Whom a body or a garment is for, by options.
void add_person(CLI::App& command, Person& person);
// Refuses a size that the figure does not have.
Measures measures_by_options(const Person& person);

// The positional SESSION.
void add_session_argument(CLI::App& command, std::string& session);
void add_refuse_option(CLI::App& command, std::vector<std::string>& codes);
void add_session_or_scene_argument(CLI::App& command, std::string& given);
void add_accuracy(CLI::App& command, std::optional<v1::Accuracy>& accuracy);
// --relax, which needs --until-rest.
void add_relax(CLI::App& command, bool& relax);

// "A:B", both included; either may be left out, and an empty text is all frames.
FrameRange read_frame_range(const std::string& text);

// "FIELD=VALUE" of --set as its parts.
std::pair<std::string, std::string> read_setting(const std::string& text);

// "HOST:PORT" as its parts. Refused where other machines reach it, and that is not what is wanted.
std::pair<std::string, std::uint16_t> read_address(const char* option, const std::string& text,
                                                   bool insecure);

// All of them, from as many pages as it takes.
v1::ListSessionsResponse list_sessions(Connection& connection);

// "paused", or "on weftd-2" where another server has it and may say more.
std::string state_text(const v1::Session& session);
// Whether it is known where it stands.
bool is_shown(const v1::Session& session);
// What a session is and does, and what the solver does for it, for people.
std::string session_text(const v1::Session& session);
// Where there are a server's counts, the cost in its time too.
std::string plan_text(const v1::Plan& plan, const v1::ServerStats* stats = nullptr);

}  // namespace weft::client
