#include "client/script/script_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>

#include "client/garments/layers.h"
#include "client/input_file.h"
#include "client/message_field.h"
#include "client/output/text.h"
#include "client/scene_file.h"
#include "client/script/fields.h"
#include "client/templates/templates.h"
#include "client/textile_file.h"

namespace weft::client {
namespace {

constexpr std::size_t kMostCases = 10'000;
constexpr std::size_t kMostSteps = 100'000;  // of all cases
constexpr std::int64_t kLastFrame = 1'000'000'000'000;

using Values = std::vector<std::pair<std::string, std::string>>;

// "k_b-0.1-segments-5" of "k_b 0.1, segments 5", for names of files
std::string file_name_of(const std::string& name) {
  std::string result;
  for (const char c : name) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_';
    if (plain) result += c;
    if (!plain && !result.empty() && result.back() != '-') result += '-';
  }
  return result;
}

class ScriptReader {
 public:
  ScriptReader(const std::string& path, const std::map<std::string, std::string>& given)
      : path_(path), given_(given) {
    script_.path = path;
    script_.name = std::filesystem::path(path).stem().string();
  }

  Script read() {
    const YAML::Node file = parse();
    Scope scope{path_, {}, faults_};
    Fields fields(file, "", scope);
    if (const auto name = fields.text("name")) script_.name = *name;
    script_.parallel = static_cast<int>(fields.whole_number("parallel", 1, 1000).value_or(1));
    read_variables(fields.node("variables"), scope);
    const std::vector<Values> loops = read_loops(fields, scope);
    const YAML::Node steps = fields.node("steps");
    for (const auto& [name, value] : given_) {
      if (!scope.variables.contains(name) && (loops.empty() || !names(loops[0]).contains(name)))
        throw usage_problem(
            fmt::format("--set {}={}: {} has no such variable", name, value, path_));
    }
    if (!fields.has("steps")) fields.fault("", "steps are missing");
    fields.end();
    if (fields.has("steps")) {
      for (const Values& values : loops) read_case(steps, scope, values);
    }
    faults_.check(path_);
    return std::move(script_);
  }

 private:
  YAML::Node parse() {
    try {
      return YAML::Load(read_text(path_));
    } catch (const YAML::Exception& error) {
      throw malformed(place_in_script(path_, error.mark.line + 1, ""), error.msg);
    }
  }

  static std::map<std::string, std::string> names(const Values& values) {
    return {values.begin(), values.end()};
  }

  void read_variables(const YAML::Node& node, Scope& scope) {
    if (!node.IsDefined()) return;
    Fields fields(node, "variables", scope);
    for (const std::string& key : fields.keys()) {
      const auto value = fields.text(key);
      const auto given = given_.find(key);
      scope.variables[key] = given != given_.end() ? given->second : value.value_or("");
    }
  }

  // Every combination of the values after `for`, the last changing fastest; without `for` one.
  std::vector<Values> read_loops(Fields& outer, Scope& scope) {
    std::vector<Values> all{{}};
    const YAML::Node node = outer.node("for");
    if (!outer.has("for")) return all;
    Fields fields(node, outer.place("for"), scope);
    for (const std::string& key : fields.keys()) {
      std::vector<std::string> values = fields.texts(key);
      if (const auto given = given_.find(key); given != given_.end()) values = {given->second};
      if (values.empty()) fields.fault(key, "has no value");
      if (all.size() * values.size() > kMostCases) {
        fields.fault(key, fmt::format("more than {} combinations", kMostCases));
        return {{}};
      }
      std::vector<Values> longer;
      for (const Values& so_far : all) {
        for (const std::string& value : values) {
          longer.push_back(so_far);
          longer.back().emplace_back(key, value);
        }
      }
      all = std::move(longer);
    }
    return all;
  }

  void read_case(const YAML::Node& steps, Scope scope, const Values& values) {
    Case result;
    for (const auto& [name, value] : values) {
      result.name += fmt::format("{}{} {}", result.name.empty() ? "" : ", ", name, value);
      scope.variables[name] = value;
    }
    if (result.name.empty()) result.name = script_.name;
    result.values = values;
    scope.variables["case"] = file_name_of(result.name);
    sessions_.clear();
    snapshots_.clear();
    read_steps(steps, scope, result.steps);
    script_.cases.push_back(std::move(result));
  }

