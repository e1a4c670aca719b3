#include "client/render/render.h"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>

#include "client/commands/commands.h"
#include "client/output/status.h"
#include "client/output/text.h"

namespace weft::client {
namespace {

constexpr std::size_t kMostRendered = 6;

struct RenderOptions {
  std::string size;
  RenderOrder order;
};

Size read_size(const std::string& text) {
  Size size;
  const char* end = text.data() + text.size();
  const auto [cross, width_error] = std::from_chars(text.data(), end, size.width);
  const bool crossed = width_error == std::errc() && cross != end && *cross == 'x';
  const auto height = std::from_chars(crossed ? cross + 1 : end, end, size.height);
  const auto fits = [](int side) { return side >= kLeastSide && side <= kMostSide; };
  if (!crossed || height.ec != std::errc() || height.ptr != end || !fits(size.width) ||
      !fits(size.height)) {
    throw usage_problem(fmt::format("--size {}: write WIDTHxHEIGHT, each {} to {} pixels", text,
                                    kLeastSide, kMostSide));
  }
  return size;
}

void check(const RenderOrder& order) {
  if (order.recordings.size() > kMostRendered)
    throw usage_problem(fmt::format("render shows at most {} recordings", kMostRendered));
  if (order.frames.size() > kMostFramesShown)
    throw usage_problem(
        fmt::format("--frame: render shows at most {} frames of a recording", kMostFramesShown));
  if (order.turntable > 0 && !ends_with_webp(order.path))
    throw usage_problem("--turntable: it is a WebP file, so -o PATH must end in .webp");
  if (order.turntable > 0 && order.frames.size() > 1)
    throw usage_problem("--turntable: it shows one frame of each recording");
  for (const std::string& recording : order.recordings) {
    std::error_code error;  // there is no such file yet
    if (std::filesystem::equivalent(order.path, recording, error))
      throw unwritable(order.path, "it is the recording itself");
  }
}

void run_render(Context& context, const RenderOptions& options) {
  RenderOrder order = options.order;
  if (!options.size.empty()) order.size = read_size(options.size);
  check(order);
  Status status(context.terminal.err, context.terminal.err_is_watched);
  const RenderResult result = render(
      order, [&](const std::string& doing) { status.show({doing}); }, context.stop);
  status.clear();
  Json document{{"output", order.path},         {"width", result.size.width},
                {"height", result.size.height}, {"frames", result.frames},
                {"views", result.views},        {"grid_m", result.grid_m}};
  std::string colours;
  if (const ColourScale* scale = scale_of(order.colouring)) {
    document[scale->field] = result.most;
    colours = fmt::format(", {} up to {}", scale->name, scale->text(result.most));
  }
  const auto shown = static_cast<std::int64_t>(result.frames.size() * result.frames[0].size());
  const std::string views = result.views > 1 ? fmt::format(", {} views", result.views) : "";
  context.answer(document,
                 fmt::format("{}: {} x {} pixels, {}{}{}\n", order.path, result.size.width,
                             result.size.height, count_of(shown, "frame"), views, colours));
}

}  // namespace

void add_render(CLI::App& app, Context& context) {
  const std::map<std::string, Colouring> colourings{
      {"cloth", Colouring::kCloth}, {"panels", Colouring::kPanels},  {"strain", Colouring::kStrain},
      {"warp", Colouring::kWarp},   {"weft", Colouring::kWeft},      {"shear", Colouring::kShear},
      {"speed", Colouring::kSpeed}, {"bending", Colouring::kBending}};
  auto options = std::make_shared<RenderOptions>();
  RenderOrder& order = options->order;
  CLI::App* command = app.add_subcommand("render", "Make a picture of frames of recordings");
  command
      ->add_option("FILE", order.recordings, "Recordings, up to 6, in one scale through one camera")
      ->option_text("...")
      ->required()
      ->expected(-1);
  command->add_option("-o,--output", order.path, "PNG file to write, or .webp")
      ->type_name("PATH")
      ->required();
  auto* frame = command->add_option("--frame", order.frames, "Frames to show; else the last")
                    ->option_text("N,N,...")
                    ->delimiter(',')
                    ->allow_extra_args(false);
  command->add_option("--contact", order.contact, "So many frames instead, from first to last")
      ->option_text("N")
      ->check(CLI::Range(2, kMostFramesShown))
      ->excludes(frame);
  command
      ->add_option("--turntable", order.turntable,
                   "So many views, once around in 4 s, as a WebP file\nthat browsers play; else 48")
      ->option_text("[N]")
      ->expected(0, 1)
      ->default_str("48")
      ->check(CLI::Range(2, 360))
      ->excludes("--contact");
  command
      ->add_option("--colour", order.colouring,
                   "cloth: a front and a back\npanels: a colour for each\n"
                   "strain: the largest at each particle\n"
                   "warp, weft, shear: strain around each particle, by sign\n"
                   "speed: of each particle since the frame before\n"
                   "bending: energy for each area, by the rigidities of the textile at the start")
      ->transform(one_of(colourings))
      ->option_text("cloth|panels|strain|warp|weft|shear|speed|bending");
  command
      ->add_option("--azimuth", order.outlook.azimuth,
                   "Seen from the front (0), from the right (90); else 30")
      ->option_text("DEGREES")
      ->check(CLI::Range(-360.0, 360.0));
  command
      ->add_option("--elevation", order.outlook.elevation,
                   "Seen from above (89) or below (-89); else 20")
      ->option_text("DEGREES")
      ->check(CLI::Range(-89.0, 89.0));
  command
      ->add_option("--size", options->size,
                   "Pixels of the picture, each 64 to 8192;\nelse 960x720, 640x480 a frame,\nor "
                   "480x360 on a turntable")
      ->option_text("WxH");
  command->callback([&context, options] { run_render(context, *options); });
}

}  // namespace weft::client
