#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "tests/support/service/service.h"
#include "weft/v1/asset.grpc.pb.h"
#include "weft/v1/mesh.pb.h"

namespace weft::testing {

// A flat square of 1 m x 1 m in cells x cells x 2 triangles, its flat shape what it is in space.
v1::MeshData square_mesh(int cells);

// A closed cube of 12 triangles around a point, with edges of 2 x `half`, m.
v1::MeshData cube_mesh(float half, float x, float y, float z);

// A sheet of the mesh, held by its first particle. By itself, or by the name of an asset.
v1::Scene scene_of(const v1::MeshData& mesh);
v1::Scene scene_of(const std::string& asset);
// small_scene() and a cube whose middle is at that height, m, in its pose at 10 s, and is lifted in
// that at 11 s; far below, unless asked otherwise.
v1::Scene posed_scene(float half = 0.1F, float height = -2, float lift = 0.2F);

// "assets/{hash}".
std::string name_of_asset(const std::string& bytes);

// A call of UploadAsset, which has said what comes.
class Upload {
 public:
  Upload(v1::AssetService::Stub& assets, const std::string& name, std::int64_t size,
         const std::string& token = {});
  ~Upload();  // cancels

  // False where the call has ended.
  bool send(std::int64_t offset, const std::string& data);
  // Ends the stream.
  std::pair<v1::Asset, Error> finish();
  // Waits for the end that the server makes of it.
  Error await_end();
  void cancel() { context_.TryCancel(); }

 private:
  grpc::ClientContext context_;
  v1::Asset answer_;
  std::unique_ptr<grpc::ClientWriter<v1::UploadAssetRequest>> writer_;
};

// All of it, in messages of so many bytes, where the server wants it to begin.
std::pair<v1::Asset, Error> upload(v1::AssetService::Stub& assets, const std::string& bytes,
                                   const std::string& token = {}, std::size_t message = 100'000);

// Under the name of other bytes.
std::pair<v1::Asset, Error> upload_as(v1::AssetService::Stub& assets, const std::string& name,
                                      const std::string& bytes);

std::pair<v1::Asset, Error> get_asset(v1::AssetService::Stub& assets, const std::string& name,
                                      const std::string& token = {});
Error delete_asset(v1::AssetService::Stub& assets, const std::string& name,
                   const std::string& token = {}, bool allow_missing = false);
std::pair<std::string, Error> download(v1::AssetService::Stub& assets, const std::string& name,
                                       std::int64_t offset = 0, const std::string& token = {});
v1::ListAssetsResponse list_assets(v1::AssetService::Stub& assets, int page_size = 0,
                                   const std::string& page_token = {},
                                   const std::string& token = {});

}  // namespace weft::testing
