#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "client/recording/frame_range.h"
#include "client/recording/reader.h"

namespace weft::client {

enum class ExportFormat { kObj, kPc2, kMdd, kGltf, kVtk, kUsda, kNpz, kCsv };

// What is exported, and where to.
struct ExportOrder {
  ExportFormat format = ExportFormat::kCsv;
  std::string path;
  std::string sheet;  // empty: all sheets
  FrameRange frames;
  std::int64_t every = 1;       // each such frame of them
  std::vector<double> times_s;  // where given, frames at these times instead
};

struct ExportResult {
  std::int64_t frames = 0;
  std::int64_t particles = 0;
};

// A frame at a time, so memory does not grow with the recording.
ExportResult export_recording(RecordingReader& recording, const ExportOrder& order,
                              const std::function<void(const ExportResult&)>& progress);

}  // namespace weft::client
