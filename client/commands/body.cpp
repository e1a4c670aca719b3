#include <fmt/format.h>

#include <algorithm>

#include "client/commands/commands.h"
#include "client/exports/output_file.h"
#include "client/figures/dress_form.h"
#include "client/figures/mesh_file.h"
#include "client/output/text.h"

namespace weft::client {
namespace {

struct BodyOptions {
  Person person;
  std::string path;
  bool replace = false;
};

void run_new_body(Context& context, const BodyOptions& options) {
  const bool binary = options.path.ends_with(".glb");
  if (!binary && !options.path.ends_with(".obj"))
    throw usage_problem("--output " + options.path + ": ends in neither .glb nor .obj");
  const DressForm form = make_dress_form(measures_by_options(options.person));
  write_new_file(options.path, binary ? glb_of(form.mesh) : obj_of(form.mesh), options.replace);

  std::string text = fmt::format("stature     {:.3f} m\n", form.stature);
  Json girths = Json::array();
  for (const DressForm::Girth& girth : form.girths) {
    text += fmt::format("{:<11} {:.3f} m, at a height of {:.3f} m\n", girth.name, girth.found,
                        girth.height);
    girths.push_back({{"name", girth.name},
                      {"wanted_m", girth.wanted},
                      {"found_m", girth.found},
                      {"height_m", girth.height}});
  }
  const auto triangles = static_cast<std::int64_t>(form.mesh.triangles.size());
  text += fmt::format("wrote {}: {}\n", options.path, count_of(triangles, "triangle"));
  context.answer({{"file", options.path},
                  {"stature_m", form.stature},
                  {"girths", std::move(girths)},
                  {"triangles", triangles}},
                 text);
}

}  // namespace

void add_person(CLI::App& command, Person& person) {
  const std::map<std::string, FigureKind> figures{{"female", FigureKind::kFemale},
                                                  {"male", FigureKind::kMale}};
  Measures& measures = person.measures;
  command.add_option("--figure", measures.figure, "Of the body; else female")
      ->transform(one_of(figures))
      ->option_text("female|male");
  command
      .add_option("--size", person.size,
                  "As in shops, such as 40 of a woman, 50 of a man; gives the girths not given")
      ->type_name("N");
  for (const LengthInfo& each : person_lengths()) {
    std::string name = each.name;
    std::ranges::replace(name, '_', '-');
    command.add_option("--" + name, measures.*each.value, each.description)
        ->type_name("M")
        ->check(CLI::Range(each.least, each.most));
  }
  command.add_option("--arm-angle", measures.arm_angle, "Of the arms below the level, degrees")
      ->type_name("DEG")
      ->check(CLI::Range(0.0, kMostArmAngle));
}

Measures measures_by_options(const Person& person) {
  try {
    return measures_of(person);
  } catch (const Violation& violation) {
    throw usage_problem(fmt::format("--{}: {}", violation.field, violation.description));
  }
}

void add_body(CLI::App& app, Context& context) {
  CLI::App* body = add_group(app, "body", "Make bodies for cloth to be worn by");
  auto options = std::make_shared<BodyOptions>();
  CLI::App* command =
      body->add_subcommand("new", "Write a dress form by the tape: a standing, closed figure");
  add_person(*command, options->person);
  command->add_option("-o,--output", options->path, "File to write: .glb or .obj")
      ->type_name("FILE")
      ->required();
  command->add_flag("--force", options->replace, "Replace a file that exists");
  command->footer(R"(
Girths are those of ISO 8559-1; what is not given follows from the rest. The form
has its feet at y = 0 and looks along z.
  weft body new --figure female --bust 0.92 --waist 0.74 --hip 1.0 -o body.glb
  weft body new --size 44 -o body.obj
  weft scene new --mesh dress.obj --body body.glb -o scene.json
)");
  command->callback([&context, options] { run_new_body(context, *options); });
}

}  // namespace weft::client
