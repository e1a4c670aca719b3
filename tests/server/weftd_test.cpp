#include <fcntl.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/service/process.h"
#include "tests/support/service/service.h"
#include "tests/support/temporary_directory.h"

namespace weft::testing {
namespace {

// weftd as a process of its own.
class Weftd {
 public:
  explicit Weftd(const std::string& port = "0") {
    int ends[2];
    EXPECT_EQ(pipe2(ends, O_CLOEXEC), 0);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    std::string program = std::string(WEFT_BIN_DIR) + "/weftd", flag = "--port=" + port;
    std::string keep = "--data-dir=none";
    char* arguments[] = {program.data(), flag.data(), keep.data(), nullptr};
    EXPECT_EQ(posix_spawn(&process_, program.c_str(), &actions, nullptr, arguments, environ), 0);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    for (char c = 0; read(ends[0], &c, 1) == 1 && c != '\n';) line_ += c;
    close(ends[0]);
  }
  ~Weftd() {
    if (process_ > 0) end(SIGKILL);
  }

  // Its first line.
  const std::string& line() const { return line_; }
  std::string address() const { return line_.substr(line_.rfind(' ') + 1); }
  std::string port() const { return line_.substr(line_.rfind(':') + 1); }

  // The exit code; nullopt where a signal ended it.
  std::optional<int> end(int signal) {
    kill(process_, signal);
    return wait();
  }
  std::optional<int> wait() {
    int status = 0;
    waitpid(process_, &status, 0);
    process_ = 0;
    return WIFEXITED(status) ? std::optional(WEXITSTATUS(status)) : std::nullopt;
  }

 private:
  pid_t process_ = 0;
  std::string line_;
};

TEST(Weftd, ServesOnAFreePortThatItPrintsAndEndsCleanly) {
  for (const int signal : {SIGTERM, SIGINT}) {
    Weftd weftd;
    ASSERT_THAT(weftd.line(), ::testing::StartsWith("weftd listening on 127.0.0.1:"));
    const auto channel = grpc::CreateChannel(weftd.address(), grpc::InsecureChannelCredentials());
    grpc::ClientContext context;
    context.set_wait_for_ready(true);
    v1::ServerInfo info;
    EXPECT_TRUE(v1::ServerService::NewStub(channel)->GetServerInfo(&context, {}, &info).ok());
    EXPECT_EQ(weftd.end(signal), 0);
  }
}

// What systemd hears of a process, and tells it by its environment.
class Notified {
 public:
  Notified() {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    directory_.path("notify").copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  ~Notified() { close(socket_); }

  std::vector<std::string> environment() const {
    return {"NOTIFY_SOCKET=" + directory_.path("notify"), "WATCHDOG_USEC=100000"};
  }
  std::string hear() const {
    char text[100];
    const ssize_t size = recv(socket_, text, sizeof text, 0);
    return {text, size > 0 ? static_cast<std::size_t>(size) : 0};
  }

 private:
  TemporaryDirectory directory_;
  const int socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

TEST(Weftd, TellsSystemdThatItServesThatItAnswersAndThatItEnds) {
  const Notified systemd;
  const TemporaryDirectory directory;
  Process weftd("weftd", {"--port=0", "--data-dir=none"}, directory.path("output"), 0,
                systemd.environment());
  EXPECT_EQ(systemd.hear(), "READY=1");
  for (int turn = 0; turn < 3; ++turn) EXPECT_EQ(systemd.hear(), "WATCHDOG=1");
  weftd.signal(SIGTERM);
  std::string heard = systemd.hear();
  while (heard == "WATCHDOG=1") heard = systemd.hear();
  EXPECT_EQ(heard, "STOPPING=1");
  EXPECT_EQ(weftd.wait(), 0);
}

TEST(Weftd, EndsStreamsWithAReasonWhenItIsTerminated) {
  Weftd weftd;
  const auto channel = grpc::CreateChannel(weftd.address(), grpc::InsecureChannelCredentials());
  const auto sessions = v1::SessionService::NewStub(channel);
  v1::CreateSessionRequest create;
  *create.mutable_session()->mutable_scene() = small_scene();
  grpc::ClientContext create_context, run_context, stream_context;
  v1::Session session;
  ASSERT_TRUE(sessions->CreateSession(&create_context, create, &session).ok());
  const auto reader =
      v1::FrameService::NewStub(channel)->StreamFrames(&stream_context, frames_of(session));
  v1::RunSessionRequest run;
  run.set_name(session.name());
  v1::RunSessionResponse running;
  ASSERT_TRUE(sessions->RunSession(&run_context, run, &running).ok());
  v1::StreamFramesResponse message;
  while (reader->Read(&message) && message.frame().number() < 5) {
  }
  // read on meanwhile, as clients do: what lies unread when a connection breaks is lost
  const std::jthread ending([&] { EXPECT_EQ(weftd.end(SIGTERM), 0); });
  while (reader->Read(&message)) {
  }
  const Error error(reader->Finish());
  EXPECT_EQ(error.code, grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(error.reason(), "SERVER_DRAINING") << error.message;
}

TEST(Weftd, SaysSoWhenThePortIsTaken) {
  const Weftd first;
  Weftd second(first.port());
  EXPECT_EQ(second.line(), "");
  EXPECT_EQ(second.wait(), 1);
}

}  // namespace
}  // namespace weft::testing
