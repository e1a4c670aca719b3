#include "client/page/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <string_view>

#include "client/assets.h"
#include "client/exports/output_file.h"
#include "client/output/json.h"
#include "client/page/facts.h"
#include "client/page/packed_frames.h"
#include "client/problem.h"
#include "client/recording/cloth.h"
#include "client/recording/phases.h"
#include "client/recording/points.h"
#include "client/recording/reader.h"
#include "client/recording/tally.h"
#include "client/sheet_layout.h"

namespace weft::client {

// viewer.html and live.html with style and scripts in them, and what both need of three.js: its
// license as a comment, its scripts as one
std::string_view viewer_template();
std::string_view live_template();
std::string_view page_license();
std::string_view page_library();

namespace {

constexpr std::string_view kPlaceOfRecordings = "<!-- recordings -->";
constexpr std::string_view kPlaceOfLicense = "<!-- license -->";
constexpr double kStepsOfSpacing = 4096;            // quanta in the finest spacing of a recording
constexpr double kLeastStepsOfSpacing = 128;        // where the page would be too large
constexpr double kMostSteps = 1 << 30;              // from the origin
constexpr std::int64_t kMostNumbers = 100'000'000;  // 400 MB in the browser

// What else was recorded of each particle.
struct Quantity {
  std::string name;
  std::vector<double> (*read)(const v1::Frame&, const v1::StreamHeader&);
};

std::vector<Quantity> quantities_of(const v1::FrameFormat& format) {
  std::vector<Quantity> quantities;
  if (format.pressure()) quantities.push_back({"pressure", read_pressures});
  if (format.clearance()) quantities.push_back({"clearance", read_clearances});
  return quantities;
}

// Of a quantity over the frames of a garment that is put on, or of all, without what few have.
struct Extent {
  Levels levels{.low = 0, .high = 0};
  double scale = 0;  // what colours end at
};

// Takes what a frame has in.
void extend(Extent& extent, std::vector<double> values, const std::string& path) {
  for (const double value : values)
    if (!std::isfinite(value)) throw damaged(path, "a value of a particle is not finite");
  const auto beyond = [&](double share) {
    const auto at = values.begin() +
                    static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  extent.levels.low = std::min(extent.levels.low, beyond(0.001));
  extent.levels.high = std::max(extent.levels.high, beyond(0.999));
  std::erase_if(values, [](double value) { return value <= 0; });
  if (!values.empty()) extent.scale = std::max(extent.scale, beyond(0.99));
}

// What the page needs to know of a recording before it holds the frames.
struct Summary {
  Tally tally;
  std::vector<Extent> extents;          // of the quantities
  std::array<double, 3> low{}, high{};  // of all positions, m
  std::vector<double> times_s;
  std::vector<v1::FrameStats> stats;
};

std::size_t particles_of(const v1::StreamHeader& header) {
  std::size_t particles = 0;
  for (const auto& sheet : header.sheets()) particles += particle_count(sheet);
  return particles;
}

Points points_of(const RecordingReader& recording, const v1::Frame& frame) {
  return read_points(frame.positions_m(), recording.header());
}

FrameRange frames_of(const RecordingReader& recording, const FrameRange& wanted) {
  const FrameRange range{.first = std::max(wanted.first, recording.first_frame()),
                         .last = std::min(wanted.last, recording.last_frame())};
  if (range.first > range.last)
    throw usage_problem(fmt::format("{} has none of these frames", recording.path()));
  const auto particles = static_cast<std::int64_t>(particles_of(recording.header()));
  const std::int64_t most = kMostNumbers / (3 * particles);
  if (range.last - range.first >= most) {
    throw usage_problem(
        fmt::format("{}: {} frames of {} particles are more than a browser holds; at most {}: "
                    "choose with --frames A:B",
                    recording.path(), range.last - range.first + 1, particles, most));
  }
  return range;
}

Summary summary_of(RecordingReader& recording, const FrameRange& range) {
  Summary found;
  found.low.fill(std::numeric_limits<double>::infinity());
  found.high.fill(-std::numeric_limits<double>::infinity());
  const v1::StreamHeader& header = recording.header();
  const std::vector<Quantity> quantities = quantities_of(header.format());
  found.extents.resize(quantities.size());
  double dressed_s = 0;
  for (const Phase& phase : phases_of(recording.scene()))
    dressed_s = phase.until_s.value_or(dressed_s);
  for (auto number = range.first; number <= range.last; ++number) {
    const v1::Frame frame = recording.read(number);
    const Points points = points_of(recording, frame);
    const std::array coordinates{&points.x, &points.y, &points.z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const double value : *coordinates[axis]) {
        if (!std::isfinite(value)) {
          throw damaged(recording.path(),
                        fmt::format("a position of frame {} is not finite", number));
        }
        found.low[axis] = std::min(found.low[axis], value);
        found.high[axis] = std::max(found.high[axis], value);
      }
    }
    for (std::size_t q = 0; q < quantities.size(); ++q)
      if (frame.time_s() >= dressed_s || number == range.last)
        extend(found.extents[q], quantities[q].read(frame, header), recording.path());
    found.tally.add(frame);
    found.times_s.push_back(frame.time_s());
    found.stats.push_back(frame.stats());
  }
  return found;
}

std::array<double, 3> middle_of(const Summary& summary) {
  std::array<double, 3> middle{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    middle[axis] = (summary.low[axis] + summary.high[axis]) / 2;
  return middle;
}

double quantum_of(const std::vector<ClothMesh>& sheets, const Summary& summary) {
  double quantum = std::numeric_limits<double>::infinity();
  for (const ClothMesh& sheet : sheets)
    quantum = std::min(quantum, sheet.spacing_m / kStepsOfSpacing);
  for (std::size_t axis = 0; axis < 3; ++axis)
    quantum = std::max(quantum, (summary.high[axis] - summary.low[axis]) / kMostSteps);
  return quantum;
}

Json stats_json(const std::vector<v1::FrameStats>& stats) {
  Json json;
  const bool led = std::any_of(stats.begin(), stats.end(), [](const v1::FrameStats& frame) {
    return frame.pose_times_s_size() > 0;
  });
  for (const v1::FrameStats& frame : stats) {
    if (led) json["pose_times_s"].push_back(frame.pose_times_s());
    json["kinetic_energy_j"].push_back(frame.kinetic_energy_j());
    json["potential_energy_j"].push_back(frame.potential_energy_j());
    json["largest_strain"].push_back(frame.largest_strain());
    json["substep_count"].push_back(frame.substep_count());
    if (frame.has_cloth_cut_count()) json["cloth_cut_count"].push_back(frame.cloth_cut_count());
  }
  return json;
}

// A mesh as it was streamed, without what is nothing, and the panels' own textiles.
Json mesh_json(v1::MeshData mesh, const ClothMesh& cloth) {
  for (int p = 0; p < mesh.panels_size(); ++p) {
    const ClothPanel& panel = cloth.panels[static_cast<std::size_t>(p)];
    if (panel.own_textile) *mesh.mutable_panels(p)->mutable_textile() = panel.textile;
  }
  return to_json(mesh, Defaults::kLeftOut);
}

// client/page/cloth.js makes triangles of both kinds.
Json sheets_json(const RecordingReader& recording, const std::vector<ClothMesh>& cloth) {
  Json sheets = Json::array();
  for (int i = 0; i < recording.header().sheets_size(); ++i) {
    const v1::SheetLayout& layout = recording.header().sheets(i);
    const v1::Sheet& sheet = recording.scene().sheets(i);
    const auto s = static_cast<std::size_t>(i);
    Json pinned = Json::array();
    for (const auto& pin : sheet.pins())
      for (const int particle : pin.particles()) pinned.push_back(particle);
    Json json{{"name", layout.name()},
              {"first_particle", layout.first_particle()},
              {"pinned", std::move(pinned)},
              {"textile", to_json(sheet.textile())}};
    if (is_grid(layout)) {
      json["rows"] = layout.rows();
      json["columns"] = layout.columns();
      json["spacing_m"] = cloth[s].spacing_m;
    } else {
      json["particle_count"] = layout.particle_count();
      json["mesh"] = mesh_json(recording.topology()[s], cloth[s]);
    }
    sheets.push_back(std::move(json));
  }
  return sheets;
}

Json colliders_json(const v1::Scene& scene) {
  Json colliders = Json::array();
  for (const auto& collider : scene.colliders())
    colliders.push_back(to_json(collider, Defaults::kLeftOut));
  return colliders;
}

// Where the frame that was judged is shown.
std::optional<v1::Verdict> verdict_in(RecordingReader& recording, const FrameRange& range) {
  auto verdict = recording.verdict();
  if (verdict && (verdict->frame() < range.first || verdict->frame() > range.last)) verdict.reset();
  return verdict;
}

// A recording on its way to the page.
struct Source {
  Source(const Exhibit& exhibit, const FrameRange& wanted)
      : name(exhibit.name),
        facts(exhibit.facts),
        recording(exhibit.path),
        range(frames_of(recording, wanted)),
        summary(summary_of(recording, range)),
        cloth(cloth_of(recording)),
        colliders(colliders_json(with_bodies(recording.scene(), recording.assets()))),
        verdict(verdict_in(recording, range)),
        quantum_m(quantum_of(cloth, summary)) {}

  std::string name;
  std::vector<std::pair<std::string, std::string>> facts;
  RecordingReader recording;
  FrameRange range;
  Summary summary;
  std::vector<ClothMesh> cloth;
  Json colliders;
  std::optional<v1::Verdict> verdict;
  double quantum_m;
  std::string frames{};  // packed
  std::string values{};  // packed
};

// Triangles of all sheets, of particles counted from the first of all.
std::vector<Triangle> triangles_of(const Source& source) {
  std::vector<Triangle> triangles;
  for (std::size_t s = 0; s < source.cloth.size(); ++s) {
    const std::int32_t first =
        source.recording.header().sheets(static_cast<int>(s)).first_particle();
    for (const auto& [a, b, c] : source.cloth[s].triangles)
      triangles.push_back({a + first, b + first, c + first});
  }
  return triangles;
}

void pack(Source& source) {
  source.frames.clear();
  const auto points = [&](std::int64_t number) {
    return points_of(source.recording, source.recording.read(number));
  };
  const std::vector<Guess> guesses = guesses_of(triangles_of(source), points(source.range.first));
  PackedFrames frames([&](std::string_view text) { source.frames += text; }, guesses,
                      middle_of(source.summary), source.quantum_m);
  for (auto number = source.range.first; number <= source.range.last; ++number)
    frames.add(points(number));
  frames.finish();
}

// Of each quantity, frame after frame: a level of every particle as the difference to that before.
void pack_values(Source& source) {
  source.values.clear();
  Deflated deflated([&](std::string_view text) { source.values += text; });
  const std::vector<Quantity> quantities = quantities_of(source.recording.header().format());
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    std::vector<unsigned char> before(particles_of(source.recording.header()));
    for (auto number = source.range.first; number <= source.range.last; ++number) {
      const std::vector<double> values =
          quantities[q].read(source.recording.read(number), source.recording.header());
      std::string differences(values.size(), '\0');
      for (std::size_t i = 0; i < values.size(); ++i) {
        const unsigned char level = source.summary.extents[q].levels.of(values[i]);
        differences[i] = static_cast<char>(level - std::exchange(before[i], level));
      }
      deflated.add(differences);
    }
  }
  deflated.finish();
}

// Values take so many characters at most, in fewer levels where it takes that.
void pack_values(Source& source, std::size_t room) {
  constexpr int kFewest = 31;
  if (source.summary.extents.empty()) return;
  for (;;) {
    pack_values(source);
    if (source.values.size() <= room || source.summary.extents[0].levels.most <= kFewest) return;
    for (Extent& extent : source.summary.extents) extent.levels.most /= 2;
  }
}

Json values_json(const Source& source) {
  Json json;
  const std::vector<Quantity> quantities = quantities_of(source.recording.header().format());
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    const auto& [levels, scale] = source.summary.extents[q];
    json[quantities[q].name] = {
        {"low", levels.low}, {"high", levels.high}, {"most", levels.most}, {"scale", scale}};
  }
  return json;
}

Json recording_json(const Source& source) {
  const RecordingReader& recording = source.recording;
  const Summary& summary = source.summary;
  Json facts = page_facts(recording, source.cloth, summary.tally);
  if (!source.facts.empty()) {
    const Json measured{{"group", "Measured"}, {"rows", source.facts}};
    facts.insert(facts.begin(), measured);
  }
  return {{"name", source.name},
          {"particles", particles_of(recording.header())},
          {"first_frame", summary.tally.first_frame},
          {"time_s", summary.times_s},
          {"origin_m", middle_of(summary)},
          {"quantum_m", source.quantum_m},
          {"low_m", summary.low},
          {"high_m", summary.high},
          {"stats", recording.header().format().stats() ? stats_json(summary.stats) : Json()},
          {"values", values_json(source)},
          {"phases", phases_json(recording.scene())},
          {"verdict", source.verdict ? to_json(*source.verdict) : Json()},
          {"sheets", sheets_json(recording, source.cloth)},
          {"colliders", source.colliders},
          {"gravity_m_per_s2",
           to_json(recording.scene().environment().gravity_m_per_s2(), Defaults::kLeftOut)},
          {"facts", std::move(facts)}};
}

// A page with something in its place.
std::string with(std::string_view page, std::string_view place, std::string_view text) {
  const std::size_t at = page.find(place);
  return std::string(page.substr(0, at)).append(text).append(page.substr(at + place.size()));
}

std::string plain_script(std::string_view id, std::string_view text) {
  return fmt::format("<script type=\"text/plain\" id=\"{}\">{}</script>\n", id, text);
}

// Packs the frames of all into so many characters, less precisely where that takes it, as far as
// kLeastStepsOfSpacing.
void pack_all(std::vector<Source>& sources, std::size_t room,
              const std::function<void(const Source&)>& progress) {
  double numbers = 0, coarser = 1;
  for (const Source& source : sources)
    numbers += 3.0 * static_cast<double>(source.summary.times_s.size() *
                                         particles_of(source.recording.header()));
  for (;;) {
    std::size_t size = 0;
    for (Source& source : sources) {
      progress(source);
      pack(source);
      size += source.frames.size();
    }
    if (size <= room || coarser >= kStepsOfSpacing / kLeastStepsOfSpacing) return;
    // half the steps save a bit of each number, which is 1/6 of a character
    const double halvings = 0.05 + 6 * static_cast<double>(size - room) / numbers;
    const double by =
        std::min(std::exp2(halvings), kStepsOfSpacing / kLeastStepsOfSpacing / coarser);
    coarser *= by;
    for (Source& source : sources) source.quantum_m *= by;
  }
}

}  // namespace

