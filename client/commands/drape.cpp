#include "client/garments/drape.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "client/commands/commands.h"
#include "client/exports/export.h"
#include "client/garments/garment_templates.h"
#include "client/output/status.h"
#include "client/output/text.h"
#include "client/page/page.h"
#include "client/recording/phases.h"
#include "client/recording/recorder.h"
#include "client/recording/writer.h"
#include "client/scene_file.h"
#include "client/textile_file.h"

namespace weft::client {
namespace {

struct DrapeOptions {
  Drape drape;
  Person person;
  std::string textile;
  std::vector<std::string> values;
  double seconds = 20;
  std::string output, page, recording;
  bool replace = false;
};

// A recording, in a file that is wanted or goes with this.
class Recorded {
 public:
  explicit Recorded(std::string wanted) : path_(std::move(wanted)), kept_(!path_.empty()) {
    if (kept_) return;
    std::string name = (std::filesystem::temp_directory_path() / "weft-drape-XXXXXX").string();
    const int file = mkstemp(name.data());
    if (file < 0) throw unwritable(name, "no temporary file can be made");
    close(file);
    path_ = name;
  }
  ~Recorded() {
    std::error_code ignored;
    if (!kept_) std::filesystem::remove(path_, ignored);
  }
  Recorded(const Recorded&) = delete;
  Recorded& operator=(const Recorded&) = delete;
  const std::string& path() const { return path_; }
  bool kept() const { return kept_; }

