#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "server/rpc/asset_streams.h"
#include "server/rpc/backend.h"
#include "weft/v1/asset.pb.h"

namespace weft {

// One call of UploadAsset. A message is read when the one before it is taken: either is a read
// under way, or work for the store, and less than two pieces are held. Lives until OnDone.
class AssetUpload final : public grpc::ServerReadReactor<grpc::ByteBuffer>,
                          public AssetStream,
                          public std::enable_shared_from_this<AssetUpload> {
 public:
  AssetUpload(Backend& backend, AssetStreams& streams, grpc::ByteBuffer* response)
      : backend_(backend), streams_(streams), ticket_(backend.calls), response_(response) {}

  // Called once, first.
  void start(const grpc::ServerContextBase& context);
  void drain() override;
  void give_up(Clock::time_point since) override;

  void OnReadDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  // with the mutex held
  grpc::Status begin(const v1::UploadAssetRequest& first);
  grpc::Status take(const v1::UploadAssetRequest& request);
  void read();
  void finish(const grpc::Status& status);
  // What is due next: work for the store, which is not waited for, comes last.
  void go_on(std::unique_lock<std::mutex>& lock);
  void look_up(std::unique_lock<std::mutex>& lock);
  void store(std::unique_lock<std::mutex>& lock);
  // `work` is done on the store's thread, with what there is of the asset; what it makes of that is
  // the upload's then. Unlocks: there may be an answer at once.
  using Work = std::function<grpc::Status(KeptAsset& asset)>;
  void post(std::unique_lock<std::mutex>& lock, Work work);

  Backend& backend_;
  AssetStreams& streams_;
  OpenCalls::Ticket ticket_;
  std::shared_ptr<AssetUpload> self_;  // until OnDone

  std::mutex mutex_;  // guards all below
  StreamCaller caller_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer* const response_;
  KeptAsset asset_;                              // as the store has it; no hash: nothing came yet
  std::optional<v1::UploadAssetRequest> first_;  // until the asset is looked up
  std::string waiting_;                          // bytes behind asset_.received
  bool reading_ = false, busy_ = false, finished_ = false;
  bool all_read_ = false;  // the caller has said all
  Clock::time_point heard_;
};

}  // namespace weft
