#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <future>
#include <mutex>

#include "client/commands/commands.h"
#include "client/exports/export.h"
#include "client/output/status.h"
#include "client/output/text.h"
#include "client/page/page.h"
#include "client/recording/recorder.h"
#include "client/templates/templates.h"

namespace weft::client {
namespace {

struct DemoOptions {
  std::string directory = "weft-demo";
  double longest_time_s = 30;
};

// One of the paper's experiments with one stiffness, and what became of it.
struct Run {
  std::string name;
  v1::Scene scene;
  std::string path;
  std::int64_t last_frame = 0;
  std::chrono::duration<double> wall{};
  Tally tally;
};

std::vector<Run> plan_runs(const DemoOptions& options) {
  std::vector<Run> runs;
  const auto add = [&](const char* experiment, const std::string& variant,
                       const TemplateOptions& values) {
    Run run;
    run.name = experiment + variant;
    run.scene = make_template(experiment, values);
    run.path = (std::filesystem::path(options.directory) / run.name).string();
    run.last_frame = std::llround(options.longest_time_s / run.scene.solver().frame_step_s());
    runs.push_back(run);
  };
  add("paper-1", "", {});
  for (const double bend : {0.0, 0.1})
    add("paper-2", fmt::format("-kb-{:g}", bend), {.bend = bend});
  for (const double bend : {0.0, 0.1, 0.2, 0.3})
    add("paper-3", fmt::format("-kb-{:g}", bend), {.bend = bend});
  for (const int segments : {2, 5, 60})
    add("paper-4", fmt::format("-{}", segments), {.segments = segments, .fold_clamp = true});
  add("paper-4", "-exact", {.evaluator = v1::EVALUATOR_EXACT});
  return runs;
}

// The paper's figures, from the recordings of the runs.
PageOrder plan_page(const DemoOptions& options) {
  const std::filesystem::path directory = options.directory;
  const auto exhibit = [&](const std::string& name, const std::string& run) {
    return Exhibit{name, (directory / (run + ".weft")).string()};
  };
  return {
      .path = (directory / "figures.html").string(),
      .title = "The paper's figures 4 to 7 by Weft",
      .figures = {
          {.title = "Figure 4",
           .caption = "Experiment 1: a cloth hung from two corners falls from level to rest.",
           .exhibits = {exhibit("k_b 0.1", "paper-1")}},
          {.title = "Figure 5",
           .caption = "Experiment 2: a cloth falls on a box. The stiffer one resists at the "
                      "corners of the box.",
           .exhibits = {exhibit("k_b 0", "paper-2-kb-0"), exhibit("k_b 0.1", "paper-2-kb-0.1")}},
          {.title = "Figure 6",
           .caption = "Experiment 3: a cloth falls on a sphere, with three stiffnesses. The "
                      "edges differ.",
           .exhibits = {exhibit("k_b 0", "paper-3-kb-0"), exhibit("k_b 0.1", "paper-3-kb-0.1"),
                        exhibit("k_b 0.3", "paper-3-kb-0.3")}},
          {.title = "Figure 7",
           .caption = "Experiment 4: the same cloth, k_b 0.1, with its clamped bending function "
                      "(eq. 5) in 2, 5 and 60 line segments, and exact.",
           .exhibits = {exhibit("2 segments", "paper-4-2"), exhibit("5 segments", "paper-4-5"),
                        exhibit("60 segments", "paper-4-60"), exhibit("exact", "paper-4-exact")}}}};
}

// All frames as a point cache, the last one as a mesh.
void export_run(const Run& run) {
  RecordingReader recording(run.path + ".weft");
  const auto ignore = [](const ExportResult&) {};
  ExportOrder order;
  order.format = ExportFormat::kPc2;
  order.path = run.path + ".pc2";
  export_recording(recording, order, ignore);
  order.format = ExportFormat::kObj;
  order.path = run.path + "-end";
  order.frames.first = run.tally.last_frame;
  export_recording(recording, order, ignore);
}

// Until rest, or the longest time.
void perform(Connection& connection, Run& run, const std::function<void(const Tally&)>& progress) {
  const auto start = std::chrono::steady_clock::now();
  v1::CreateSessionRequest request;
  *request.mutable_session()->mutable_scene() = run.scene;
  RecordingOrder order;
  order.session = connection.call(&Sessions::CreateSession, request).name();
  order.path = run.path + ".weft";
  order.replace = true;
  order.to = run.last_frame;
  order.until_rest = true;
  order.run = true;
  const RecordingResult result = record(connection, order, progress);
  if (!result.complete) throw interrupted();
  run.tally = result.tally;
  run.wall = std::chrono::steady_clock::now() - start;
  export_run(run);
}

std::string progress_text(const Run& run, const Tally& tally) {
  const double done = tally.last_stats.at_rest() ? 1.0
                                                 : static_cast<double>(tally.last_frame) /
                                                       static_cast<double>(run.last_frame);
  return fmt::format("{:14} {}  {:5.1f} s  {}", run.name, bar(done), tally.last_time_s,
                     tally.last_stats.at_rest() ? "at rest" : "");
}

// Side by side; the server's workers share the processor among them.
void perform_all(Context& context, std::vector<Run>& runs) {
  Status status(context.terminal.err, context.terminal.err_is_watched);
  std::mutex mutex;
  std::vector<std::string> lines;
  for (const Run& run : runs) lines.push_back(progress_text(run, {}));

  std::vector<std::future<void>> tasks;
  Connection& connection = context.connection();
  for (std::size_t i = 0; i < runs.size(); ++i) {
    tasks.push_back(std::async(std::launch::async, [&, i] {
      perform(connection, runs[i], [&, i](const Tally& tally) {
        const std::lock_guard lock(mutex);
        lines[i] = progress_text(runs[i], tally);
        status.show(lines);
      });
    }));
  }
  for (auto& task : tasks) task.get();
}

double energy(const Run& run) {
  return run.tally.last_stats.kinetic_energy_j() + run.tally.last_stats.potential_energy_j();
}

std::string table_text(const std::vector<Run>& runs, const std::string& directory,
                       const std::string& page) {
  Table table({"EXPERIMENT", "WALL", "SIMULATED", "STEPS", "STRAIN", "AT REST", "RECORDING"});
  for (const Run& run : runs) {
    table.add({run.name, fmt::format("{:.1f} s", run.wall.count()),
               fmt::format("{:.1f} s", run.tally.last_time_s), std::to_string(run.tally.substeps),
               fmt::format("{:.2f} %", 100 * run.tally.largest_strain),
               fmt::format("{:.4f} J{}", energy(run),
                           run.tally.last_stats.at_rest() ? "" : " (in motion)"),
               run.name + ".weft"});
  }
  return fmt::format(
      "{}\nAll in {}; beside each recording .pc2, its frames as a point cache, and\n"
      "-end, the last one as OBJ. STRAIN: the largest. AT REST: the energy.\n"
      "The paper's figures 4 to 7, to be played and turned in a browser:\n  {}\n",
      table.text(), directory, page);
}

Json runs_json(const std::vector<Run>& runs, const std::string& page) {
  Json json = Json::array();
  for (const Run& run : runs) {
    json.push_back({{"experiment", run.name},
                    {"wall_s", run.wall.count()},
                    {"time_s", run.tally.last_time_s},
                    {"steps", run.tally.substeps},
                    {"largest_strain", run.tally.largest_strain},
                    {"energy_j", energy(run)},
                    {"at_rest", run.tally.last_stats.at_rest()},
                    {"file", run.path + ".weft"}});
  }
  return {{"runs", std::move(json)}, {"page", page}};
}

void run_demo(Context& context, const DemoOptions& options) {
  context.embedded = true;
  std::error_code error;
  std::filesystem::create_directories(options.directory, error);
  if (error) throw unwritable(options.directory, error.message());
  std::vector<Run> runs = plan_runs(options);
  perform_all(context, runs);
  const PageOrder page = plan_page(options);
  write_page(page, [](const std::string&) {});
  const std::string path = std::filesystem::absolute(page.path).string();
  context.answer(runs_json(runs, path), table_text(runs, options.directory, path));
}

}  // namespace

void add_demo(CLI::App& app, Context& context) {
  auto options = std::make_shared<DemoOptions>();
  CLI::App* command =
      app.add_subcommand("demo", "Run the paper's experiments on a server within this command");
  command->add_option("-o,--output", options->directory, "Directory for recordings and exports")
      ->type_name("DIR")
      ->capture_default_str();
  command
      ->add_option("--longest", options->longest_time_s,
                   "Simulated time at which a run that is not at rest ends, s")
      ->type_name("S")
      ->check(CLI::Range(0.1, 1e4))
      ->capture_default_str();
  command->callback([&context, options] { run_demo(context, *options); });
}

}  // namespace weft::client
