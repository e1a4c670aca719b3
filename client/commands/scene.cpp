#include <fmt/format.h>

#include "client/commands/commands.h"
#include "client/exports/output_file.h"
#include "client/message_field.h"
#include "client/output/text.h"
#include "client/scene_file.h"
#include "client/templates/templates.h"
#include "client/textile_file.h"

namespace weft::client {
namespace {

struct NewOptions {
  std::string name;
  std::string path;
  bool replace = false;
  std::string textile;
  std::vector<std::string> fields;  // "solver.safety=0.5"
  TemplateOptions values;
};

void run_new(Context& context, NewOptions options) {
  if (!options.textile.empty()) options.values.textile = textile_named(options.textile);
  v1::Scene scene = make_template(options.name, options.values);
  for (const std::string& field : options.fields) {
    const auto [place, value] = read_setting(field);
    set_field(scene, place, value);
  }
  if (options.path.empty()) {
    context.terminal.out << scene_text(scene) << std::flush;
    return;
  }
  write_new_file(options.path, scene_text(scene), options.replace);
  context.answer({{"file", options.path}}, "wrote " + options.path + '\n');
}

void run_check(Context& context, const std::string& path) {
  v1::CreateSessionRequest request;
  request.set_validate_only(true);
  context.prefer_embedded();
  const v1::Session session = create_session(context.connection(), read_scene(path), request);

  std::int64_t particles = 0;
  for (const auto& sheet : session.scene().sheets()) {
    particles += std::int64_t{sheet.grid().rows()} * sheet.grid().columns();
  }
  const std::string heading = fmt::format(
      "{}: {}, {}, {}\n", path, count_of(session.scene().sheets_size(), "sheet"),
      count_of(particles, "particle"), count_of(session.scene().colliders_size(), "collider"));
  const auto stats = context.connection().call(&v1::ServerService::Stub::GetServerStats,
                                               v1::GetServerStatsRequest());
  context.answer(to_json(session.plan()), heading + plan_text(session.plan(), &stats));
}

std::string template_list() {
  std::string text = "Templates:\n";
  std::size_t width = 0;
  for (const auto& info : templates()) width = std::max(width, info.name.size());
  for (const auto& info : templates())
    text += fmt::format("  {:{}}  {}\n", info.name, width, info.description);
  return text;
}

void add_new(CLI::App& scene, Context& context) {
  const std::map<std::string, v1::Evaluator> evaluators{{"series", v1::EVALUATOR_SERIES},
                                                        {"exact", v1::EVALUATOR_EXACT},
                                                        {"linearized", v1::EVALUATOR_LINEARIZED},
                                                        {"polynomial", v1::EVALUATOR_POLYNOMIAL}};
  const std::map<std::string, v1::Accuracy> accuracies{{"draft", v1::ACCURACY_DRAFT},
                                                       {"standard", v1::ACCURACY_STANDARD},
                                                       {"fine", v1::ACCURACY_FINE}};
  auto options = std::make_shared<NewOptions>();
  TemplateOptions& values = options->values;
  CLI::App* command = scene.add_subcommand("new", "Write a scene file from a template");
  command->add_option("-t,--template", options->name, "Template to start from")
      ->type_name("NAME")
      ->required();
  command->add_option("-o,--output", options->path, "Scene file to write; else it goes to stdout")
      ->type_name("FILE");
  command->add_flag("--force", options->replace, "Replace a file that exists");
  command->add_option("--rows", values.rows, "Particles along z")->type_name("N");
  command->add_option("--columns", values.columns, "Particles along x")->type_name("N");
  command->add_option("--spacing", values.spacing_m, "Distance between neighbours, m")
      ->type_name("M")
      ->check(CLI::Range(1e-5, 10.0));
  command
      ->add_option("--textile", options->textile,
                   "Preset (weft textile list), or a file (weft textile new)")
      ->option_text("NAME|FILE.json");
  command->add_option("--bend", values.bend, "k_b in the paper's unit, 1e-4 N m^2 (paper-*)")
      ->type_name("K");
  command->add_option("--evaluator", values.evaluator, "How bending is computed")
      ->transform(one_of(evaluators))
      ->option_text("series|exact|linearized|polynomial");
  command->add_option("--segments", values.segments, "Line segments of the linearized law")
      ->type_name("N")
      ->check(CLI::Range(1, 65536));
  command->add_flag("--fold-clamp", values.fold_clamp, "Linearize the clamped function (eq. 5)");
  command->add_flag("--optimal-breakpoints", values.optimal_breakpoints,
                    "Shorter segments where the law bends more");
  command->add_option("--accuracy", values.accuracy, "How close to the equations, and how fast")
      ->transform(one_of(accuracies))
      ->option_text("draft|standard|fine");
  command
      ->add_option("--set", options->fields,
                   "One value by its place, such as sheets[0].skin_m=0.003; may be given again")
      ->option_text("FIELD=VALUE ...")
      ->allow_extra_args(false);
  command->footer(template_list());
  command->callback([&context, options] { run_new(context, *options); });
}

void add_check(CLI::App& scene, Context& context) {
  auto path = std::make_shared<std::string>();
  CLI::App* command =
      scene.add_subcommand("check", "Say what the solver would do, or all that is wrong");
  command->alias("explain");
  command->add_option("FILE", *path, "Scene file")->option_text(" ")->required();
  command->callback([&context, path] { run_check(context, *path); });
}

}  // namespace

void add_scene(CLI::App& app, Context& context) {
  CLI::App* scene = add_group(app, "scene", "Make and check scene files");
  add_new(*scene, context);
  add_check(*scene, context);
}

}  // namespace weft::client
