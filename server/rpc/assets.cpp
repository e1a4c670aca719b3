#include "server/rpc/assets.h"

#include <cstddef>
#include <utility>
#include <variant>

#include "server/convert/convert.h"
#include "server/convert/mesh.h"
#include "server/convert/names.h"
#include "server/rpc/errors.h"
#include "server/store/records.h"

namespace weft {
namespace {

// What is wrong with the bytes, or what they are.
std::variant<v1::MeshFacts, grpc::Status> look_at(const KeptAsset& asset,
                                                  const std::string& bytes) {
  if (const std::string hash = sha256(bytes); hash != asset.hash)
    return errors::hash_differs(asset_name(asset.hash), hash);
  v1::MeshData mesh;
  if (!mesh.ParseFromString(bytes))
    return errors::field_invalid("data", "the bytes are no weft.v1.MeshData");
  if (const auto problems = find_problems(mesh, "data"); !problems.empty())
    return errors::field_invalid(problems);
  return facts_of(mesh);
}

}  // namespace

v1::Asset to_proto(const KeptAsset& asset) {
  v1::Asset result;
  result.set_name(asset_name(asset.hash));
  result.set_size_bytes(asset.size);
  result.set_received_bytes(asset.received);
  result.set_owner(asset.owner);
  if (!asset.create_time) return result;
  *result.mutable_create_time() = timestamp_of(*asset.create_time);
  result.mutable_mesh()->ParseFromString(asset.facts);
  return result;
}

std::optional<KeptAsset> find_asset(Assets& assets, const Caller& caller, const std::string& hash) {
  auto own = assets.find(hash, caller.principal);
  if (!caller.is_admin || (own && own->create_time)) return own;
  auto any = assets.find_any(hash);
  return own && any && !any->create_time ? own : any;
}

std::shared_ptr<const v1::MeshData> find_mesh(Assets& assets, const Caller& caller,
                                              const std::string& name) {
  const auto asset = find_asset(assets, caller, hash_of(name));
  return asset && asset->create_time ? records::read_mesh(assets, *asset) : nullptr;
}

std::map<std::string, NewAsset> name_meshes(const v1::Scene& given, Scene& scene) {
  std::map<std::string, NewAsset> fresh;
  const auto add = [&](const auto& source, std::string& name) {
    if (!source.has_data()) return;
    std::string bytes = source.data().SerializeAsString();
    const std::string hash = sha256(bytes);
    name = asset_name(hash);
    fresh.try_emplace(hash, NewAsset{std::move(bytes), facts_of(source.data())});
  };
  for (std::size_t i = 0; i < scene.sheets.size(); ++i)
    add(given.sheets(static_cast<int>(i)).triangles(), scene.sheets[i].asset);
  for (std::size_t i = 0; i < scene.colliders.size(); ++i)
    add(given.colliders(static_cast<int>(i)).mesh(), scene.colliders[i].asset);
  return fresh;
}

grpc::Status keep_assets(Backend& backend, const std::string& principal, const Scene& scene,
                         const std::map<std::string, NewAsset>& fresh) {
  const auto names = assets_of(scene);
  if (names.empty()) return grpc::Status::OK;
  Assets& assets = backend.store->assets();
  const auto now = std::chrono::system_clock::now();
  for (const auto& [hash, asset] : fresh) {
    const auto excess = assets.put(hash, principal, asset.bytes, asset.facts.SerializeAsString(),
                                   backend.limits, now);
    if (excess) return errors::exhausted(*excess);
  }
  for (const std::string& hash : names)
    if (!assets.own(hash, principal, now)) return errors::asset_not_found(asset_name(hash));
  count_assets(backend);
  return grpc::Status::OK;
}

grpc::Status finish_asset(Backend& backend, KeptAsset& asset) {
  Assets& assets = backend.store->assets();
  const auto found = look_at(asset, assets.bytes(asset));
  if (const auto* error = std::get_if<grpc::Status>(&found)) {
    assets.drop(asset);
    count_assets(backend);
    return *error;
  }
  // as exactly as it is kept
  asset.create_time =
      std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now());
  asset.facts = std::get<v1::MeshFacts>(found).SerializeAsString();
  assets.finish(asset, asset.facts, *asset.create_time);
  return grpc::Status::OK;
}

void sweep_assets(Backend& backend, std::chrono::system_clock::time_point unused_since) {
  backend.store->assets().sweep(unused_since);
  count_assets(backend);
}

void count_assets(Backend& backend) {
  const Assets::Total total = backend.store->assets().total();
  backend.stats.assets = total.count;
  backend.stats.asset_bytes = total.bytes;
}

}  // namespace weft
