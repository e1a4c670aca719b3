#include "server/server.h"

#include <sched.h>

#include <atomic>
#include <filesystem>
#include <future>
#include <thread>
#include <vector>

#include "server/config.h"
#include "tests/support/service/service.h"

namespace weft::testing {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

TEST(Server, TellsItsVersionAndLimits) {
  ServerOptions options = Service::in_process();
  options.limits.max_sessions = 17;
  Service service(options);
  service.create();
  const v1::ServerInfo info = service.info();
  EXPECT_FALSE(info.version().empty());
  EXPECT_FALSE(info.numerics_id().empty());
  EXPECT_EQ(info.worker_threads(), 2);
  EXPECT_EQ(info.sessions(), 1);
  EXPECT_EQ(info.limits().max_sessions(), 17);
  EXPECT_EQ(info.limits().max_request_bytes(), 16 << 20);
}

TEST(Server, ServesManyClientsAtOnce) {
  Service service;
  std::vector<std::jthread> clients;
  for (int i = 0; i < 20; ++i) {
    clients.emplace_back([&, i] {
      const v1::Session session = service.create(small_scene(), "client-" + std::to_string(i));
      Stream stream(service, frames_of(session, 0, 50));
      service.run(session, 50);
      const auto frames = stream.rest();
      ASSERT_THAT(frames, SizeIs(51));
      for (int k = 0; k <= 50; ++k) EXPECT_EQ(frames[static_cast<std::size_t>(k)].number(), k);
      EXPECT_EQ(stream.finish().code, grpc::StatusCode::OK);
      service.erase(session);
    });
  }
  clients.clear();
  EXPECT_EQ(service.info().sessions(), 0);
}

TEST(Server, ThreadsOfCallsWaitUntilOneThatAdvancesSessionsPauses) {
  const ServerOptions options = Service::in_process();
  const Server server(options);
  int waiting = 0, others = 0;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
    const int policy = sched_getscheduler(std::stoi(thread.path().filename()));
    waiting += policy == SCHED_BATCH;
    others += policy == SCHED_OTHER;
  }
  EXPECT_GT(waiting, 0);
  EXPECT_GT(others, options.worker_threads);
  EXPECT_EQ(sched_getscheduler(0), SCHED_OTHER);
}

TEST(Server, ListensOnAFreePortAndNoOtherServerSharesIt) {
  ServerOptions options;
  const Server server(options);
  ASSERT_THAT(server.address(), ::testing::StartsWith("127.0.0.1:"));
  options.port = std::stoi(server.address().substr(10));
  EXPECT_GT(options.port, 0);
  EXPECT_THROW(Server{options}, std::runtime_error);
}

TEST(Server, StopsWithAStepUnderWay) {
  Service service;
  const v1::Session session = service.create();
  Stream stream(service, frames_of(session));
  std::jthread stepping([&] {
    v1::StepSessionRequest request;
    request.set_name(session.name());
    request.set_frames(100'000);
    const Error error = service.error(&Service::Sessions::StepSession, request);
    EXPECT_EQ(error.code, grpc::StatusCode::UNAVAILABLE);
    EXPECT_EQ(error.reason(), "SERVER_DRAINING");
  });
  while (stream.frame().number() < 3) {
  }
  const auto begin = std::chrono::steady_clock::now();
  service.server.stop();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(60));
}

// Large scenes take a while to plan, one frame of a small one takes none.
class WhileScenesArePlanned : public ::testing::Test {
 protected:
  static constexpr int kScenes = 4;

  WhileScenesArePlanned() {
    v1::Scene large = small_scene();
    large.mutable_sheets(0)->mutable_grid()->set_rows(100);
    large.mutable_sheets(0)->mutable_grid()->set_columns(100);
    for (int i = 0; i < kScenes; ++i)
      creations_.push_back(std::async(std::launch::async, [this, large] {
        const Error error = service_.create_error(large);
        --planned_;
        return error;
      }));
  }

  Service service_;
  v1::Session session_ = service_.create();
  std::atomic<int> planned_ = kScenes;
  std::vector<std::future<Error>> creations_;
};

TEST_F(WhileScenesArePlanned, OtherSessionsGoOn) {
  EXPECT_EQ(service_.step(session_).frame(), 1);
  EXPECT_GT(planned_, 0);
}

TEST_F(WhileScenesArePlanned, SmallOnesAreCreated) {
  service_.create();
  EXPECT_GT(planned_, 0);
}

