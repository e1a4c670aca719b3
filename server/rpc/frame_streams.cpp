#include "server/rpc/frame_streams.h"

#include <utility>

#include "server/rpc/errors.h"
#include "server/rpc/frame_call.h"

namespace weft {

FrameStreams::FrameStreams(Stats& stats)
    : stats_(stats), thread_([this](const std::stop_token& stop) { remind(stop); }) {}

FrameStreams::~FrameStreams() = default;

grpc::Status FrameStreams::add(std::shared_ptr<FrameCall> stream) {
  std::lock_guard lock(mutex_);
  if (draining_) return errors::server_draining();
  streams_.insert(std::move(stream));
  ++stats_.streams;
  changed_.notify_one();
  return grpc::Status::OK;
}

void FrameStreams::remove(const std::shared_ptr<FrameCall>& stream) {
  std::lock_guard lock(mutex_);
  stats_.streams -= static_cast<std::int64_t>(streams_.erase(stream));
}

void FrameStreams::drain() {
  std::set<std::shared_ptr<FrameCall>> streams;
  {
    std::lock_guard lock(mutex_);
    draining_ = true;
    streams = streams_;
  }
  for (const auto& stream : streams) stream->drain();
}

void FrameStreams::remind(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [&] { return !streams_.empty(); })) {
    changed_.wait_for(lock, stop, kTick, [] { return false; });
    const auto streams = streams_;
    lock.unlock();
    for (const auto& stream : streams) stream->tick(Clock::now());
    lock.lock();
  }
}

}  // namespace weft
