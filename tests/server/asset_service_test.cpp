#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <string>
#include <thread>

#include "server/store/assets.h"
#include "tests/server/restart_support.h"
#include "tests/support/service/assets.h"
#include "tests/support/service/process.h"

namespace weft::testing {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// Some 2.8 MB: three pieces.
std::string large_mesh() {
  static const std::string bytes = square_mesh(300).SerializeAsString();
  return bytes;
}
std::string small_mesh() { return square_mesh(3).SerializeAsString(); }

std::int64_t size_of(const std::string& bytes) { return static_cast<std::int64_t>(bytes.size()); }

// A server and its assets.
class AssetTest : public Restart {
 protected:
  v1::AssetService::Stub& assets() { return *service_->assets; }

  // Sends so many whole pieces of the bytes, and breaks off.
  void send_pieces(const std::string& bytes, int pieces) {
    Upload upload(assets(), name_of_asset(bytes), size_of(bytes));
    for (int i = 0; i < pieces; ++i)
      upload.send(i * Assets::kPiece,
                  bytes.substr(static_cast<std::size_t>(i * Assets::kPiece), Assets::kPiece));
    while (get_asset(assets(), name_of_asset(bytes)).first.received_bytes() <
           pieces * Assets::kPiece)
      std::this_thread::yield();
  }
};

TEST_F(AssetTest, ComesBackAsItWasSentAndSaysWhatItIs) {
  const std::string bytes = large_mesh();
  const auto [sent, error] = upload(assets(), bytes);
  ASSERT_EQ(error.code, grpc::StatusCode::OK) << error.message;
  EXPECT_EQ(sent.name(), name_of_asset(bytes));
  EXPECT_EQ(sent.size_bytes(), size_of(bytes));
  EXPECT_EQ(sent.received_bytes(), size_of(bytes));
  EXPECT_TRUE(sent.has_create_time());
  EXPECT_EQ(sent.mesh().particles(), 301 * 301);
  EXPECT_EQ(sent.mesh().triangles(), 2 * 300 * 300);
  EXPECT_EQ(sent.mesh().panels(), 1);
  EXPECT_NEAR(sent.mesh().flat_area_m2(), 1, 1e-4);
  EXPECT_EQ(sent.mesh().border_edges(), 4 * 300);
  EXPECT_EQ(sent.mesh().branching_edges(), 0);
  EXPECT_FALSE(sent.mesh().closed());
  EXPECT_NEAR(sent.mesh().least_height_m(), 1 / 300.0 / std::sqrt(2), 1e-5);
  EXPECT_EQ(get_asset(assets(), sent.name()).first.SerializeAsString(), sent.SerializeAsString());
  EXPECT_EQ(download(assets(), sent.name()).first, bytes);
  EXPECT_EQ(download(assets(), sent.name(), 1'500'000).first, bytes.substr(1'500'000));
  EXPECT_EQ(download(assets(), sent.name(), size_of(bytes)).first, "");
  EXPECT_EQ(download(assets(), sent.name(), size_of(bytes) + 1).second.fields(),
            std::vector<std::string>{"offset"});
}

TEST_F(AssetTest, ThatIsThereNeedNotBeSentAgain) {
  const std::string bytes = small_mesh();
  upload(assets(), bytes);
  const auto [asset, error] = Upload(assets(), name_of_asset(bytes), size_of(bytes)).finish();
  EXPECT_EQ(error.code, grpc::StatusCode::OK);
  EXPECT_EQ(asset.received_bytes(), size_of(bytes));
}

TEST_F(AssetTest, GoesOnAfterABrokenStreamWhereTheServerSays) {
  const std::string bytes = large_mesh();
  send_pieces(bytes, 2);
  const v1::Asset begun = get_asset(assets(), name_of_asset(bytes)).first;
  EXPECT_EQ(begun.received_bytes(), 2 * Assets::kPiece);
  EXPECT_EQ(begun.size_bytes(), size_of(bytes));
  EXPECT_FALSE(begun.has_create_time());
  EXPECT_EQ(download(assets(), begun.name()).second.reason(), "ASSET_INCOMPLETE");
  EXPECT_EQ(upload(assets(), bytes).first.received_bytes(), size_of(bytes));
  EXPECT_EQ(download(assets(), begun.name()).first, bytes);
}

TEST_F(AssetTest, GoesOnAfterARestartOfTheServer) {
  const std::string bytes = large_mesh();
  send_pieces(bytes, 1);
  restart();
  EXPECT_EQ(get_asset(assets(), name_of_asset(bytes)).first.received_bytes(), Assets::kPiece);
  EXPECT_EQ(upload(assets(), bytes).second.code, grpc::StatusCode::OK);
  restart();
  EXPECT_EQ(download(assets(), name_of_asset(bytes)).first, bytes);
}

TEST_F(AssetTest, TellsAStreamThatBeginsElsewhereWhereToBegin) {
  const std::string bytes = large_mesh();
  send_pieces(bytes, 1);
  Upload late(assets(), name_of_asset(bytes), size_of(bytes));
  late.send(0, bytes.substr(0, 1000));
  const Error error = late.finish().second;
  EXPECT_EQ(error.code, grpc::StatusCode::ABORTED);
  EXPECT_EQ(error.reason(), "OFFSET_STALE");
  EXPECT_EQ(error.metadata("received_bytes"), std::to_string(Assets::kPiece));
}

TEST_F(AssetTest, OfOtherBytesThanItsNameSaysIsForgotten) {
  const std::string name = name_of_asset("something else");
  const Error error = upload_as(assets(), name, small_mesh()).second;
  EXPECT_EQ(error.code, grpc::StatusCode::DATA_LOSS);
  EXPECT_EQ(error.reason(), "HASH_DIFFERS");
  EXPECT_EQ("assets/" + error.metadata("hash"), name_of_asset(small_mesh()));
  EXPECT_EQ(get_asset(assets(), name).second.code, grpc::StatusCode::NOT_FOUND);
}

TEST_F(AssetTest, ThatIsNoMeshIsRefusedWithEveryFault) {
  EXPECT_EQ(upload(assets(), "no mesh at all").second.fields(), std::vector<std::string>{"data"});
  v1::MeshData mesh = square_mesh(2);
  mesh.mutable_triangles()->replace(0, 4, "\xff\xff\xff\xff");
  mesh.mutable_flat_m()->replace(0, 4, std::string("\0\0\xc0\x7f", 4));  // NaN
  mesh.add_panels()->set_name("front");
  const Error error = upload(assets(), mesh.SerializeAsString()).second;
  EXPECT_EQ(error.code, grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(error.fields(), ::testing::IsSupersetOf({"data.triangles", "data.flat_m"}));
  EXPECT_THAT(list_assets(assets()).assets(), IsEmpty());
}

TEST_F(AssetTest, MayBeABodyWhichIsClosed) {
  v1::MeshData cube = cube_mesh(0.1F, 0, 0, 0);
  const auto [asset, error] = upload(assets(), cube.SerializeAsString());
  ASSERT_EQ(error.code, grpc::StatusCode::OK) << error.message;
  EXPECT_TRUE(asset.mesh().closed());
  EXPECT_EQ(asset.mesh().triangles(), 12);
  EXPECT_NEAR(asset.mesh().flat_area_m2(), 6 * 0.04, 1e-6);
  cube.mutable_triangles()->resize(11 * 12);
  EXPECT_THAT(upload(assets(), cube.SerializeAsString()).second.fields(),
              ::testing::Contains("data.triangles"));
}

TEST_F(AssetTest, MayBeABodyInMotionWhosePosesFit) {
  v1::MeshData cube = cube_mesh(0.1F, 0, 0, 0);
  const std::string first = cube.positions_m(), next = cube_mesh(0.1F, 0, 1, 0).positions_m();
  cube.clear_positions_m();
  cube.mutable_poses()->add_times_s(0);
  cube.mutable_poses()->add_times_s(0.5);
  cube.mutable_poses()->set_positions_m(first + next);
  const auto [asset, error] = upload(assets(), cube.SerializeAsString());
  ASSERT_EQ(error.code, grpc::StatusCode::OK) << error.message;
  EXPECT_EQ(asset.mesh().poses(), 2);
  EXPECT_EQ(asset.mesh().particles(), 8);
  EXPECT_NEAR(asset.mesh().flat_area_m2(), 6 * 0.04, 1e-6);

  const auto fault = [&] {
    const Error found = upload(assets(), cube.SerializeAsString()).second;
    return found.fields().empty() ? "" : found.fields()[0];
  };
  cube.mutable_poses()->set_times_s(1, 0.005);  // 200 m/s
  EXPECT_EQ(fault(), "data.poses.positions_m");
  cube.mutable_poses()->set_times_s(1, 0);
  EXPECT_EQ(fault(), "data.poses.times_s[1]");
  cube.mutable_poses()->set_times_s(1, 1);
  cube.set_positions_m(first + next);
  EXPECT_THAT(upload(assets(), cube.SerializeAsString()).second.fields(),
              ::testing::ElementsAre("data.poses", "data.positions_m"));
  cube = square_mesh(1);
  cube.mutable_poses()->add_times_s(0);
  EXPECT_EQ(fault(), "data.flat_m");
}

TEST_F(AssetTest, IsListedInOrderOfNameOnPages) {
  std::vector<std::string> names;
  for (int cells = 1; cells <= 5; ++cells)
    names.push_back(upload(assets(), square_mesh(cells).SerializeAsString()).first.name());
  std::sort(names.begin(), names.end());
  std::vector<std::string> found;
  std::string token;
  do {
    const auto page = list_assets(assets(), 2, token);
    for (const auto& asset : page.assets()) found.push_back(asset.name());
    token = page.next_page_token();
  } while (!token.empty());
  EXPECT_EQ(found, names);
}

TEST_F(AssetTest, IsDeletedOnce) {
  const std::string name = upload(assets(), small_mesh()).first.name();
  EXPECT_EQ(delete_asset(assets(), name).code, grpc::StatusCode::OK);
  EXPECT_EQ(delete_asset(assets(), name).reason(), "ASSET_NOT_FOUND");
  EXPECT_EQ(delete_asset(assets(), name, {}, true).code, grpc::StatusCode::OK);
  EXPECT_EQ(download(assets(), name).second.code, grpc::StatusCode::NOT_FOUND);
}

// Servers with limits or patience of their own.
class AssetLimits : public ::testing::Test {
 protected:
  static ServerOptions with(void (*set)(ServerOptions&)) {
    ServerOptions options = Service::in_process();
    set(options);
    return options;
  }
};

TEST_F(AssetLimits, BoundOneAndAllOfAPrincipal) {
  Service service(with([](ServerOptions& options) {
    options.limits.max_asset_bytes = 3000;
    options.limits.max_asset_bytes_per_principal = 4000;
  }));
  const Error large = upload(*service.assets, square_mesh(20).SerializeAsString()).second;
  EXPECT_EQ(large.code, grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(large.quota.violations(0).subject(), "asset_bytes");
  EXPECT_FALSE(large.retry);

  // what is begun counts whole
  const std::string first = square_mesh(8).SerializeAsString();
  ASSERT_GT(first.size(), 2000);
  EXPECT_EQ(Upload(*service.assets, name_of_asset(first), size_of(first)).finish().second.code,
            grpc::StatusCode::OK);
  const std::string second = square_mesh(9).SerializeAsString();
  const Error excess = upload(*service.assets, second).second;
  EXPECT_EQ(excess.code, grpc::StatusCode::RESOURCE_EXHAUSTED) << excess.message;
  EXPECT_EQ(excess.quota.violations(0).subject(), "asset_bytes_per_principal");
  EXPECT_TRUE(excess.retry);
  delete_asset(*service.assets, name_of_asset(first));
  EXPECT_EQ(upload(*service.assets, second).second.code, grpc::StatusCode::OK);
  EXPECT_EQ(service.info().limits().max_asset_bytes(), 3000);
  EXPECT_EQ(service.info().limits().max_asset_bytes_per_principal(), 4000);
}

TEST_F(AssetLimits, EndAnUploadThatSaysNothing) {
  Service service(with([](ServerOptions& options) { options.upload_patience = milliseconds(20); }));
  Upload upload(*service.assets, name_of_asset(small_mesh()), size_of(small_mesh()));
  const Error error = upload.await_end();
  EXPECT_EQ(error.code, grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_EQ(error.reason(), "UPLOAD_STALLED");
}

TEST_F(AssetLimits, EndUploadsOfAServerThatGoes) {
  auto service = std::make_unique<Service>();
  Upload upload(*service->assets, name_of_asset(large_mesh()), size_of(large_mesh()));
  upload.send(0, large_mesh().substr(0, Assets::kPiece));
  while (get_asset(*service->assets, name_of_asset(large_mesh())).first.received_bytes() == 0)
    std::this_thread::yield();
  std::thread stop([&] { service->server.stop(); });
  EXPECT_EQ(upload.await_end().reason(), "SERVER_DRAINING");
  stop.join();
}

TEST_F(AssetLimits, HaveWhatIsUnusedForgotten) {
  Service service(with([](ServerOptions& options) { options.asset_ttl = milliseconds(50); }));
  const std::string name = upload(*service.assets, small_mesh()).first.name();
  Upload(*service.assets, name_of_asset(large_mesh()), size_of(large_mesh())).finish();
  while (!list_assets(*service.assets).assets().empty()) std::this_thread::yield();
  EXPECT_EQ(get_asset(*service.assets, name).second.code, grpc::StatusCode::NOT_FOUND);
}

TEST_F(AssetTest, AreCountedInBytes) {
  const std::string bytes = small_mesh();
  upload(assets(), bytes);
  download(assets(), name_of_asset(bytes));
  const auto stats = [&] {
    grpc::ClientContext context;
    v1::ServerStats found;
    EXPECT_TRUE(service_->servers->GetServerStats(&context, {}, &found).ok());
    return found;
  };
  EXPECT_EQ(stats().assets(), 1);
  EXPECT_EQ(stats().asset_bytes(), size_of(bytes));
  EXPECT_EQ(stats().asset_bytes_received(), size_of(bytes));
  EXPECT_EQ(stats().asset_bytes_sent(), size_of(bytes));
  restart();
  EXPECT_EQ(stats().assets(), 1);
  delete_asset(assets(), name_of_asset(bytes));
  EXPECT_EQ(stats().asset_bytes(), 0);
}

// A server that asks who calls: ann's token is "a1", bob's "b1", the admin's "r1".
class AssetsOfPrincipals : public ::testing::Test {
 protected:
  AssetsOfPrincipals() {
    std::ofstream(directory_.path("tokens"))
        << "ann f55ff16f66f43360266b95db6f8fec01d76031054306ae4a4b380598f6cfd114\n"
           "bob 7dc96f776c8423e57a2785489a3f9c43fb6e756876d6ad9a9cac4aa4e72ec193\n"
           "root 82f3e9c695dc6b8d1b11818d5701919e286de8d47f7c3eb3100c485f79e57828 admin\n";
    ServerOptions options = Service::in_process();
    options.tokens = directory_.path("tokens");
    options.host = "127.0.0.1";
    service_ = std::make_unique<Service>(options);
    // a channel over the network, for the tokens
    assets_ = v1::AssetService::NewStub(
        grpc::CreateChannel(service_->server.address(), grpc::InsecureChannelCredentials()));
  }

  TemporaryDirectory directory_;
  std::unique_ptr<Service> service_;
  std::unique_ptr<v1::AssetService::Stub> assets_;
};

TEST_F(AssetsOfPrincipals, AreNobodyElsesAndAHashDoesNotTell) {
  const std::string bytes = small_mesh(), name = name_of_asset(bytes);
  EXPECT_EQ(upload(*assets_, bytes, "a1").first.owner(), "ann");
  const Error theirs = get_asset(*assets_, name, "b1").second;
  const Error nobodys = get_asset(*assets_, name_of_asset("nothing"), "b1").second;
  EXPECT_EQ(theirs.code, grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(theirs.reason(), nobodys.reason());
  EXPECT_EQ(download(*assets_, name, 0, "b1").second.code, grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(delete_asset(*assets_, name, "b1").code, grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(list_assets(*assets_, 0, {}, "b1").assets(), IsEmpty());
  EXPECT_EQ(Upload(*assets_, name, size_of(bytes), "b1").finish().first.received_bytes(), 0);

  // he sends all of it, and keeps it when she has none any more
  const v1::Asset his = upload(*assets_, bytes, "b1").first;
  EXPECT_EQ(his.owner(), "bob");
  EXPECT_EQ(delete_asset(*assets_, name, "a1").code, grpc::StatusCode::OK);
  EXPECT_EQ(download(*assets_, name, 0, "b1").first, bytes);
  EXPECT_EQ(get_asset(*assets_, name, "a1").second.code, grpc::StatusCode::NOT_FOUND);
}

TEST_F(AssetsOfPrincipals, AreTheAdminsToReadAndToDelete) {
  const std::string bytes = small_mesh(), name = name_of_asset(bytes);
  upload(*assets_, bytes, "a1");
  upload(*assets_, bytes, "b1");
  EXPECT_THAT(list_assets(*assets_, 0, {}, "r1").assets(), SizeIs(2));
  EXPECT_EQ(download(*assets_, name, 0, "r1").first, bytes);
  const auto page = list_assets(*assets_, 1, {}, "r1");
  EXPECT_EQ(page.assets(0).owner(), "ann");
  EXPECT_EQ(list_assets(*assets_, 1, page.next_page_token(), "r1").assets(0).owner(), "bob");
  EXPECT_EQ(delete_asset(*assets_, name, "r1").code, grpc::StatusCode::OK);
  EXPECT_EQ(get_asset(*assets_, name, "a1").second.code, grpc::StatusCode::NOT_FOUND);
}

TEST_F(AssetTest, SurvivesWhenTheServerIsKilledInTheMiddle) {
  const std::string bytes = large_mesh();
  const TemporaryDirectory directory;
  const auto start = [&](const std::string& output) {
    auto process =
        std::make_unique<Process>("weftd",
                                  std::vector<std::string>{"--port=0", "--metrics=none",
                                                           "--data-dir=" + directory.path("data")},
                                  directory.path(output));
    const std::string listening = "weftd listening on ";
    std::string text;
    while ((text = content(directory.path(output))).find(listening) == std::string::npos ||
           !text.ends_with('\n'))
      std::this_thread::sleep_for(milliseconds(2));
    const std::size_t begin = text.find(listening) + listening.size();
    auto stub = v1::AssetService::NewStub(grpc::CreateChannel(
        text.substr(begin, text.find('\n', begin) - begin), grpc::InsecureChannelCredentials()));
    return std::pair(std::move(process), std::move(stub));
  };
  auto [killed, assets] = start("first");
  Upload upload_begun(*assets, name_of_asset(bytes), size_of(bytes));
  upload_begun.send(0, bytes.substr(0, Assets::kPiece));
  upload_begun.send(Assets::kPiece, bytes.substr(Assets::kPiece, 1000));
  while (get_asset(*assets, name_of_asset(bytes)).first.received_bytes() == 0)
    std::this_thread::yield();
  killed->signal(SIGKILL);
  killed->wait();
  auto [again, assets_again] = start("second");
  EXPECT_EQ(get_asset(*assets_again, name_of_asset(bytes)).first.received_bytes(), Assets::kPiece);
  EXPECT_EQ(upload(*assets_again, bytes).second.code, grpc::StatusCode::OK);
  EXPECT_EQ(download(*assets_again, name_of_asset(bytes)).first, bytes);
}

}  // namespace
}  // namespace weft::testing
