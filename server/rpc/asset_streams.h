#pragma once

#include <grpcpp/support/status.h>

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <set>
#include <thread>

#include "server/session/scheduler.h"

namespace weft {

// An open call that carries the bytes of an asset.
class AssetStream {
 public:
  virtual ~AssetStream() = default;

  // Ends the call with SERVER_DRAINING.
  virtual void drain() = 0;
  // Ends it where its caller has said nothing since.
  virtual void give_up(Clock::time_point since) = 0;
};

// All of them. Thread-safe.
class AssetStreams {
 public:
  explicit AssetStreams(std::chrono::milliseconds patience)
      : patience_(patience), thread_([this](const std::stop_token& stop) { watch(stop); }) {}

  // Why the stream is not one of them.
  grpc::Status add(std::shared_ptr<AssetStream> stream);
  void remove(const std::shared_ptr<AssetStream>& stream);

  // Ends every stream, and adds none any more.
  void drain();

 private:
  void watch(const std::stop_token& stop);

  const std::chrono::milliseconds patience_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::set<std::shared_ptr<AssetStream>> streams_;
  bool draining_ = false;
  std::jthread thread_;
};

}  // namespace weft
