#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>

#include "client/commands/commands.h"
#include "client/exports/output_file.h"
#include "client/message_field.h"
#include "client/output/text.h"
#include "client/scene_file.h"
#include "client/templates/templates.h"
#include "client/textile_change.h"
#include "client/textile_file.h"

namespace weft::client {
namespace {

using google::protobuf::FieldDescriptor;

void list_textiles(Context& context) {
  context.prefer_embedded();
  const auto all = context.connection().call(&Textiles::ListTextiles, v1::ListTextilesRequest());
  Table table({"NAME", "TEXTILE", "kg/m^2", "STATUS"});
  for (const auto& textile : all.textiles()) {
    const std::string name = textile.name().substr(textile.name().find('/') + 1);
    const std::string status = textile.status().substr(0, textile.status().find(" ("));
    table.add({name, textile.display_name(),
               number_text(textile.values().areal_density_kg_per_m2()),
               textile.missing().empty() ? status : "incomplete"});
  }
  context.answer(to_json(all), table.text(context.terminal.columns));
}

// Place of a word in the list, from 1; at its end where it is new.
std::size_t index_in(std::vector<std::string>& list, const std::string& word) {
  const auto found = std::find(list.begin(), list.end(), word);
  const auto place = static_cast<std::size_t>(found - list.begin()) + 1;
  if (found == list.end()) list.push_back(word);
  return place;
}

// The value a sheet gets; the field's name has its unit. Empty where the field is not of the model.
std::string si_text(const v1::MeasuredTextile& values, const std::string& field) {
  const FieldDescriptor* found = values.GetDescriptor()->FindFieldByName(field);
  return found == nullptr ? "" : number_text(values.GetReflection()->GetDouble(values, found));
}

// A preset's, or those of a file.
v1::TextilePreset values_of(Context& context, const std::string& name) {
  if (is_textile_file(name)) return read_textile_file(name);
  v1::GetTextileRequest request;
  request.set_name(name.starts_with("textiles/") ? name : "textiles/" + name);
  context.prefer_embedded();
  return context.connection().call(&Textiles::GetTextile, request);
}

void run_show(Context& context, const std::string& name) {
  const v1::TextilePreset textile = values_of(context, name);
  Facts facts;
  facts.add("textile", textile.display_name())
      .add("composition", textile.composition())
      .add("use", textile.typical_use())
      .add("status", textile.status());
  if (!textile.missing().empty())
    facts.add("missing", fmt::format("{}", fmt::join(textile.missing(), ", ")));
  if (!textile.note().empty()) facts.add("note", textile.note());
  Table table({"FIELD", "SI", "GIVEN", "UNIT", "STATUS"});
  std::vector<std::string> sources;
  for (const auto& property : textile.properties()) {
    table.add({property.field(), si_text(textile.values(), property.field()), property.value(),
               property.unit(),
               fmt::format("{} [{}]", property.status(), index_in(sources, property.source()))});
  }
  std::string notes;
  for (std::size_t i = 0; i < sources.size(); ++i)
    notes += fmt::format("[{}]  {}\n", i + 1, sources[i]);
  context.answer(to_json(textile), facts.text() + '\n' + table.text(context.terminal.columns) +
                                       '\n' + wrapped(notes));
}

struct SetOptions {
  std::string session;
  std::string sheet;
  std::string textile;              // preset or file
  std::vector<std::string> values;  // "raw.bend_n_m2=1e-4"
  std::optional<double> duration_s;
};

double read_number(const std::string& text, const std::string& setting) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    throw usage_problem("--set " + setting + ": not a number");
  }
  return value;
}

void run_set(Context& context, const SetOptions& options) {
  if (options.textile.empty() && options.values.empty()) {
    throw usage_problem("textile set: give --textile or --set");
  }
  TextileChange change{.sheet = options.sheet, .duration_s = options.duration_s};
  if (!options.textile.empty()) change.textile = textile_named(options.textile);
  for (const auto& setting : options.values) {
    const auto [field, value] = read_setting(setting);
    change.values.emplace_back(field, read_number(value, setting));
  }
  const std::string name = context.session_name(options.session);
  const v1::UpdateTextileRequest request =
      textile_request(context.connection().get_session(name), change);
  const auto response = context.connection().call(&Sessions::UpdateTextile, request);
  context.answer(to_json(response),
                 fmt::format("applied from frame {}\n{}", response.applied_frame(),
                             plan_text(response.plan())));
}

