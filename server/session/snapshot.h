#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "core/simulation.h"
#include "server/session/command.h"
#include "server/session/log.h"

namespace weft {

// A session between two frames: what came before need not be computed again.
struct SessionSnapshot {
  // What a named call was answered.
  struct Answered {
    Request request;
    Outcome outcome;
  };
  std::string numerics_id;   // of the server that kept it; empty until it is kept
  std::int64_t entries = 0;  // of the log, that were carried out before it
  std::chrono::system_clock::time_point create_time;
  Snapshot simulation;
  std::vector<LogEntry> under_way;  // the beginnings of a run and a step
  std::vector<Answered> answers;    // that are remembered, oldest first
};

// "frame-120"
inline std::string default_snapshot_id(std::int64_t frame) {
  return "frame-" + std::to_string(frame);
}

}  // namespace weft
