#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <future>
#include <mutex>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "client/connection.h"
#include "client/recording/recorder.h"

// Sessions that are recorded while their textiles are changed, and what is wrong with the
// recordings.
namespace weft::stress {

using Clock = std::chrono::steady_clock;

// When each recorder heard its newest frame.
class Hearing {
 public:
  explicit Hearing(std::size_t recorders) : heard_(recorders) {}

  std::size_t recorders() const { return heard_.size(); }

  void note(std::size_t recorder, std::int64_t frame) {
    const std::lock_guard lock(mutex_);
    if (heard_[recorder].frame == frame) return;
    heard_[recorder] = {frame, Clock::now()};
    changed_.notify_all();
  }

  // The times at which all of them, or those from `first` on, had heard something after `moment`.
  std::vector<Clock::time_point> wait_for_all_after(Clock::time_point moment,
                                                    std::size_t first = 0) {
    std::unique_lock lock(mutex_);
    std::vector<Clock::time_point> times;
    for (const Heard& heard : std::span(heard_).subspan(first)) {
      if (!changed_.wait_for(lock, std::chrono::minutes(2), [&] { return heard.time > moment; }))
        throw std::runtime_error("a recorder does not go on within two minutes");
      times.push_back(heard.time);
    }
    return times;
  }

 private:
  struct Heard {
    std::int64_t frame = -1;
    Clock::time_point time;
  };

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Heard> heard_;
};

// A change that the server acknowledged.
struct Change {
  v1::UpdateTextileRequest request;
  std::int64_t applied_frame = 0;
};

struct Recorded {
  v1::Session session;
  std::string path;
  std::vector<Change> changes;
  std::future<client::RecordingResult> recorder;
};

// Sessions of the scene that run at the pace, each with a recorder that goes on as after any broken
// connection; recordings are files of the directory. The connection is the recorders'.
std::vector<Recorded> record_sessions(const std::string& directory, client::Connection& connection,
                                      const v1::Scene& scene, Hearing& hearing, double pace = 1);

// The `number`th change, the same whenever it is sent again.
v1::UpdateTextileRequest change_of(const v1::Session& session, int number);

struct Faults {
  std::int64_t frames = 0;
  std::int64_t lost = 0;
  std::int64_t differing = 0;
};

// Pauses a session, waits for its recording, and holds it to what the core computes with the
// acknowledged changes.
void finish(client::Connection& connection, const v1::Scene& scene, Recorded& one, Faults& faults);
// The same of the frames that a file has, which may begin late.
void compare(const std::string& path, const v1::Scene& scene, const std::vector<Change>& changes,
             Faults& faults);

}  // namespace weft::stress
