#include <fmt/format.h>

#include <sstream>

#include "client/commands/commands.h"
#include "client/frame_feed.h"
#include "client/output/pace.h"
#include "client/output/status.h"
#include "client/output/text.h"

namespace weft::client {
namespace {

struct WatchOptions {
  std::string session;
  std::optional<std::int64_t> to;
  bool until_rest = false;
  bool run = false;
};

v1::StreamFramesRequest stream_request(const std::string& session, const WatchOptions& options) {
  v1::StreamFramesRequest request;
  request.set_session(session);
  if (options.to) request.set_end_frame(*options.to);
  request.mutable_format()->set_stats(true);
  return request;
}

void let_run(Context& context, const std::string& session, const WatchOptions& options) {
  v1::RunSessionRequest request;
  request.set_name(session);
  if (options.to) request.set_until_frame(*options.to);
  request.set_until_rest(options.until_rest);
  context.connection().call(&Sessions::RunSession, request);
}

Json frame_json(const v1::Frame& frame, double pace) {
  Json json{{"frame", frame.number()}, {"time_s", frame.time_s()}, {"speed", pace}};
  json.update(to_json(frame.stats()));
  return json;
}

// Shows frames: in place on a terminal, else a line for each, in JSON or at most one a second.
class Display {
 public:
  explicit Display(Context& context)
      : context_(context),
        status_(context.terminal.out, context.terminal.out_is_watched && !context.json) {}

  void show(const v1::Frame& frame) {
    pace_now_ = pace_.update(frame.time_s());
    last_ = frame;
    if (context_.json) {
      context_.answer(frame_json(frame, pace_now_), "");
    } else if (context_.terminal.out_is_watched) {
      status_.show(lines());
    } else if (const auto now = Clock::now(); now - last_line_ >= std::chrono::seconds(1)) {
      print_row();
      last_line_ = now;
    }
  }

  // Of a frame that takes long.
  void show_share(const v1::Progress& progress) {
    if (context_.json) return;
    const std::string line = fmt::format("frame {}: {:.0f} % computed", progress.latest_frame() + 1,
                                         100 * progress.frame_share());
    if (context_.terminal.out_is_watched) {
      auto all = last_ ? lines() : std::vector<std::string>();
      all.push_back(line);
      status_.show(std::move(all));
    } else if (const auto now = Clock::now(); now - last_line_ >= std::chrono::seconds(1)) {
      context_.terminal.out << line << std::endl;
      last_line_ = now;
    }
  }

  // The last frame stays on the screen.
  void finish() {
    if (context_.json || !last_) return;
    if (context_.terminal.out_is_watched) {
      status_.clear();
      for (const auto& line : lines()) context_.terminal.out << line << '\n';
    } else if (last_->number() != last_printed_) {
      print_row();
    }
  }

 private:
  using Clock = std::chrono::steady_clock;

  std::vector<std::string> lines() const {
    const v1::FrameStats& stats = last_->stats();
    Facts facts;
    facts.add("frame", std::to_string(last_->number()))
        .add("simulated time", fmt::format("{:.3f} s", last_->time_s()))
        .add("kinetic energy", number_text(stats.kinetic_energy_j()) + " J")
        .add("potential energy", number_text(stats.potential_energy_j()) + " J")
        .add("largest strain", percent_text(stats.largest_strain()));
    if (stats.has_cloth_cut_count())
      facts.add("cuts of cloth", std::to_string(stats.cloth_cut_count()));
    facts.add("speed", fmt::format("{:.2f} x real time", pace_now_))
        .add("at rest", (stats.at_rest() ? "yes" : "no") + residual_text(stats));
    std::istringstream text(facts.text());
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    return lines;
  }

  void print_row() {
    constexpr const char* kRow = "{:>8}  {:>10}  {:>12}  {:>12}  {:>9}  {:>7}\n";
    std::ostream& out = context_.terminal.out;
    if (last_printed_ < 0)
      out << fmt::format(kRow, "FRAME", "TIME s", "KINETIC J", "POTENTIAL J", "STRAIN %", "SPEED");
    const v1::FrameStats& stats = last_->stats();
    out << fmt::format(kRow, last_->number(), fmt::format("{:.3f}", last_->time_s()),
                       number_text(stats.kinetic_energy_j()),
                       number_text(stats.potential_energy_j()),
                       fmt::format("{:.3g}", 100 * stats.largest_strain()),
                       fmt::format("{:.2f}", pace_now_))
        << std::flush;
    last_printed_ = last_->number();
  }

  Context& context_;
  Status status_;
  Pace pace_;
  double pace_now_ = 0;
  std::optional<v1::Frame> last_;
  std::int64_t last_printed_ = -1;
  Clock::time_point last_line_;
};

// Watches until the end; false: the watcher was too slow and must begin anew at the newest frame.
bool watch(Context& context, const std::string& session, const WatchOptions& options,
           bool& to_be_run, Display& display) try {
  FrameFeed feed(context.connection(), stream_request(session, options), std::chrono::seconds(60));
  while (const auto message = feed.next()) {
    if (message->has_header() && std::exchange(to_be_run, false))
      let_run(context, session, options);
    if (message->has_progress() && message->progress().frame_share() > 0)
      display.show_share(message->progress());
    if (!message->has_frame()) continue;
    display.show(message->frame());
    if (options.until_rest && message->frame().stats().at_rest()) break;
  }
  return true;
} catch (const Problem& problem) {
  if (problem.reason != "FRAME_EXPIRED") throw;
  return false;
}

void run_watch(Context& context, const WatchOptions& options) {
  const std::string session = context.session_or_scene(options.session);
  bool to_be_run = options.run || context.embedded;
  Display display(context);
  while (!watch(context, session, options, to_be_run, display)) {
  }
  display.finish();
  const bool has_end = options.to || options.until_rest;
  if (has_end && context.stop.stop_requested()) throw interrupted();
}

}  // namespace

void add_watch(CLI::App& app, Context& context) {
  auto options = std::make_shared<WatchOptions>();
  CLI::App* command =
      app.add_subcommand("watch", "Show a session's frames as they come, until Ctrl-C");
  add_session_or_scene_argument(*command, options->session);
  command->add_option("--to", options->to, "End after this frame")->type_name("N");
  command->add_flag("--until-rest", options->until_rest, "End at rest");
  command->add_flag("--run", options->run,
                    "Let the session run, as far as it is watched (always with --embedded)");
  command->callback([&context, options] { run_watch(context, *options); });
}

}  // namespace weft::client