// A number of a textile as it is given to `textile new`.
struct Property {
  const char* option;
  const char* field;  // of MeasuredTextile
  const char* placeholder;
  const char* unit;
  const char* description;
};
constexpr std::array kProperties{
    Property{"--areal-density", "areal_density_kg_per_m2", "KG_PER_M2", "kg/m^2", "Mass per area"},
    Property{"--tensile-warp", "tensile_warp_n_per_m", "N_PER_M", "N/m",
             "Tensile stiffness along the warp, by width"},
    Property{"--tensile-weft", "tensile_weft_n_per_m", "N_PER_M", "N/m", "The same along the weft"},
    Property{"--shear", "shear_n_per_m", "N_PER_M", "N/m", "Shear stiffness per radian"},
    Property{"--bend-warp", "bend_rigidity_warp_n_m", "N_M", "N m",
             "Bending rigidity along the warp"},
    Property{"--bend-weft", "bend_rigidity_weft_n_m", "N_M", "N m", "The same along the weft"},
    Property{"--air-drag", "air_drag_kg_per_m2_s", "KG_PER_M2_S", "kg/(m^2 s)",
             "Drag in still air, 0 if absent"},
};

struct NewTextileOptions {
  std::string path;
  bool replace = false;
  std::string from;  // preset or file
  std::string display_name, composition, source;
  std::array<std::optional<double>, kProperties.size()> values;
};

// Puts the value in, with where it comes from.
void set_property(const Property& property, double value, const std::string& source,
                  v1::TextilePreset& textile) {
  const std::string text = fmt::format("{}", value);
  set_field(*textile.mutable_values(), property.field, text);
  const auto same = [&](const auto& each) { return each.field() == property.field; };
  auto& all = *textile.mutable_properties();
  const auto found = std::find_if(all.begin(), all.end(), same);
  v1::TextileProperty& entry = found == all.end() ? *all.Add() : *found;
  entry.set_field(property.field);
  entry.set_value(text);
  entry.set_unit(property.unit);
  entry.set_status(source.empty() ? "assumed" : "measured");
  entry.set_source(source.empty() ? "given without a source" : source);
  auto& missing = *textile.mutable_missing();
  missing.erase(std::remove(missing.begin(), missing.end(), property.field), missing.end());
}

// Has the solver say what is wrong with the values, in the words of the options.
void check_textile(Context& context, const v1::TextilePreset& textile) {
  v1::Textile values;
  *values.mutable_measured() = textile.values();
  v1::CreateSessionRequest request;
  request.set_validate_only(true);
  context.prefer_embedded();
  try {
    create_session(context.connection(), make_template("hang", {.textile = values}), request);
  } catch (const Problem& problem) {
    if (problem.violations.empty()) throw;
    std::vector<Violation> violations = problem.violations;
    for (Violation& violation : violations)
      for (const Property& property : kProperties)
        if (violation.field.ends_with(property.field)) violation.field = property.option;
    Problem named(problem.exit, problem.code, problem.reason,
                  violations[0].field + ": " + violations[0].description);
    named.violations = std::move(violations);
    throw named;
  }
}

