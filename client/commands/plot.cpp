#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "client/commands/commands.h"
#include "client/exports/output_file.h"
#include "client/output/status.h"
#include "client/output/svg.h"
#include "client/output/text.h"
#include "client/recording/points.h"
#include "client/recording/reader.h"

namespace weft::client {
namespace {

struct PlotOptions {
  std::vector<std::string> recordings;
  std::string frames;
  std::string path;
};

constexpr std::size_t kMostPlotted = 4;
constexpr const char* kTime = "time, s";

// Curves over simulated time, of every recording.
struct Curves {
  Plot energy{"Energy", kTime, "J", {}};
  Plot strain{"Largest strain", kTime, "%", {}};
  Plot speed{"Speed of the fastest particle, as a mean from frame to frame", kTime, "m/s", {}};
  Plot substeps{"Substeps of a frame", kTime, "", {}};
  std::int64_t frames = 0;
};

double largest_distance(const Points& a, const Points& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.x.size(); ++i) {
    largest = std::max(largest, std::hypot(a.x[i] - b.x[i], a.y[i] - b.y[i], a.z[i] - b.z[i]));
  }
  return largest;
}

void add_curves(Curves& curves, const std::string& path, const FrameRange& wanted, bool alone) {
  RecordingReader recording(path);
  if (!recording.header().format().stats())
    throw usage_problem(path + " holds no energies: it was recorded without stats");
  const std::string name = std::filesystem::path(path).stem().string();
  Series kinetic{alone ? "kinetic" : name + ", kinetic", {}};
  Series potential{alone ? "potential" : name + ", potential", {}};
  Series strain{name, {}};
  Series speed{name, {}};
  Series substeps{name, {}};

  Points before;
  double time_before = 0;
  const std::int64_t last = std::min(wanted.last, recording.last_frame());
  for (auto n = std::max(wanted.first, recording.first_frame()); n <= last; ++n) {
    const v1::Frame frame = recording.read(n);
    Points points = read_points(frame.positions_m(), recording.header());
    const double time = frame.time_s();
    kinetic.points.emplace_back(time, frame.stats().kinetic_energy_j());
    potential.points.emplace_back(time, frame.stats().potential_energy_j());
    strain.points.emplace_back(time, 100 * frame.stats().largest_strain());
    if (n > 0)  // frame 0 takes none
      substeps.points.emplace_back(time, static_cast<double>(frame.stats().substep_count()));
    if (!before.x.empty())
      speed.points.emplace_back(time, largest_distance(points, before) / (time - time_before));
    before = std::move(points);
    time_before = time;
    ++curves.frames;
  }
  if (before.x.empty()) throw usage_problem(path + " has none of these frames");
  curves.energy.series.push_back(std::move(kinetic));
  curves.energy.series.push_back(std::move(potential));
  curves.strain.series.push_back(std::move(strain));
  curves.speed.series.push_back(std::move(speed));
  curves.substeps.series.push_back(std::move(substeps));
}

// The four plots in two rows.
std::string sheet_of_plots(const Curves& curves) {
  std::string svg =
      fmt::format("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\">\n",
                  2 * kPlotWidth, 2 * kPlotHeight);
  int place = 0;
  for (const Plot* plot : {&curves.energy, &curves.strain, &curves.speed, &curves.substeps}) {
    svg += fmt::format("<svg x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\">\n{}</svg>\n",
                       place % 2 * kPlotWidth, place / 2 * kPlotHeight, kPlotWidth, kPlotHeight,
                       svg_text(*plot));
    ++place;
  }
  return svg + "</svg>\n";
}

void run_plot(Context& context, const PlotOptions& options) {
  if (options.recordings.size() > kMostPlotted)
    throw usage_problem(fmt::format("plot draws at most {} recordings", kMostPlotted));
  Status status(context.terminal.err, context.terminal.err_is_watched);
  Curves curves;
  for (const std::string& path : options.recordings) {
    status.show({"reading " + path});
    add_curves(curves, path, read_frame_range(options.frames), options.recordings.size() == 1);
  }
  status.clear();
  OutputFile file(options.path);
  file.write(sheet_of_plots(curves));
  file.close();
  context.answer({{"output", options.path}, {"frames", curves.frames}},
                 fmt::format("{}: energy, strain, speed and substeps of {}\n", options.path,
                             count_of(curves.frames, "frame")));
}

}  // namespace

void add_plot(CLI::App& app, Context& context) {
  auto options = std::make_shared<PlotOptions>();
  CLI::App* command =
      app.add_subcommand("plot", "Draw energy, strain, speed and substeps over time");
  command->add_option("FILE", options->recordings, "Recordings, up to 4 in one picture")
      ->option_text("...")
      ->required()
      ->expected(-1);
  command->add_option("-o,--output", options->path, "SVG file to write")
      ->type_name("PATH")
      ->required();
  command->add_option("--frames", options->frames, "Frames A to B; either may be left out")
      ->option_text("A:B");
  command->callback([&context, options] { run_plot(context, *options); });
}

}  // namespace weft::client