  void read_steps(const YAML::Node& list, Scope& scope, std::vector<Step>& steps) {
    const auto fault = [&](const YAML::Node& node, const std::string& what) {
      faults_.add(place_in_script(path_, node.Mark().line + 1, "steps"), what);
    };
    if (!list.IsSequence()) return fault(list, "a list of steps is wanted here");
    for (const auto& node : list) {
      if (!node.IsMap() || node.size() == 0) {
        fault(node, "a step is a name and its fields, such as \"run: {until_rest: true}\"");
        continue;
      }
      if (node["for"].IsDefined()) {
        read_loop(node, scope, steps);
        continue;
      }
      const auto entry = *node.begin();
      const std::string kind = entry.first.IsScalar() ? entry.first.Scalar() : "?";
      const int line = entry.first.Mark().line + 1;
      const auto known = std::find_if(kKinds.begin(), kKinds.end(),
                                      [&](const Kind& each) { return kind == each.name; });
      if (node.size() > 1) {
        fault(node, "a step has one name; begin the next with a dash");
      } else if (known == kKinds.end()) {
        std::string names;
        for (const Kind& each : kKinds) names += std::string(each.name) + ", ";
        faults_.add(place_in_script(path_, line, kind), "no such step; there are " + names + "for");
      } else if (++steps_read_ > kMostSteps) {
        return fault(node, fmt::format("more than {} steps", kMostSteps));
      } else {
        Fields fields(entry.second, kind, scope);
        Step step{.line = line, .kind = kind, .what = (this->*known->read)(fields, scope)};
        fields.end();
        steps.push_back(std::move(step));
      }
    }
  }

  void read_loop(const YAML::Node& node, Scope& outer, std::vector<Step>& steps) {
    Fields fields(node, "", outer);
    const std::vector<Values> loops = read_loops(fields, outer);
    const YAML::Node body = fields.node("steps");
    fields.end();
    if (!fields.has("steps")) return fields.fault("", "steps are missing");
    for (const Values& values : loops) {
      Scope scope = outer;
      for (const auto& [name, value] : values) scope.variables[name] = value;
      read_steps(body, scope, steps);
    }
  }

  using What = decltype(Step::what);

  // The session meant: the one named, or the only one.
  std::string read_session(Fields& fields) { return known_session(fields, fields.text("session")); }

  std::string known_session(Fields& fields, const std::optional<std::string>& name) {
    const auto known = [&] { return fmt::format("{}", fmt::join(sessions_, ", ")); };
    if (sessions_.empty()) {
      fields.fault("session", "no session was created before this");
    } else if (!name) {
      if (sessions_.size() == 1) return sessions_[0];
      fields.fault("", "session is missing; there are " + known());
    } else if (std::find(sessions_.begin(), sessions_.end(), *name) == sessions_.end()) {
      fields.fault("session", fmt::format("no session \"{}\"; there are {}", *name, known()));
    }
    return name.value_or("");
  }

  // A name that is given once, among those given before.
  static std::string new_name(Fields& fields, const char* key, std::vector<std::string>& names,
                              const char* otherwise = "") {
    std::string name = fields.text(key).value_or(otherwise);
    if (name.empty() && !fields.has(key)) fields.fault("", std::string(key) + " is missing");
    if (std::find(names.begin(), names.end(), name) != names.end())
      fields.fault(key, fmt::format("there is a {} \"{}\" already", key, name));
    names.push_back(name);
    return name;
  }

  What read_create(Fields& fields, Scope& scope) {
    CreateStep step;
    step.session = new_name(fields, "session", sessions_, "cloth");

    const TemplateOptions options = read_template_options(fields);
    Drape drape = read_drape(fields, options);
    const auto name = fields.text("template");
    const auto file = fields.text("scene");
    const YAML::Node changes = fields.node("fields");
    if (fields.has("template") + fields.has("scene") + fields.has("drape") != 1)
      fields.fault("", "give one of template, scene and drape");
    if (name) try_to(fields, "template", [&] { step.scene = make_template(*name, options); });
    if (file) try_to(fields, "scene", [&] { step.scene = read_scene(from_here(*file)); });
    if (fields.has("fields") && fields.has("drape"))
      drape.values = read_values(changes, scope);
    else if (fields.has("fields"))
      change_scene(changes, scope, step.scene);
    if (fields.has("drape")) step.drape = std::move(drape);
    return step;
  }

  // What is for one kind of scene alone.
  static void only_for(const char* kind, std::initializer_list<const char*> keys, Fields& fields) {
    for (const char* key : keys)
      if (fields.has(key) && !fields.has(kind)) fields.fault(key, std::string("is for a ") + kind);
  }

