#include "server/rpc/asset_download.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>

#include "server/convert/names.h"
#include "server/rpc/asset_service.h"
#include "server/rpc/assets.h"
#include "server/rpc/errors.h"

namespace weft {
namespace {

// The asset where it is not known yet, and the bytes that come next.
struct Part {
  std::optional<KeptAsset> asset;
  std::string data;
};

grpc::Status read(Assets& assets, const Caller& caller, const v1::DownloadAssetRequest& request,
                  std::int64_t next, Part& part) {
  if (!part.asset) part.asset = find_asset(assets, caller, hash_of(request.name()));
  const std::optional<KeptAsset>& asset = part.asset;
  if (!asset) return errors::asset_not_found(request.name());
  if (!asset->create_time) return errors::asset_incomplete(request.name(), asset->received);
  if (next > asset->size)
    return errors::field_invalid(
        "offset", std::to_string(next) + " is not within 0 to " + std::to_string(asset->size));
  if (next == asset->size) return grpc::Status::OK;
  part.data = assets.piece(*asset, next / Assets::kPiece);
  const auto want = std::min(Assets::kPiece, asset->size - next / Assets::kPiece * Assets::kPiece);
  if (static_cast<std::int64_t>(part.data.size()) != want)
    return errors::asset_damaged(request.name(),
                                 "bytes from " + std::to_string(next) + " on are missing");
  part.data.erase(0, static_cast<std::size_t>(next % Assets::kPiece));
  return grpc::Status::OK;
}

}  // namespace

void AssetDownload::start(const grpc::ServerContextBase& context,
                          const v1::DownloadAssetRequest& request) {
  std::unique_lock lock(mutex_);
  self_ = shared_from_this();
  request_ = request;
  next_ = request.offset();
  auto admitted = backend_.admit(context);
  if (const auto* error = std::get_if<grpc::Status>(&admitted)) return finish(*error);
  caller_ = std::get<StreamCaller>(std::move(admitted));
  if (const auto error = refusal_of_asset_name(request.name())) return finish(*error);
  if (next_ < 0)
    return finish(errors::field_invalid("offset", std::to_string(next_) + " is below 0"));
  if (const auto status = streams_.add(self_); !status.ok()) return finish(status);
  go_on(lock);
}

void AssetDownload::drain() {
  std::lock_guard lock(mutex_);
  finish(errors::server_draining());
}

void AssetDownload::OnCancel() {
  std::lock_guard lock(mutex_);
  finish(errors::cancelled());
}

void AssetDownload::OnDone() {
  const auto self = std::move(self_);
  streams_.remove(self);
}

void AssetDownload::OnWriteDone(bool ok) {
  std::unique_lock lock(mutex_);
  writing_ = false;
  if (!ok) finish(errors::cancelled());
  if (ending_) return finish(*ending_);
  go_on(lock);
}

void AssetDownload::finish(const grpc::Status& status) {
  if (!ending_) ending_ = status;
  if (writing_ || std::exchange(finished_, true)) return;
  Finish(*ending_);
}

// Unlocks: there may be an answer at once.
void AssetDownload::go_on(std::unique_lock<std::mutex>& lock) {
  if (ending_) return;
  const auto part = std::make_shared<Part>(Part{asset_, {}});
  const auto self = shared_from_this();
  lock.unlock();
  self->backend_.asset_calls.ask(
      [&assets = self->backend_.store->assets(), caller = self->caller_.caller,
       request = self->request_, next = self->next_, part] {
        try {
          return read(assets, caller, request, next, *part);
        } catch (const StoreError& error) {
          return errors::store_unreachable(error.what());
        }
      },
      [self, part](const grpc::Status& status) {
        std::lock_guard locked(self->mutex_);
        if (self->ending_) return;
        if (!status.ok() || part->data.empty()) return self->finish(status);
        self->asset_ = std::move(part->asset);
        const auto size = static_cast<std::int64_t>(part->data.size());
        self->next_ += size;
        self->backend_.stats.asset_bytes_sent += size;
        self->message_.set_data(std::move(part->data));
        self->writing_ = true;
        self->StartWrite(&self->message_);
      });
}

}  // namespace weft
