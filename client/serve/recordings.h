#pragma once

#include <condition_variable>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "client/connection.h"
#include "client/output/json.h"
#include "client/recording/tally.h"

namespace weft::client {

// Recordings of sessions, under way and ended, in files of one directory. For any thread.
class Recordings {
 public:
  Recordings(const Connection& connection, std::string directory);
  // Ends those that are under way; their files hold what came so far.
  ~Recordings();
  Recordings(const Recordings&) = delete;
  Recordings& operator=(const Recordings&) = delete;

  // Records from the newest frame on, through pauses, until stopped; at most 16 at a time, and a
  // session once. The file is named after the session and the time.
  Json start(const std::string& session);  // "sessions/flag"
  // Ends a session's recording and waits until its file is whole.
  Json stop(const std::string& session);
  // The latest, newest first: {"recordings": [{"file", "session", "state": "recording", "done" or
  // "failed", "frames", "last_frame", "last_time_s", "bytes", "message"}]}
  Json list() const;

 private:
  struct Recording {
    std::string file;
    std::string session;
    std::stop_source stop{};
    Tally tally{};
    bool done = false;
    std::optional<Problem> problem{};
    std::jthread thread{};  // its stop is not used
  };

  static Json to_json(const Recording& recording);
  Recording* find_active(const std::string& session);
  void record_into(Recording& recording);
  void forget_old();

  const Connection& connection_;
  const std::string directory_;
  mutable std::mutex mutex_;
  std::condition_variable ended_;
  std::list<Recording> recordings_;  // newest first; guarded by mutex_
};

}  // namespace weft::client
