#include <chrono>
#include <filesystem>
#include <fstream>

#include "tests/support/certificates.h"
#include "tests/support/service/process.h"
#include "tests/support/service/service.h"
#include "tests/support/temporary_directory.h"

namespace weft::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// Servers with certificates of `ours`, and clients with any.
class TlsTest : public ::testing::Test {
 protected:
  TlsTest() {
    options_.host = "127.0.0.1";
    options_.tls = ServerTls{server_.certificate, server_.key, {}};
  }
  std::string path(const std::string& name) const { return directory_.path(name); }
  void start() { service_.emplace(options_); }
  void start_mutual() {
    options_.tls->client_ca = ours_.certificate();
    start();
  }

  // A channel of somebody who trusts what `ca` signed.
  std::shared_ptr<grpc::Channel> channel(const std::string& ca,
                                         const CertificateFiles& own = {}) const {
    grpc::SslCredentialsOptions ssl;
    ssl.pem_root_certs = text_of(ca);
    if (!own.key.empty()) {
      ssl.pem_cert_chain = text_of(own.certificate);
      ssl.pem_private_key = text_of(own.key);
    }
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return grpc::CreateCustomChannel(service_->server.address(), grpc::SslCredentials(ssl),
                                     arguments);
  }
  static Error info(const std::shared_ptr<grpc::Channel>& channel, const std::string& token = {}) {
    grpc::ClientContext context;
    if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
    v1::ServerInfo info;
    return Error(v1::ServerService::NewStub(channel)->GetServerInfo(&context, {}, &info));
  }

  const TemporaryDirectory directory_;
  const CertificateAuthority ours_{path("ours")}, theirs_{path("theirs")};
  const CertificateFiles server_ = ours_.sign(path("server"), "weftd");
  const CertificateFiles ann_ = ours_.sign(path("ann"), "ann");
  ServerOptions options_ = Service::in_process();
  std::optional<Service> service_;
};

TEST_F(TlsTest, EncryptsForWhoeverTrustsItsCertificate) {
  start();
  EXPECT_EQ(info(channel(ours_.certificate())).code, grpc::StatusCode::OK);
  EXPECT_EQ(info(channel(theirs_.certificate())).code, grpc::StatusCode::UNAVAILABLE);
  const auto plain =
      grpc::CreateChannel(service_->server.address(), grpc::InsecureChannelCredentials());
  EXPECT_EQ(info(plain).code, grpc::StatusCode::UNAVAILABLE);
}

TEST_F(TlsTest, WantsACertificateThatItsAuthoritySignedAndThatIsValid) {
  start_mutual();
  EXPECT_EQ(info(channel(ours_.certificate(), ann_)).code, grpc::StatusCode::OK);
  for (const auto& [why, own] :
       {std::pair("none", CertificateFiles{}),
        std::pair("of another authority", theirs_.sign(path("mallory"), "ann")),
        std::pair("expired", ours_.sign(path("old"), "ann", -1))}) {
    EXPECT_EQ(info(channel(ours_.certificate(), own)).code, grpc::StatusCode::UNAVAILABLE) << why;
  }
}

