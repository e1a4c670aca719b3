#include <fmt/format.h>

#include "client/commands/commands.h"
#include "client/output/pace.h"
#include "client/output/status.h"
#include "client/output/text.h"
#include "client/recording/recorder.h"

namespace weft::client {
namespace {

struct RecordOptions {
  RecordingOrder order;
  std::int64_t patience_s = 60;
};

std::string progress_text(const RecordingOrder& order, const Tally& tally, double pace) {
  if (tally.frames == 0) return "waiting for the first frame";
  std::string text = fmt::format("frame {}  {:.3f} s  {:.2f} x real time  {}", tally.last_frame,
                                 tally.last_time_s, pace, bytes_text(tally.bytes));
  if (order.to && *order.to > tally.first_frame) {
    const auto done = static_cast<double>(tally.last_frame - tally.first_frame);
    text = bar(done / static_cast<double>(*order.to - tally.first_frame)) + "  " + text;
  }
  return text;
}

void answer(Context& context, const RecordingOrder& order, const RecordingResult& result) {
  const Tally& tally = result.tally;
  const Json json{
      {"file", order.path},
      {"session", order.session},
      {"complete", result.complete},
      {"frames", tally.frames},
      {"first_frame", tally.first_frame},
      {"last_frame", tally.last_frame},
      {"last_time_s", tally.last_time_s},
      {"substeps", tally.substeps},
      {"largest_strain", tally.largest_strain},
      {"repairs", tally.repairs},
      {"most_cuts", tally.most_cuts ? Json(*tally.most_cuts) : Json()},
      {"at_rest", tally.last_stats.at_rest()},
      {"residual", tally.last_stats.has_residual() ? Json(tally.last_stats.residual()) : Json()},
      {"reconnections", result.reconnections}};
  std::string text = fmt::format("{}: {}", order.path, count_of(tally.frames, "frame"));
  if (tally.frames > 0) {
    text += fmt::format(
        ", {} to {}, up to {:.6g} s{}, largest strain {}", tally.first_frame, tally.last_frame,
        tally.last_time_s,
        tally.last_stats.at_rest() ? " (at rest" + residual_text(tally.last_stats) + ")" : "",
        percent_text(tally.largest_strain));
  }
  if (tally.repairs > 0) text += fmt::format(", {}", count_of(tally.repairs, "repair"));
  if (tally.most_cuts.value_or(0) > 0)
    text += fmt::format(", up to {} of cloth in a frame", count_of(*tally.most_cuts, "cut"));
  if (result.reconnections > 0)
    text += fmt::format(", connected again {}", count_of(result.reconnections, "time"));
  context.answer(json, text + '\n');
}

void run_record(Context& context, const RecordOptions& options) {
  RecordingOrder order = options.order;
  order.session = context.session_or_scene(order.session);
  order.run = order.run || context.embedded;
  if (order.relax && !order.run)
    throw usage_problem("--relax is for a session that runs; give --run");
  order.patience = std::chrono::seconds(options.patience_s);

  Pace pace;
  Status status(context.terminal.err, context.terminal.err_is_watched);
  const RecordingResult result = record(context.connection(), order, [&](const Tally& tally) {
    status.show({progress_text(order, tally, pace.update(tally.last_time_s))});
  });
  status.clear();
  answer(context, order, result);
  const bool has_end = order.to || order.until_rest;
  if (has_end && !result.complete) throw interrupted();
}

}  // namespace

void add_record(CLI::App& app, Context& context) {
  const std::map<std::string, v1::FrameEncoding> encodings{
      {"float32", v1::FRAME_ENCODING_FLOAT32},
      {"float64", v1::FRAME_ENCODING_FLOAT64},
      {"quantized", v1::FRAME_ENCODING_QUANTIZED_ZSTD}};
  auto options = std::make_shared<RecordOptions>();
  RecordingOrder& order = options->order;
  CLI::App* command =
      app.add_subcommand("record", "Record the frames of a session to a file, losing none");
  add_session_or_scene_argument(*command, order.session);
  command->add_option("-o,--output", order.path, "Recording to write; it must not exist")
      ->type_name("FILE")
      ->required();
  command->add_option("--from", order.from, "First frame; else the newest")->type_name("N");
  command->add_option("--to", order.to, "End after this frame")->type_name("N");
  command->add_flag("--until-rest", order.until_rest, "End at rest");
  add_relax(*command, order.relax);
  command->add_flag("--run", order.run,
                    "Let the session run, as far as it is recorded (always with --embedded)");
  command->add_flag("--velocities", order.velocities, "Velocities too");
  command->add_flag("--pressure", order.pressure, "Pressure of colliders on each particle too");
  command->add_flag("--clearance", order.clearance,
                    "Distance of each particle from the nearest collider too");
  command
      ->add_option("--encoding", order.encoding,
                   "Numbers in the file [float32]; quantized: within 0.05 mm")
      ->transform(one_of(encodings))
      ->option_text("float32|float64|quantized");
  command
      ->add_option("--patience", options->patience_s,
                   "Seconds to try again after a connection broke")
      ->type_name("S")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_flag("--force", order.replace, "Replace a file that exists");
  command->footer(
      "Without --to and --until-rest it ends when the session, having advanced, is\npaused. "
      "Ctrl-C ends it at any time; the file holds what came so far.");
  command->callback([&context, options] { run_record(context, *options); });
}

}  // namespace weft::client