  // Its files are read here to find what is wrong with them.
  Drape read_drape(Fields& fields, const TemplateOptions& options) const {
    Drape drape{.measures = read_measures(fields),
                .forms = forms_,
                .textile = options.textile,
                .edge_m = fields.number("edge_m", 0.002, 0.1),
                .deflate_m = fields.number("deflate_m", 0, 0.1),
                .accuracy = options.accuracy,
                .edge_field = "edge_m"};
    if (const auto garment = fields.text("drape")) {
      drape.garment = is_garment_template(*garment) ? *garment : from_here(*garment);
      if (!is_garment_template(*garment))
        try_to(fields, "drape", [&] { read_garment(drape.garment); });
    }
    for (const std::string& file : fields.texts("body")) {
      drape.bodies.push_back(from_here(file));
      try_to(fields, "body", [&] { garment_body(drape.bodies.back()); });
    }
    if (const auto beneath = fields.text("over")) {
      if (fields.has("body")) fields.fault("over", "excludes body: the recording has its own");
      drape.over = from_here(*beneath);
      try_to(fields, "over", [&] { worn_at_end(drape.over); });
    }
    only_for("drape", {"edge_m", "deflate_m", "body", "over"}, fields);
    return drape;
  }

  static Measures read_measures(Fields& fields) {
    constexpr std::array kFigures{std::pair{"female", FigureKind::kFemale},
                                  std::pair{"male", FigureKind::kMale}};
    Person person;
    Measures& measures = person.measures;
    measures.figure = read_choice("figure", kFigures, fields).value_or(measures.figure);
    if (const auto size = fields.whole_number("size", 0, 1000))
      person.size = static_cast<int>(*size);
    for (const LengthInfo& each : person_lengths()) {
      const std::string key = std::string(each.name) + "_m";
      measures.*each.value = fields.number(key, each.least, each.most);
      only_for("drape", {key.c_str()}, fields);
    }
    measures.arm_angle = fields.number("arm_angle", 0, kMostArmAngle).value_or(measures.arm_angle);
    only_for("drape", {"figure", "size", "arm_angle"}, fields);
    try {
      return measures_of(person);
    } catch (const Violation& violation) {
      fields.fault(violation.field, violation.description);
      return measures;
    }
  }

  // What goes wrong with it is a fault of the field.
  template <class Work>
  static void try_to(Fields& fields, const std::string& key, const Work& work) {
    try {
      work();
    } catch (const Problem& problem) {
      fields.fault(key, problem.what());
    }
  }

  // The textile that a field names, if any.
  std::optional<v1::Textile> read_textile(Fields& fields, const std::string& key) const {
    std::optional<v1::Textile> textile;
    if (const auto name = fields.text(key))
      try_to(fields, key,
             [&] { textile = textile_named(is_textile_file(*name) ? from_here(*name) : *name); });
    return textile;
  }

  // One of some words, each with its value.
  template <class Choices>
  static auto read_choice(const char* key, const Choices& choices, Fields& fields)
      -> std::optional<decltype(choices[0].second)> {
    const auto name = fields.text(key);
    if (!name) return std::nullopt;
    std::string known;
    for (const auto& [word, value] : choices) {
      if (*name == word) return value;
      known += std::string(known.empty() ? "" : ", ") + word;
    }
    fields.fault(key, fmt::format("\"{}\" is none of {}", *name, known));
    return std::nullopt;
  }

  TemplateOptions read_template_options(Fields& fields) const {
    constexpr std::array kEvaluators{std::pair{"series", v1::EVALUATOR_SERIES},
                                     std::pair{"exact", v1::EVALUATOR_EXACT},
                                     std::pair{"linearized", v1::EVALUATOR_LINEARIZED},
                                     std::pair{"polynomial", v1::EVALUATOR_POLYNOMIAL}};
    constexpr std::array kAccuracies{std::pair{"draft", v1::ACCURACY_DRAFT},
                                     std::pair{"standard", v1::ACCURACY_STANDARD},
                                     std::pair{"fine", v1::ACCURACY_FINE}};
    TemplateOptions options;
    const auto count = [&](const char* key, std::int64_t most) -> std::optional<int> {
      const auto number = fields.whole_number(key, 1, most);
      return number ? std::optional(static_cast<int>(*number)) : std::nullopt;
    };
    options.rows = count("rows", 4096);
    options.columns = count("columns", 4096);
    options.spacing_m = fields.number("spacing_m", 1e-5, 10);
    options.textile = read_textile(fields, "textile");
    options.bend = fields.number("bend", 0, 1e5);
    options.segments = count("segments", 65536);
    options.fold_clamp = fields.flag("fold_clamp").value_or(false);
    options.optimal_breakpoints = fields.flag("optimal_breakpoints").value_or(false);
    options.evaluator = read_choice("evaluator", kEvaluators, fields);
    options.accuracy = read_choice("accuracy", kAccuracies, fields);
    only_for("template",
             {"rows", "columns", "spacing_m", "bend", "segments", "fold_clamp",
              "optimal_breakpoints", "evaluator"},
             fields);
    if (fields.has("scene"))
      for (const char* key : {"textile", "accuracy"})
        if (fields.has(key)) fields.fault(key, "is for a template or a drape; use fields");
    return options;
  }

