#include <fmt/format.h>

#include <filesystem>

#include "client/commands/commands.h"
#include "client/output/status.h"
#include "client/output/text.h"
#include "client/recording/inspection.h"

namespace weft::client {
namespace {

std::string sheets_text(const RecordingReader& recording) {
  std::string text;
  for (const SheetMesh& sheet : meshes_of(recording.header(), recording.topology())) {
    text +=
        fmt::format("{}{} ({})", text.empty() ? "" : ", ", sheet.layout.name(), shape_text(sheet));
  }
  return text;
}

std::string numbers_text(const v1::FrameFormat& format) {
  switch (format.encoding()) {
    case v1::FRAME_ENCODING_FLOAT64:
      return "float64";
    case v1::FRAME_ENCODING_QUANTIZED_ZSTD:
      return fmt::format("quantized to {:g} mm", 1000 * format.grid_step_m());
    default:
      return "float32";
  }
}

std::string content_text(const v1::FrameFormat& format) {
  std::string text = "positions";
  if (format.velocities()) text += ", velocities";
  if (format.pressure()) text += ", pressure";
  if (format.clearance()) text += ", clearance";
  return text + ", " + numbers_text(format);
}

std::string cuts_text(std::int64_t most) {
  return most == 0 ? "none" : fmt::format("{} in a frame at most", most);
}

std::string facts_text(RecordingReader& recording, const Inspection& inspection) {
  const v1::StreamHeader& header = recording.header();
  const Tally& tally = inspection.tally;
  Facts facts;
  facts.add("recording", recording.path())
      .add("recorded", recording.recorded_at())
      .add("session", header.session())
      .add("uid", header.uid())
      .add("numerics", header.numerics_id())
      .add("sheets", sheets_text(recording))
      .add("content", content_text(header.format()))
      .add("frame step", seconds_text(header.frame_step_s()))
      .add("frames", tally.frames == 0 ? "none"
                                       : fmt::format("{} ({} to {})", tally.frames,
                                                     tally.first_frame, tally.last_frame));
  if (tally.frames > 0) {
    facts
        .add("simulated time",
             fmt::format("{:.6g} s to {:.6g} s", tally.first_time_s, tally.last_time_s))
        .add("largest strain", percent_text(tally.largest_strain))
        .add("repairs", tally.repairs == 0 ? "none" : std::to_string(tally.repairs));
    if (tally.most_cuts) facts.add("cuts of cloth", cuts_text(*tally.most_cuts));
    if (const auto verdict = recording.verdict())
      facts.add("verdict", verdict->good() ? "good" : "not good");
    facts.add("kinetic energy", number_text(tally.last_stats.kinetic_energy_j()) + " J at the end")
        .add("potential energy",
             number_text(tally.last_stats.potential_energy_j()) + " J at the end")
        .add("at rest",
             (tally.last_stats.at_rest() ? "yes" : "no") + residual_text(tally.last_stats));
  }
  facts
      .add("file size",
           bytes_text(static_cast<std::int64_t>(std::filesystem::file_size(recording.path()))))
      .add("checksums",
           inspection.faults.empty()
               ? "all right"
               : count_of(static_cast<std::int64_t>(inspection.faults.size()), "fault"));
  return facts.text();
}

Json facts_json(const RecordingReader& recording, const Inspection& inspection) {
  const Tally& tally = inspection.tally;
  return {{"file", recording.path()},
          {"bytes", std::filesystem::file_size(recording.path())},
          {"recorded_at", recording.recorded_at()},
          {"header", to_json(recording.header())},
          {"frames", tally.frames},
          {"first_frame", tally.first_frame},
          {"last_frame", tally.last_frame},
          {"first_time_s", tally.first_time_s},
          {"last_time_s", tally.last_time_s},
          {"substeps", tally.substeps},
          {"largest_strain", tally.largest_strain},
          {"most_cuts", tally.most_cuts ? Json(*tally.most_cuts) : Json()},
          {"last_stats", to_json(tally.last_stats)},
          {"faults", inspection.faults.size()}};
}

void run_info(Context& context, const std::string& path) {
  RecordingReader recording(path);
  Status status(context.terminal.err, context.terminal.err_is_watched);
  const Inspection inspection = inspect(recording, [&](std::int64_t frame) {
    status.show({fmt::format("reading frame {}", frame)});
  });
  status.clear();
  context.answer(facts_json(recording, inspection), facts_text(recording, inspection));
  check(recording, inspection);
}

}  // namespace

void add_info(CLI::App& app, Context& context) {
  auto path = std::make_shared<std::string>();
  CLI::App* command =
      app.add_subcommand("info", "Say what a recording holds, and check every frame of it");
  command->add_option("FILE", *path, "Recording")->option_text(" ")->required();
  command->callback([&context, path] { run_info(context, *path); });
}

}  // namespace weft::client
