#include <gmock/gmock.h>
#include <signal.h>

#include <boost/asio.hpp>
#include <boost/beast.hpp>
#include <cstring>
#include <filesystem>
#include <thread>

#include "client/recording/reader.h"
#include "client/serve/live_server.h"
#include "tests/client/client_test.h"
#include "tests/client/fake_fleet.h"
#include "tests/support/service/process.h"

namespace weft::testing {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using Json = nlohmann::json;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

using Request = http::request<http::string_body>;
using Response = http::response<http::string_body>;

constexpr const char* kSessions = "/weft.v1.SessionService/";
constexpr const char* kView = "/weft.v1.FrameService/ViewFrames";
constexpr const char* kInteract = "/weft.v1.SessionService/Interact";

// A WebSocket of the page.
class WebSocket {
 public:
  WebSocket(tcp::socket socket, const std::string& host, const std::string& path,
            const std::string& origin = {})
      : stream_(std::move(socket)) {
    stream_.set_option(websocket::stream_base::decorator([origin](websocket::request_type& asked) {
      if (!origin.empty()) asked.set(http::field::origin, origin);
    }));
    stream_.handshake(host, path, error_);
  }

  std::string ask(const std::string& said) {
    stream_.write(asio::buffer(said), error_);
    beast::flat_buffer buffer;
    stream_.read(buffer, error_);
    return beast::buffers_to_string(buffer.data());
  }
  bool is_open() const { return !error_; }
  // Ends as when a browser is killed.
  void die() { stream_.next_layer().close(); }

 private:
  websocket::stream<tcp::socket> stream_;
  boost::system::error_code error_;
};

// The page's server before a server with one session of 4 x 5 particles.
class ServeTest : public ClientTest {
 protected:
  tcp::socket connect() { return connect(served_); }
  tcp::socket connect(const client::LiveServer& served) {
    tcp::socket socket(context_);
    const std::size_t colon = served.address().rfind(':');
    const auto port = static_cast<std::uint16_t>(std::stoi(served.address().substr(colon + 1)));
    socket.connect({asio::ip::make_address("127.0.0.1"), port});
    return socket;
  }

  Response send(Request request) {
    tcp::socket socket = connect();
    if (request[http::field::host].empty()) request.set(http::field::host, served_.address());
    request.prepare_payload();
    http::write(socket, request);
    beast::flat_buffer buffer;
    Response response;
    http::read(socket, buffer, response);
    return response;
  }
  Response get(const std::string& path, const std::string& host = {}) {
    Request request(http::verb::get, path, 11);
    if (!host.empty()) request.set(http::field::host, host);
    return send(request);
  }
  Response post(const std::string& path, const std::string& body, const std::string& origin = {}) {
    Request request(http::verb::post, path, 11, body);
    if (!origin.empty()) request.set(http::field::origin, origin);
    return send(request);
  }
  Json call(const std::string& path, const Json& body) {
    const Response response = post(path, body.dump());
    EXPECT_EQ(response.result_int(), 200) << response.body();
    return Json::parse(response.body());
  }
  WebSocket stream(const std::string& path, const std::string& origin = {}) {
    return {connect(), served_.address(), path, origin};
  }

