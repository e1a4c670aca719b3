#include <chrono>
#include <filesystem>
#include <string>

#include "server/store/assets.h"
#include "server/store/sqlite_tables.h"
#include "tests/server/restart_support.h"
#include "tests/support/service/assets.h"

namespace weft::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;
using Sessions = Service::Sessions;

// Sessions whose scenes name assets.
class SessionAssets : public RestartWithSnapshots {
 protected:
  v1::AssetService::Stub& assets() { return *service_->assets; }
  std::string asset_of(const v1::Session& session) {
    return service_->get(session).scene().sheets(0).triangles().asset();
  }

  // What is kept of sessions, on disk.
  std::string kept() const {
    std::string all;
    for (const auto& file : std::filesystem::recursive_directory_iterator(directory_.name()))
      if (file.is_regular_file() && !file.path().filename().string().starts_with("assets.db"))
        all += content(file.path().string());
    return all;
  }

  const v1::MeshData mesh_ = square_mesh(4);
  const std::string bytes_ = mesh_.SerializeAsString();
  const std::string name_ = name_of_asset(bytes_);
};

TEST_F(SessionAssets, HoldTheirAssetAsLongAsTheyAre) {
  upload(assets(), bytes_);
  const v1::Session session = service_->create(scene_of(name_));
  EXPECT_EQ(asset_of(session), name_);
  EXPECT_EQ(service_->step(session, 3).frame(), 3);
  for (int i = 0; i < 2; ++i) {
    const Error used = delete_asset(assets(), name_);
    EXPECT_EQ(used.code, grpc::StatusCode::FAILED_PRECONDITION);
    EXPECT_EQ(used.reason(), "ASSET_USED");
    restart();
  }
  service_->erase(session);
  EXPECT_EQ(delete_asset(assets(), name_).code, grpc::StatusCode::OK);
}

TEST_F(SessionAssets, AreMadeOfTheMeshThatASceneHolds) {
  const v1::Session session = service_->create(scene_of(mesh_));
  EXPECT_EQ(session.scene().sheets(0).triangles().asset(), name_);
  EXPECT_EQ(asset_of(session), name_);
  EXPECT_EQ(download(assets(), name_).first, bytes_);
  EXPECT_EQ(service_->create(scene_of(mesh_)).scene().sheets(0).triangles().asset(), name_);
  EXPECT_THAT(list_assets(assets()).assets(), SizeIs(1));
}

TEST_F(SessionAssets, HaveLargeValuesInNeitherLogNorSnapshots) {
  const v1::Session session = service_->create(scene_of(mesh_));
  RestartWithSnapshots::kept(session);
  EXPECT_THAT(kept(), HasSubstr(name_));
  EXPECT_THAT(kept(), Not(HasSubstr(mesh_.triangles())));
  EXPECT_THAT(content(directory_.path("assets.db")) + content(directory_.path("assets.db-wal")),
              HasSubstr(mesh_.triangles()));
}

TEST_F(SessionAssets, GoOnAfterARestartWithTheSameFrames) {
  for (const int snapshot_ms : {2000, 0}) {  // by the log; by snapshots
    snapshot_ms_ = snapshot_ms;
    restart();
    const v1::Session session = service_->create(scene_of(mesh_));
    service_->step(session, 20);
    restart();
    service_->step(session, 5);
    const v1::Session undisturbed = service_->create(scene_of(name_));
    service_->step(undisturbed, 25);
    const auto newest = [&](const v1::Session& of) {
      return Stream(*service_, frames_of(of, 25, 25)).rest();
    };
    expect_equal(newest(session), newest(undisturbed));
    EXPECT_EQ(asset_of(session), name_);
  }
  v1::ListSessionsResponse listed;
  ASSERT_TRUE(service_->call(&Sessions::ListSessions, {}, &listed).ok());
  EXPECT_EQ(listed.sessions(0).scene().sheets(0).triangles().asset(), name_);
}

