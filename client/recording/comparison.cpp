#include "client/recording/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "client/output/text.h"
#include "client/problem.h"
#include "client/recording/points.h"
#include "client/sheet_layout.h"

namespace weft::client {
namespace {

[[noreturn]] void refuse(const RecordingReader& a, const RecordingReader& b,
                         const std::string& why) {
  throw Problem(Exit::kRefused, "FAILED_PRECONDITION", "RECORDINGS_NOT_COMPARABLE",
                fmt::format("{} and {} cannot be compared: {}", a.path(), b.path(), why));
}

std::string sheet_text(const v1::SheetLayout& sheet) {
  return fmt::format("{} ({})", sheet.name(), shape_text(sheet));
}

std::string frames_text(const RecordingReader& recording) {
  return recording.last_frame() < recording.first_frame()
             ? "no frames"
             : fmt::format("frames {} to {}", recording.first_frame(), recording.last_frame());
}

void check_layouts(const RecordingReader& a, const RecordingReader& b) {
  const v1::StreamHeader& left = a.header();
  const v1::StreamHeader& right = b.header();
  if (left.sheets_size() != right.sheets_size()) {
    refuse(a, b,
           fmt::format("one has {}, the other {}", count_of(left.sheets_size(), "sheet"),
                       count_of(right.sheets_size(), "sheet")));
  }
  for (int i = 0; i < left.sheets_size(); ++i) {
    const std::string one = sheet_text(left.sheets(i));
    const std::string other = sheet_text(right.sheets(i));
    if (one != other) refuse(a, b, fmt::format("sheet {} is {} and {}", i + 1, one, other));
    const auto triangles = [i](const RecordingReader& recording) -> const std::string& {
      return recording.topology()[static_cast<std::size_t>(i)].triangles();
    };
    if (!is_grid(left.sheets(i)) && triangles(a) != triangles(b))
      refuse(a, b, fmt::format("the triangles of sheet {}, {}, are others", i + 1, one));
  }
  if (left.frame_step_s() != right.frame_step_s()) {
    refuse(a, b,
           fmt::format("their frames are {:.9g} s and {:.9g} s apart", left.frame_step_s(),
                       right.frame_step_s()));
  }
}

// Says of what sheet the particle is, and where on it.
void place(Comparison& found, const v1::StreamHeader& header, std::size_t particle) {
  for (const auto& sheet : header.sheets()) {
    const std::size_t index = particle - static_cast<std::size_t>(sheet.first_particle());
    if (index >= particle_count(sheet)) continue;
    found.sheet = sheet.name();
    found.particle = static_cast<int>(index);
    found.place.reset();
    if (is_grid(sheet)) found.place = place_in(sheet, found.particle);
    return;
  }
  throw std::logic_error("no such particle");
}

struct FrameDifference {
  double sum_of_squares = 0;
  double largest = -1;
  std::size_t particle = 0;
  std::size_t particles = 0;
};

FrameDifference difference(const Points& a, const Points& b) {
  FrameDifference result{.particles = a.x.size()};
  for (std::size_t i = 0; i < a.x.size(); ++i) {
    double distance = std::hypot(a.x[i] - b.x[i], a.y[i] - b.y[i], a.z[i] - b.z[i]);
    if (std::isnan(distance)) distance = std::numeric_limits<double>::infinity();
    result.sum_of_squares += distance * distance;
    if (distance > result.largest) {
      result.largest = distance;
      result.particle = i;
    }
  }
  return result;
}

}  // namespace

Comparison compare(RecordingReader& a, RecordingReader& b, const FrameRange& range,
                   const std::function<void(std::int64_t frame)>& progress) {
  check_layouts(a, b);
  Comparison result;
  result.first_frame = std::max({range.first, a.first_frame(), b.first_frame()});
  result.last_frame = std::min({range.last, a.last_frame(), b.last_frame()});
  if (result.first_frame > result.last_frame) {
    refuse(a, b,
           fmt::format("no frame asked for is in both, one has {}, the other {}", frames_text(a),
                       frames_text(b)));
  }
  result.same_frames =
      std::max(range.first, a.first_frame()) == std::max(range.first, b.first_frame()) &&
      std::min(range.last, a.last_frame()) == std::min(range.last, b.last_frame());

  double sum_of_squares = 0;
  double count = 0;
  result.largest_m = -1;
  for (auto number = result.first_frame; number <= result.last_frame; ++number) {
    const v1::Frame left = a.read(number);
    const v1::Frame right = b.read(number);
    const FrameDifference found = difference(read_points(left.positions_m(), a.header()),
                                             read_points(right.positions_m(), b.header()));
    sum_of_squares += found.sum_of_squares;
    count += static_cast<double>(found.particles);
    if (found.largest > result.largest_m) {
      result.largest_m = found.largest;
      result.frame = number;
      result.time_s = left.time_s();
      place(result, a.header(), found.particle);
    }
    if (!result.first_unequal && left.SerializeAsString() != right.SerializeAsString())
      result.first_unequal = number;
    progress(number);
  }
  result.rms_m = std::sqrt(sum_of_squares / count);
  return result;
}

}  // namespace weft::client