 private:
  std::string path_;
  bool kept_;
};

std::optional<ExportFormat> format_of(const std::string& path) {
  static const std::map<std::string, ExportFormat> formats{
      {".glb", ExportFormat::kGltf}, {".usda", ExportFormat::kUsda}, {".npz", ExportFormat::kNpz}};
  const auto found = formats.find(std::filesystem::path(path).extension().string());
  return found == formats.end() ? std::nullopt : std::optional(found->second);
}

void check(const DrapeOptions& options) {
  if (!options.output.empty() && !format_of(options.output))
    throw usage_problem(
        fmt::format("--output {}: ends in none of .glb, .usda and .npz", options.output));
  for (const std::string& path : {options.output, options.page, options.recording})
    if (!path.empty() && !options.replace && std::filesystem::exists(path))
      throw unwritable(path, "the file exists; --force replaces it");
}

// What goes on at a time.
std::string phase_at(const std::vector<Phase>& phases, double time_s) {
  for (const Phase& phase : phases)
    if (!phase.until_s || time_s < *phase.until_s) return phase.name;
  return {};
}

RecordingResult dress(Context& context, const v1::Session& session, const DrapeOptions& options,
                      const std::string& path) {
  const v1::Scene& scene = session.scene();
  const std::vector<Phase> phases = phases_of(scene);
  RecordingOrder order;
  order.session = session.name();
  order.path = path;
  order.replace = order.run = true;
  order.from = 0;
  order.until_rest = true;
  order.pressure = order.clearance = !options.page.empty() || !options.recording.empty();
  order.to = static_cast<std::int64_t>(std::ceil(options.seconds / scene.solver().frame_step_s()));
  Status status(context.terminal.err, context.terminal.err_is_watched);
  RecordingResult result = record(context.connection(), order, [&](const Tally& tally) {
    status.show({fmt::format(
        "{:<16} {:.2f} s  {}", phase_at(phases, tally.last_time_s), tally.last_time_s,
        tally.last_stats.cloth_cut_count() > 0 ? count_of(tally.last_stats.cloth_cut_count(), "cut")
                                               : "")});
  });
  status.clear();
  return result;
}

// What is wrong with the start, which seldom ends well.
std::vector<v1::Warning> faults_of_start(const v1::Plan& plan) {
  std::vector<v1::Warning> faults;
  for (const v1::Warning& warning : plan.warnings())
    if (warning.code() == "STARTS_INSIDE" || warning.code() == "TANGLED_START")
      faults.push_back(warning);
  return faults;
}

std::string verdict_text(const v1::Verdict& verdict, const std::vector<v1::Warning>& start,
                         const Tally& tally) {
  Facts facts;
  facts.add("verdict", verdict.good() ? "good" : "not good");
  for (const v1::Fault& fault : verdict.faults())
    facts.add("fault", fmt::format("{}: {}", fault.code(), fault.message()));
  for (const v1::Warning& warning : start)
    facts.add("start", fmt::format("{}: {}", warning.code(), warning.message()));
  facts.add("rest", verdict.at_rest() ? fmt::format("after {:.2f} s", tally.last_time_s)
                                      : fmt::format("not within {:.2f} s", tally.last_time_s));
  facts.add("cuts", fmt::format("{} at the end, {} in the worst frame", verdict.cloth_cut_count(),
                                tally.most_cuts.value_or(0)));
  facts.add("body", verdict.particles_inside() == 0
                        ? "nothing inside"
                        : fmt::format("{} inside, up to {:.2g} mm",
                                      count_of(verdict.particles_inside(), "particle"),
                                      1000 * verdict.deepest_m()));
  facts.add("strain",
            fmt::format("99 % of it below {} along the warp, {} along the weft",
                        percent_text(verdict.strain_warp()), percent_text(verdict.strain_weft())));
  facts.add("pressure", fmt::format("up to {:.3g} kPa", verdict.largest_pressure_pa() / 1000));
  if (verdict.slid_m() != 0)
    facts.add("slid", fmt::format("{:.0f} mm down", 1000 * verdict.slid_m()));
  facts.add("cost",
            fmt::format("{}, {} of processors", count_of(verdict.substep_count(), "substep"),
                        seconds_text(verdict.computing_s())));
  return facts.text();
}

// Writes what is asked for, of a recording whose last frame is that, and tells of it.
void write_files(const DrapeOptions& options, const std::string& name, const Recorded& recorded,
                 std::int64_t last_frame, Json& document, std::string& text) {
  const auto tell = [&](const char* what, const std::string& path) {
    document[what] = path;
    text += "wrote " + path + '\n';
  };
  if (!options.output.empty()) {
    RecordingReader recording(recorded.path());
    ExportOrder order;
    order.format = *format_of(options.output);
    order.path = options.output;
    order.frames.first = order.frames.last = last_frame;
    export_recording(recording, order, [](const ExportResult&) {});
    tell("output", options.output);
  }
  if (!options.page.empty()) {
    PageOrder order{.path = options.page, .title = name};
    order.figures.push_back({.title = "", .caption = "", .exhibits = {{name, recorded.path()}}});
    write_page(order, [](const std::string&) {});
    tell("page", options.page);
  }
  if (recorded.kept()) tell("recording", recorded.path());
}

Problem not_good(const v1::Verdict& verdict) {
  std::string why;
  for (const v1::Fault& fault : verdict.faults())
    why += (why.empty() ? "" : "; ") + fault.code() + ": " + fault.message();
  return {Exit::kRefused, "FAILED_PRECONDITION", "DRAPE_NOT_GOOD", "not a good drape: " + why};
}

void run_drape(Context& context, const DrapeOptions& options) {
  check(options);
  context.prefer_embedded();
  Drape drape = options.drape;
  drape.measures = measures_by_options(options.person);
  if (!options.textile.empty()) drape.textile = textile_named(options.textile);
  for (const std::string& value : options.values) drape.values.push_back(read_setting(value));
  const GarmentScene made = make_drape(context.connection(), drape);
  const v1::Session session = create_session(context.connection(), made.scene);
  const Recorded recorded(options.recording);
  const RecordingResult result = dress(context, session, options, recorded.path());
  if (context.stop.stop_requested()) throw interrupted();

  v1::GetVerdictRequest ask;
  ask.set_name(session.name());
  const v1::Verdict verdict = context.connection().call(&Sessions::GetVerdict, ask);
  add_verdict(recorded.path(), verdict);
  Json document{{"garment", made.json}, {"verdict", to_json(verdict)}, {"session", session.name()}};
  const std::vector<v1::Warning> start = faults_of_start(session.plan());
  for (const v1::Warning& warning : start) document["start"].push_back(to_json(warning));
  std::string text = made.text + verdict_text(verdict, start, result.tally);
  write_files(options, made.scene.sheets().rbegin()->name(), recorded, result.tally.last_frame,
              document, text);
  context.answer(document, text);
  if (!verdict.good()) throw not_good(verdict);
}

}  // namespace

void add_drape(CLI::App& app, Context& context) {
  auto options = std::make_shared<DrapeOptions>();
  CLI::App* command =
      app.add_subcommand("drape", "Dress a body in a garment, and judge how it sits");
  command
      ->add_option("GARMENT", options->drape.garment,
                   "Garment (weft garment new --help lists them), or a pattern file")
      ->option_text(" ")
      ->required();
  add_person(*command, options->person);
  CLI::Option* bodies =
      command
          ->add_option("--body", options->drape.bodies,
                       "Closed triangles that wear it instead of the dress form: .obj, .gltf or "
                       ".glb; may be given again")
          ->type_name("FILE")
          ->allow_extra_args(false);
  command
      ->add_option("--over", options->drape.over,
                   "Recording of a drape, whose body wears it over what it wears there")
      ->type_name("FILE")
      ->excludes(bodies);
  command
      ->add_option(
          "--textile", options->textile,
          "Preset (weft textile list), or a file (weft textile new); else denim_11oz for a "
          "skirt or trousers, wool_tropical for a dress or a pleated_skirt, jersey_interlock for "
          "all else")
      ->option_text("NAME|FILE.json");
  command
      ->add_option("--edge", options->drape.edge_m,
                   "Wanted length of triangles' edges, m; else 0.01")
      ->type_name("M");
  command
      ->add_option("--deflate", options->drape.deflate_m,
                   "By how much bodies are smaller while seams close, m, so that thighs part; else "
                   "0.02 for trousers")
      ->type_name("M");
  add_accuracy(*command, options->drape.accuracy);
  command
      ->add_option("--set", options->values,
                   "One value of the scene by its place, such as "
                   "solver.max_self_weight_strain=0.01; may be given again")
      ->option_text("FIELD=VALUE ...")
      ->allow_extra_args(false);
  command->add_option("--seconds", options->seconds, "Most simulated time until it is at rest, s")
      ->type_name("S")
      ->check(CLI::Range(0.1, 1000.0))
      ->capture_default_str();
  command
      ->add_option("-o,--output", options->output, "Dressed garment to write: .glb, .usda or .npz")
      ->type_name("FILE");
  command->add_option("--page", options->page, "Page that plays it to write")->type_name("FILE");
  command->add_option("--recording", options->recording, "Recording to write")->type_name("FILE");
  command->add_flag("--force", options->replace, "Replace files that exist");
  command->footer(R"(
Panels start where the pattern places them. Seams close, without weight, then
weight comes in; of what has no shoulders, edges with the label "waist", or else
the highest border, are held up meanwhile. It ends at rest with a verdict, and
exit code 1 where that is not good. On a server that is named the session stays.
  weft drape tshirt --size 40 -o tshirt.glb --page tshirt.html
  weft drape pattern.json --body body.obj --textile denim_11oz -o out.glb
  weft drape trousers --size 40 --recording trousers.weft
  weft drape shirt --size 40 --over trousers.weft --page dressed.html
)");
  command->callback([&context, options] { run_drape(context, *options); });
}

}  // namespace weft::client
