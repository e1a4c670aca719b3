#include <gmock/gmock.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <random>
#include <thread>

#include "client/recording/reader.h"
#include "tests/client/breaking_proxy.h"
#include "tests/client/client_test.h"

namespace weft::testing {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

class DamagedConnections : public ClientTest {
 protected:
  // What clients send that create a session, step it, watch it and delete it.
  std::vector<std::string> conversations() {
    std::vector<std::string> bytes;
    for (const std::vector<std::string>& words :
         {std::vector<std::string>{"session", "create", scene_file(small_scene()), "--id", "other"},
          {"step", "other", "--frames", "3"},
          {"watch", "other", "--to", "3"},
          {"session", "delete", "other"}}) {
      const BreakingProxy proxy(address_);
      std::vector<std::string> arguments = words;
      arguments.insert(arguments.end(), {"--server", proxy.address()});
      const Outcome outcome = run_weft(arguments);
      EXPECT_EQ(outcome.exit, 0) << outcome.err;
      bytes.push_back(proxy.asked());
    }
    return bytes;
  }

  // Sends the bytes; the server may hang up before it has them all.
  tcp::socket send(const std::string& bytes) {
    const std::size_t colon = address_.rfind(':');
    tcp::socket socket(io_);
    asio::connect(
        socket, tcp::resolver(io_).resolve(address_.substr(0, colon), address_.substr(colon + 1)));
    boost::system::error_code gone;
    asio::write(socket, asio::buffer(bytes), gone);
    return socket;
  }

 private:
  asio::io_context io_;
};

TEST_F(DamagedConnections, LeaveTheServerServingAndOthersWithEveryFrame) {
  constexpr int kConnections = 300;
  const std::vector<std::string> sound = conversations();
  const v1::Session session = service_.create(small_scene(), "cloth");
  const std::string file = path("cloth.weft");
  Outcome recorded;
  std::thread recorder([&] {
    recorded = weft({"record", "cloth", "--from", "0", "--to", std::to_string(kConnections), "-o",
                     file, "--json"});
  });
  std::mt19937 random(11);
  std::vector<tcp::socket> open;
  for (int i = 0; i < kConnections; ++i) {
    tcp::socket socket = send(damaged(sound[random() % sound.size()], random));
    boost::system::error_code gone;
    if (i % 3 == 0) socket.shutdown(tcp::socket::shutdown_send, gone);
    if (i % 3 != 1) open.push_back(std::move(socket));
    service_.step(session);
  }
  for (const char* other : {"", "GET / HTTP/1.1\r\nHost: weft\r\n\r\n", "\x16\x03\x01\x02"})
    open.push_back(send(other));
  recorder.join();

  EXPECT_EQ(raw_call(service_, "/grpc.health.v1.Health/Check", "").first, "\x08\x01");
  EXPECT_EQ(ask({"session", "get", "cloth"})["frame"], kConnections);
  ASSERT_EQ(recorded.exit, 0) << recorded.err;
  EXPECT_EQ(recorded.json()["reconnections"], 0);
  client::RecordingReader reader(file);
  for (const v1::Frame& wanted : stream("sessions/cloth", 0, kConnections))
    ASSERT_EQ(reader.read(wanted.number()).SerializeAsString(), wanted.SerializeAsString());
}

}  // namespace
}  // namespace weft::testing
