#include "server/rpc/asset_upload.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "server/convert/names.h"
#include "server/rpc/asset_service.h"
#include "server/rpc/assets.h"
#include "server/rpc/bytes.h"
#include "server/rpc/errors.h"

namespace weft {

void AssetUpload::start(const grpc::ServerContextBase& context) {
  std::lock_guard lock(mutex_);
  self_ = shared_from_this();
  auto admitted = backend_.admit(context);
  if (const auto* error = std::get_if<grpc::Status>(&admitted)) return finish(*error);
  caller_ = std::get<StreamCaller>(std::move(admitted));
  if (const auto status = streams_.add(self_); !status.ok()) return finish(status);
  read();
}

void AssetUpload::drain() {
  std::lock_guard lock(mutex_);
  finish(errors::server_draining());
}

void AssetUpload::give_up(Clock::time_point since) {
  std::lock_guard lock(mutex_);
  if (reading_ && heard_ < since) finish(errors::upload_stalled(asset_.received));
}

void AssetUpload::OnCancel() {
  std::lock_guard lock(mutex_);
  finish(errors::cancelled());
}

void AssetUpload::OnDone() {
  const auto self = std::move(self_);
  streams_.remove(self);
}

void AssetUpload::OnReadDone(bool ok) {
  std::unique_lock lock(mutex_);
  reading_ = false;
  if (finished_) return;
  if (!ok) {
    all_read_ = true;
    return go_on(lock);
  }
  v1::UploadAssetRequest request;
  const bool decoded = decode(request_, request);
  request_.Clear();
  if (!decoded) return finish(errors::message_malformed("weft.v1.UploadAssetRequest"));
  const grpc::Status status = asset_.hash.empty() ? begin(request) : take(request);
  if (!status.ok()) return finish(status);
  go_on(lock);
}

grpc::Status AssetUpload::begin(const v1::UploadAssetRequest& first) {
  if (const auto error = refusal_of_asset_name(first.name())) return *error;
  if (first.size_bytes() < 1)
    return errors::field_invalid("size_bytes", std::to_string(first.size_bytes()) + " is below 1");
  asset_.hash = hash_of(first.name());
  first_ = first;
  return grpc::Status::OK;
}

grpc::Status AssetUpload::take(const v1::UploadAssetRequest& request) {
  if (!request.name().empty() && hash_of(request.name()) != asset_.hash)
    return errors::field_invalid(
        "name", "\"" + request.name() + "\" is another one than the stream began with");
  if (request.size_bytes() != 0 && request.size_bytes() != asset_.size)
    return errors::field_invalid("size_bytes", std::to_string(request.size_bytes()) +
                                                   " is another one than at first, " +
                                                   std::to_string(asset_.size));
  const auto come = asset_.received + static_cast<std::int64_t>(waiting_.size());
  const auto size = static_cast<std::int64_t>(request.data().size());
  const bool asks = size == 0 && request.offset() == 0;  // for received_bytes
  if (!asks && request.offset() != come) return errors::offset_stale(come);
  if (size > Assets::kPiece)
    return errors::field_invalid("data", "has " + std::to_string(size) + " bytes; a message has " +
                                             std::to_string(Assets::kPiece) + " at most");
  if (size > asset_.size - come)
    return errors::field_invalid(
        "data", "ends behind the last of " + std::to_string(asset_.size) + " bytes");
  backend_.stats.asset_bytes_received += size;
  waiting_ += request.data();
  return grpc::Status::OK;
}

void AssetUpload::go_on(std::unique_lock<std::mutex>& lock) {
  if (finished_ || reading_ || busy_) return;
  if (asset_.hash.empty()) return finish(errors::field_invalid("name", "is absent"));
  if (asset_.content.empty()) return look_up(lock);
  if (asset_.create_time) return finish(grpc::Status::OK);
  if (first_) {
    const auto first = std::exchange(first_, std::nullopt);
    if (const auto status = take(*first); !status.ok()) return finish(status);
  }
  const auto missing = static_cast<std::size_t>(asset_.size - asset_.received);
  if (missing == 0 || waiting_.size() >= std::min<std::size_t>(missing, Assets::kPiece))
    return store(lock);
  if (all_read_) return finish(grpc::Status::OK);
  read();
}

// Begins it, or finds how far it came.
void AssetUpload::look_up(std::unique_lock<std::mutex>& lock) {
  post(lock, [&backend = backend_, owner = caller_.caller.principal,
              size = first_->size_bytes()](KeptAsset& asset) {
    auto begun = backend.store->assets().begin(asset.hash, owner, size, backend.limits,
                                               std::chrono::system_clock::now());
    if (const auto* excess = std::get_if<Quota::Excess>(&begun)) return errors::exhausted(*excess);
    asset = std::get<KeptAsset>(std::move(begun));
    count_assets(backend);
    return grpc::Status::OK;
  });
}

// Writes the next piece; after the last one the asset is looked at.
void AssetUpload::store(std::unique_lock<std::mutex>& lock) {
  std::string piece = waiting_.substr(0, Assets::kPiece);
  waiting_.erase(0, piece.size());
  post(lock, [&backend = backend_, piece = std::move(piece)](KeptAsset& asset) {
    if (!piece.empty()) {
      const std::int64_t wanted = asset.received + static_cast<std::int64_t>(piece.size());
      const std::int64_t received =
          backend.store->assets().append(asset, piece, std::chrono::system_clock::now());
      if (received != wanted) return errors::offset_stale(received);
      asset.received = received;
    }
    return asset.received == asset.size ? finish_asset(backend, asset) : grpc::Status::OK;
  });
}

void AssetUpload::post(std::unique_lock<std::mutex>& lock, Work work) {
  busy_ = true;
  const auto asset = std::make_shared<KeptAsset>(asset_);
  const auto self = shared_from_this();
  lock.unlock();
  self->backend_.asset_calls.ask(
      [asset, work = std::move(work)] {
        try {
          return work(*asset);
        } catch (const StoreError& error) {
          return errors::store_unwritable(error.what());
        }
      },
      [self, asset](const grpc::Status& status) {
        std::unique_lock locked(self->mutex_);
        self->busy_ = false;
        if (!status.ok()) return self->finish(status);
        self->asset_ = std::move(*asset);
        self->go_on(locked);
      });
}

void AssetUpload::read() {
  reading_ = true;
  heard_ = Clock::now();
  StartRead(&request_);
}

void AssetUpload::finish(const grpc::Status& status) {
  if (std::exchange(finished_, true)) return;
  if (status.ok()) *response_ = encoded(to_proto(asset_));
  Finish(status);
}

}  // namespace weft
