#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "client/recording/frame_range.h"
#include "client/recording/reader.h"

namespace weft::client {

struct SpliceOrder {
  FrameRange frames;
  std::string path;
  bool replace = false;
};

// Writes the frames of recordings of one session to another one, each once and as it is; the frames
// that were written. Memory does not grow with them. Throws, and leaves no file, where they are not
// of one session or one format, where a frame of the range is in none of them, or where two hold it
// differently.
FrameRange splice(std::vector<RecordingReader>& recordings, const SpliceOrder& order,
                  const std::function<void(std::int64_t frame)>& progress);

}  // namespace weft::client
