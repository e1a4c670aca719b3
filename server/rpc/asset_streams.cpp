#include "server/rpc/asset_streams.h"

#include <utility>

#include "server/rpc/errors.h"

namespace weft {

grpc::Status AssetStreams::add(std::shared_ptr<AssetStream> stream) {
  std::lock_guard lock(mutex_);
  if (draining_) return errors::server_draining();
  streams_.insert(std::move(stream));
  changed_.notify_one();
  return grpc::Status::OK;
}

void AssetStreams::remove(const std::shared_ptr<AssetStream>& stream) {
  std::lock_guard lock(mutex_);
  streams_.erase(stream);
}

void AssetStreams::drain() {
  std::set<std::shared_ptr<AssetStream>> streams;
  {
    std::lock_guard lock(mutex_);
    draining_ = true;
    streams = streams_;
  }
  for (const auto& stream : streams) stream->drain();
}

void AssetStreams::watch(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [&] { return !streams_.empty(); })) {
    changed_.wait_for(lock, stop, patience_ / 4, [] { return false; });
    const auto streams = streams_;
    lock.unlock();
    for (const auto& stream : streams) stream->give_up(Clock::now() - patience_);
    lock.lock();
  }
}

}  // namespace weft
