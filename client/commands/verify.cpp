#include <fmt/format.h>

#include "client/commands/commands.h"
#include "client/output/status.h"
#include "client/output/text.h"
#include "client/recording/inspection.h"

namespace weft::client {
namespace {

void run_verify(Context& context, const std::string& path) {
  RecordingReader recording(path);
  Status status(context.terminal.err, context.terminal.err_is_watched);
  const Inspection inspection = inspect(recording, [&](std::int64_t frame) {
    status.show({fmt::format("reading frame {} of {}", frame, recording.last_frame())});
  });
  status.clear();
  check(recording, inspection);
  const Tally& tally = inspection.tally;
  const std::string range =
      tally.frames == 0 ? "" : fmt::format(", {} to {}", tally.first_frame, tally.last_frame);
  context.answer({{"file", path},
                  {"frames", tally.frames},
                  {"first_frame", recording.first_frame()},
                  {"last_frame", recording.last_frame()},
                  {"faults", 0}},
                 fmt::format("{}: {}{}, all as they were written\n", path,
                             count_of(tally.frames, "frame"), range));
}

}  // namespace

void add_verify(CLI::App& app, Context& context) {
  auto path = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand(
      "verify", "Hold all of a recording to its checksums, or say what is wrong");
  command->add_option("FILE", *path, "Recording")->option_text(" ")->required();
  command->callback([&context, path] { run_verify(context, *path); });
}

}  // namespace weft::client
