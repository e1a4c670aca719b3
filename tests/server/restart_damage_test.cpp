#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "server/store/store.h"
#include "tests/server/restart_support.h"

namespace weft::testing {
namespace {

using Sessions = Service::Sessions;

TEST_F(Restart, LosesOnlyTheSessionThatIsDamaged) {
  v1::Scene scene = small_scene();
  const v1::Session good = service_->create(scene, "good");
  scene.mutable_sheets(0)->set_name("treacherous");
  const v1::Session bad = service_->create(scene, "bad");
  service_->step(good, 5);
  service_->step(bad, 5);
  service_.reset();
  std::string bytes = content(file());
  const auto place = bytes.find("treacherous");
  ASSERT_NE(place, std::string::npos);
  bytes[place] = 'T';
  std::ofstream(file(), std::ios::binary) << bytes;

  start();
  EXPECT_EQ(service_->step(good).frame(), 6);
  v1::GetSessionRequest get;
  get.set_name(bad.name());
  const Error error = service_->error(&Sessions::GetSession, get);
  EXPECT_EQ(error.code, grpc::StatusCode::DATA_LOSS);
  EXPECT_EQ(error.reason(), "SESSION_DAMAGED");
  EXPECT_EQ(service_->create_error(small_scene(), "bad").code, grpc::StatusCode::ALREADY_EXISTS);
  service_->erase(bad);
  restart();
  EXPECT_EQ(service_->error(&Sessions::GetSession, get).code, grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(service_->step(good).frame(), 7);
}

TEST_F(Restart, NeverMistakesADamagedCallForASoundOne) {
  constexpr double kBend = 1.2345e-5;
  const v1::Session session = service_->create(small_scene(), "curtain");
  v1::UpdateTextileRequest update;
  update.set_name(session.name());
  update.mutable_update_mask()->add_paths("raw.bend_n_m2");
  update.mutable_textile()->mutable_raw()->set_bend_n_m2(kBend);
  ASSERT_EQ(service_->error(&Sessions::UpdateTextile, update).code, grpc::StatusCode::OK);
  service_.reset();
  const std::string good = content(file());
  const std::string value(reinterpret_cast<const char*>(&kBend), sizeof kBend);
  const auto place = good.find(value);
  ASSERT_NE(place, std::string::npos);
  for (std::size_t byte = 0; byte < value.size(); ++byte) {
    std::string bytes = good;
    bytes[place + byte] = static_cast<char>(bytes[place + byte] ^ 1);
    std::ofstream(file(), std::ios::binary) << bytes;
    start();
    v1::GetSessionRequest get;
    get.set_name(session.name());
    EXPECT_EQ(service_->error(&Sessions::GetSession, get).code, grpc::StatusCode::DATA_LOSS);
    service_.reset();
  }
}

// Whatever byte is changed: the server refuses the file, or has the session as it was, or says that
// it is damaged.
TEST_F(Restart, NeverMistakesDamageForASession) {
  const v1::Session session = service_->create(small_scene(), "curtain");
  for (int i = 0; i < 5; ++i) service_->step(session, 2);
  const std::string before = frames(session, 10).back().SerializeAsString();
  service_.reset();
  const std::string good = content(file());
  int found = 0;
  for (std::size_t place = 3; place < good.size(); place += 173) {
    std::string bytes = good;
    bytes[place] = static_cast<char>(bytes[place] ^ 0x11);
    std::ofstream(file(), std::ios::binary) << bytes;
    try {
      start();
      v1::GetSessionRequest get;
      get.set_name(session.name());
      const Error error = service_->error(&Sessions::GetSession, get);
      if (error.code == grpc::StatusCode::OK) {
        EXPECT_EQ(frames(session, 10).back().SerializeAsString(), before) << "byte " << place;
      } else {
        EXPECT_EQ(error.code, grpc::StatusCode::DATA_LOSS) << "byte " << place;
        ++found;
      }
    } catch (const std::runtime_error&) {
      ++found;
    }
    service_.reset();
  }
  EXPECT_GT(found, 0);
}

}  // namespace
}  // namespace weft::testing
