#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "client/connection.h"
#include "client/recording/tally.h"

namespace weft::client {

// What is recorded, where, and when it ends: after the frame `to`, or at rest, or when the session,
// having advanced, is paused again, or when it is stopped.
struct RecordingOrder {
  std::string session;  // "sessions/flag"
  std::string path;
  bool replace = false;              // a file of that path
  std::optional<std::int64_t> from;  // absent: the newest frame
  std::optional<std::int64_t> to;
  bool until_rest = false;
  bool relax = false;           // comes to rest on its shortest way, where it runs
  bool through_pauses = false;  // a pause does not end it
  bool run = false;             // lets the session run, as far as it is recorded
  bool velocities = false, pressure = false, clearance = false;
  v1::FrameEncoding encoding = v1::FRAME_ENCODING_FLOAT32;
  std::chrono::seconds patience{60};  // with a connection that is gone
};

struct RecordingResult {
  Tally tally;
  int reconnections = 0;
  bool complete = false;  // false: stopped before its end
};

// Records a session, losing no frame: the session waits where the recorder is slower. A stop that
// is requested ends it too. The file holds what came so far, however this ends.
RecordingResult record(Connection& connection, const RecordingOrder& order,
                       const std::function<void(const Tally&)>& progress);

}  // namespace weft::client
