#include "client/load/load.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <tuple>

#include "client/commands/commands.h"
#include "client/exports/output_file.h"
#include "client/garments/drape.h"
#include "client/input_file.h"
#include "client/load/garments.h"
#include "client/load/limit.h"
#include "client/load/load_page.h"
#include "client/output/status.h"
#include "client/output/text.h"
#include "client/scene_file.h"
#include "client/templates/templates.h"

namespace weft::client {
namespace {

struct LoadOptions {
  std::string scene;
  std::string scene_template = "load";
  LoadOrder order;
  std::optional<double> rate;
  double ramp_s = 1;
  double duration_s = 10;
  bool find_limit = false;
  std::optional<double> target_s;
  std::string against;
  std::vector<std::string> compare;
  std::string page;
  std::optional<int> garments;
  int at_once = 2;
  double seconds = 20;
};

constexpr std::array kQuantiles{std::pair{"p50", 0.5}, std::pair{"p90", 0.9},
                                std::pair{"p99", 0.99}, std::pair{"p99_9", 0.999},
                                std::pair{"max", 1.0}};

double frames_per_s(const LoadResult& result) {
  return static_cast<double>(result.frames_received) / result.wall.count();
}

double frames_per_s(const LoadOrder& order, const StageResult& stage) {
  return static_cast<double>(stage.frames_received) / order.duration.count();
}

std::string errors_text(const LoadResult& result) {
  std::string text;
  for (const auto& [reason, count] : result.errors)
    text += fmt::format("{}{} x {}", text.empty() ? "" : ", ", count, reason);
  return text;
}

std::string frames_text(const LoadOrder& order, const LoadResult& result) {
  const std::string due =
      order.drive == Drive::kFree ? "" : fmt::format(" of {} due", result.frames_due);
  return fmt::format("{}{}, {} lost, {} doubled", result.frames_received, due, result.frames_lost,
                     result.frames_doubled);
}

std::vector<std::string> progress_lines(const LoadOrder& order, const LoadResult& result,
                                        double elapsed_s) {
  const auto stages = static_cast<double>(result.stages.size());
  const double whole = stages * (order.ramp + order.duration).count();
  return {fmt::format("{}  {:.0f} of {:.0f} s", bar(elapsed_s / whole), elapsed_s, whole),
          fmt::format("sessions  {} of {}", result.sessions, result.stages.back().sessions),
          fmt::format("frames    {}", frames_text(order, result)),
          fmt::format("lateness  {} p50, {} p99", seconds_text(result.frame.quantile(0.5)),
                      seconds_text(result.frame.quantile(0.99))),
          fmt::format("errors    {}", result.error_count())};
}

// Of each stage.
std::string stages_text(const LoadOrder& order, const LoadResult& result) {
  Table table({"SESSIONS", "CREATE P99", "P50", "P99", "P99.9", "MAX", "FRAMES/S", "ERRORS"});
  for (const StageResult& stage : result.stages) {
    table.add({std::to_string(stage.sessions), seconds_text(stage.create.quantile(0.99)),
               seconds_text(stage.frame.quantile(0.5)), seconds_text(stage.frame.quantile(0.99)),
               seconds_text(stage.frame.quantile(0.999)), seconds_text(stage.frame.quantile(1)),
               fmt::format("{:.0f}", frames_per_s(order, stage)), std::to_string(stage.errors)});
  }
  return table.text();
}

std::string load_text(const LoadOrder& order, const LoadResult& result) {
  Table table({"LATENESS", "COUNT", "P50", "P90", "P99", "P99.9", "MAX"});
  for (const auto& [name, latencies] :
       {std::pair{"create", &result.create}, std::pair{"step", &result.step},
        std::pair{"frame", &result.frame}}) {
    if (latencies->count() == 0) continue;
    std::vector<std::string> row{name, std::to_string(latencies->count())};
    for (const auto& [label, fraction] : kQuantiles)
      row.push_back(seconds_text(latencies->quantile(fraction)));
    table.add(row);
  }
  Facts facts;
  facts.add("sessions", std::to_string(result.sessions))
      .add("frames", frames_text(order, result))
      .add("received", fmt::format("{:.1f} frames/s", frames_per_s(result)))
      .add("planned", fmt::format("{} substeps", result.planned_substeps))
      .add("own processor", fmt::format("{:.2f} of a core", result.cpu / result.wall));
  for (const auto& [reason, count] : result.errors)
    facts.add("errors", fmt::format("{} x {}", count, reason));
  const std::string stages =
      result.stages.size() > 1 ? stages_text(order, result) + '\n' : std::string();
  return stages + table.text() + '\n' + facts.text();
}

template <class Result>
Json times_json(const Result& result) {
  Json json;
  for (const auto& [name, latencies] :
       {std::pair{"create_s", &result.create}, std::pair{"step_s", &result.step},
        std::pair{"frame_s", &result.frame}}) {
    json[name]["count"] = latencies->count();
    for (const auto& [label, fraction] : kQuantiles)
      json[name][label] = latencies->quantile(fraction);
  }
  return json;
}

Json load_json(const LoadOrder& order, const LoadResult& result) {
  constexpr std::array kDrives{"paced", "stepped", "free"};
  Json json{{"sessions", result.stages.back().sessions},
            {"subscribers", order.subscribers},
            {"drive", kDrives[static_cast<std::size_t>(order.drive)]},
            {"rate_per_s", order.rate_per_s},
            {"sessions_created", result.sessions},
            {"frames_due", result.frames_due},
            {"frames_received", result.frames_received},
            {"frames_per_s", frames_per_s(result)},
            {"frames_lost", result.frames_lost},
            {"frames_doubled", result.frames_doubled},
            {"planned_substeps", result.planned_substeps},
            {"wall_s", result.wall.count()},
            {"cpu_s", result.cpu.count()}};
  json.update(times_json(result));
  json["stages"] = Json::array();
  for (const StageResult& stage : result.stages) {
    Json stage_json{{"sessions", stage.sessions},
                    {"frames_per_s", frames_per_s(order, stage)},
                    {"errors", stage.errors}};
    stage_json.update(times_json(stage));
    json["stages"].push_back(std::move(stage_json));
  }
  json["errors"] = result.errors;
  return json;
}

// One load beside another.
std::string change_text(const Json& before, const Json& now) {
  Table table({"FIGURE", "BEFORE", "NOW", "CHANGE"});
  const auto add = [&](const std::string& name, const Json& old_value, const Json& new_value,
                       std::string (*text)(double)) {
    const auto was = old_value.get<double>();
    const auto is = new_value.get<double>();
    table.add({name, text(was), text(is),
               was > 0 ? fmt::format("{:+.1f} %", 100 * (is / was - 1)) : std::string("-")});
  };
  add("sessions", before.at("sessions"), now.at("sessions"), number_text);
  add("frames a second", before.at("frames_per_s"), now.at("frames_per_s"), number_text);
  for (const auto& [name, times] : {std::pair{"create", "create_s"}, std::pair{"step", "step_s"},
                                    std::pair{"frame", "frame_s"}}) {
    if (now.at(times).at("count") == 0) continue;
    for (const char* quantile : {"p50", "p99", "max"}) {
      add(fmt::format("{} {}", name, quantile), before.at(times).at(quantile),
          now.at(times).at(quantile), seconds_text);
    }
  }
  const Json stages_before = before.value("stages", Json::array());
  const Json stages_now = now.value("stages", Json::array());
  for (const Json& was : stages_before) {
    for (const Json& is : stages_now) {
      if (stages_now.size() < 2 || was.at("sessions") != is.at("sessions")) continue;
      add(fmt::format("{} sessions: frame p99", is.at("sessions").get<int>()),
          was.at("frame_s").at("p99"), is.at("frame_s").at("p99"), seconds_text);
    }
  }
  add("frames lost", before.at("frames_lost"), now.at("frames_lost"), number_text);
  return table.text();
}

Json read_earlier(const std::string& path) try {
  Json json = Json::parse(read_text(path));
  // has all that is compared and drawn
  std::ignore = change_text(json, json);
  std::ignore = load_page(path, {{path, json}});
  return json;
} catch (const Json::exception&) {
  throw malformed(path, "this is not what weft load --json answers");
}

// Lines that change in place: how far a load is.
class LoadView {
 public:
  LoadView(Context& context, const LoadOrder& order)
      : order_(order), status_(context.terminal.err, context.terminal.err_is_watched) {}

