#include "server/rpc/asset_service.h"

#include <cstddef>
#include <memory>
#include <utility>

#include "server/convert/names.h"
#include "server/rpc/asset_download.h"
#include "server/rpc/asset_upload.h"
#include "server/rpc/assets.h"
#include "server/rpc/errors.h"
#include "server/rpc/unary_call.h"

namespace weft {
namespace {

// Calls `work` with the caller and a response, on the store's thread, and answers with what that
// comes to. The work may outlive the call.
template <class Response, class Work>
grpc::ServerUnaryReactor* on_assets(Backend& backend, grpc::CallbackServerContext* context,
                                    Response* response, Work work) {
  const auto caller = backend.access.caller(*context);
  if (const auto* error = std::get_if<grpc::Status>(&caller)) return answer(context, *error);
  auto* call = new UnaryCall(backend.calls);
  const auto made = std::make_shared<Response>();
  backend.asset_calls.ask(
      [work = std::move(work), who = std::get<Caller>(caller), made] {
        try {
          return work(who, *made);
        } catch (const StoreError& error) {
          return errors::store_unreachable(error.what());
        }
      },
      [call, response, made](const grpc::Status& status) {
        if (status.ok()) response->Swap(made.get());
        call->Finish(status);
      });
  return call;
}

// Where a page ends: the hash and the owner of its last asset.
struct Place {
  std::string hash, owner;
};

std::optional<Place> place_of(const std::string& token) {
  if (token.empty()) return Place{};
  constexpr std::size_t kDigits = 64;
  Place place{token.substr(0, kDigits), token.size() > kDigits ? token.substr(kDigits) : ""};
  if (hash_of(asset_name(place.hash)).empty()) return std::nullopt;
  return place;
}

// What is wrong with the request.
std::optional<grpc::Status> refusal_of(const v1::ListAssetsRequest& request) {
  constexpr int kMost = 1000;
  if (request.page_size() < 0 || request.page_size() > kMost) {
    return errors::field_invalid("page_size",
                                 std::to_string(request.page_size()) + " is not within 0 to 1000");
  }
  if (!place_of(request.page_token()))
    return errors::field_invalid("page_token", "is none that this server gave");
  return std::nullopt;
}

grpc::Status list(Assets& assets, const Caller& caller, const v1::ListAssetsRequest& request,
                  v1::ListAssetsResponse& response) {
  constexpr int kDefault = 100;
  const auto size =
      static_cast<std::size_t>(request.page_size() == 0 ? kDefault : request.page_size());
  const Place after = *place_of(request.page_token());
  // one more than a page has tells that there is a next one
  auto found = assets.list(after.hash, after.owner, size + 1,
                           caller.is_admin ? std::nullopt : std::optional(caller.principal));
  if (found.size() > size) {
    found.pop_back();
    response.set_next_page_token(found.back().hash + found.back().owner);
  }
  for (const KeptAsset& asset : found) *response.add_assets() = to_proto(asset);
  return grpc::Status::OK;
}

grpc::Status erase(Assets& assets, const Caller& caller, const v1::DeleteAssetRequest& request) {
  const std::string hash = hash_of(request.name());
  const auto own = assets.find(hash, caller.principal);
  if (own) return assets.erase(*own) ? grpc::Status::OK : errors::asset_used(request.name());
  bool any = false;
  for (; caller.is_admin; any = true) {
    const auto found = assets.find_any(hash);
    if (!found) break;
    if (!assets.erase(*found)) return errors::asset_used(request.name());
  }
  return any || request.allow_missing() ? grpc::Status::OK
                                        : errors::asset_not_found(request.name());
}

}  // namespace

std::optional<grpc::Status> refusal_of_asset_name(const std::string& name) {
  if (!hash_of(name).empty()) return std::nullopt;
  return errors::field_invalid("name", "\"" + name +
                                           "\" is not assets/ and 64 hexadecimal digits in small "
                                           "letters, the SHA-256 of the bytes");
}

grpc::ServerReadReactor<grpc::ByteBuffer>* AssetService::UploadAsset(
    grpc::CallbackServerContext* context, grpc::ByteBuffer* response) {
  const auto upload = std::make_shared<AssetUpload>(backend_, streams_, response);
  upload->start(*context);
  return upload.get();
}

grpc::ServerUnaryReactor* AssetService::GetAsset(grpc::CallbackServerContext* context,
                                                 const v1::GetAssetRequest* request,
                                                 v1::Asset* response) {
  return on_assets(backend_, context, response,
                   [&assets = backend_.store->assets(), name = request->name()](
                       const Caller& caller, v1::Asset& made) {
                     if (const auto error = refusal_of_asset_name(name)) return *error;
                     const auto found = find_asset(assets, caller, hash_of(name));
                     if (!found) return errors::asset_not_found(name);
                     made = to_proto(*found);
                     return grpc::Status::OK;
                   });
}

grpc::ServerUnaryReactor* AssetService::ListAssets(grpc::CallbackServerContext* context,
                                                   const v1::ListAssetsRequest* request,
                                                   v1::ListAssetsResponse* response) {
  return on_assets(backend_, context, response,
                   [&assets = backend_.store->assets(), request = *request](
                       const Caller& caller, v1::ListAssetsResponse& made) {
                     if (const auto error = refusal_of(request)) return *error;
                     return list(assets, caller, request, made);
                   });
}

grpc::ServerWriteReactor<v1::DownloadAssetResponse>* AssetService::DownloadAsset(
    grpc::CallbackServerContext* context, const v1::DownloadAssetRequest* request) {
  const auto download = std::make_shared<AssetDownload>(backend_, streams_);
  download->start(*context, *request);
  return download.get();
}

grpc::ServerUnaryReactor* AssetService::DeleteAsset(grpc::CallbackServerContext* context,
                                                    const v1::DeleteAssetRequest* request,
                                                    v1::DeleteAssetResponse* response) {
  return on_assets(
      backend_, context, response,
      [&backend = backend_, request = *request](const Caller& caller, v1::DeleteAssetResponse&) {
        if (const auto error = refusal_of_asset_name(request.name())) return *error;
        if (backend.draining) return errors::server_draining();
        grpc::Status status = erase(backend.store->assets(), caller, request);
        count_assets(backend);
        return status;
      });
}

}  // namespace weft
