#include "client/exports/export.h"

#include <fmt/format.h>

#include "client/commands/commands.h"
#include "client/output/status.h"
#include "client/output/text.h"

namespace weft::client {
namespace {

struct ExportOptions {
  std::string recording;
  std::string frames;
  ExportOrder order;
};

void run_export(Context& context, const ExportOptions& options) {
  ExportOrder order = options.order;
  order.frames = read_frame_range(options.frames);
  RecordingReader recording(options.recording);
  Status status(context.terminal.err, context.terminal.err_is_watched);
  const ExportResult result = export_recording(recording, order, [&](const ExportResult& so_far) {
    status.show({fmt::format("{}: {}", order.path, count_of(so_far.frames, "frame"))});
  });
  status.clear();
  context.answer(
      {{"output", order.path}, {"frames", result.frames}, {"particles", result.particles}},
      fmt::format("{}: {} of {}\n", order.path, count_of(result.frames, "frame"),
                  count_of(result.particles, "particle")));
}

}  // namespace

void add_export(CLI::App& app, Context& context) {
  const std::map<std::string, ExportFormat> formats{
      {"obj", ExportFormat::kObj},   {"pc2", ExportFormat::kPc2}, {"mdd", ExportFormat::kMdd},
      {"gltf", ExportFormat::kGltf}, {"vtk", ExportFormat::kVtk}, {"usda", ExportFormat::kUsda},
      {"npz", ExportFormat::kNpz},   {"csv", ExportFormat::kCsv}};
  auto options = std::make_shared<ExportOptions>();
  ExportOrder& order = options->order;
  CLI::App* command =
      app.add_subcommand("export", "Write a recording as files that other tools open");
  command->add_option("FILE", options->recording, "Recording")->option_text(" ")->required();
  command
      ->add_option(
          "-f,--format", order.format,
          "obj: a directory of meshes\npc2, mdd: point caches\n"
          "gltf: an animated mesh, .glb\nvtk: a collection of meshes, .pvd\n"
          "usda: an animated mesh in USD text\nnpz: arrays of NumPy\ncsv: a row for every frame")
      ->required()
      ->transform(one_of(formats))
      ->option_text("obj|pc2|mdd|gltf|vtk|usda|npz|csv, REQUIRED");
  command->add_option("-o,--output", order.path, "File to write; for obj a directory")
      ->type_name("PATH")
      ->required();
  command->add_option("--sheet", order.sheet, "This sheet only; else all, in scene order")
      ->type_name("NAME");
  auto* frames =
      command->add_option("--frames", options->frames, "Frames A to B; either may be left out")
          ->option_text("A:B");
  auto* every = command->add_option("--every", order.every, "Of the frames each Nth only")
                    ->option_text("N")
                    ->check(CLI::Range(std::int64_t{1}, std::int64_t{1'000'000'000}));
  command->add_option("--times", order.times_s, "Frames at these simulated times instead, s")
      ->option_text("S,S,...")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->excludes(frames, every);
  command->callback([&context, options] { run_export(context, *options); });
}

}  // namespace weft::client