  const v1::Session session_ = service_.create(small_scene(), "drape");
  std::unique_ptr<client::Connection> connection_ = client::Connection::to(address_, {});
  client::LiveServer served_{*connection_, {.recordings = path("")}};
  asio::io_context context_;
};

// The JSON of a binary message, whose length comes first.
Json facts_of(const std::string& message) {
  std::uint32_t length = 0;
  std::memcpy(&length, message.data(), sizeof length);
  return Json::parse(message.substr(sizeof length, length));
}

TEST_F(ServeTest, ThePageIsOneFileThatAsksItsServerAlone) {
  const Response page = get("/");
  EXPECT_EQ(page.result_int(), 200);
  const std::string policy(page["Content-Security-Policy"]);
  EXPECT_THAT(policy, AllOf(HasSubstr("default-src 'none'"), HasSubstr("connect-src 'self'")));
  EXPECT_THAT(page.body(), AllOf(Not(HasSubstr("<link")), Not(HasSubstr("<script src")),
                                 Not(HasSubstr("@stage_html@")), HasSubstr("OrbitControls")));
}

TEST_F(ServeTest, MethodsAreCalledByTheirPaths) {
  const Json all = call("/weft.v1.SessionService/ListSessions", Json::object());
  ASSERT_EQ(all["sessions"].size(), 1);
  EXPECT_EQ(all["sessions"][0]["name"], "sessions/drape");
  EXPECT_FALSE(all["sessions"][0].contains("scene"));
  EXPECT_EQ(call(std::string(kSessions) + "StepSession",
                 {{"name", "sessions/drape"}, {"frames", 3}})["frame"],
            3);
  EXPECT_EQ(call(std::string(kSessions) + "GetSession", {{"name", "sessions/drape"}})["frame"], 3);
}

TEST_F(ServeTest, OneFieldOfATextileIsChangedByItsPath) {
  const Json answer =
      call(std::string(kSessions) + "UpdateTextile", {{"name", "sessions/drape"},
                                                      {"textile", {{"raw", {{"bend_n_m2", 3e-5}}}}},
                                                      {"update_mask", "raw.bend_n_m2"}});
  EXPECT_EQ(answer["applied_frame"], 1);
  EXPECT_EQ(answer["textile"]["raw"]["bend_n_m2"], 3e-5);
  EXPECT_EQ(service_.get(session_).scene().sheets(0).textile().raw().bend_n_m2(), 3e-5);
}

TEST_F(ServeTest, AnErrorIsTheServersOwn) {
  const Response missing =
      post(std::string(kSessions) + "GetSession", R"({"name": "sessions/none"})");
  EXPECT_EQ(missing.result_int(), 404);
  EXPECT_THAT(missing.body(), HasSubstr("there is no session sessions/none"));
  const Response bad = post(std::string(kSessions) + "RunSession",
                            R"({"name": "sessions/drape", "time_scale": -1})");
  EXPECT_EQ(bad.result_int(), 400);
  EXPECT_EQ(Json::parse(bad.body())["error"]["violations"][0]["field"], "time_scale");
  EXPECT_EQ(post(std::string(kSessions) + "RunSession", "{").result_int(), 400);
  EXPECT_EQ(post(std::string(kSessions) + "DeleteSession", "{}").result_int(), 404);
  EXPECT_EQ(get(std::string(kSessions) + "ListSessions").result_int(), 405);
}

TEST_F(ServeTest, AServerThatIsGoneIsSaidToBe) {
  const auto nowhere = client::Connection::to("127.0.0.1:1", {});
  const client::LiveServer served(*nowhere, {});
  tcp::socket socket = connect(served);
  Request request(http::verb::post, std::string(kSessions) + "ListSessions", 11, "{}");
  request.set(http::field::host, served.address());
  request.prepare_payload();
  http::write(socket, request);
  beast::flat_buffer buffer;
  Response response;
  http::read(socket, buffer, response);
  EXPECT_EQ(response.result_int(), 503);
  EXPECT_THAT(response.body(), HasSubstr("no connection to 127.0.0.1:1"));
}

TEST_F(ServeTest, OnlyItsOwnPagesMayAsk) {
  const std::string port = served_.address().substr(served_.address().rfind(':'));
  for (const std::string host : {"localhost", "127.0.0.1", "[::1]"})
    EXPECT_EQ(get("/", host + port).result_int(), 200) << host;
  for (const std::string host :
       {"weft.example", "127.0.0.1.weft.example", "localhost.", "[::1", "::1"})
    EXPECT_EQ(get("/", host + port).result_int(), 403) << host;

  const std::string list = std::string(kSessions) + "ListSessions";
  EXPECT_EQ(post(list, "{}", "http://" + served_.address()).result_int(), 200);
  for (const std::string origin : {"http://weft.example", "null", "http://127.0.0.1:1"}) {
    EXPECT_EQ(post(list, "{}", origin).result_int(), 403) << origin;
    EXPECT_FALSE(stream(kView, origin).is_open()) << origin;
  }
  EXPECT_TRUE(stream(kView, "http://" + served_.address()).is_open());
}

TEST_F(ServeTest, AViewGoesOnAtAnotherServer) {
  const FakeFleet fleet({stream_removed(), wrong_replica("weftd-2")});
  const auto connection = client::Connection::to(fleet.address(), {});
  client::LiveServer served(*connection, {});
  WebSocket view(connect(served), served.address(), kView);
  std::vector<std::int64_t> frames;
  std::string said = R"({"session": "sessions/cloth", "uid": "uid-1", "credits": 1})";
  for (int answer = 0; answer < 6; ++answer) {
    const std::string message = view.ask(said);
    ASSERT_TRUE(view.is_open()) << message;
    const bool is_header = message.starts_with('{');
    if (!is_header) frames.push_back(facts_of(message)["frame"]["number"]);
    said = is_header ? "" : R"({"credits": 1})";
  }
  EXPECT_THAT(frames, ElementsAre(0, 1, 2));
  EXPECT_THAT(fleet.attempts(),
              ElementsAre(Attempt{.session = "cloth", .uid = "uid-1"},
                          Attempt{.session = "cloth", .uid = "uid-1"},
                          Attempt{.session = "cloth", .replica = "weftd-2", .uid = "uid-1"}));
}

TEST_F(ServeTest, RequestsAndMessagesAreBounded) {
  EXPECT_EQ(post(std::string(kSessions) + "ListSessions", std::string(65'537, ' ')).result_int(),
            413);
  Request request(http::verb::get, "/", 11);
  request.set("Long", std::string(20'000, 'x'));
  EXPECT_EQ(send(request).result_int(), 431);
  WebSocket view = stream(kView);
  view.ask(std::string(65'537, ' '));
  EXPECT_FALSE(view.is_open());
}

TEST_F(ServeTest, OfTooManyConnectionsTheLastAreClosed) {
  std::vector<tcp::socket> sockets;
  for (int i = 0; i < 64; ++i) sockets.push_back(connect());
  tcp::socket last = connect();
  char byte = 0;
  boost::system::error_code error;
  last.read_some(asio::buffer(&byte, 1), error);
  EXPECT_TRUE(error);

  sockets.clear();
  for (;;) {  // the server hears of it in its own time
    tcp::socket socket = connect();
    Request again(http::verb::get, "/", 11);
    again.set(http::field::host, served_.address());
    http::write(socket, again, error);
    beast::flat_buffer buffer;
    Response response;
    if (!error) http::read(socket, buffer, response, error);
    if (!error && response.result_int() == 200) break;
  }
}

TEST_F(ServeTest, AViewerSeesTheNewestFrameForEachCreditAndNothingQueues) {
  WebSocket view = stream(kView);
  const Json header = Json::parse(view.ask(R"({"session": "sessions/drape", "credits": 1})"));
  EXPECT_EQ(header["header"]["sheets"][0]["rows"], 4);
  EXPECT_EQ(facts_of(view.ask(""))["frame"]["number"], 0);

  service_.step(session_, 50);
  const std::string message = view.ask(R"({"credits": 1})");
  const Json facts = facts_of(message);
  EXPECT_EQ(facts["frame"]["number"], 50);
  EXPECT_EQ(facts["skipped_count"], 49);
  const v1::Frame frame = ClientTest::stream("sessions/drape", 50, 50).front();
  EXPECT_EQ(message.substr(message.size() - frame.positions_m().size()), frame.positions_m());
  EXPECT_EQ((message.size() - frame.positions_m().size()) % 4, 0);
}

TEST_F(ServeTest, AStreamThatFailsSaysWhyAndEnds) {
  WebSocket view = stream(kView);
  EXPECT_THAT(view.ask(R"({"session": "sessions/none", "credits": 1})"),
              HasSubstr("there is no session sessions/none"));
  view.ask("");
  EXPECT_FALSE(view.is_open());
  EXPECT_THAT(stream(kView).ask("{"), HasSubstr("USAGE"));
  EXPECT_FALSE(stream("/weft.v1.FrameService/StreamFrames").is_open());
}

TEST_F(ServeTest, AHandLeadsAParticleAndLetsGoWhenItsBrowserDies) {
  WebSocket hand = stream(kInteract);
  const auto act = [&](int sequence, const Json& action) {
    return Json::parse(hand.ask(
        Json{{"session", "sessions/drape"}, {"sequence", sequence}, {"action", action}}.dump()));
  };
  EXPECT_EQ(act(1, {{"grab", {{"particle", 19}}}})["applied_frame"], 1);
  act(2, {{"drag", {{"particle", 19}, {"target_m", {{"x", 0.1}, {"y", 0.05}, {"z", 0.2}}}}}});
  service_.step(session_, 20);
  const v1::Frame frame = ClientTest::stream("sessions/drape", 20, 20).front();
  float y = 0;
  std::memcpy(&y, frame.positions_m().data() + sizeof(float) * (20 + 19), sizeof y);
  EXPECT_FLOAT_EQ(y, 0.05F);

  v1::ApplyActionsRequest grab;
  grab.set_name(session_.name());
  grab.add_actions()->mutable_grab()->set_particle(19);
  EXPECT_EQ(service_.error(&Service::Sessions::ApplyActions, grab).code,
            grpc::StatusCode::INVALID_ARGUMENT);
  hand.die();
  while (service_.error(&Service::Sessions::ApplyActions, grab).code != grpc::StatusCode::OK)
    std::this_thread::yield();
}

TEST_F(ServeTest, ARecordingGoesOnThroughPausesUntilItIsStopped) {
  const Json name{{"session", "sessions/drape"}};
  const std::string file = call("/recordings/start", name)["file"];
  EXPECT_THAT(file, AllOf(HasSubstr("drape-"), HasSubstr(".weft")));
  EXPECT_THAT(post("/recordings/start", name.dump()).body(),
              HasSubstr("is being recorded already"));
  const auto frames = [&] {
    return call("/recordings/list", Json::object())["recordings"][0]["frames"].get<int>();
  };
  while (frames() < 1) std::this_thread::yield();
  for (const int last : {10, 20}) {
    service_.step(session_, 10);
    while (frames() < last + 1) std::this_thread::yield();
  }
  const Json ended = call("/recordings/stop", name);
  EXPECT_EQ(ended["state"], "done");
  EXPECT_EQ(ended["frames"], 21);
  client::RecordingReader recording(file);
  EXPECT_EQ(recording.last_frame(), 20);
  EXPECT_EQ(recording.read(20).positions_m(),
            ClientTest::stream("sessions/drape", 20, 20)[0].positions_m());
  EXPECT_THAT(post("/recordings/stop", name.dump()).body(), HasSubstr("is not being recorded"));
  EXPECT_NE(call("/recordings/start", name)["file"], file);
}

TEST_F(ServeTest, ARecordingThatFailsSaysWhy) {
  call("/recordings/start", {{"session", "sessions/none"}});
  Json listed;
  do {
    listed = call("/recordings/list", Json::object())["recordings"][0];
  } while (listed["state"] == "recording");
  EXPECT_EQ(listed["state"], "failed");
  EXPECT_EQ(listed["message"],
            "there is no session sessions/none; ListSessions (weft session list) names them all");
  EXPECT_EQ(post("/recordings/start", R"({"session": "sessions/../up"})").result_int(), 400);
  EXPECT_EQ(post("/recordings/start", "{}").result_int(), 400);
}

// What the program wrote so far, once it has a line.
std::string first_line(const std::string& path) {
  std::string text;
  while (text.find('\n') == std::string::npos) {
    text = read_file(path);
    std::this_thread::yield();
  }
  return text;
}

TEST_F(ServeTest, TheCommandServesUntilItIsInterrupted) {
  const std::string scene = scene_file(small_scene());
  const std::string output = path("serve.txt");
  Process program("weft", {"serve", scene, "--embedded", "--http", "127.0.0.1:0"}, output);
  EXPECT_THAT(first_line(output), AllOf(HasSubstr("http://127.0.0.1:"), HasSubstr("/#")));
  program.signal(SIGINT);
  EXPECT_EQ(program.wait(), 0);
}

TEST_F(ServeTest, TheCommandRefusesPlacesWhereItCannotOrShouldNotListen) {
  EXPECT_THAT(weft({"serve", "--http", "0.0.0.0:0"}).err, HasSubstr("other machines can reach"));
  EXPECT_THAT(weft({"serve", "--http", "7312"}).err, HasSubstr("write HOST:PORT"));
  EXPECT_THAT(weft({"serve", "--http", "127.0.0.1:65536"}).err, HasSubstr("write HOST:PORT"));
  EXPECT_THAT(weft({"serve", "--http", served_.address()}).err, HasSubstr("cannot listen on"));
  EXPECT_THAT(weft({"serve", "--http", "127.0.0.1:0", "--recordings", path("none")}).err,
              HasSubstr("it is no directory"));
}

}  // namespace
}  // namespace weft::testing
