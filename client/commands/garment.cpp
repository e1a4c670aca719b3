#include <fmt/format.h>

#include <filesystem>

#include "client/commands/commands.h"
#include "client/exports/output_file.h"
#include "client/garments/garment_scene.h"
#include "client/garments/garment_templates.h"
#include "client/garments/pattern_file.h"
#include "client/imports/import.h"
#include "client/output/text.h"
#include "client/scene_file.h"
#include "client/textile_file.h"

namespace weft::client {
namespace {

struct NewGarmentOptions {
  std::string name;
  Person person;
  std::string path;
  bool replace = false;
};

// To the file, or where none is named to stdout.
void write_pattern(Context& context, const v1::Pattern& pattern, const std::string& path,
                   bool replace, const std::vector<std::string>& notes) {
  std::string text;
  for (const std::string& note : notes) text += note + '\n';
  if (path.empty()) {
    context.terminal.err << text;
    context.terminal.out << pattern_text(pattern) << std::flush;
    return;
  }
  write_new_file(path, pattern_text(pattern), replace);
  text += fmt::format("wrote {}: {}, {}\n", path, count_of(pattern.panels_size(), "panel"),
                      count_of(pattern.seams_size(), "seam"));
  context.answer({{"file", path},
                  {"panels", pattern.panels_size()},
                  {"seams", pattern.seams_size()},
                  {"notes", notes}},
                 text);
}

void run_new_garment(Context& context, const NewGarmentOptions& options) {
  const v1::Pattern pattern = make_garment(options.name, measures_by_options(options.person));
  write_pattern(context, pattern, options.path, options.replace, {});
}

struct ImportOptionsOfPattern {
  std::string from, path;
  bool replace = false;
};

void run_import(Context& context, const ImportOptionsOfPattern& options) {
  if (is_mesh_file(options.from))
    throw usage_problem(
        fmt::format("{} has triangles, not panels to cut; weft scene new --mesh {} "
                    "makes a scene of it",
                    options.from, options.from));
  const ImportedPattern read = read_pattern(options.from);
  write_pattern(context, read.pattern, options.path, options.replace, read.notes);
}

struct BuildOptions {
  std::string pattern, path;
  std::optional<double> edge_m, deflate_m;
  std::string textile = "wool_tropical";
  std::vector<std::string> panel_textiles, bodies;
  bool replace = false;
};

void set_panel_textile(v1::Pattern& pattern, const std::string& given) {
  const auto [name, textile] = read_setting(given);
  const auto found = std::ranges::find(*pattern.mutable_panels(), name, &v1::PatternPanel::name);
  if (found == pattern.mutable_panels()->end())
    throw usage_problem(fmt::format("--panel-textile: the pattern has no panel \"{}\"", name));
  *found->mutable_textile() = textile_named(textile);
}

void run_build(Context& context, const BuildOptions& options) {
  context.prefer_embedded();
  ImportedPattern read = read_pattern(options.pattern);
  for (const std::string& given : options.panel_textiles) set_panel_textile(read.pattern, given);
  GarmentOrder order{
      .name = plain_name(std::filesystem::path(options.pattern).stem().string(), "garment"),
      .pattern = std::move(read.pattern),
      .textile = textile_named(options.textile),
      .edge_m = options.edge_m,
      .deflate_m = options.deflate_m};
  for (const std::string& path : options.bodies) order.bodies.push_back(garment_body(path));
  GarmentScene made = make_garment_scene(context.connection(), order);
  std::string text;
  for (const std::string& note : read.notes) text += note + '\n';
  text += made.text;
  if (!options.path.empty()) {
    write_new_file(options.path, scene_text(made.scene), options.replace);
    made.json["file"] = options.path;
    text += "wrote " + options.path + '\n';
  }
  context.answer(made.json, text);
}

void add_output(CLI::App& command, std::string& path, bool& replace, const char* description) {
  command.add_option("-o,--output", path, description)->type_name("FILE");
  command.add_flag("--force", replace, "Replace a file that exists");
}

void add_new_garment(CLI::App& group, Context& context) {
  auto options = std::make_shared<NewGarmentOptions>();
  CLI::App* command =
      group.add_subcommand("new", "Write the pattern of a garment, by the tape or by size");
  command->add_option("NAME", options->name, "Garment; see below")->option_text(" ")->required();
  add_person(*command, options->person);
  add_output(*command, options->path, options->replace,
             "Pattern file to write; else it goes to stdout");
  std::string text = "Garments:\n";
  for (const GarmentInfo& info : garment_templates())
    text += fmt::format("  {:8}  {}\n", info.name, info.description);
  command->footer(text + R"(
Panels are placed around the dress form of the same measures (weft body new).
  weft body new --size 40 -o body.obj
  weft garment new tshirt --size 40 -o tshirt.json
  weft garment build tshirt.json --body body.obj -o scene.json
)");
  command->callback([&context, options] { run_new_garment(context, *options); });
}

void add_import(CLI::App& group, Context& context) {
  auto options = std::make_shared<ImportOptionsOfPattern>();
  CLI::App* command = group.add_subcommand("import", "Make a pattern file of another program's");
  command->add_option("FILE", options->from, "JSON of GarmentCode or Garment-Pattern-Generator")
      ->option_text(" ")
      ->required();
  add_output(*command, options->path, options->replace,
             "Pattern file to write; else it goes to stdout");
  command->footer(R"(
Panels keep their names, made plain, edges their numbers, and all their places,
in m. Panels drawn from the back are mirrored; lower_interface is a waist.
Meshes (.obj, .glb) are sewn already: weft scene new --mesh takes them.
)");
  command->callback([&context, options] { run_import(context, *options); });
}

void add_build(CLI::App& group, Context& context) {
  auto options = std::make_shared<BuildOptions>();
  CLI::App* command =
      group.add_subcommand("build", "Cut a pattern into triangles, sew them, and write a scene");
  command->add_option("PATTERN", options->pattern, "Pattern file, or one of GarmentCode")
      ->option_text(" ")
      ->required();
  command->add_option("--edge", options->edge_m, "Wanted length of triangles' edges, m; else 0.01")
      ->type_name("M");
  command
      ->add_option("--textile", options->textile,
                   "Preset (weft textile list), or a file (weft textile new)")
      ->option_text("NAME|FILE.json");
  command
      ->add_option("--panel-textile", options->panel_textiles,
                   "Of one panel, as --textile; may be given again")
      ->option_text("PANEL=NAME|FILE.json")
      ->allow_extra_args(false);
  command
      ->add_option("--body", options->bodies,
                   "Closed triangles that wear it: .obj, .gltf or .glb; may be given again")
      ->type_name("FILE")
      ->allow_extra_args(false);
  command
      ->add_option("--deflate", options->deflate_m,
                   "By how much bodies are smaller while seams close, m, so that thighs part")
      ->type_name("M");
  add_output(*command, options->path, options->replace,
             "Scene file to write; else the pattern is looked at alone");
  command->footer(R"(
What is noteworthy is said with its panel and edge: SEAM_UNEQUAL (one side is
gathered), EDGE_SHORT, CORNER_SHARP, PANEL_NARROW (low triangles, short steps),
PANEL_TURNED (seams turn a panel over), PANELS_OVERLAP (panels that are placed
into each other in one plane start apart). What cannot be cut or sewn is
refused.
)");
  command->callback([&context, options] { run_build(context, *options); });
}

}  // namespace

void add_garment(CLI::App& app, Context& context) {
  CLI::App* garment = add_group(app, "garment", "Make patterns, and sheets of them");
  add_new_garment(*garment, context);
  add_import(*garment, context);
  add_build(*garment, context);
}

}  // namespace weft::client
