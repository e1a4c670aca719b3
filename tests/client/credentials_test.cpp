#include <filesystem>

#include "tests/client/client_test.h"
#include "tests/support/certificates.h"

namespace weft::testing {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// A server with TLS and a token of ann's, and one of somebody whom it does not know.
class CredentialsTest : public ::testing::Test {
 protected:
  CredentialsTest() {
    write_file(path("tokens"), make_token("ann"));
    make_token("mallory");
    const auto own = ours_.sign(path("server"), "weftd");
    ServerOptions options;
    options.tls = ServerTls{own.certificate, own.key, {}};
    options.tokens = path("tokens");
    service_.emplace(options);
  }

  std::string path(const std::string& name) const { return directory_.path(name); }
  // Its token is in NAME.token.
  std::string make_token(const std::string& name) const {
    const Outcome made = run_weft({"token", name, "-o", path(name + ".token")});
    EXPECT_EQ(made.exit, 0) << made.err;
    return made.out;
  }
  Outcome weft(std::vector<std::string> arguments, const std::string& ca, const std::string& name) {
    arguments.insert(arguments.end(), {"--server", service_->server.address()});
    if (!ca.empty()) arguments.insert(arguments.end(), {"--tls-ca", ca});
    if (!name.empty()) arguments.insert(arguments.end(), {"--token-file", path(name + ".token")});
    return run_weft(std::move(arguments));
  }

  const TemporaryDirectory directory_;
  const CertificateAuthority ours_{path("ours")}, theirs_{path("theirs")};
  std::optional<Service> service_;
};

TEST_F(CredentialsTest, LetCommandsAndStreamsIn) {
  const std::string scene = path("scene.json"), recording = path("sheet.weft");
  run_weft({"scene", "new", "--template", "hang", "--rows", "4", "--columns", "4", "-o", scene});
  const Outcome created =
      weft({"session", "create", scene, "--id", "sheet"}, ours_.certificate(), "ann");
  EXPECT_EQ(created.exit, 0) << created.err;
  EXPECT_THAT(weft({"session", "get", "sheet"}, ours_.certificate(), "ann").out,
              HasSubstr("owner           ann\n"));
  const Outcome recorded =
      weft({"record", "sheet", "--run", "--to", "20", "-o", recording}, ours_.certificate(), "ann");
  EXPECT_EQ(recorded.exit, 0) << recorded.err;
  EXPECT_THAT(recorded.out, HasSubstr("21 frames"));
  const Outcome loaded = weft({"load", "--scene", scene, "--sessions", "2", "--subscribers", "2",
                               "--ramp", "0", "--duration", "0.2"},
                              ours_.certificate(), "ann");
  EXPECT_EQ(loaded.exit, 0) << loaded.err;
}

TEST_F(CredentialsTest, ThatAreWrongAreSaidToBe) {
  const std::vector<std::string> list = {"session", "list"};
  const Outcome unknown = weft(list, ours_.certificate(), "mallory");
  EXPECT_EQ(unknown.exit, 1);
  EXPECT_EQ(unknown.err,
            "weft: the server does not know this token; weftd --tokens has those it knows\n");
  const Outcome none = weft(list, ours_.certificate(), "");
  EXPECT_EQ(none.exit, 1);
  EXPECT_THAT(none.err, HasSubstr("the call has no token"));
  EXPECT_EQ(weft({"health"}, ours_.certificate(), "").exit, 0) << "it needs none";

  const Outcome stranger = weft(list, theirs_.certificate(), "ann");
  EXPECT_EQ(stranger.exit, 3);
  EXPECT_THAT(stranger.err, HasSubstr("its certificate is not signed by --tls-ca"));
  const Outcome plain = weft(list, "", "ann");
  EXPECT_EQ(plain.exit, 3);
  EXPECT_THAT(plain.err, HasSubstr("does the server want TLS? give --tls-ca"));
}

TEST_F(CredentialsTest, ThatCannotBeUsedAreNamed) {
  write_file(path("junk"), "no token\n");
  const auto refused = [&](std::vector<std::string> arguments, int exit) {
    arguments.insert(arguments.begin(), {"session", "list"});
    const Outcome outcome = run_weft(std::move(arguments));
    EXPECT_EQ(outcome.exit, exit);
    return outcome.err;
  };
  EXPECT_THAT(refused({"--token-file", path("nowhere")}, 4),
              HasSubstr("cannot read " + path("nowhere")));
  EXPECT_THAT(refused({"--token-file", path("junk")}, 4),
              HasSubstr(path("junk") + ": is no token"));
  EXPECT_THAT(refused({"--tls-ca", path("junk")}, 4),
              HasSubstr(path("junk") + " has no certificate"));
  EXPECT_THAT(refused({"--tls-ca", ours_.certificate(), "--tls-cert", "c"}, 2),
              HasSubstr("--tls-cert and --tls-key go together"));
  EXPECT_THAT(refused({"--server", "192.0.2.1:7311", "--token-file", path("ann.token")}, 2),
              HasSubstr("would leave this machine unencrypted for 192.0.2.1:7311; give --tls-ca"));
}

TEST_F(CredentialsTest, OfATokenAreWrittenOnceAndForItsOwnerAlone) {
  const std::string file = path("new.token");
  const Outcome made = run_weft({"token", "new", "--admin", "-o", file});
  EXPECT_THAT(made.out, AllOf(StartsWith("new "), EndsWith(" admin\n")));
  EXPECT_THAT(made.out, Not(HasSubstr(read_file(file).substr(0, 64))));
  EXPECT_EQ(std::filesystem::status(file).permissions(), std::filesystem::perms(0600));
  const Outcome again = run_weft({"token", "new", "-o", file});
  EXPECT_EQ(again.exit, 4);
  EXPECT_THAT(again.err, HasSubstr(file));
  EXPECT_EQ(run_weft({"token", "two words", "-o", path("two.token")}).exit, 2);
}

}  // namespace
}  // namespace weft::testing