TEST_F(WhileScenesArePlanned, TheServerStopsAndAnswersEveryCall) {
  while (planned_ == kScenes) std::this_thread::yield();  // until the calls are there
  service_.server.stop();
  for (auto& creation : creations_) {
    const Error error = creation.get();
    if (!error.reason().empty()) {
      EXPECT_EQ(error.reason(), "SERVER_DRAINING");
    }
  }
}

TEST(Server, StopsWithAReaderThatDoesNotRead) {
  Service service;
  const v1::Session session = service.create();
  Stream stream(service, frames_of(session));
  stream.header();
  service.step(session, 500);
  service.server.stop(std::chrono::milliseconds(100));
}

TEST(Server, IsHealthyAsAWholeAndByService) {
  Service service;
  const std::string serving = "\x08\x01";  // HealthCheckResponse{status: SERVING}
  for (const std::string name : {"", "weft.v1.SessionService", "weft.v1.FrameService",
                                 "weft.v1.ServerService", "weft.v1.TextileService"}) {
    const std::string request = "\x0a" + std::string(1, static_cast<char>(name.size())) + name;
    EXPECT_EQ(raw_call(service, "/grpc.health.v1.Health/Check", request).first, serving) << name;
  }
}

TEST(Server, DescribesItselfByReflection) {
  Service service;
  const std::string list_services = "\x3a\x01*";
  const std::string services =
      raw_call(service, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
               list_services)
          .first;
  EXPECT_THAT(services, HasSubstr("weft.v1.SessionService"));
  EXPECT_THAT(services, HasSubstr("weft.v1.FrameService"));
}

// What read_config says to flags.
std::string refusal(std::vector<const char*> flags) {
  flags.insert(flags.begin(), "weftd");
  try {
    read_config(static_cast<int>(flags.size()), flags.data());
  } catch (const ConfigExit& exit) {
    return exit.text;
  }
  return "";
}

Config config(std::vector<const char*> flags) {
  flags.insert(flags.begin(), "weftd");
  return read_config(static_cast<int>(flags.size()), flags.data());
}

// A file that is gone with the test.
class TomlFile {
 public:
  explicit TomlFile(const std::string& text) {
    const int file = mkstemp(path_);
    EXPECT_EQ(write(file, text.data(), text.size()), static_cast<ssize_t>(text.size()));
    close(file);
  }
  ~TomlFile() { unlink(path_); }
  const char* path() const { return path_; }

 private:
  char path_[32] = "/tmp/weft-config-XXXXXX";
};

TEST(Config, HelpFits80Columns) {
  EXPECT_THAT(refusal({"--help"}), Not(ContainsRegex("[^\n]{81}")));
}

TEST(Config, TakesFlagsBeforeTheFileAndTheFileBeforeDefaults) {
  const TomlFile file("port = 4000\nmax_sessions = 5\nlog_level = \"warn\"\n");
  const Config read = config({"--config", file.path(), "--port", "4001"});
  EXPECT_EQ(read.server.port, 4001);
  EXPECT_EQ(read.server.limits.max_sessions, 5);
  EXPECT_EQ(read.log_level, "warn");
  EXPECT_EQ(read.server.limits.max_streams, Limits().max_streams);
  EXPECT_EQ(read.server.host, "127.0.0.1");
}

TEST(Config, NamesFileLineKeyValueAndBoundOfWhatIsWrong) {
  const TomlFile range("port = 1\n\nmax_sessions = 0\n");
  EXPECT_THAT(
      refusal({"--config", range.path()}),
      HasSubstr(std::string(range.path()) + ":3: max_sessions is 0, not within 1 to 100000"));
  const TomlFile unknown("port = 1\nprt = 2\n");
  EXPECT_THAT(refusal({"--config", unknown.path()}), HasSubstr(":2: prt is not known"));
  const TomlFile type("port = \"one\"\n");
  EXPECT_THAT(refusal({"--config", type.path()}), HasSubstr(":1: port is not a whole number"));
  const TomlFile syntax("\nport = = 1\n");
  EXPECT_THAT(refusal({"--config", syntax.path()}), HasSubstr(std::string(syntax.path()) + ":2"));
  EXPECT_THAT(refusal({"--config", "/nowhere.toml"}), HasSubstr("/nowhere.toml"));
  EXPECT_THAT(refusal({"--workers", "0"}), HasSubstr("--workers is 0, not within 1 to 1024"));
  EXPECT_THAT(refusal({"--log-level", "loud"}), HasSubstr("--log-level is \"loud\""));
  EXPECT_THAT(refusal({"--prt", "1"}), HasSubstr("--prt"));
}

