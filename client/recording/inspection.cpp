#include "client/recording/inspection.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "client/output/text.h"
#include "client/recording/points.h"

namespace weft::client {
namespace {

bool is_finite(const v1::Frame& frame, const v1::StreamHeader& header) {
  const Points points = read_points(frame.positions_m(), header);
  const auto finite = [](double value) { return std::isfinite(value); };
  return std::all_of(points.x.begin(), points.x.end(), finite) &&
         std::all_of(points.y.begin(), points.y.end(), finite) &&
         std::all_of(points.z.begin(), points.z.end(), finite);
}

}  // namespace

Inspection inspect(RecordingReader& recording,
                   const std::function<void(std::int64_t frame)>& progress) {
  constexpr std::size_t kMostFaults = 1000;  // beyond this many the list says no more
  Inspection found;
  for (const auto& text : recording.find_damage()) found.faults.push_back({"file", text});
  try {
    recording.assets();
  } catch (const Problem& problem) {
    found.faults.push_back({"assets", problem.what()});
  }
  double last_time = -std::numeric_limits<double>::infinity();
  for (auto number = recording.first_frame();
       number <= recording.last_frame() && found.faults.size() < kMostFaults; ++number) {
    const auto fault = [&](const std::string& what) {
      found.faults.push_back({fmt::format("frame {}", number), what});
    };
    try {
      const v1::Frame frame = recording.read(number);
      if (!is_finite(frame, recording.header())) fault("a position is not finite");
      if (!(frame.time_s() > last_time)) fault("it is not later than the frame before");
      last_time = frame.time_s();
      found.tally.add(frame);
    } catch (const Problem& problem) {
      fault(problem.what());
    }
    progress(number);
  }
  return found;
}

void check(const RecordingReader& recording, const Inspection& inspection) {
  if (inspection.faults.empty()) return;
  const auto count = static_cast<std::int64_t>(inspection.faults.size());
  Problem problem = damaged(recording.path(), count_of(count, "fault"));
  problem.violations = inspection.faults;
  throw problem;
}

}  // namespace weft::client