  // Values by their place in the scene file: "sheets[0].grid.rows: 9".
  static Values read_values(const YAML::Node& node, Scope& scope) {
    Fields fields(node, "create.fields", scope);
    Values values;
    for (const std::string& key : fields.keys())
      if (const auto value = fields.text(key)) values.emplace_back(key, *value);
    return values;
  }

  static void change_scene(const YAML::Node& node, Scope& scope, v1::Scene& scene) {
    Fields fields(node, "create.fields", scope);
    for (const auto& each : read_values(node, scope))
      try_to(fields, each.first, [&] { set_field(scene, each.first, each.second); });
  }

  What read_set(Fields& fields, Scope& scope) {
    SetStep step;
    step.session = read_session(fields);
    step.change.sheet = fields.text("sheet").value_or("");
    for (const char* key : {"textile", "preset"})
      if (auto textile = read_textile(fields, key)) step.change.textile = std::move(textile);
    step.change.duration_s = fields.number("over_s", 0, 1e4);
    const YAML::Node values = fields.node("fields");
    if (fields.has("textile") + fields.has("preset") + fields.has("fields") != 1)
      fields.fault("", "give either textile or fields");
    if (!fields.has("fields")) return step;
    Fields numbers(values, "set.fields", scope);
    for (const std::string& key : numbers.keys()) {
      if (const auto value = numbers.number(key)) step.change.values.emplace_back(key, *value);
    }
    return step;
  }

  What read_run(Fields& fields, Scope&) {
    RunStep step;
    const std::vector<std::string> names = fields.texts("session");
    for (const std::string& name : names) step.sessions.push_back(known_session(fields, name));
    if (names.empty()) step.sessions.push_back(known_session(fields, std::nullopt));
    step.until_frame = fields.whole_number("until_frame", 1, kLastFrame);
    step.until_time_s = fields.number("until_time_s", 0, 1e9);
    step.until_rest = fields.flag("until_rest").value_or(false);
    step.time_scale = fields.number("time_scale", 1e-3, 1000);
    step.wait = fields.flag("wait").value_or(true);
    if (fields.has("until_frame") && fields.has("until_time_s"))
      fields.fault("", "give either until_frame or until_time_s");
    if (step.wait && !fields.has("until_frame") && !fields.has("until_time_s") && !step.until_rest)
      fields.fault("", "give until_frame, until_time_s or until_rest, or else wait: false");
    return step;
  }

  static ParticlePlace read_particle_place(Fields& fields) {
    const auto whole = [&](const char* key, std::int64_t most) {
      const auto value = fields.whole_number(key, 0, most);
      return value ? std::optional(static_cast<int>(*value)) : std::nullopt;
    };
    ParticlePlace place{.sheet = fields.text("sheet").value_or(""),
                        .number = whole("number", std::numeric_limits<int>::max())};
    place.row = whole("row", 4095).value_or(0);
    place.column = whole("column", 4095).value_or(0);
    for (const char* key : {"row", "column"}) {
      if (fields.has(key) && fields.has("number")) fields.fault(key, "is given beside number");
      if (!fields.has(key) && !fields.has("number"))
        fields.fault("", std::string(key) + " is missing");
    }
    return place;
  }

