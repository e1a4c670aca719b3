#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "server/rpc/asset_streams.h"
#include "server/rpc/backend.h"
#include "weft/v1/asset.grpc.pb.h"

namespace weft {

// What is wrong with a name.
std::optional<grpc::Status> refusal_of_asset_name(const std::string& name);

// Messages of UploadAsset pass as bytes: gRPC would show those it cannot decode as the stream's
// end.
using AssetMethods =
    v1::AssetService::WithCallbackMethod_GetAsset<v1::AssetService::WithCallbackMethod_ListAssets<
        v1::AssetService::WithCallbackMethod_DownloadAsset<
            v1::AssetService::WithCallbackMethod_DeleteAsset<
                v1::AssetService::WithRawCallbackMethod_UploadAsset<v1::AssetService::Service>>>>>;

class AssetService final : public AssetMethods {
 public:
  // Ends uploads that nobody has sent anything on for as long as patience lasts.
  AssetService(Backend& backend, std::chrono::milliseconds patience)
      : backend_(backend), streams_(patience) {}

  grpc::ServerReadReactor<grpc::ByteBuffer>* UploadAsset(grpc::CallbackServerContext* context,
                                                         grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* GetAsset(grpc::CallbackServerContext* context,
                                     const v1::GetAssetRequest* request,
                                     v1::Asset* response) override;
  grpc::ServerUnaryReactor* ListAssets(grpc::CallbackServerContext* context,
                                       const v1::ListAssetsRequest* request,
                                       v1::ListAssetsResponse* response) override;
  grpc::ServerWriteReactor<v1::DownloadAssetResponse>* DownloadAsset(
      grpc::CallbackServerContext* context, const v1::DownloadAssetRequest* request) override;
  grpc::ServerUnaryReactor* DeleteAsset(grpc::CallbackServerContext* context,
                                        const v1::DeleteAssetRequest* request,
                                        v1::DeleteAssetResponse* response) override;

  // Ends every stream, and begins none any more.
  void drain() { streams_.drain(); }

 private:
  Backend& backend_;
  AssetStreams streams_;
};

}  // namespace weft
