#include "client/assets.h"

#include <gmock/gmock.h>

#include <stop_token>
#include <string>

#include "client/scene_file.h"
#include "tests/client/breaking_proxy.h"
#include "tests/support/service/assets.h"
#include "tests/support/service/service.h"

namespace weft::testing {
namespace {

using client::Connection;

// A server that other processes reach.
ServerOptions with_host() {
  ServerOptions options = Service::in_process();
  options.host = "127.0.0.1";
  return options;
}

TEST(ClientAssets, AreSentOnceAndGoOnWhereAConnectionBroke) {
  constexpr int kBreaks = 3;
  Service service(with_host());
  const v1::MeshData mesh = square_mesh(500);  // some 8 MB
  const BreakingProxy proxy(service.server.address(),
                            {.breaks = kBreaks, .after_asked_bytes = 1'500'000});
  const auto connection = Connection::to(proxy.address(), std::stop_token());
  connection->call(&v1::ServerService::Stub::GetServerInfo, v1::GetServerInfoRequest());
  const v1::Asset asset = client::upload_mesh(*connection, mesh);
  EXPECT_EQ(proxy.broken(), kBreaks);
  EXPECT_EQ(download(*service.assets, asset.name()).first, mesh.SerializeAsString());
  const std::size_t sent = proxy.asked().size();
  EXPECT_LT(sent, 2 * mesh.ByteSizeLong());
  EXPECT_EQ(client::upload_mesh(*connection, mesh).name(), asset.name());
  EXPECT_LT(proxy.asked().size() - sent, 10'000);
}

TEST(ClientAssets, TakeThePlaceOfALargeMeshAlone) {
  Service service(with_host());
  const auto connection = Connection::to(service.server.address(), std::stop_token());
  const v1::MeshData large = square_mesh(250);
  ASSERT_GT(large.ByteSizeLong(), client::kMostInline);
  const v1::Scene named = client::upload_meshes(*connection, scene_of(large));
  EXPECT_EQ(named.sheets(0).triangles().asset(), name_of_asset(large.SerializeAsString()));
  EXPECT_TRUE(client::upload_meshes(*connection, scene_of(square_mesh(2)))
                  .sheets(0)
                  .triangles()
                  .has_data());
}

TEST(ClientAssets, NameAFaultByItsPlaceInTheScene) {
  Service service(with_host());
  const auto connection = Connection::to(service.server.address(), std::stop_token());
  v1::MeshData mesh = square_mesh(250);
  mesh.mutable_triangles()->replace(0, 4, "\xff\xff\xff\xff");
  try {
    client::create_session(*connection, scene_of(mesh));
    ADD_FAILURE() << "there is no particle 4294967295";
  } catch (const client::Problem& problem) {
    ASSERT_FALSE(problem.violations.empty());
    EXPECT_EQ(problem.violations[0].field, "sheets[0].triangles.data.triangles");
  }
}

}  // namespace
}  // namespace weft::testing
