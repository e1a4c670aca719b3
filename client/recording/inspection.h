#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "client/problem.h"
#include "client/recording/reader.h"
#include "client/recording/tally.h"

namespace weft::client {

// What a recording amounts to, and all that is wrong with it.
struct Inspection {
  Tally tally;  // of the frames that are whole
  std::vector<Violation> faults;
};

// Reads the whole file and holds it to what recordings promise: every frame of the extent is there
// as it was written, in order of time, with finite positions.
Inspection inspect(RecordingReader& recording,
                   const std::function<void(std::int64_t frame)>& progress);

// Throws the faults, if there are any.
void check(const RecordingReader& recording, const Inspection& inspection);

}  // namespace weft::client