  void show(int sessions, const LoadResult& so_far) {
    if (sessions != sessions_) start_ = std::chrono::steady_clock::now();
    sessions_ = sessions;
    order_.sessions = sessions;
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
    status_.show(progress_lines(order_, so_far, elapsed.count()));
  }
  void clear() { status_.clear(); }

 private:
  LoadOrder order_;
  Status status_;
  int sessions_ = 0;
  std::chrono::steady_clock::time_point start_;
};

std::string asked_text(const LoadOrder& order) {
  return fmt::format("{:g} frames/s of each session, {} of each", order.rate_per_s,
                     count_of(order.subscribers, "subscriber"));
}

std::string sessions_text(const Json& load) {
  return count_of(load.at("sessions").get<std::int64_t>(), "session");
}

// A page that is written once it is known; that it can be is known before.
class Page {
 public:
  explicit Page(const std::string& path) {
    if (!path.empty()) file_.emplace(path);
  }
  void write(const std::string& asked, const std::vector<NamedLoad>& loads) {
    if (!file_) return;
    file_->write(load_page(asked, loads));
    file_->close();
  }

 private:
  std::optional<OutputFile> file_;
};

void load_once(Context& context, const LoadOrder& order, const std::string& against, Page& page) {
  const std::optional<Json> before =
      against.empty() ? std::nullopt : std::optional(read_earlier(against));
  LoadView view(context, order);
  const LoadResult result = apply_load(context.connection(), order, [&](const LoadResult& so_far) {
    view.show(order.sessions_of_stages().back(), so_far);
  });
  view.clear();
  const Json json = load_json(order, result);
  std::string text = load_text(order, result);
  std::vector<NamedLoad> loads;
  if (before) {
    text += '\n' + change_text(*before, json);
    loads = {{"before", *before}, {"now", json}};
  } else {
    for (const Json& stage : json.at("stages")) loads.push_back({sessions_text(stage), stage});
  }
  page.write(asked_text(order), loads);
  context.answer(json, text);
  if (context.stop.stop_requested()) throw interrupted();
  if (!result.clean()) {
    throw Problem(Exit::kRefused, "FAILED_PRECONDITION", "LOAD_FAILED",
                  fmt::format("{}, {} lost, {} doubled", count_of(result.error_count(), "error"),
                              count_of(result.frames_lost, "frame"), result.frames_doubled));
  }
}

void compare(Context& context, const std::vector<std::string>& paths, Page& page) {
  const Json before = read_earlier(paths[0]);
  const Json now = read_earlier(paths[1]);
  page.write(fmt::format("before: {}, now: {}", paths[0], paths[1]),
             {{"before", before}, {"now", now}});
  context.answer({{"before", before}, {"now", now}}, change_text(before, now));
}

std::string why_not(const Probe& probe) {
  if (probe.holds) return "";
  if (probe.result.error_count() > 0) return errors_text(probe.result);
  return probe.result.clean() ? "too late" : "frames lost or doubled";
}

void search_limit(Context& context, const LoadOrder& order, double target_s, Page& page) {
  Table table({"SESSIONS", "P50", "P99", "MAX", "FRAMES/S", "OWN CPU", "HOLDS", "WHY NOT"});
  Json probes = Json::array();
  LoadView view(context, order);
  LimitSearch search;
  search.first = order.sessions;
  search.target_s = target_s;
  const auto tried = [&](const Probe& probe) {
    LoadOrder tried_order = order;
    tried_order.sessions = probe.sessions;
    const Latencies& frame = probe.result.frame;
    Json json = load_json(tried_order, probe.result);
    json["holds"] = probe.holds;
    probes.push_back(std::move(json));
    table.add({std::to_string(probe.sessions), seconds_text(frame.quantile(0.5)),
               seconds_text(frame.quantile(0.99)), seconds_text(frame.quantile(1)),
               fmt::format("{:.0f}", frames_per_s(probe.result)),
               fmt::format("{:.2f}", probe.result.cpu / probe.result.wall),
               probe.holds ? "yes" : "no", why_not(probe)});
  };
  const int limit =
      find_limit(context.connection(), order, search, tried,
                 [&](int sessions, const LoadResult& so_far) { view.show(sessions, so_far); });
  view.clear();
  if (context.stop.stop_requested()) throw interrupted();
  std::vector<NamedLoad> loads;
  for (const Json& probe : probes)
    loads.push_back({sessions_text(probe) + (probe.at("holds") ? "" : ", too many"), probe});
  page.write(fmt::format("{}: {} hold with 99 % within {}", asked_text(order),
                         count_of(limit, "session"), seconds_text(target_s)),
             loads);
  context.answer({{"limit", limit}, {"target_s", target_s}, {"probes", std::move(probes)}},
                 fmt::format("{}\n{} hold {:g} frames/s with 99 % within {}\n", table.text(),
                             count_of(limit, "session"), order.rate_per_s, seconds_text(target_s)));
  if (limit == 0) {
    throw Problem(
        Exit::kRefused, "FAILED_PRECONDITION", "LOAD_FAILED",
        "not even one session holds; give a longer --target, a lower --rate or a smaller --scene");
  }
}

// A T-shirt on a form of size 40.
v1::Scene tshirt_scene(Connection& connection) {
  return make_drape(connection, {.garment = "tshirt", .edge_m = 0.02}).scene;
}

std::string garments_text(const GarmentsResult& result) {
  Facts facts;
  facts.add("garments", fmt::format("{} put on, {} good", result.done, result.good))
      .add("rate", fmt::format("{:.0f} an hour", result.per_hour()))
      .add("time",
           fmt::format("{} in all, {} of processors for each", seconds_text(result.wall.count()),
                       seconds_text(result.computing_s / std::max(1, result.done))));
  for (const auto& [code, count] : result.faults)
    facts.add("faults", fmt::format("{} x {}", count, code));
  for (const auto& [reason, count] : result.errors)
    facts.add("errors", fmt::format("{} x {}", count, reason));
  return facts.text();
}

void load_with_garments(Context& context, const LoadOptions& options) {
  GarmentsOrder order;
  order.scene =
      options.scene.empty() ? tshirt_scene(context.connection()) : read_scene(options.scene);
  order.garments = *options.garments;
  order.at_once = options.at_once;
  order.seconds = options.seconds;
  Status status(context.terminal.err, context.terminal.err_is_watched);
  const GarmentsResult result =
      put_on(context.connection(), order, [&](const GarmentsResult& so_far) {
        status.show({fmt::format("{} of {} put on, {:.0f} an hour", so_far.done, order.garments,
                                 so_far.per_hour())});
      });
  status.clear();
  context.answer({{"garments", result.done},
                  {"good", result.good},
                  {"garments_per_hour", result.per_hour()},
                  {"faults", result.faults},
                  {"errors", result.errors},
                  {"substeps", result.substeps},
                  {"computing_s", result.computing_s},
                  {"wall_s", result.wall.count()}},
                 garments_text(result));
  if (context.stop.stop_requested()) throw interrupted();
  if (result.good < order.garments)
    throw Problem(Exit::kRefused, "FAILED_PRECONDITION", "LOAD_FAILED",
                  fmt::format("{} of {} garments do not sit well", order.garments - result.good,
                              order.garments));
}

// What the sessions would be: with every default filled in.
v1::Scene checked_scene(Connection& connection, const LoadOptions& options) {
  v1::CreateSessionRequest request;
  request.set_validate_only(true);
  const v1::Scene scene =
      options.scene.empty() ? make_template(options.scene_template) : read_scene(options.scene);
  return create_session(connection, scene, request).scene();
}

void check_stages(const LoadOrder& order) {
  const std::vector<int>& stages = order.stages;
  const bool rise =
      std::adjacent_find(stages.begin(), stages.end(), std::greater_equal()) == stages.end();
  if (!rise || (!stages.empty() && (stages.front() < 1 || stages.back() > 100'000)))
    throw usage_problem("--stages: write rising numbers of sessions, 1 to 100000, as in 10,20,40");
  if (!stages.empty() && order.frames)
    throw usage_problem("--frames would end sessions before the last of the --stages");
}

void run_load(Context& context, const LoadOptions& options) {
  Page page(options.page);
  if (!options.compare.empty()) return compare(context, options.compare, page);
  if (options.garments) return load_with_garments(context, options);
  LoadOrder order = options.order;
  check_stages(order);
  if (order.drive == Drive::kFree && options.find_limit)
    throw usage_problem("--find-limit: no frame is late where the drive is free");
  constexpr std::int64_t kMostStreams = 100'000;
  const int sessions = order.sessions_of_stages().back();
  if (std::int64_t{sessions} * order.subscribers > kMostStreams) {
    throw usage_problem(fmt::format("{} sessions x {} subscribers are more than {} streams",
                                    sessions, order.subscribers, kMostStreams));
  }
  if ((order.frames || options.find_limit) && order.subscribers == 0)
    throw usage_problem("--subscribers 0: nobody would count the frames");
  order.scene = checked_scene(context.connection(), options);
  order.ramp = std::chrono::duration<double>(options.ramp_s);
  order.duration = std::chrono::duration<double>(options.duration_s);
  const double frame_step_s = order.scene.solver().frame_step_s();
  order.rate_per_s = options.rate.value_or(1 / frame_step_s);
  const double time_scale = order.rate_per_s * frame_step_s;
  if (order.drive == Drive::kPaced && (time_scale < 1e-3 || time_scale > 1000)) {
    throw usage_problem(
        fmt::format("--rate: {:g} frames/s of {} each are {:g} times real time; "
                    "a server paces 0.001 to 1000 times",
                    order.rate_per_s, seconds_text(frame_step_s), time_scale));
  }
  if (options.find_limit)
    return search_limit(context, order, options.target_s.value_or(1 / order.rate_per_s), page);
  load_once(context, order, options.against, page);
}

constexpr const char* kLoadFooter =
    R"(paced    sessions run by themselves at the rate
stepped  a call for every frame, when it is due and the one before is answered
free     sessions run as fast as their subscribers read; nothing is late

Lateness counts from the time a call or a frame was due, whether or not the
server kept up; what never came counts as it had waited at the end. What was
due within the ramp is not timed. With --embedded the processor time is the
server's too. The sessions are deleted in the end.)";

}  // namespace

void add_load(CLI::App& app, Context& context) {
  auto options = std::make_shared<LoadOptions>();
  LoadOrder& order = options->order;
  const std::map<std::string, Drive> drives{
      {"paced", Drive::kPaced}, {"stepped", Drive::kStepped}, {"free", Drive::kFree}};
  CLI::App* command =
      app.add_subcommand("load", "Load a server with sessions and say how late their frames are");
  auto* scene = command->add_option("--scene", options->scene, "Scene file of every session")
                    ->type_name("FILE");
  command->add_option("-t,--template", options->scene_template, "Template instead of a file")
      ->type_name("NAME")
      ->excludes(scene)
      ->capture_default_str();
  auto* sessions =
      command->add_option("--sessions", order.sessions, "How many; with --find-limit the first try")
          ->type_name("N")
          ->check(CLI::Range(1, 100'000))
          ->capture_default_str();
  auto* stages = command
                     ->add_option("--stages", order.stages,
                                  "Rising numbers instead, figures for each: 10,20,40")
                     ->type_name("N,N...")
                     ->delimiter(',')
                     ->allow_extra_args(false)
                     ->excludes(sessions);
  command->add_option("--subscribers", order.subscribers, "Streams of each session")
      ->type_name("N")
      ->check(CLI::Range(0, 100'000))
      ->capture_default_str();
  command->add_option("--drive", order.drive, "What makes sessions advance [paced]")
      ->transform(one_of(drives))
      ->option_text("paced|stepped|free");
  command->add_option("--rate", options->rate, "Frames a second [the scene's own]")
      ->type_name("R")
      ->check(CLI::Range(1e-3, 1e5));
  command->add_option("--frames", order.frames, "End when each session has so many")
      ->type_name("N")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1'000'000'000}));
  command->add_option("--ramp", options->ramp_s, "Seconds in which a stage creates its sessions")
      ->type_name("S")
      ->check(CLI::Range(0.0, 1e5))
      ->capture_default_str();
  command->add_option("--duration", options->duration_s, "Seconds of a stage after the ramp")
      ->type_name("S")
      ->check(CLI::Range(0.01, 1e6))
      ->capture_default_str();
  auto* limit =
      command
          ->add_flag("--find-limit", options->find_limit, "Search how many sessions hold --target")
          ->excludes(stages);
  command->add_option("--target", options->target_s, "Lateness 99 of 100 may have, s [an interval]")
      ->type_name("S")
      ->check(CLI::PositiveNumber)
      ->needs(limit);
  command->add_option("--against", options->against, "Compare with an earlier answer to --json")
      ->type_name("FILE")
      ->excludes(limit);
  command->add_option("--compare", options->compare, "Load nothing; compare two answers to --json")
      ->type_name("BEFORE AFTER")
      ->expected(2);
  auto* garments =
      command
          ->add_option(
              "--garments", options->garments,
              "Put on so many instead, a T-shirt or a --scene with a dressing, and say how "
              "many an hour")
          ->type_name("N")
          ->check(CLI::Range(1, 100'000));
  for (CLI::Option* other : {sessions, stages, limit}) garments->excludes(other);
  command->add_option("--at-once", options->at_once, "Of the garments")
      ->type_name("N")
      ->check(CLI::Range(1, 1000))
      ->needs(garments)
      ->capture_default_str();
  command->add_option("--seconds", options->seconds, "Most simulated time until one is at rest, s")
      ->type_name("S")
      ->check(CLI::Range(0.1, 1000.0))
      ->needs(garments)
      ->capture_default_str();
  command->add_option("-o,--output", options->page, "HTML page with all of it as curves too")
      ->type_name("PATH");
  command->footer(kLoadFooter);
  command->callback([&context, options] { run_load(context, *options); });
}

}  // namespace weft::client