std::string live_page() {
  const std::string library =
      fmt::format("{}<script>\n{}\n</script>\n", page_license(), page_library());
  return with(live_template(), kPlaceOfLicense, library);
}

PageResult write_page(const PageOrder& order,
                      const std::function<void(const std::string& doing)>& progress) {
  // all that may be wrong with the recordings, before there is a file
  std::vector<Source> sources;
  Json figures = Json::array();
  for (const Figure& figure : order.figures) {
    Json shown = Json::array();
    for (const Exhibit& exhibit : figure.exhibits) {
      progress("reading " + exhibit.path);
      shown.push_back(sources.size());
      sources.emplace_back(exhibit, order.frames);
    }
    figures.push_back(
        {{"title", figure.title}, {"caption", figure.caption}, {"recordings", std::move(shown)}});
  }

  const std::string page =
      with(viewer_template(), kPlaceOfLicense,
           std::string(page_license()) + plain_script("library", deflated(page_library())));
  const auto description = [&] {
    Json recordings = Json::array();
    for (const Source& source : sources) recordings.push_back(recording_json(source));
    const Json json{
        {"title", order.title}, {"figures", figures}, {"recordings", std::move(recordings)}};
    const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    return plain_script("page", deflated(text));
  };
  // positions are what is left for
  constexpr std::size_t kPart = 4;
  std::size_t rest = page.size();
  for (Source& source : sources) {
    pack_values(source, order.most_bytes / kPart / sources.size());
    rest += source.values.size();
  }
  rest += description().size();
  const std::size_t room = order.most_bytes > rest ? order.most_bytes - rest : 0;
  pack_all(sources, room, [&](const Source& source) {
    progress(fmt::format("{}: {}", order.path, source.recording.path()));
  });

  PageResult result;
  std::string recordings = description();
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const Source& source = sources[i];
    recordings += plain_script(fmt::format("frames-{}", i), source.frames);
    if (!source.values.empty())
      recordings += plain_script(fmt::format("values-{}", i), source.values);
    result.frames += source.summary.tally.frames;
    result.largest_error_m = std::max(result.largest_error_m, source.quantum_m / 2);
  }
  OutputFile file(order.path);
  file.write(with(page, kPlaceOfRecordings, recordings));
  file.close();
  result.bytes = static_cast<std::int64_t>(std::filesystem::file_size(order.path));
  return result;
}

}  // namespace weft::client
