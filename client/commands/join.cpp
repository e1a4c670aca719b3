#include <fmt/format.h>

#include "client/commands/commands.h"
#include "client/output/status.h"
#include "client/output/text.h"
#include "client/recording/splice.h"

namespace weft::client {
namespace {

struct JoinOptions {
  std::vector<std::string> recordings;
  std::string frames;
  SpliceOrder order;
};

void run_join(Context& context, const JoinOptions& options) {
  SpliceOrder order = options.order;
  order.frames = read_frame_range(options.frames);
  std::vector<RecordingReader> recordings;
  for (const std::string& path : options.recordings) recordings.emplace_back(path);
  Status status(context.terminal.err, context.terminal.err_is_watched);
  const FrameRange written = splice(recordings, order, [&](std::int64_t frame) {
    status.show({fmt::format("{}: frame {}", order.path, frame)});
  });
  status.clear();
  const std::int64_t count = written.last - written.first + 1;
  context.answer({{"output", order.path},
                  {"frames", count},
                  {"first_frame", written.first},
                  {"last_frame", written.last}},
                 fmt::format("{}: {}, {} to {}\n", order.path, count_of(count, "frame"),
                             written.first, written.last));
}

// What cutting and joining have in common.
void add_output(CLI::App& command, Context& context, const std::shared_ptr<JoinOptions>& options) {
  command.add_option("-o,--output", options->order.path, "Recording to write")
      ->type_name("FILE")
      ->required();
  command.add_flag("--force", options->order.replace, "Replace it if it exists");
  command.callback([&context, options] { run_join(context, *options); });
}

}  // namespace

void add_cut(CLI::App& app, Context& context) {
  auto options = std::make_shared<JoinOptions>();
  options->recordings.resize(1);
  CLI::App* command = app.add_subcommand("cut", "Take frames out of a recording, as they are");
  command->add_option("FILE", options->recordings[0], "Recording")->option_text(" ")->required();
  command->add_option("--frames", options->frames, "Frames A to B; either may be left out")
      ->option_text("A:B, REQUIRED")
      ->required();
  add_output(*command, context, options);
}

void add_join(CLI::App& app, Context& context) {
  auto options = std::make_shared<JoinOptions>();
  CLI::App* command =
      app.add_subcommand("join", "Put recordings of one session together, every frame once");
  command->add_option("FILE", options->recordings, "Recordings, in any order; they may overlap")
      ->option_text("...")
      ->required();
  add_output(*command, context, options);
}

}  // namespace weft::client