  // "grab" ... of a particle, "move" or "pose" of a collider, or "relax".
  What read_act(Fields& fields, Scope&) {
    ActStep step{.session = read_session(fields), .action = {.kind = fields.place("")}};
    SceneAction& action = step.action;
    if (action.kind == "relax") return step;
    if (action.kind == "pose") {
      action.kind = "pose_collider";
      action.collider = fields.text("collider").value_or("");
      const auto time = fields.number("to_s", 0, 1e6);
      if (!fields.has("to_s")) fields.fault("", "to_s is missing");
      action.pose_time_s = time.value_or(0);
      action.speed_m_per_s = fields.number("speed_m_per_s", 0.01, 20);
      return step;
    }
    const bool moves = action.kind == "move";
    if (moves) {
      action.kind = "move_collider";
      action.collider = fields.text("collider").value_or("");
    } else {
      action.particle = read_particle_place(fields);
    }
    if (!moves && action.kind != "drag") return step;
    std::vector<double> target;
    for (const std::string& text : fields.texts("to_m")) {
      if (const auto number = read_number(text)) target.push_back(*number);
    }
    if (target.size() == 3) action.target_m = {target[0], target[1], target[2]};
    if (!action.target_m) fields.fault("to_m", "give [x, y, z]");
    action.duration_s = fields.number("over_s", 1e-6, 1e4);
    return step;
  }

  What read_wait(Fields& fields, Scope&) {
    WaitStep step{.session = read_session(fields)};
    const auto frame = fields.whole_number("frame", 0, kLastFrame);
    if (!fields.has("frame")) fields.fault("", "frame is missing");
    step.frame = frame.value_or(0);
    return step;
  }

  What read_pause(Fields& fields, Scope&) { return PauseStep{.session = read_session(fields)}; }

  What read_record(Fields& fields, Scope&) {
    RecordStep step;
    step.session = read_session(fields);
    if (const auto file = fields.text("file")) step.path = from_here(*file);
    if (!fields.has("file")) fields.fault("", "file is missing");
    step.velocities = fields.flag("velocities").value_or(false);
    if (const auto encoding = fields.text("encoding")) {
      if (*encoding == "float64") step.encoding = v1::FRAME_ENCODING_FLOAT64;
      if (*encoding != "float64" && *encoding != "float32")
        fields.fault("encoding", fmt::format("\"{}\" is not float32 or float64", *encoding));
    }
    return step;
  }

  What read_snapshot(Fields& fields, Scope&) {
    return SnapshotStep{.session = read_session(fields),
                        .snapshot = new_name(fields, "snapshot", snapshots_)};
  }

  What read_restore(Fields& fields, Scope&) {
    RestoreStep step{.session = new_name(fields, "session", sessions_),
                     .snapshot = fields.text("snapshot").value_or("")};
    if (!fields.has("snapshot")) {
      fields.fault("", "snapshot is missing");
    } else if (std::find(snapshots_.begin(), snapshots_.end(), step.snapshot) == snapshots_.end()) {
      fields.fault("snapshot",
                   fmt::format("no snapshot \"{}\" was taken before this", step.snapshot));
    }
    return step;
  }

  What read_expect(Fields& fields, Scope& scope) {
    constexpr std::array kQuantities{std::pair{"frame", Quantity::kFrame},
                                     std::pair{"time_s", Quantity::kTime},
                                     std::pair{"rest_time_s", Quantity::kRestTime},
                                     std::pair{"largest_strain", Quantity::kLargestStrain},
                                     std::pair{"strain", Quantity::kStrain},
                                     std::pair{"cloth_cuts", Quantity::kCuts},
                                     std::pair{"kinetic_energy_j", Quantity::kKineticEnergy},
                                     std::pair{"potential_energy_j", Quantity::kPotentialEnergy},
                                     std::pair{"energy_j", Quantity::kEnergy},
                                     std::pair{"strain_warp", Quantity::kStrainWarp},
                                     std::pair{"strain_weft", Quantity::kStrainWeft},
                                     std::pair{"pressure_pa", Quantity::kPressure},
                                     std::pair{"slid_m", Quantity::kSlid}};
    ExpectStep step;
    step.session = read_session(fields);
    if (const auto rest = fields.flag("at_rest")) {
      const double value = *rest ? 1 : 0;
      step.expectations.push_back(
          {.quantity = Quantity::kAtRest, .name = "at_rest", .low = value, .high = value});
    }
    for (const auto& [name, quantity] : kQuantities) {
      Expectation expectation{.quantity = quantity, .name = name};
      if (read_band(fields, name, scope, expectation)) step.expectations.push_back(expectation);
    }
    step.faults = read_verdict(fields);
    const YAML::Node particle = fields.node("particle");
    if (fields.has("particle")) {
      Fields place(particle, "expect.particle", scope);
      Expectation expectation{.quantity = Quantity::kPosition};
      expectation.particle = read_particle_place(place);
      bool any = false;
      for (int axis = 0; axis < 3; ++axis) {
        const std::string key = fmt::format("{}_m", "xyz"[axis]);
        any = any || place.has(key);
        expectation.axis = axis;
        expectation.name = "particle." + key;
        if (read_band(place, key, scope, expectation)) step.expectations.push_back(expectation);
      }
      if (!any) place.fault("", "give x_m, y_m or z_m");
      place.end();
    }
    if (step.expectations.empty() && !fields.has("particle") && !fields.has("verdict"))
      fields.fault("", "says nothing that is expected");
    return step;
  }

