#include <fmt/format.h>

#include <filesystem>

#include "client/commands/commands.h"
#include "client/output/status.h"
#include "client/output/text.h"
#include "client/page/page.h"

namespace weft::client {
namespace {

struct ViewOptions {
  std::vector<std::string> recordings;
  std::string frames;
  std::string path;
  std::string title;
  double most_mb = 8;
};

constexpr std::size_t kMostShown = 6;

void check(const ViewOptions& options) {
  if (options.recordings.size() > kMostShown)
    throw usage_problem(fmt::format("view shows at most {} recordings", kMostShown));
  for (const std::string& recording : options.recordings) {
    std::error_code error;  // there is no such file yet
    if (std::filesystem::equivalent(options.path, recording, error))
      throw unwritable(options.path, "it is the recording itself");
  }
}

void run_view(Context& context, const ViewOptions& options) {
  check(options);
  PageOrder order{.path = options.path, .title = options.title};
  order.most_bytes = static_cast<std::size_t>(1e6 * options.most_mb);
  order.frames = read_frame_range(options.frames);
  Figure& figure = order.figures.emplace_back();
  for (const std::string& path : options.recordings)
    figure.exhibits.push_back({std::filesystem::path(path).stem().string(), path});
  if (order.title.empty()) {
    for (const Exhibit& exhibit : figure.exhibits)
      order.title += (order.title.empty() ? "" : ", ") + exhibit.name;
  }
  Status status(context.terminal.err, context.terminal.err_is_watched);
  const PageResult result =
      write_page(order, [&](const std::string& doing) { status.show({doing}); });
  status.clear();
  context.answer({{"output", order.path},
                  {"frames", result.frames},
                  {"bytes", result.bytes},
                  {"largest_error_m", result.largest_error_m}},
                 fmt::format("{}: {}, {}, positions within {:.2g} um\n", order.path,
                             count_of(result.frames, "frame"), bytes_text(result.bytes),
                             1e6 * result.largest_error_m));
}

}  // namespace

void add_view(CLI::App& app, Context& context) {
  auto options = std::make_shared<ViewOptions>();
  CLI::App* command = app.add_subcommand("view", "Write a page that plays recordings in a browser");
  command->add_option("FILE", options->recordings, "Recordings, up to 6, shown in step")
      ->option_text("...")
      ->required()
      ->expected(-1);
  command->add_option("-o,--output", options->path, "File to write")->type_name("PATH")->required();
  command->add_option("--title", options->title, "Of the page; else the recordings' names")
      ->type_name("TEXT");
  command->add_option("--frames", options->frames, "Frames A to B; either may be left out")
      ->option_text("A:B");
  command
      ->add_option("--most-mb", options->most_mb,
                   "Size of the page, kept by less precise positions as far\nas these do; else 8")
      ->option_text("MB")
      ->check(CLI::Range(0.1, 1000.0));
  command->callback([&context, options] { run_view(context, *options); });
}

}  // namespace weft::client
