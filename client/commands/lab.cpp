#include <fmt/format.h>

#include <map>
#include <sstream>
#include <stop_token>

#include "client/commands/commands.h"
#include "client/exports/output_file.h"
#include "client/output/status.h"
#include "client/output/svg.h"
#include "client/output/text.h"
#include "client/textile_file.h"

namespace weft::client {
namespace {

struct LabOptions {
  v1::LabTest test = v1::LAB_TEST_UNSPECIFIED;
  std::string name;  // of the test
  std::string textile;
  std::string direction = "warp";
  bool isometric = false;
  v1::LabMesh mesh = v1::LAB_MESH_UNSPECIFIED;

  bool of_triangles() const { return mesh > v1::LAB_MESH_LATTICE; }

  v1::Evaluator evaluator = v1::EVALUATOR_UNSPECIFIED;
  std::optional<int> segments;
  bool fold_clamp = false;
  bool optimal_breakpoints = false;
  bool no_diagonals = false;
  std::vector<double> spacings_mm;
  std::string csv, svg;
};

v1::RunTestRequest request_of(const LabOptions& options) {
  v1::RunTestRequest request;
  request.set_test(options.test);
  *request.mutable_textile() = textile_named(options.textile);
  request.set_mesh(options.mesh);
  if (options.isometric || options.of_triangles()) {
    request.mutable_bending()->mutable_isometric();
  } else {
    v1::ChoiKo* law = request.mutable_bending()->mutable_choi_ko();
    law->set_evaluator(options.evaluator);
    if (options.segments) law->set_segments(*options.segments);
    law->set_fold_clamp(options.fold_clamp);
    law->set_optimal_breakpoints(options.optimal_breakpoints);
    law->set_diagonal_bend(!options.no_diagonals);
  }
  request.set_direction(options.direction == "weft" ? v1::LAB_DIRECTION_WEFT
                                                    : v1::LAB_DIRECTION_WARP);
  for (const double spacing : options.spacings_mm) request.add_spacings_m(spacing / 1000);
  return request;
}

// The report, with a bar while it is being made.
v1::LabReport report_of(Context& context, const v1::RunTestRequest& request) {
  context.prefer_embedded();
  Connection& connection = context.connection();
  grpc::ClientContext call;
  const std::stop_callback cancel(context.stop, [&] { call.TryCancel(); });
  const auto reader = connection.lab().RunTest(&call, request);
  Status status(context.terminal.err, context.terminal.err_is_watched);
  v1::RunTestResponse message;
  v1::LabReport report;
  while (reader->Read(&message)) {
    const v1::LabProgress& progress = message.progress();
    if (message.has_report())
      report = std::move(*message.mutable_report());
    else if (progress.specimens() == 0)
      status.show({"waits for other tests"});
    else
      status.show({fmt::format("{} specimen {} of {}",
                               bar(static_cast<double>(progress.done()) / progress.specimens()),
                               progress.done() + 1, progress.specimens())});
  }
  connection.check(reader->Finish());
  return report;
}

std::string error_text(const v1::LabValue& value) {
  if (!value.has_asked()) return "-";
  if (value.unit() == "degrees") return fmt::format("{:+.2f}", value.found() - value.asked());
  if (value.asked() == 0) return "-";
  return fmt::format("{:+.3g} %", 100 * (value.found() / value.asked() - 1));
}

// Lines of at most 78 characters, broken at spaces; all but the first are indented.
std::string wrapped(const std::string& text, std::size_t indent = 0) {
  constexpr std::size_t kMost = 78;
  std::string out, line;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (!line.empty() && line.size() + 1 + word.size() > kMost) {
      out += line + '\n';
      line = std::string(indent, ' ') + word;
    } else {
      line += (line.empty() ? "" : " ") + word;
    }
  }
  return out + line + '\n';
}

std::string report_text(const v1::LabReport& report) {
  Table table({"QUANTITY", "UNIT", "SPACING", "PARTICLES", "ASKED", "FOUND", "ERROR"});
  for (const auto& value : report.values()) {
    table.add({value.quantity(), value.unit(), fmt::format("{:.3g} mm", 1000 * value.spacing_m()),
               std::to_string(value.particles()),
               value.has_asked() ? number_text(value.asked()) : "-", number_text(value.found()),
               error_text(value)});
  }
  std::string text = wrapped(report.method()) + '\n' + table.text();
  for (const auto& note : report.notes()) text += '\n' + wrapped("note: " + note, 6);
  return text;
}

std::string values_csv(const v1::LabReport& report) {
  std::string csv = "quantity,unit,spacing_m,particles,asked,found\n";
  for (const auto& value : report.values())
    csv +=
        fmt::format("\"{}\",\"{}\",{:.9g},{},{},{:.12g}\n", value.quantity(), value.unit(),
                    value.spacing_m(), value.particles(),
                    value.has_asked() ? fmt::format("{:.12g}", value.asked()) : "", value.found());
  return csv;
}

// Calls use(curve, row) with each row of a curve: the place of its first value.
template <class Use>
void for_each_row(const v1::LabCurve& curve, const Use& use) {
  const int width = curve.columns_size();
  for (int row = 0; width > 0 && row + width <= curve.values_size(); row += width) use(row);
}

// The curves one under the other; all have the columns of the first.
std::string curves_csv(const v1::LabReport& report) {
  std::string csv = "curve";
  for (const auto& column : report.curves(0).columns()) csv += ',' + column;
  csv += '\n';
  for (const auto& curve : report.curves()) {
    for_each_row(curve, [&](int row) {
      csv += '"' + curve.name() + '"';
      for (int c = 0; c < curve.columns_size(); ++c)
        csv += fmt::format(",{:.12g}", curve.values(row + c));
      csv += '\n';
    });
  }
  return csv;
}

// Every column of every curve over its first.
Plot plot_of_curves(const v1::LabReport& report) {
  Plot plot;
  for (const auto& curve : report.curves()) {
    const int width = curve.columns_size();
    for (int c = 1; c < width; ++c) {
      std::string name = report.curves_size() == 1 ? curve.columns(c) : curve.name();
      if (report.curves_size() > 1 && width > 2) name += ", " + curve.columns(c);
      Series series{name, {}};
      for_each_row(curve, [&](int row) {
        series.points.emplace_back(curve.values(row), curve.values(row + c));
      });
      plot.series.push_back(std::move(series));
    }
    plot.x_label = curve.columns(0);
    plot.y_label = width > 2 ? "N" : curve.columns(width - 1);
  }
  return plot;
}

// What was asked and what came out over the spacing.
Plot plot_of_values(const v1::LabReport& report) {
  Plot plot;
  plot.points = true;
  plot.x_label = "spacing mm";
  std::map<std::string, Series> found;
  Series asked{"asked", {}};
  for (const auto& value : report.values()) {
    plot.y_label = value.unit();
    found[value.quantity()].points.emplace_back(1000 * value.spacing_m(), value.found());
    if (value.has_asked()) asked.points.emplace_back(1000 * value.spacing_m(), value.asked());
  }
  plot.series.push_back(asked);
  for (auto& [quantity, series] : found) {
    series.name = quantity;
    plot.series.push_back(series);
  }
  return plot;
}

void write_text(const std::string& path, const std::string& text) {
  OutputFile file(path);
  file.write(text);
  file.close();
}

void run_lab(Context& context, const LabOptions& options) {
  const v1::LabReport report = report_of(context, request_of(options));
  if (!options.csv.empty())
    write_text(options.csv, options.test == v1::LAB_TEST_BENDING && !report.curves().empty()
                                ? curves_csv(report)
                                : values_csv(report));
  if (!options.svg.empty()) {
    Plot plot = report.curves().empty() ? plot_of_values(report) : plot_of_curves(report);
    plot.title = options.name + " of " + options.textile;
    plot.downwards = options.test == v1::LAB_TEST_CANTILEVER || options.test == v1::LAB_TEST_DRAPE;
    write_text(options.svg, svg_text(plot));
  }
  context.answer(to_json(report), report_text(report));
}

void add_bending_options(CLI::App& command, LabOptions& options) {
  static const std::map<std::string, v1::Evaluator> evaluators{
      {"series", v1::EVALUATOR_SERIES},
      {"exact", v1::EVALUATOR_EXACT},
      {"linearized", v1::EVALUATOR_LINEARIZED},
      {"polynomial", v1::EVALUATOR_POLYNOMIAL}};
  if (options.test != v1::LAB_TEST_BENDING)
    command.add_flag("--isometric", options.isometric,
                     "Isometric bending instead of Choi and Ko's");
  command.add_option("--evaluator", options.evaluator, "Of the bending curve [linearized]")
      ->transform(one_of(evaluators))
      ->option_text("series|exact|linearized|polynomial");
  command.add_option("--segments", options.segments, "Line segments of the linearized curve")
      ->type_name("N")
      ->check(CLI::Range(1, 65536));
  command.add_flag("--fold-clamp", options.fold_clamp, "Linearize the clamped function (eq. 5)");
  command.add_flag("--optimal-breakpoints", options.optimal_breakpoints,
                   "Shorter segments where the curve bends more");
  command.add_flag("--no-diagonals", options.no_diagonals, "No diagonal bend connections");
}

void add_test(CLI::App& lab, Context& context, const char* name, v1::LabTest test,
              const char* description) {
  auto options = std::make_shared<LabOptions>();
  options->test = test;
  options->name = name;
  CLI::App* command = lab.add_subcommand(name, description);
  command
      ->add_option("--textile", options->textile,
                   "Preset (weft textile list), or a file (weft textile new)")
      ->option_text("NAME|FILE.json")
      ->required();
  command->add_option("--direction", options->direction, "How the specimen is cut [warp]")
      ->check(CLI::IsMember({"warp", "weft"}))
      ->option_text("warp|weft");
  if (test != v1::LAB_TEST_CHAIN) add_bending_options(*command, *options);
  static const std::map<std::string, v1::LabMesh> meshes{{"lattice", v1::LAB_MESH_LATTICE},
                                                         {"right", v1::LAB_MESH_RIGHT},
                                                         {"alternating", v1::LAB_MESH_ALTERNATING},
                                                         {"equilateral", v1::LAB_MESH_EQUILATERAL},
                                                         {"irregular", v1::LAB_MESH_IRREGULAR}};
  command
      ->add_option("--mesh", options->mesh,
                   "What the specimen is made of [lattice]; triangles bend isometrically")
      ->transform(one_of(meshes))
      ->option_text("lattice|right|alternating|equilateral|irregular");
  command->add_option("--spacing", options->spacings_mm, "Spacings of the mesh; else a range")
      ->option_text("MM ...");
  const bool bending = test == v1::LAB_TEST_BENDING;
  command
      ->add_option(
          "--csv", options->csv,
          bending ? "Write the curve: r, f_b, f_b*, approximation, error" : "Write the figures")
      ->type_name("FILE");
  command
      ->add_option("--svg", options->svg,
                   bending ? "Draw the curve (figure 2 of the paper)"
                           : "Draw curves, or figures over spacing")
      ->type_name("FILE");
  command->callback([&context, options] { run_lab(context, *options); });
}

}  // namespace

void add_lab(CLI::App& app, Context& context) {
  CLI::App* lab = add_group(app, "lab", "Put a textile to a test with an answer from a textbook");
  add_test(*lab, context, "tensile", v1::LAB_TEST_TENSILE, "Pull a strip: its modulus");
  add_test(*lab, context, "shear", v1::LAB_TEST_SHEAR, "Shear a frame: its modulus");
  add_test(*lab, context, "bending", v1::LAB_TEST_BENDING,
           "Bend one connection: curve, clamp, evaluator and error");
  add_test(*lab, context, "cantilever", v1::LAB_TEST_CANTILEVER,
           "ASTM D1388: hang a strip over an edge");
  add_test(*lab, context, "chain", v1::LAB_TEST_CHAIN,
           "Hang threads between two hooks: a catenary");
  add_test(*lab, context, "drape", v1::LAB_TEST_DRAPE,
           "ISO 9073-9 (Cusick): the shadow of a disc over a smaller one");
}

}  // namespace weft::client
