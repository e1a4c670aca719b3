#pragma once

#include <grpcpp/support/status.h>

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <set>
#include <thread>

#include "server/session/stats.h"

namespace weft {

class FrameCall;

// The open calls that send frames. A thread of its own reminds them of Progress.
class FrameStreams {
 public:
  // With kTick, readers get a message at least every two seconds.
  static constexpr std::chrono::milliseconds kTick{250};
  static constexpr std::chrono::milliseconds kProgressInterval{1750};
  static constexpr std::chrono::milliseconds kLongFrameInterval{400};

  explicit FrameStreams(Stats& stats);
  ~FrameStreams();

  // Why the stream is not one of them.
  grpc::Status add(std::shared_ptr<FrameCall> stream);
  void remove(const std::shared_ptr<FrameCall>& stream);

  // Ends every stream, and adds none any more.
  void drain();

 private:
  void remind(const std::stop_token& stop);

  Stats& stats_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::set<std::shared_ptr<FrameCall>> streams_;
  bool draining_ = false;
  std::jthread thread_;
};

}  // namespace weft
