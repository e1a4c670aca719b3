#include "client/exports/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "client/exports/frame_writer.h"
#include "client/problem.h"
#include "client/sheet_layout.h"

namespace weft::client {
namespace {

constexpr double kSameTime = 1e-9;  // s

// The particles that are exported, and their sheets counted from the first of them.
struct Part {
  std::vector<SheetMesh> sheets;
  std::size_t first = 0;
  std::size_t count = 0;
};

// Lies as it starts.
void set_flat_shape(SheetMesh& mesh, const v1::Grid& grid) {
  for (std::size_t i = 0; i < particle_count(mesh.layout); ++i) {
    const GridPlace place = place_in(mesh.layout, static_cast<int>(i));
    mesh.flat.push_back({static_cast<float>(place.row * grid.spacing_m()),
                         static_cast<float>(place.column * grid.spacing_m())});
  }
  mesh.flat_triangles = mesh.triangles;
}

Part find_part(const RecordingReader& recording, const std::string& name) {
  Part part;
  std::string names;
  int index = -1;
  for (SheetMesh& mesh : meshes_of(recording.header(), recording.topology())) {
    v1::SheetLayout& sheet = mesh.layout;
    ++index;
    names += (names.empty() ? "" : ", ") + sheet.name();
    if (!name.empty() && sheet.name() != name) continue;
    if (part.sheets.empty()) part.first = static_cast<std::size_t>(sheet.first_particle());
    sheet.set_first_particle(static_cast<std::int32_t>(part.count));
    part.count += particle_count(sheet);
    if (mesh.flat.empty() && index < recording.scene().sheets_size())
      set_flat_shape(mesh, recording.scene().sheets(index).grid());
    part.sheets.push_back(std::move(mesh));
  }
  if (part.sheets.empty()) {
    throw usage_problem(
        fmt::format("{} has no sheet \"{}\"; it has: {}", recording.path(), name, names));
  }
  return part;
}

std::int64_t find_frame_at(RecordingReader& recording, double time_s) {
  const auto around = recording.find_around(time_s + kSameTime);
  std::string neighbours;
  for (const auto& [number, time] : around) {
    if (std::abs(time - time_s) <= kSameTime) return number;
    neighbours +=
        fmt::format("{}frame {} at {:.12g} s", neighbours.empty() ? "" : " and ", number, time);
  }
  throw Problem(Exit::kRefused, "OUT_OF_RANGE", "NO_FRAME_AT_TIME",
                fmt::format("{} has no frame at {:.12g} s; next to it: {}", recording.path(),
                            time_s, neighbours.empty() ? "nothing" : neighbours));
}

std::vector<std::int64_t> frames_to_export(RecordingReader& recording, const ExportOrder& order) {
  std::vector<std::int64_t> numbers;
  for (const double time : order.times_s) numbers.push_back(find_frame_at(recording, time));
  if (!order.times_s.empty()) return numbers;
  const std::int64_t last = std::min(order.frames.last, recording.last_frame());
  if (recording.last_frame() >= recording.first_frame() + recording.count_frames())
    throw damaged(recording.path(), "it holds fewer frames than it says");
  for (auto n = std::max(order.frames.first, recording.first_frame()); n <= last; n += order.every)
    numbers.push_back(n);
  return numbers;
}

UsdStage stage_of(const RecordingReader& recording, const std::vector<std::int64_t>& numbers) {
  const auto [first, last] = std::minmax_element(numbers.begin(), numbers.end());
  const v1::Vector3& gravity = recording.scene().environment().gravity_m_per_s2();
  return {.first_frame = *first,
          .last_frame = *last,
          .frames_per_second = 1 / recording.header().frame_step_s(),
          .up_axis = std::abs(gravity.z()) > std::abs(gravity.y()) ? 'Z' : 'Y'};
}

std::vector<std::string> value_names(const RecordingReader& recording) {
  std::vector<std::string> names;
  if (recording.header().format().pressure()) names.emplace_back("pressure");
  if (recording.header().format().clearance()) names.emplace_back("clearance");
  return names;
}

std::vector<ExportValues> values_of(const v1::Frame& frame, const RecordingReader& recording,
                                    const Part& part) {
  std::vector<ExportValues> values;
  const auto add = [&](const char* name, const std::vector<double>& all) {
    const auto begin = all.begin() + static_cast<std::ptrdiff_t>(part.first);
    values.push_back({name, {begin, begin + static_cast<std::ptrdiff_t>(part.count)}});
  };
  const v1::FrameFormat& format = recording.header().format();
  if (format.pressure()) add("pressure", read_pressures(frame, recording.header()));
  if (format.clearance()) add("clearance", read_clearances(frame, recording.header()));
  return values;
}

std::unique_ptr<FrameWriter> make_writer(const ExportOrder& order, const Part& part,
                                         const RecordingReader& recording,
                                         const std::vector<std::int64_t>& numbers) {
  switch (order.format) {
    case ExportFormat::kObj:
      return make_obj_writer(order.path, part.sheets);
    case ExportFormat::kPc2:
      return make_pc2_writer(order.path, part.count, numbers.front());
    case ExportFormat::kMdd:
      return make_mdd_writer(order.path, part.count, numbers.size());
    case ExportFormat::kGltf:
      return make_gltf_writer(order.path, part.sheets, numbers.size(), value_names(recording));
    case ExportFormat::kVtk:
      return make_vtk_writer(order.path, part.sheets);
    case ExportFormat::kUsda:
      return make_usd_writer(order.path, part.sheets, stage_of(recording, numbers));
    case ExportFormat::kNpz:
      return make_npz_writer(
          order.path, part.sheets, numbers.size(),
          1 / (recording.header().frame_step_s() * static_cast<double>(order.every)));
    case ExportFormat::kCsv:
      return make_csv_writer(order.path, part.count, value_names(recording));
  }
  throw std::logic_error("no such format");
}

}  // namespace

ExportResult export_recording(RecordingReader& recording, const ExportOrder& order,
                              const std::function<void(const ExportResult&)>& progress) {
  const std::vector<std::int64_t> numbers = frames_to_export(recording, order);
  if (numbers.empty())
    throw usage_problem(fmt::format("{} has none of these frames", recording.path()));

  std::error_code error;  // there is no such file yet
  if (std::filesystem::equivalent(order.path, recording.path(), error))
    throw unwritable(order.path, "it is the recording itself");
  recording.read(numbers.front());  // its particles are as many as the header says, or it throws
  const Part part = find_part(recording, order.sheet);
  const auto writer = make_writer(order, part, recording, numbers);
  ExportResult result{.frames = 0, .particles = static_cast<std::int64_t>(part.count)};
  for (const std::int64_t number : numbers) {
    const v1::Frame frame = recording.read(number);
    writer->add(
        {.number = frame.number(),
         .time_s = frame.time_s(),
         .points = read_points(frame.positions_m(), recording.header(), part.first, part.count),
         .values = values_of(frame, recording, part)});
    ++result.frames;
    progress(result);
  }
  writer->finish();
  return result;
}

}  // namespace weft::client