TEST_F(TlsTest, ACertificateNamesThePrincipalAndATokenGoesBeforeIt) {
  // of the token "b1"
  std::ofstream(path("tokens"))
      << "bob 7dc96f776c8423e57a2785489a3f9c43fb6e756876d6ad9a9cac4aa4e72ec193\n";
  options_.tokens = path("tokens");
  start_mutual();
  const auto create = [&](const std::string& token) {
    grpc::ClientContext context;
    if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
    v1::CreateSessionRequest request;
    *request.mutable_session()->mutable_scene() = small_scene();
    v1::Session session;
    const auto stub = v1::SessionService::NewStub(channel(ours_.certificate(), ann_));
    EXPECT_TRUE(stub->CreateSession(&context, request, &session).ok());
    return session;
  };
  const v1::Session hers = create("");
  EXPECT_EQ(hers.owner(), "ann");
  EXPECT_EQ(create("b1").owner(), "bob");
  EXPECT_EQ(info(channel(ours_.certificate(), ann_), "b2").reason(), "TOKEN_UNKNOWN");

  grpc::ClientContext context;
  v1::GetSessionRequest request;
  request.set_name(hers.name());
  v1::Session session;
  const auto bob = channel(ours_.certificate(), ours_.sign(path("bob"), "bob"));
  EXPECT_EQ(v1::SessionService::NewStub(bob)->GetSession(&context, request, &session).error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
}

TEST_F(TlsTest, TakesNewFilesWithoutARestart) {
  start();
  ASSERT_EQ(info(channel(ours_.certificate())).code, grpc::StatusCode::OK);
  const auto next = theirs_.sign(path("next"), "weftd");
  std::filesystem::rename(next.key, server_.key);
  std::filesystem::rename(next.certificate, server_.certificate);
  EXPECT_TRUE(
      channel(theirs_.certificate())->WaitForConnected(std::chrono::system_clock::now() + 60s));
}

TEST_F(TlsTest, NamesTheFileThatItCannotUse) {
  std::ofstream(path("junk")) << "junk\n";
  const auto refusal = [&](const ServerTls& tls) {
    options_.tls = tls;
    try {
      start();
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(refusal({path("nowhere"), server_.key, {}}),
              HasSubstr("cannot read " + path("nowhere") + ": No such file"));
  EXPECT_THAT(refusal({path("junk"), server_.key, {}}),
              HasSubstr(path("junk") + " has no certificate"));
  EXPECT_THAT(refusal({server_.certificate, path("junk"), {}}),
              HasSubstr(path("junk") + " has no key"));
  EXPECT_THAT(
      refusal({server_.certificate, ann_.key, {}}),
      AllOf(HasSubstr(ann_.key), HasSubstr("does not belong"), HasSubstr(server_.certificate)));
  EXPECT_THAT(refusal({server_.certificate, server_.key, path("junk")}), HasSubstr(path("junk")));
}

TEST_F(TlsTest, NeitherLogsNorMetricsHaveATokenAndOpenKeysAreWarnedOf) {
  const std::string good = "the-good-token", bad = "the-bad-token", log = path("log");
  std::ofstream(path("tokens"))
      << "ann 4714902b073faff760700e2e0e3db68f8a3cb46dbd231ea4cfc7d9010d90d360\n";
  std::filesystem::permissions(server_.key, std::filesystem::perms(0644));
  Process weftd("weftd",
                {"--port", "0", "--data-dir", path("data"), "--metrics", "127.0.0.1:0",
                 "--log-level", "trace", "--tokens", path("tokens"), "--tls-cert",
                 server_.certificate, "--tls-key", server_.key},
                log);
  const auto logged = [&](const std::string& before) {
    for (;;) {
      const std::string text = text_of(log);
      const std::size_t at = text.find(before), end = text.find('\n', at);
      if (end == std::string::npos || at == std::string::npos) continue;
      return text.substr(at + before.size(), end - at - before.size());
    }
  };
  const std::string address = logged("listening on "), metrics = logged("metrics at http://");
  grpc::SslCredentialsOptions ssl;
  ssl.pem_root_certs = text_of(ours_.certificate());
  const auto to_it = grpc::CreateChannel(address, grpc::SslCredentials(ssl));
  EXPECT_EQ(info(to_it, good).code, grpc::StatusCode::OK);
  EXPECT_EQ(info(to_it, bad).reason(), "TOKEN_UNKNOWN");
  const std::string shown = metrics_at(metrics.substr(0, metrics.find('/')));
  EXPECT_THAT(shown, AllOf(HasSubstr("weft_streams"), Not(HasSubstr(good)), Not(HasSubstr(bad))));
  weftd.signal(SIGTERM);
  EXPECT_EQ(weftd.wait(), 0);
  EXPECT_THAT(text_of(log), AllOf(Not(HasSubstr(good)), Not(HasSubstr(bad)),
                                  HasSubstr(server_.key + " can be read by others")));
}

}  // namespace
}  // namespace weft::testing
