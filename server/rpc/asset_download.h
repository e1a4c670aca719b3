#pragma once

#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "server/rpc/asset_streams.h"
#include "server/rpc/backend.h"
#include "weft/v1/asset.pb.h"

namespace weft {

// One call of DownloadAsset: a piece is read from the store when the one before it has left. Lives
// until OnDone.
class AssetDownload final : public grpc::ServerWriteReactor<v1::DownloadAssetResponse>,
                            public AssetStream,
                            public std::enable_shared_from_this<AssetDownload> {
 public:
  AssetDownload(Backend& backend, AssetStreams& streams)
      : backend_(backend), streams_(streams), ticket_(backend.calls) {}

  // Called once, first.
  void start(const grpc::ServerContextBase& context, const v1::DownloadAssetRequest& request);
  void drain() override;
  void give_up(Clock::time_point /*since*/) override {}  // it waits for its caller, holding a piece

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  // with the mutex held
  void finish(const grpc::Status& status);
  void go_on(std::unique_lock<std::mutex>& lock);

  Backend& backend_;
  AssetStreams& streams_;
  OpenCalls::Ticket ticket_;
  std::shared_ptr<AssetDownload> self_;  // until OnDone

  std::mutex mutex_;  // guards all below
  StreamCaller caller_;
  v1::DownloadAssetRequest request_;
  std::optional<KeptAsset> asset_;  // none: it is not looked up yet
  std::int64_t next_ = 0;           // byte to send
  v1::DownloadAssetResponse message_;
  bool writing_ = false, finished_ = false;
  std::optional<grpc::Status> ending_;  // as soon as nothing is in flight
};

}  // namespace weft
