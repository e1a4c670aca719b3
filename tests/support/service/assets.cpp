#include "tests/support/service/assets.h"

#include <algorithm>
#include <cstring>
#include <vector>

#include "server/store/assets.h"

namespace weft::testing {
namespace {

void authorize(grpc::ClientContext& context, const std::string& token) {
  if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
}

template <class Value>
std::string bytes_of(const std::vector<Value>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value)};
}

}  // namespace

v1::MeshData square_mesh(int cells) {
  const auto points = static_cast<std::uint32_t>(cells + 1);
  std::vector<float> u, v;
  std::vector<std::uint32_t> triangles;
  for (std::uint32_t row = 0; row < points; ++row) {
    for (std::uint32_t column = 0; column < points; ++column) {
      u.push_back(static_cast<float>(column) / static_cast<float>(cells));
      v.push_back(static_cast<float>(row) / static_cast<float>(cells));
      if (row + 1 == points || column + 1 == points) continue;
      const std::uint32_t at = row * points + column;
      for (const std::uint32_t corner :
           {at, at + 1, at + points, at + 1, at + points + 1, at + points})
        triangles.push_back(corner);
    }
  }
  v1::MeshData mesh;
  mesh.set_flat_m(bytes_of(u) + bytes_of(v));
  mesh.set_triangles(bytes_of(triangles));
  return mesh;
}

v1::MeshData cube_mesh(float half, float x, float y, float z) {
  const float middle[] = {x, y, z};
  std::vector<float> planes;
  for (int axis = 0; axis < 3; ++axis)
    for (int corner = 0; corner < 8; ++corner)
      planes.push_back(middle[axis] + ((corner >> axis & 1) != 0 ? half : -half));
  const std::vector<std::uint32_t> triangles = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6,
                                                0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7,
                                                0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  v1::MeshData mesh;
  mesh.set_positions_m(bytes_of(planes));
  mesh.set_triangles(bytes_of(triangles));
  return mesh;
}

v1::Scene scene_of(const v1::MeshData& mesh) {
  v1::Scene scene = scene_of(std::string());
  *scene.mutable_sheets(0)->mutable_triangles()->mutable_data() = mesh;
  return scene;
}

v1::Scene scene_of(const std::string& asset) {
  v1::Scene scene;
  v1::Sheet* sheet = scene.add_sheets();
  sheet->mutable_triangles()->set_asset(asset);
  v1::MeasuredTextile* textile = sheet->mutable_textile()->mutable_measured();
  textile->set_areal_density_kg_per_m2(0.2);
  textile->set_tensile_warp_n_per_m(100);
  textile->set_tensile_weft_n_per_m(100);
  textile->set_shear_n_per_m(20);
  textile->set_bend_rigidity_warp_n_m(1e-5);
  textile->set_bend_rigidity_weft_n_m(1e-5);
  sheet->add_pins()->add_particles(0);
  return scene;
}

v1::Scene posed_scene(float half, float height, float lift) {
  v1::Scene scene = small_scene();
  v1::MeshData cube = cube_mesh(half, 0.1F, height, 0.1F);
  cube.mutable_poses()->add_times_s(10);
  cube.mutable_poses()->add_times_s(11);
  cube.mutable_poses()->set_positions_m(cube.positions_m() +
                                        cube_mesh(half, 0.1F, height + lift, 0.1F).positions_m());
  *scene.add_colliders()->mutable_mesh()->mutable_data() = cube;
  return scene;
}

std::string name_of_asset(const std::string& bytes) { return "assets/" + sha256(bytes); }

Upload::Upload(v1::AssetService::Stub& assets, const std::string& name, std::int64_t size,
               const std::string& token) {
  authorize(context_, token);
  writer_ = assets.UploadAsset(&context_, &answer_);
  v1::UploadAssetRequest first;
  first.set_name(name);
  first.set_size_bytes(size);
  writer_->Write(first);
}

Upload::~Upload() {
  if (!writer_) return;
  cancel();
  writer_->Finish();
}

bool Upload::send(std::int64_t offset, const std::string& data) {
  v1::UploadAssetRequest request;
  request.set_offset(offset);
  request.set_data(data);
  return writer_->Write(request);
}

std::pair<v1::Asset, Error> Upload::finish() {
  writer_->WritesDone();
  const Error error(writer_->Finish());
  writer_.reset();
  return {answer_, error};
}

Error Upload::await_end() {
  const Error error(writer_->Finish());
  writer_.reset();
  return error;
}

std::pair<v1::Asset, Error> upload(v1::AssetService::Stub& assets, const std::string& bytes,
                                   const std::string& token, std::size_t message) {
  const std::string name = name_of_asset(bytes);
  const auto size = static_cast<std::int64_t>(bytes.size());
  const auto asked = Upload(assets, name, size, token).finish();
  if (asked.second.code != grpc::StatusCode::OK || asked.first.received_bytes() == size)
    return asked;
  Upload upload(assets, name, size, token);
  for (auto at = static_cast<std::size_t>(asked.first.received_bytes()); at < bytes.size();
       at += message)
    if (!upload.send(static_cast<std::int64_t>(at), bytes.substr(at, message))) break;
  return upload.finish();
}

std::pair<v1::Asset, Error> upload_as(v1::AssetService::Stub& assets, const std::string& name,
                                      const std::string& bytes) {
  Upload upload(assets, name, static_cast<std::int64_t>(bytes.size()));
  upload.send(0, bytes);
  return upload.finish();
}

std::pair<v1::Asset, Error> get_asset(v1::AssetService::Stub& assets, const std::string& name,
                                      const std::string& token) {
  grpc::ClientContext context;
  authorize(context, token);
  v1::GetAssetRequest request;
  request.set_name(name);
  v1::Asset asset;
  const grpc::Status status = assets.GetAsset(&context, request, &asset);
  return {asset, Error(status)};
}

Error delete_asset(v1::AssetService::Stub& assets, const std::string& name,
                   const std::string& token, bool allow_missing) {
  grpc::ClientContext context;
  authorize(context, token);
  v1::DeleteAssetRequest request;
  request.set_name(name);
  request.set_allow_missing(allow_missing);
  v1::DeleteAssetResponse response;
  return Error(assets.DeleteAsset(&context, request, &response));
}

std::pair<std::string, Error> download(v1::AssetService::Stub& assets, const std::string& name,
                                       std::int64_t offset, const std::string& token) {
  grpc::ClientContext context;
  authorize(context, token);
  v1::DownloadAssetRequest request;
  request.set_name(name);
  request.set_offset(offset);
  const auto reader = assets.DownloadAsset(&context, request);
  std::string bytes;
  v1::DownloadAssetResponse message;
  while (reader->Read(&message)) bytes += message.data();
  return {bytes, Error(reader->Finish())};
}

v1::ListAssetsResponse list_assets(v1::AssetService::Stub& assets, int page_size,
                                   const std::string& page_token, const std::string& token) {
  grpc::ClientContext context;
  authorize(context, token);
  v1::ListAssetsRequest request;
  request.set_page_size(page_size);
  request.set_page_token(page_token);
  v1::ListAssetsResponse response;
  const grpc::Status status = assets.ListAssets(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response;
}

}  // namespace weft::testing
