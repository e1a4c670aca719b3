#pragma once

#include <grpcpp/support/status.h>

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "core/model/scene.h"
#include "server/rpc/backend.h"
#include "weft/v1/asset.pb.h"
#include "weft/v1/mesh.pb.h"
#include "weft/v1/scene.pb.h"

// Assets of callers. All of it waits for the store, and throws StoreError.
namespace weft {

v1::Asset to_proto(const KeptAsset& asset);

// The caller's asset; for admins, also another's. Whole where there is such a one.
std::optional<KeptAsset> find_asset(Assets& assets, const Caller& caller, const std::string& hash);

// Its mesh, where it is whole; else nullptr.
std::shared_ptr<const v1::MeshData> find_mesh(Assets& assets, const Caller& caller,
                                              const std::string& name);

// What becomes of the meshes that a scene holds itself.
struct NewAsset {
  std::string bytes;
  v1::MeshFacts facts;
};

// Has the scene name an asset for each mesh that it was given with; those by hash, not kept yet.
std::map<std::string, NewAsset> name_meshes(const v1::Scene& given, Scene& scene);

// Keeps the new ones, and makes all that the scene names the principal's.
grpc::Status keep_assets(Backend& backend, const std::string& principal, const Scene& scene,
                         const std::map<std::string, NewAsset>& fresh);

// Looks at the bytes of an asset that are all there: it is whole then, or forgotten, with the
// reason.
grpc::Status finish_asset(Backend& backend, KeptAsset& asset);

// Deletes assets that nothing has used for so long.
void sweep_assets(Backend& backend, std::chrono::system_clock::time_point unused_since);

// Counts them anew, for GetServerStats.
void count_assets(Backend& backend);

}  // namespace weft
