#pragma once

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "client/connection.h"
#include "client/recording/tally.h"
#include "client/recording/writer.h"

namespace weft::client {

// What was seen of a session so far.
struct Sight {
  v1::StreamHeader header;
  Topology topology;
  v1::Frame frame;  // the newest
  Tally tally;
  std::optional<double> rest_time_s;  // of the first frame of the rest that the newest is in
  v1::Progress progress;
};

// Sees every frame of a session, in a thread of its own, and records them where asked. The session
// waits where it is slower.
class Observer {
 public:
  Observer(Connection& connection, const v1::Session& session, const v1::FrameFormat& format);
  ~Observer();
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  // Waits until that holds, and returns what was seen then. Throws what ends the stream before, or
  // the recording.
  Sight await(const std::function<bool(const Sight&)>& holds);
  // Records from the newest frame on, until the next call or the end; commit() says whether the
  // file holds all of it.
  void record(const std::string& path, bool replace, const v1::Scene& scene);
  void commit();

 private:
  void observe(v1::StreamFramesRequest request);
  void take(const v1::StreamFramesResponse& message, const Topology& topology);

  Connection& connection_;
  std::stop_source stop_;
  std::stop_callback<std::function<void()>> stop_with_connection_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  Sight sight_;
  std::optional<RecordingWriter> writer_;
  std::exception_ptr end_;  // why nothing more will come
  std::thread thread_;
};

}  // namespace weft::client
