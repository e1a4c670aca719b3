#include <fmt/format.h>

#include <atomic>
#include <exception>
#include <future>
#include <map>
#include <mutex>

#include "client/commands/commands.h"
#include "client/exports/output_file.h"
#include "client/output/status.h"
#include "client/output/text.h"
#include "client/script/check.h"
#include "client/script/report.h"
#include "client/script/script_file.h"

namespace weft::client {
namespace {

struct ScriptOptions {
  std::string path;
  std::vector<std::string> values;  // "k_b=0.1"
  std::string junit;
  bool dry_run = false;
  bool replace = false;
};

std::map<std::string, std::string> read_values(const std::vector<std::string>& settings) {
  std::map<std::string, std::string> values;
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos || equals == 0)
      throw usage_problem("--set " + setting + ": write VARIABLE=VALUE");
    values[setting.substr(0, equals)] = setting.substr(equals + 1);
  }
  return values;
}

void answer_plan(Context& context, const Script& script) {
  Json cases = Json::array();
  std::int64_t steps = 0;
  std::string text;
  for (const Case& each : script.cases) {
    Json names = Json::array();
    for (const Step& step : each.steps) names.push_back(step.kind);
    const auto count = static_cast<std::int64_t>(each.steps.size());
    text += fmt::format("  {}: {}\n", each.name, count_of(count, "step"));
    steps += count;
    cases.push_back({{"name", each.name}, {"steps", std::move(names)}});
  }
  context.answer({{"script", script.path}, {"name", script.name}, {"cases", std::move(cases)}},
                 fmt::format("{}: {}, {}, nothing wrong\n{}", script.path,
                             count_of(static_cast<std::int64_t>(script.cases.size()), "case"),
                             count_of(steps, "step"), text));
}

// As many cases at a time as the script says; what ends one for good ends all, and is thrown.
void perform_all(Context& context, const Script& script, bool replace,
                 std::vector<CaseResult>& results) {
  std::vector<std::string> lines(script.cases.size());
  Status status(context.terminal.err, context.terminal.err_is_watched);
  Connection& connection = context.connection();
  std::mutex mutex;
  std::atomic<std::size_t> next = 0;
  std::atomic<bool> ended = false;
  const auto work = [&] {
    for (std::size_t i = next++; i < results.size() && !ended; i = next++) {
      const auto show = [&, i](const std::string& line) {
        const std::lock_guard lock(mutex);
        lines[i] = line.empty() ? "" : fmt::format("{}  {}", script.cases[i].name, line);
        std::vector<std::string> shown;
        for (const std::string& each : lines) {
          if (!each.empty()) shown.push_back(each);
        }
        status.show(shown);
      };
      try {
        results[i] = perform(connection, script.cases[i], replace, show);
      } catch (...) {
        ended = true;
        throw;
      }
      if (!results[i].ended) ended = true;
      show("");
    }
  };
  std::vector<std::future<void>> workers;
  for (int i = 0; i < script.parallel; ++i) workers.push_back(std::async(std::launch::async, work));
  for (auto& worker : workers) worker.wait();
  for (auto& worker : workers) worker.get();
}

void run_script(Context& context, const ScriptOptions& options) {
  const Script script = read_script(options.path, read_values(options.values));
  check_script(context.connection(), script, options.replace);
  if (options.dry_run) return answer_plan(context, script);

  std::vector<CaseResult> results(script.cases.size());
  std::exception_ptr end;
  try {
    perform_all(context, script, options.replace, results);
  } catch (const Problem&) {
    end = std::current_exception();
  }
  if (!options.junit.empty()) {
    OutputFile file(options.junit);
    file.write(report_junit(script, results));
    file.close();
  }
  context.answer(report_json(script, results),
                 report_text(script, results, context.terminal.columns));
  if (end) std::rethrow_exception(end);
  if (context.stop.stop_requested()) throw interrupted();
  std::size_t failed = 0;
  for (const CaseResult& result : results) failed += result.passed() ? 0 : 1;
  if (failed == 0) return;
  throw Problem(Exit::kRefused, "FAILED_PRECONDITION", "SCRIPT_FAILED",
                fmt::format("{}: {} of {} failed", script.path, failed,
                            count_of(static_cast<std::int64_t>(results.size()), "case")));
}

constexpr const char* kFooter =
    R"(A script is YAML; all that is wrong with it is said before anything runs:

  for: {textile: [denim_11oz, wool_tropical], rows: [11, 21]}  # 4 cases
  parallel: 2                                                  # cases at a time
  variables: {longest: 10}
  steps:
    - create: {template: sphere, textile: $textile, rows: $rows, columns: $rows}
    - record: {file: $case.weft}
    - run: {until_rest: true, until_time_s: $longest}
    - expect: {at_rest: true, largest_strain: {max: 0.05}}

create   template, with the options of `weft scene new`, or scene, or drape;
         fields: {PLACE: VALUE ...};
         drape is a garment or a pattern file, with what `weft drape` takes:
         textile, figure, size, stature_m, bust_m, underbust_m, waist_m,
         top_hip_m, hip_m, arm_angle, or body, files; over, a recording;
         edge_m, deflate_m, accuracy
set      textile, a preset or file, or fields: {FIELD: VALUE ...};
         sheet; over_s, else at once
grab     row, column; sheet; likewise release, pin and unpin
drag     row, column; sheet; to_m: [X, Y, Z]; over_s; moves as it runs on
move     collider; to_m, an offset from its start; over_s
relax    comes to rest on its shortest way, as it runs on
record   file; velocities, encoding; to the end of the case
run      until_frame, until_time_s, until_rest; time_scale;
         wait: false goes on at once
wait     frame
pause    stops what runs
snapshot snapshot: a name; keeps the session as it is now
restore  snapshot; session: a new one that goes on from there
expect   frame, time_s, at_rest, rest_time_s; largest_strain, of all frames;
         strain, cloth_cuts, kinetic_energy_j, potential_energy_j, energy_j,
         of the newest; strain_warp, strain_weft, pressure_pa, slid_m, of its
         verdict;
         particle: {sheet, row, column, x_m, y_m, z_m};
         each a value, {min, max} or {near, within};
         verdict: good, or all its faults, such as [SLID_DOWN]

Each has `session`, a name within the case, needed only where there are several;
run takes a list of them. A step may be a loop: {for: {...}, steps: [...]}.
$NAME and $(NAME) stand for variables, $case for the case's name. Paths are
relative to the script. Sessions end with their case. What is interrupted, by
Ctrl-C or a connection that is lost, still reports the cases that are over.)";

}  // namespace

void add_script(CLI::App& app, Context& context) {
  auto options = std::make_shared<ScriptOptions>();
  CLI::App* command =
      app.add_subcommand("script", "Run sessions as a file says, and hold them to what it expects");
  command->add_option("FILE", options->path, "Script")->option_text(" ")->required();
  command->add_flag("--dry-run", options->dry_run, "Check everything, run nothing");
  command->add_option("--set", options->values, "Another value for a variable; may be given again")
      ->option_text("VARIABLE=VALUE ...")
      ->allow_extra_args(false);
  command->add_option("--junit", options->junit, "Write the result for JUnit's readers too")
      ->type_name("FILE");
  command->add_flag("--force", options->replace, "Replace recordings that exist");
  command->footer(kFooter);
  command->callback([&context, options] { run_script(context, *options); });
}

}  // namespace weft::client
