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

// From there on.
grpc::Status receive(Connection& connection, const Attempts& attempts,
                     const v1::DownloadAssetRequest& request, std::string& bytes) {
  grpc::ClientContext context;
  attempts.address(context);
  const std::stop_callback cancel(connection.stop(), [&] { context.TryCancel(); });
  const auto reader = connection.assets().DownloadAsset(&context, request);
  v1::DownloadAssetResponse message;
  while (reader->Read(&message)) bytes += message.data();
  return reader->Finish();
}

std::string download_asset(Connection& connection, const std::string& name) {
  v1::DownloadAssetRequest request;
  request.set_name(name);
  Attempts attempts(connection, request);
  std::string bytes;
  for (;;) {
    const grpc::Status status = receive(connection, attempts, request, bytes);
    if (status.ok()) return bytes;
    const auto received = static_cast<std::int64_t>(bytes.size());
    if (received > request.offset()) attempts.note_message();
    request.set_offset(received);
    attempts.go_on_after(status);
  }
}

}  // namespace

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
  const auto upload = [&](auto& source, const std::string& field) {
    if (source.data().ByteSizeLong() <= kMostInline) return;
    try {
      source.set_asset(upload_mesh(connection, source.data()).name());
    } catch (Problem& problem) {
      // "data.triangles" of the asset
      for (auto& violation : problem.violations) violation.field = field + violation.field;
      throw;
    }
  };
  for (int i = 0; i < scene.sheets_size(); ++i)
    if (scene.sheets(i).has_triangles())
      upload(*scene.mutable_sheets(i)->mutable_triangles(),
             "sheets[" + std::to_string(i) + "].triangles.");
  for (int i = 0; i < scene.colliders_size(); ++i)
    if (scene.colliders(i).has_mesh())
      upload(*scene.mutable_colliders(i)->mutable_mesh(),
             "colliders[" + std::to_string(i) + "].mesh.");
  return scene;
}

Assets assets_of(Connection& connection, const v1::Scene& scene) {
  Assets assets;
  const auto add = [&](const std::string& name) {
    if (name.empty() || assets.contains(name)) return;
    try {
      std::string bytes = download_asset(connection, name);
      if (asset_name(bytes) == name) assets.emplace(name, std::move(bytes));
    } catch (const Problem& problem) {  // a server without assets, or another's
      if (problem.code != "NOT_FOUND" && problem.code != "UNIMPLEMENTED") throw;
    }
  };
  for (const auto& sheet : scene.sheets()) add(sheet.triangles().asset());
  for (const auto& collider : scene.colliders()) add(collider.mesh().asset());
  return assets;
}

v1::Scene with_meshes(v1::Scene scene, const Assets& assets) {
  for (auto& sheet : *scene.mutable_sheets()) {
    const auto asset = assets.find(sheet.triangles().asset());
    if (asset != assets.end())
      sheet.mutable_triangles()->mutable_data()->ParseFromString(asset->second);
  }
  return with_bodies(std::move(scene), assets);
}

v1::Scene with_bodies(v1::Scene scene, const Assets& assets) {
  for (auto& collider : *scene.mutable_colliders()) {
    const auto asset = assets.find(collider.mesh().asset());
    if (asset != assets.end())
      collider.mutable_mesh()->mutable_data()->ParseFromString(asset->second);
  }
  return scene;
}

}  // namespace weft::client
