#include <fmt/format.h>

#include <filesystem>
#include <numbers>

#include "client/commands/commands.h"
#include "client/exports/output_file.h"
#include "client/imports/mesh_data.h"
#include "client/imports/mesh_facts.h"
#include "client/imports/mesh_scene.h"
#include "client/message_field.h"
#include "client/output/text.h"
#include "client/scene_file.h"
#include "client/templates/templates.h"
#include "client/textile_file.h"

namespace weft::client {
namespace {

// Of a scene made from a mesh.
struct MeshOptions {
  std::string path;
  std::vector<std::string> panel_textiles;  // "front=denim_11oz"
  std::string unit = "m";
  std::string up = "y";
  double grain_degrees = 0;
  ImportOptions import{};
  MeshSceneOptions scene{};
};

struct NewOptions {
  std::string name;
  MeshOptions mesh;
  std::vector<std::string> bodies;  // files of triangles
  std::string path;
  bool replace = false;
  std::string textile;
  std::vector<std::string> fields;  // "solver.safety=0.5"
  TemplateOptions values;
};

// A scene, and what there is to say about it.
struct NewScene {
  v1::Scene scene;
  std::string text;
  Json json = Json::object();
};

// How files have their positions.
ImportOptions placed(const MeshOptions& options) {
  const std::map<std::string, double> units{{"m", 1}, {"cm", 0.01}, {"mm", 0.001}};
  ImportOptions import = options.import;
  import.unit_m = units.at(options.unit);
  import.z_up = options.up == "z";
  return import;
}

void add_body_file(const std::string& path, const MeshOptions& options, NewScene& made) {
  const ImportedMesh mesh = import_body(path, placed(options));
  v1::Collider* body = made.scene.add_colliders();
  body->set_name(plain_name(std::filesystem::path(path).stem().string(), "body"));
  *body->mutable_mesh()->mutable_data() = body_data(mesh);
  made.text += fmt::format("body        {}: {}\n", body->name(),
                           count_of(static_cast<std::int64_t>(mesh.triangles.size()), "triangle"));
  for (const std::string& note : mesh.notes) made.text += fmt::format("            {}\n", note);
  made.json["bodies"].push_back({{"name", body->name()}, {"triangles", mesh.triangles.size()}});
}

NewScene from_mesh(MeshOptions options, const TemplateOptions& values) {
  const double grain = options.grain_degrees * std::numbers::pi / 180;
  options.import = placed(options);
  options.import.grain_rad = options.scene.grain_rad = grain;
  options.scene.textile = values.textile;
  options.scene.accuracy = values.accuracy;
  for (const std::string& given : options.panel_textiles) {
    const auto [panel, textile] = read_setting(given);
    options.scene.panel_textiles[panel] = textile_named(textile);
  }
  const Import import = import_mesh(options.path, options.import);
  const MeshFacts facts = facts_of(import);
  NewScene made{make_mesh_scene(options.path, import.mesh, options.scene),
                facts_text(import, facts)};
  made.json["mesh"] = facts_json(import, facts);
  std::vector<int> counts;
  for (const v1::Pin& pin : made.scene.sheets(0).pins()) counts.push_back(pin.particles_size());
  for (std::size_t i = 0; i < counts.size(); ++i)
    made.text +=
        fmt::format("pinned      {}: {}\n", options.scene.pins[i], count_of(counts[i], "particle"));
  made.json["pinned"] = counts;
  return made;
}

NewScene new_scene(const NewOptions& options) {
  if (!options.mesh.path.empty()) return from_mesh(options.mesh, options.values);
  if (options.name.empty())
    throw usage_problem("--template says what to start from, or --mesh; see weft scene new --help");
  return {make_template(options.name, options.values), ""};
}

void run_new(Context& context, NewOptions options) {
  if (!options.textile.empty()) options.values.textile = textile_named(options.textile);
  NewScene made = new_scene(options);
  for (const std::string& body : options.bodies) add_body_file(body, options.mesh, made);
  for (const std::string& field : options.fields) {
    const auto [place, value] = read_setting(field);
    set_field(made.scene, place, value);
  }
  if (options.path.empty()) {
    context.terminal.err << made.text;
    context.terminal.out << scene_text(made.scene) << std::flush;
    return;
  }
  write_new_file(options.path, scene_text(made.scene), options.replace);
  Json answer{{"file", options.path}};
  answer.update(made.json);
  context.answer(answer, made.text + "wrote " + options.path + '\n');
}

std::int64_t particles_of(const v1::Sheet& sheet) {
  if (sheet.has_grid()) return std::int64_t{sheet.grid().rows()} * sheet.grid().columns();
  constexpr std::size_t kPosition = 3 * sizeof(float), kFlat = 2 * sizeof(float);
  const v1::MeshData& mesh = sheet.triangles().data();
  return static_cast<std::int64_t>(mesh.positions_m().empty()
                                       ? mesh.flat_m().size() / kFlat
                                       : mesh.positions_m().size() / kPosition);
}

struct CheckOptions {
  std::string path;
  std::vector<std::string> refused;
};

void run_check(Context& context, const CheckOptions& options) {
  const auto& [path, refused] = options;
  v1::CreateSessionRequest request;
  request.set_validate_only(true);
  request.mutable_refused_warnings()->Add(refused.begin(), refused.end());
  context.prefer_embedded();
  const v1::Scene scene = read_scene(path);
  const v1::Session session = create_session(context.connection(), scene, request);

  std::int64_t particles = 0;
  for (const auto& sheet : scene.sheets()) particles += particles_of(sheet);
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

constexpr const char* kMeshHelp = R"(
A mesh becomes a sheet of triangles: its flat shape is its UV, a panel is a
group (g) of an OBJ file where it has several, else a material (usemtl), else an
object (o); of glTF a primitive. Polygons are cut into triangles. What was found
is said: panels, borders, seams, scale, the triangles that keep the step short.
It does not pass through itself, unless --set cloth_contact=false.
Top is +y and right +x, as seen from the front. Lines of C-IPC, "stitch POINT A B
SHARE" in an OBJ file, sew a point to the nearer of two, in the mean of their
places; without UV the flat shape is then the planes of the pieces. What cannot
be simulated is refused with its place in the file.
  weft scene new --mesh shirt.obj --pin border:top -o shirt.json
  weft scene new --mesh dress.glb --mend --textile jersey_interlock \
      --panel-textile belt=denim_11oz --body figure.obj -o dress.json

--mend joins points in one place, drops triangles without area, turns those that
face the other way, and joins the ends of slivers, triangles lower than a
quarter of the median, where no border or seam moves; it says what it did.
)";

void refuse_options_of_templates(const CLI::App& command) {
  for (const char* option : {"--template", "--rows", "--columns", "--spacing", "--bend",
                             "--evaluator", "--segments", "--fold-clamp", "--optimal-breakpoints"})
    if (command.count(option) > 0)
      throw usage_problem(fmt::format("{} is for templates; --mesh excludes it", option));
}

void add_mesh_options(CLI::App& command, MeshOptions& options) {
  CLI::Option* mesh =
      command.add_option("--mesh", options.path, "Triangles to start from: .obj, .gltf or .glb")
          ->type_name("FILE");
  const auto of_mesh = [mesh](CLI::Option* option) { return option->needs(mesh); };
  of_mesh(command.add_option("--flat-scale", options.import.flat_scale,
                             "m for a unit of UV; else found by comparing lengths"))
      ->type_name("M")
      ->check(CLI::Range(1e-6, 1e6));
  command.add_option("--unit", options.unit, "Of positions in the mesh and in bodies; else m")
      ->check(CLI::IsMember({"m", "cm", "mm"}))
      ->option_text("m|cm|mm");
  command.add_option("--up", options.up, "Up in the mesh and in bodies; else y")
      ->check(CLI::IsMember({"y", "z"}))
      ->option_text("y|z");
  of_mesh(command.add_option("--grain", options.grain_degrees,
                             "From the v axis of UV to the warp, degrees, anticlockwise"))
      ->type_name("DEG")
      ->check(CLI::Range(-360.0, 360.0));
  of_mesh(command.add_option("--panel-textile", options.panel_textiles,
                             "Of one panel, as --textile; may be given again"))
      ->option_text("PANEL=NAME|FILE.json")
      ->allow_extra_args(false);
  of_mesh(command.add_option("--pin", options.scene.pins,
                             "Hold border:top (bottom, left, right, or its number), panel:NAME, "
                             "panel:NAME:border:top, box:x0,y0,z0:x1,y1,z1 (m), or particles "
                             "0,5,7-12; may be given again"))
      ->option_text("WHAT")
      ->allow_extra_args(false);
  of_mesh(command.add_flag("--mend", options.import.mend, "Mend what is safe; see below"));
}

void add_new(CLI::App& scene, Context& context) {
  const std::map<std::string, v1::Evaluator> evaluators{{"series", v1::EVALUATOR_SERIES},
                                                        {"exact", v1::EVALUATOR_EXACT},
                                                        {"linearized", v1::EVALUATOR_LINEARIZED},
                                                        {"polynomial", v1::EVALUATOR_POLYNOMIAL}};
  auto options = std::make_shared<NewOptions>();
  TemplateOptions& values = options->values;
  CLI::App* command =
      scene.add_subcommand("new", "Write a scene file from a template, or from a mesh");
  command->add_option("-t,--template", options->name, "Template to start from")->type_name("NAME");
  add_mesh_options(*command, options->mesh);
  command
      ->add_option("--body", options->bodies,
                   "Closed triangles that particles do not enter: .obj, .gltf or .glb; may be "
                   "given again")
      ->type_name("FILE")
      ->allow_extra_args(false);
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
  add_accuracy(*command, values.accuracy);
  command
      ->add_option("--set", options->fields,
                   "One value by its place, such as sheets[0].skin_m=0.003; may be given again")
      ->option_text("FIELD=VALUE ...")
      ->allow_extra_args(false);
  command->footer(template_list() + kMeshHelp);
  command->callback([&context, options, command] {
    if (!options->mesh.path.empty()) refuse_options_of_templates(*command);
    run_new(context, *options);
  });
}

void add_check(CLI::App& scene, Context& context) {
  auto options = std::make_shared<CheckOptions>();
  CLI::App* command =
      scene.add_subcommand("check", "Say what the solver would do, or all that is wrong");
  command->alias("explain");
  command->add_option("FILE", options->path, "Scene file")->option_text(" ")->required();
  add_refuse_option(*command, options->refused);
  command->callback([&context, options] { run_check(context, *options); });
}

}  // namespace

void add_scene(CLI::App& app, Context& context) {
  CLI::App* scene = add_group(app, "scene", "Make and check scene files");
  add_new(*scene, context);
  add_check(*scene, context);
}

}  // namespace weft::client
