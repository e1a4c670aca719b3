#include "client/assets.h"

#include <openssl/sha.h>

#include <array>
#include <cstdint>
#include <stop_token>
#include <utility>

#include "client/attempts.h"
#include "client/problem.h"

namespace weft::client {
namespace {

constexpr std::size_t kMessage = 256 << 10;  // bytes of the asset in one

std::string asset_name(const std::string& bytes) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> hash{};
  SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), hash.data());
  std::string name = "assets/";
  for (const unsigned char byte : hash) {
    name += "0123456789abcdef"[byte >> 4];
    name += "0123456789abcdef"[byte & 15];
  }
  return name;
}

// One stream: asks what there is where there are no bytes, else sends those that are missing.
grpc::Status send(Connection& connection, const Attempts& attempts,
                  const v1::UploadAssetRequest& first, const std::string* bytes, v1::Asset& asset) {
  grpc::ClientContext context;
  attempts.address(context);
  const std::stop_callback cancel(connection.stop(), [&] { context.TryCancel(); });
  const auto begin = static_cast<std::size_t>(asset.received_bytes());
  const auto writer = connection.assets().UploadAsset(&context, &asset);
  bool open = writer->Write(first);
  v1::UploadAssetRequest message;
  for (std::size_t at = begin; open && bytes != nullptr && at < bytes->size(); at += kMessage) {
    message.set_offset(static_cast<std::int64_t>(at));
    message.set_data(bytes->substr(at, kMessage));
    open = writer->Write(message);
  }
  writer->WritesDone();
  return writer->Finish();
}

}  // namespace

v1::Asset upload_mesh(Connection& connection, const v1::MeshData& mesh) {
  const std::string bytes = mesh.SerializeAsString();
  v1::UploadAssetRequest first;
  first.set_name(asset_name(bytes));
  first.set_size_bytes(static_cast<std::int64_t>(bytes.size()));
  Attempts attempts(connection, first);
  for (std::int64_t known = 0;;) {
    v1::Asset asset;
    grpc::Status status = send(connection, attempts, first, nullptr, asset);
    if (status.ok() && asset.received_bytes() > std::exchange(known, asset.received_bytes()))
      attempts.note_message();  // it comes on
    if (status.ok() && asset.received_bytes() < first.size_bytes())
      status = send(connection, attempts, first, &bytes, asset);
    if (status.ok() && asset.received_bytes() == first.size_bytes()) {
      attempts.note_message();
      return asset;
    }
    const auto info = error_info(status);
    if (info && info->reason() == "OFFSET_STALE") continue;  // somebody sends the same
    attempts.go_on_after(status);
  }
}

v1::Scene upload_meshes(Connection& connection, v1::Scene scene) {
  for (int i = 0; i < scene.sheets_size(); ++i) {
    v1::TriangleSheet* triangles = scene.mutable_sheets(i)->has_triangles()
                                       ? scene.mutable_sheets(i)->mutable_triangles()
                                       : nullptr;
    if (triangles == nullptr || triangles->data().ByteSizeLong() <= kMostInline) continue;
    try {
      triangles->set_asset(upload_mesh(connection, triangles->data()).name());
    } catch (Problem& problem) {
      // "data.triangles" of the asset
      for (auto& violation : problem.violations)
        violation.field = "sheets[" + std::to_string(i) + "].triangles." + violation.field;
      throw;
    }
  }
  return scene;
}

}  // namespace weft::client