void run_new_textile(Context& context, const NewTextileOptions& options) {
  v1::TextilePreset textile;
  if (!options.from.empty()) textile = values_of(context, options.from);
  if (options.from.empty())
    for (const Property& property : kProperties)
      if (std::string_view(property.option) != "--air-drag") textile.add_missing(property.field);
  textile.clear_name();
  std::vector<std::string> given;
  for (std::size_t i = 0; i < kProperties.size(); ++i) {
    if (!options.values[i]) continue;
    set_property(kProperties[i], *options.values[i], options.source, textile);
    given.emplace_back(kProperties[i].field);
  }
  if (!options.from.empty() && !given.empty()) {
    textile.set_note(fmt::format("{} with values of its own: {}. Of the former: {}", options.from,
                                 fmt::join(given, ", "),
                                 textile.note().empty() ? "no note." : textile.note()));
    textile.set_status("composed");
  } else if (options.from.empty()) {
    textile.set_status(options.source.empty() ? "assumed" : "measured");
  }
  if (!options.display_name.empty()) textile.set_display_name(options.display_name);
  if (!options.composition.empty()) textile.set_composition(options.composition);
  if (textile.display_name().empty())
    textile.set_display_name(std::filesystem::path(options.path).stem().string());

  std::vector<std::string> absent;
  for (const Property& property : kProperties)
    for (const std::string& field : textile.missing())
      if (field == property.field) absent.emplace_back(property.option);
  if (!absent.empty())
    throw usage_problem(fmt::format("textile new: give {}; or --from a textile that has them",
                                    fmt::join(absent, ", ")));
  check_textile(context, textile);
  write_new_file(options.path, textile_file_text(textile), options.replace);
  context.answer({{"file", options.path}}, "wrote " + options.path + '\n');
}

void add_new_textile(CLI::App& group, Context& context) {
  auto options = std::make_shared<NewTextileOptions>();
  CLI::App* command = group.add_subcommand("new", "Write a textile of your own to a file");
  command->add_option("-o,--output", options->path, "Textile file to write, *.json")
      ->type_name("FILE.json")
      ->required();
  command->add_flag("--force", options->replace, "Replace a file that exists");
  command->add_option("--from", options->from, "Preset or file that has the values not given")
      ->option_text("NAME|FILE.json");
  command->add_option("--display-name", options->display_name, "What people call it")
      ->type_name("TEXT");
  command->add_option("--composition", options->composition, "Fibres")->type_name("TEXT");
  command->add_option("--source", options->source, "Where the values given come from")
      ->type_name("TEXT");
  for (std::size_t i = 0; i < kProperties.size(); ++i)
    command
        ->add_option(kProperties[i].option, options->values[i],
                     fmt::format("{}, {}", kProperties[i].description, kProperties[i].unit))
        ->type_name(kProperties[i].placeholder);
  command->footer(
      "`--textile FILE.json` takes it wherever it takes a preset: in scene new, textile\n"
      "set, lab and scripts. `weft textile show FILE.json` shows it.");
  command->callback([&context, options] {
    if (!is_textile_file(options->path))
      throw usage_problem("--output: " + options->path + " does not end with .json");
    run_new_textile(context, *options);
  });
}

}  // namespace

void add_textile(CLI::App& app, Context& context) {
  CLI::App* textile =
      add_group(app, "textile", "Show and make textiles, change the textile of a session");

  CLI::App* command = textile->add_subcommand("list", "List the presets");
  command->callback([&context] { list_textiles(context); });

  add_new_textile(*textile, context);

  auto name = std::make_shared<std::string>();
  command = textile->add_subcommand("show", "Show a preset or file, every number with its source");
  command->add_option("NAME", *name, "Preset, such as denim_11oz, or file")
      ->option_text(" ")
      ->required();
  command->callback([&context, name] { run_show(context, *name); });

  auto set = std::make_shared<SetOptions>();
  command =
      textile->add_subcommand("set", "Change the textile of a sheet, while the session runs too");
  add_session_argument(*command, set->session);
  command->add_option("--sheet", set->sheet, "Sheet to change; may be left out where there is one")
      ->type_name("NAME");
  CLI::Option* textile_option =
      command
          ->add_option("--textile,--preset", set->textile,
                       "Values of a preset or file; damping and friction stay")
          ->option_text("NAME|FILE.json");
  command->add_option("--set", set->values, "One value, such as bend_n_m2=2e-5; may be given again")
      ->option_text("FIELD=VALUE ...")
      ->allow_extra_args(false)
      ->excludes(textile_option);
  command->add_option("--over", set->duration_s, "How long the change takes; else it is at once")
      ->type_name("SECONDS");
  command->callback([&context, set] { run_set(context, *set); });
}

}  // namespace weft::client