TEST(Config, RefusesToListenBeyondThisMachineUnlessToldTwice) {
  EXPECT_THAT(refusal({"--host", "0.0.0.0"}), HasSubstr("--insecure"));
  EXPECT_THAT(refusal({"--host", "127.example.com"}), HasSubstr("--insecure"));
  EXPECT_THAT(refusal({"--metrics", "0.0.0.0:9464"}), HasSubstr("--insecure"));
  EXPECT_EQ(config({"--host", "0.0.0.0", "--insecure"}).server.host, "0.0.0.0");
}

TEST(Config, OpensTheServerToOtherMachinesWithTlsButNotItsMetrics) {
  const Config read = config({"--host", "0.0.0.0", "--tls-cert", "c", "--tls-key", "k"});
  EXPECT_EQ(read.server.tls->certificate, "c");
  EXPECT_EQ(read.server.tls->client_ca, std::nullopt);
  EXPECT_THAT(refusal({"--host", "0.0.0.0", "--tokens", "t"}), HasSubstr("--insecure"));
  EXPECT_THAT(refusal({"--metrics", "0.0.0.0:1", "--tls-cert", "c", "--tls-key", "k"}),
              HasSubstr("metrics is 0.0.0.0:1, which other machines can reach"));
  EXPECT_THAT(refusal({"--tls-cert", "c"}), HasSubstr("one is missing"));
  EXPECT_THAT(refusal({"--tls-client-ca", "c"}), HasSubstr("one is missing"));
  const TomlFile file("tls_cert = \"c\"\ntls_key = \"k\"\ntls_client_ca = \"a\"\ntokens = \"t\"\n");
  const Config from_file = config({"--config", file.path(), "--tls-key", "l"});
  EXPECT_EQ(from_file.server.tls->key, "l");
  EXPECT_EQ(from_file.server.tls->client_ca, "a");
  EXPECT_EQ(from_file.server.tokens, "t");
}

TEST(Config, KeepsSessionsUnlessToldNotTo) {
  EXPECT_THAT(config({}).server.data_dir.value_or(""), Not(IsEmpty()));
  EXPECT_EQ(config({"--data-dir", "/var/cloth"}).server.data_dir, "/var/cloth");
  EXPECT_EQ(config({"--data-dir", "none"}).server.data_dir, std::nullopt);
  EXPECT_THAT(refusal({"--data-dir", ""}), HasSubstr("data_dir is empty"));
  EXPECT_THAT(refusal({"--metrics", "9464"}), HasSubstr("metrics is \"9464\", not an address"));
}

TEST(Config, SharesADatabaseUnderANameThatALoadBalancerCanSpell) {
  EXPECT_EQ(config({}).server.database, std::nullopt);
  EXPECT_EQ(config({"--database", "host=db"}).server.database, "host=db");
  EXPECT_EQ(config({"--database", "none"}).server.database, std::nullopt);
  EXPECT_EQ(config({"--replica", "weftd-1"}).server.replica, "weftd-1");
  EXPECT_THAT(refusal({"--replica", "Cloth 1"}), HasSubstr("replica is \"Cloth 1\", not 1 to 63"));
  EXPECT_EQ(config({}).server.idle, std::chrono::hours(1));
  EXPECT_EQ(config({"--asset-ttl-s", "60"}).server.asset_ttl, std::chrono::minutes(1));
  EXPECT_THAT(refusal({"--idle-s", "-1"}), HasSubstr("--idle-s is -1, not within 0 to"));
}

TEST(Config, HelpsWithEveryFlag) {
  const std::string help = refusal({"--help"});
  for (const char* flag : {"--host",
                           "--port",
                           "--config",
                           "--data-dir",
                           "--database",
                           "--replica",
                           "--idle-s",
                           "--insecure",
                           "--until-eof",
                           "--workers",
                           "--max-sessions",
                           "--max-particles",
                           "--max-streams",
                           "--tls-cert",
                           "--tls-key",
                           "--tls-client-ca",
                           "--tokens",
                           "--max-sessions-per-principal",
                           "--max-particles-per-principal",
                           "--max-total-particles",
                           "--max-streams-per-principal",
                           "--max-tests",
                           "--max-asset-bytes",
                           "--max-asset-bytes-per-principal",
                           "--max-total-asset-bytes",
                           "--asset-ttl-s",
                           "--history-bytes",
                           "--max-total-history-bytes",
                           "--log-level"}) {
    EXPECT_THAT(help, HasSubstr(flag));
  }
}

}  // namespace
}  // namespace weft::testing