  // "good", or all the faults that a verdict shall have.
  static std::optional<std::set<std::string>> read_verdict(Fields& fields) {
    static const std::set<std::string> kFaults{"BESIDE_BODY", "CLOTH_CUTS",  "INSIDE_BODY",
                                               "NOT_AT_REST", "NOT_DRESSED", "SLID_DOWN",
                                               "TOO_TIGHT"};
    const std::vector<std::string> wanted = fields.texts("verdict");
    if (!fields.has("verdict")) return std::nullopt;
    if (wanted.empty()) fields.fault("verdict", "give good, or faults");
    if (wanted == std::vector<std::string>{"good"}) return std::set<std::string>{};
    for (const std::string& code : wanted)
      if (!kFaults.contains(code))
        fields.fault("verdict", fmt::format("\"{}\" is not good, alone, nor one of {}", code,
                                            fmt::join(kFaults, ", ")));
    return std::set(wanted.begin(), wanted.end());
  }

  // A number, or {min, max}, or {near, within}.
  static bool read_band(Fields& fields, const std::string& key, Scope& scope,
                        Expectation& expectation) {
    const YAML::Node node = fields.node(key);
    if (!fields.has(key)) return false;
    if (!node.IsMap()) {
      const auto value = fields.number(key);
      expectation.low = expectation.high = value.value_or(0);
      return value.has_value();
    }
    constexpr double kAny = std::numeric_limits<double>::infinity();
    Fields band(node, fields.place(key), scope);
    const auto low = band.number("min");
    const auto high = band.number("max");
    const auto near = band.number("near");
    const auto within = band.number("within", 0);
    band.end();
    const bool is_range = band.has("min") || band.has("max");
    const bool is_near = band.has("near") && band.has("within");
    if (is_range == is_near || band.has("near") != band.has("within")) {
      band.fault("", "give min, max or both, or near and within");
      return false;
    }
    expectation.low = is_range ? low.value_or(-kAny) : near.value_or(0) - within.value_or(0);
    expectation.high = is_range ? high.value_or(kAny) : near.value_or(0) + within.value_or(0);
    if (expectation.low > expectation.high) band.fault("", "min is above max");
    return true;
  }

  // Paths are relative to the script.
  std::string from_here(const std::string& file) const {
    return (std::filesystem::path(path_).parent_path() / file).string();
  }

  struct Kind {
    const char* name;
    What (ScriptReader::*read)(Fields&, Scope&);
  };
  static constexpr std::array<Kind, 17> kKinds{{{"create", &ScriptReader::read_create},
                                                {"set", &ScriptReader::read_set},
                                                {"grab", &ScriptReader::read_act},
                                                {"drag", &ScriptReader::read_act},
                                                {"release", &ScriptReader::read_act},
                                                {"pin", &ScriptReader::read_act},
                                                {"unpin", &ScriptReader::read_act},
                                                {"relax", &ScriptReader::read_act},
                                                {"move", &ScriptReader::read_act},
                                                {"pose", &ScriptReader::read_act},
                                                {"run", &ScriptReader::read_run},
                                                {"wait", &ScriptReader::read_wait},
                                                {"pause", &ScriptReader::read_pause},
                                                {"record", &ScriptReader::read_record},
                                                {"snapshot", &ScriptReader::read_snapshot},
                                                {"restore", &ScriptReader::read_restore},
                                                {"expect", &ScriptReader::read_expect}}};

  std::string path_;
  const std::map<std::string, std::string>& given_;
  Faults faults_;
  Script script_;
  const std::shared_ptr<DressForms> forms_ = std::make_shared<DressForms>();  // of all cases
  std::vector<std::string> sessions_, snapshots_;  // of the case, in order of creation
  std::size_t steps_read_ = 0;
};

}  // namespace

Script read_script(const std::string& path, const std::map<std::string, std::string>& values) {
  return ScriptReader(path, values).read();
}

}  // namespace weft::client
