#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "client/recording/reader.h"
#include "server/session/frame.h"
#include "weft/v1/session.pb.h"

namespace weft::client {

// Plays a recording: its frames come one after the other, each at its time, as those of a session
// that runs; those that came stay. Begins PAUSED at the first. All public methods are thread-safe.
class Player {
 public:
  struct Run {
    std::optional<double> time_scale =
        {};  // recorded seconds per second; absent: as fast as possible
    std::optional<std::int64_t> until_frame = {};
    bool until_rest = false;
  };
  // Where it stands.
  struct Place {
    v1::SessionState state = v1::SESSION_STATE_PAUSED;
    std::shared_ptr<const Frame> newest;
    std::uint64_t changes = 0;  // of the state and the run, so far
    std::string failure;        // of FAILED: why the next frame cannot be read
    bool closed = false;
  };

  // Throws where the file is no recording, or holds no frame.
  explicit Player(const std::string& path);

  const v1::Scene& scene() const { return recording_.scene(); }
  const v1::StreamHeader& header() const { return recording_.header(); }
  const Topology& topology() const { return recording_.topology(); }
  const std::string& recorded_at() const { return recording_.recorded_at(); }
  std::int64_t first_frame() const { return recording_.first_frame(); }
  std::int64_t last_frame() const { return recording_.last_frame(); }

  Place place() const;
  // The same, as soon as frame `next` has come, or more has changed than `changes`, or it is
  // closed, or the time is over.
  Place wait(std::int64_t next, std::uint64_t changes, std::chrono::milliseconds longest) const;
  // Those that the scene names, as far as they were recorded.
  Assets assets();
  // A frame that has come. Throws where it cannot be read.
  std::shared_ptr<const Frame> frame(std::int64_t number);

  // Each answers with the place then; at the end of the recording nothing comes any more.
  Place run(const Run& run);
  Place pause();
  Place step(std::int64_t frames);
  // Nobody waits any more.
  void close();

 private:
  using Clock = std::chrono::steady_clock;

  void play(const std::stop_token& stop);

  // with the mutex held
  std::shared_ptr<const Frame> load(std::int64_t number);
  void advance_to(std::int64_t number);
  Clock::time_point due() const;
  void change(v1::SessionState state);

  RecordingReader recording_;  // what changes in it is guarded by the mutex
  mutable std::mutex mutex_;   // guards all below
  mutable std::condition_variable_any changed_;
  Place place_;
  Run run_;
  Clock::time_point start_time_;  // of the run
  double start_s_ = 0;            // time of the frame then
  std::jthread thread_;
};

}  // namespace weft::client
