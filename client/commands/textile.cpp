#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "client/commands/commands.h"
#include "client/output/text.h"
#include "client/textile_change.h"

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
std::size_t place_in(std::vector<std::string>& list, const std::string& word) {
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

void run_show(Context& context, const std::string& name) {
  v1::GetTextileRequest request;
  request.set_name(name.starts_with("textiles/") ? name : "textiles/" + name);
  context.prefer_embedded();
  const v1::TextilePreset textile = context.connection().call(&Textiles::GetTextile, request);
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
               fmt::format("{} [{}]", property.status(), place_in(sources, property.source()))});
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
  std::string preset;
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
  if (options.preset.empty() && options.values.empty()) {
    throw usage_problem("textile set: give --preset or --set");
  }
  TextileChange change{
      .sheet = options.sheet, .preset = options.preset, .duration_s = options.duration_s};
  for (const auto& setting : options.values) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos)
      throw usage_problem("--set " + setting + ": write FIELD=VALUE");
    change.values.emplace_back(setting.substr(0, equals),
                               read_number(setting.substr(equals + 1), setting));
  }
  const std::string name = context.session_name(options.session);
  const v1::UpdateTextileRequest request =
      textile_request(context.connection().get_session(name), change);
  const auto response = context.connection().call(&Sessions::UpdateTextile, request);
  context.answer(to_json(response),
                 fmt::format("applied from frame {}\n{}", response.applied_frame(),
                             plan_text(response.plan())));
}

}  // namespace

void add_textile(CLI::App& app, Context& context) {
  CLI::App* textile =
      add_group(app, "textile", "Show textile presets, change the textile of a session");

  CLI::App* command = textile->add_subcommand("list", "List the presets");
  command->callback([&context] { list_textiles(context); });

  auto name = std::make_shared<std::string>();
  command = textile->add_subcommand("show", "Show a preset, every number with its source");
  command->add_option("NAME", *name, "Preset, such as denim_11oz")->option_text(" ")->required();
  command->callback([&context, name] { run_show(context, *name); });

  auto set = std::make_shared<SetOptions>();
  command =
      textile->add_subcommand("set", "Change the textile of a sheet, while the session runs too");
  add_session_argument(*command, set->session);
  command->add_option("--sheet", set->sheet, "Sheet to change; may be left out where there is one")
      ->type_name("NAME");
  CLI::Option* preset =
      command->add_option("--preset", set->preset, "Values of a preset; damping and friction stay")
          ->type_name("NAME");
  command->add_option("--set", set->values, "One value, such as bend_n_m2=2e-5; may be given again")
      ->option_text("FIELD=VALUE ...")
      ->allow_extra_args(false)
      ->excludes(preset);
  command->add_option("--over", set->duration_s, "How long the change takes; else it is at once")
      ->type_name("SECONDS");
  command->callback([&context, set] { run_set(context, *set); });
}

}  // namespace weft::client
