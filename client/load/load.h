#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/connection.h"
#include "client/load/latencies.h"

namespace weft::client {

// What makes the sessions of a load advance.
enum class Drive {
  kPaced,    // they run by themselves at the rate
  kStepped,  // a call for every frame, due at the rate
  kFree,     // they run as fast as they can and their subscribers read; no frame is due
};

// Sessions that each publish frames at a given rate, whether or not the server keeps up, and
// subscribers that receive all of them.
struct LoadOrder {
  v1::Scene scene;
  int sessions = 10;
  std::vector<int> stages{};  // or as many up to each stage, rising
  int subscribers = 1;        // of each session
  Drive drive = Drive::kPaced;
  double rate_per_s = 60;                      // frames a second of each session
  std::optional<std::int64_t> frames{};        // of each session, if it shall end after them
  std::chrono::duration<double> ramp{1};       // of a stage: it creates its sessions, evenly
  std::chrono::duration<double> duration{10};  // of a stage, after the ramp
  std::chrono::duration<double> grace{10};     // for answers and frames under way at the end
  // Called with every frame received: of which session and subscriber, from 0. Called from any
  // thread, for one subscriber in order.
  std::function<void(int session, int subscriber, const v1::Frame&)> on_frame{};

  std::vector<int> sessions_of_stages() const {
    return stages.empty() ? std::vector{sessions} : stages;
  }
};

// What was due in a stage after its ramp; creations within it.
struct StageResult {
  int sessions = 0;  // in all
  Latencies create;
  Latencies step;
  Latencies frame;
  std::int64_t frames_received = 0;  // after the ramp
  std::int64_t errors = 0;           // that came in the stage
};

// Every latency counts from the time at which the call, or the frame, was due: a server that is
// late with one does not make what waits behind it look prompt. Those due within a ramp are not
// timed, and those that never came count as they had waited at the end.
//
// Frame k is due k intervals after the answer to the call that began the session's run, or earlier
// where a frame came so early that it must have begun earlier.
struct LoadResult {
  Latencies create;
  Latencies step;   // kStepped
  Latencies frame;  // to each subscriber; not kFree
  std::vector<StageResult> stages;
  std::int64_t sessions = 0;
  std::int64_t frames_due = 0;  // by the end, of all subscribers; not kFree
  std::int64_t frames_received = 0;
  std::int64_t frames_lost = 0;                // computed, but never received
  std::int64_t frames_doubled = 0;             // received again, or out of order
  std::int64_t planned_substeps = 0;           // of the sessions' frames; those at rest take none
  std::map<std::string, std::int64_t> errors;  // by call and reason, "step: SOLVER_FAILED"
  std::chrono::duration<double> wall{};        // until sessions were stopped
  std::chrono::duration<double> cpu{};         // of this process, in that time

  std::int64_t error_count() const;
  // Whether nothing was lost, doubled or refused.
  bool clean() const { return frames_lost + frames_doubled + error_count() == 0; }
};

// Calls `progress` twice a second. A stop of the connection ends it early; the sessions are deleted
// in any case.
LoadResult apply_load(Connection& connection, const LoadOrder& order,
                      const std::function<void(const LoadResult&)>& progress = {});

}  // namespace weft::client