TEST_F(SessionAssets, HoldTheMeshesOfBodiesAsThoseOfSheets) {
  v1::Scene scene = small_scene();
  v1::MeshData cube = cube_mesh(0.2F, 0.1F, -0.3F, 0.1F);
  const std::string risen = cube_mesh(0.25F, 0.1F, -0.25F, 0.1F).positions_m();
  cube.mutable_poses()->add_times_s(0.05);
  cube.mutable_poses()->add_times_s(1);
  cube.mutable_poses()->set_positions_m(cube.positions_m() + risen);
  const std::string name = name_of_asset(cube.SerializeAsString());
  *scene.add_colliders()->mutable_mesh()->mutable_data() = cube;
  scene.mutable_colliders(0)->mutable_mesh()->set_cell_m(0.02);  // made anew as it moves
  v1::Session session = service_->create(scene);
  EXPECT_EQ(session.scene().colliders(0).mesh().asset(), name);
  service_->step(session, 20);
  RestartWithSnapshots::kept(session);
  EXPECT_THAT(kept(), HasSubstr(name));
  EXPECT_THAT(kept(), Not(HasSubstr(cube.positions_m())));
  EXPECT_THAT(kept(), Not(HasSubstr(risen)));
  restart();
  EXPECT_EQ(service_->get(session).scene().colliders(0).mesh().asset(), name);
  const std::int64_t last = service_->step(session, 5).frame();
  EXPECT_EQ(delete_asset(assets(), name).reason(), "ASSET_USED");

  scene.mutable_colliders(0)->mutable_mesh()->set_asset(name);
  const v1::Session undisturbed = service_->create(scene);
  service_->step(undisturbed, last);
  const auto newest = [&](const v1::Session& of) {
    return Stream(*service_, frames_of(of, last, last)).rest();
  };
  expect_equal(newest(session), newest(undisturbed));
}

TEST_F(SessionAssets, StoreNothingOfASceneThatIsOnlyLookedAt) {
  v1::CreateSessionRequest request;
  *request.mutable_session()->mutable_scene() = scene_of(mesh_);
  request.set_validate_only(true);
  v1::Session session;
  ASSERT_TRUE(service_->call(&Sessions::CreateSession, request, &session).ok());
  EXPECT_EQ(session.scene().sheets(0).triangles().asset(), name_);
  EXPECT_THAT(list_assets(assets()).assets(), IsEmpty());
}

TEST_F(SessionAssets, AreAnsweredOnceHoweverOftenTheyAreAskedFor) {
  v1::CreateSessionRequest request;
  *request.mutable_session()->mutable_scene() = scene_of(mesh_);
  request.set_request_id("make");
  v1::Session first, again;
  ASSERT_TRUE(service_->call(&Sessions::CreateSession, request, &first).ok());
  ASSERT_TRUE(service_->call(&Sessions::CreateSession, request, &again).ok());
  EXPECT_EQ(again.uid(), first.uid());
  *request.mutable_session()->mutable_scene() = scene_of(name_);
  EXPECT_EQ(service_->error(&Sessions::CreateSession, request).fields(),
            std::vector<std::string>{"request_id"})
      << "it is another call, though the scene is the same";
}

TEST_F(SessionAssets, AreRefusedWhereTheAssetIsNotThereOrNotWhole) {
  const std::vector<std::string> field{"session.scene.sheets[0].triangles.asset"};
  EXPECT_EQ(service_->create_error(scene_of(name_)).fields(), field);
  Upload(assets(), name_, static_cast<std::int64_t>(bytes_.size())).finish();
  EXPECT_EQ(service_->create_error(scene_of(name_)).fields(), field);
  EXPECT_EQ(service_->create_error(scene_of("meshes/shirt")).fields(), field);
}

TEST_F(SessionAssets, ShareTheirAssetWithWhatIsRestoredFromTheirSnapshots) {
  const v1::Session session = service_->create(scene_of(mesh_), "first");
  service_->step(session, 2);
  v1::CreateSnapshotRequest snapshot;
  snapshot.set_parent(session.name());
  snapshot.set_snapshot_id("two");
  ASSERT_EQ(service_->error(&Sessions::CreateSnapshot, snapshot).code, grpc::StatusCode::OK);
  v1::RestoreSessionRequest request;
  request.set_name(session.name() + "/snapshots/two");
  v1::Session restored;
  ASSERT_TRUE(service_->call(&Sessions::RestoreSession, request, &restored).ok());
  service_->erase(session);
  EXPECT_EQ(delete_asset(assets(), name_).reason(), "ASSET_USED");
  EXPECT_EQ(asset_of(restored), name_);
  EXPECT_EQ(service_->step(restored).frame(), 3);
}

TEST_F(SessionAssets, AreLostWithTheirAssetWhichIsNamed) {
  const v1::Session session = service_->create(scene_of(mesh_));
  service_.reset();
  {
    Assets kept(open_sqlite_tables(directory_.path("assets.db")));
    kept.release(session.uid(), std::chrono::system_clock::now());
    EXPECT_TRUE(kept.erase(*kept.find(sha256(bytes_), "")));
  }
  start();
  v1::GetSessionRequest request;
  request.set_name(session.name());
  const Error error = service_->error(&Sessions::GetSession, request);
  EXPECT_EQ(error.code, grpc::StatusCode::DATA_LOSS);
  EXPECT_THAT(error.message, HasSubstr(name_));
}

}  // namespace
}  // namespace weft::testing
