#include <google/protobuf/dynamic_message.h>

#include <chrono>
#include <fstream>
#include <set>
#include <sstream>
#include <thread>

#include "tests/support/service/service.h"
#include "tests/support/temporary_directory.h"

namespace weft::testing {
namespace {

using namespace std::chrono_literals;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// SHA-256 of "a1", "b1" and "r1".
constexpr const char* kTokens = R"(# who may call
ann f55ff16f66f43360266b95db6f8fec01d76031054306ae4a4b380598f6cfd114
bob 7DC96F776C8423E57A2785489A3F9C43FB6E756876D6AD9A9CAC4AA4E72EC193  # capitals too

root 82f3e9c695dc6b8d1b11818d5701919e286de8d47f7c3eb3100c485f79e57828 admin
)";

// A server that wants tokens: ann's is "a1", bob's "b1", that of the admin root "r1".
class AccessTest : public ::testing::Test {
 protected:
  AccessTest() {
    std::ofstream(directory_.path("tokens")) << kTokens;
    options_.tokens = directory_.path("tokens");
    options_.data_dir = directory_.path("data");
    options_.host = "127.0.0.1";
    start();
  }
  void start() {
    service_.reset();
    service_ = std::make_unique<Service>(options_);
    service_->channel =
        grpc::CreateChannel(service_->server.address(), grpc::InsecureChannelCredentials());
  }

  // The error of a method called with a token, or the answer.
  template <class Response = v1::DeleteSessionResponse>
  std::pair<Response, Error> call(const std::string& token, const std::string& method,
                                  const Message& request, bool streams = false) {
    auto [bytes, error] =
        raw_call(*service_, "/weft.v1." + method, request.SerializeAsString(), streams, token);
    Response response;
    response.ParseFromString(bytes);
    return {response, std::move(error)};
  }
  std::pair<v1::Session, Error> create(const std::string& token, const std::string& id,
                                       const std::string& request_id = {}) {
    v1::CreateSessionRequest request;
    *request.mutable_session()->mutable_scene() = small_scene();
    request.set_session_id(id);
    request.set_request_id(request_id);
    return call<v1::Session>(token, "SessionService/CreateSession", request);
  }
  std::pair<v1::Session, Error> get(const std::string& token, const std::string& id) {
    v1::GetSessionRequest request;
    request.set_name("sessions/" + id);
    return call<v1::Session>(token, "SessionService/GetSession", request);
  }
  std::vector<std::string> list(const std::string& token, int page_size = 0) {
    std::vector<std::string> names;
    v1::ListSessionsRequest request;
    request.set_page_size(page_size);
    do {
      const auto page =
          call<v1::ListSessionsResponse>(token, "SessionService/ListSessions", request).first;
      for (const auto& session : page.sessions()) names.push_back(session.name());
      request.set_page_token(page.next_page_token());
    } while (!request.page_token().empty());
    return names;
  }

  const TemporaryDirectory directory_;
  ServerOptions options_ = Service::in_process();
  std::unique_ptr<Service> service_;
};

std::string path_of_method(const MethodDescriptor& method) {
  return "/" + method.service()->full_name() + "/" + method.name();
}

TEST_F(AccessTest, EveryMethodWantsAToken) {
  std::set<std::string> services;
  for (const MethodDescriptor* method : all_methods()) {
    SCOPED_TRACE(method->full_name());
    services.insert(method->service()->full_name());
    const Error none =
        raw_call(*service_, path_of_method(*method), "", method->server_streaming()).second;
    EXPECT_EQ(none.code, grpc::StatusCode::UNAUTHENTICATED) << none.message;
    EXPECT_EQ(none.reason(), "TOKEN_MISSING");
    const Error wrong =
        raw_call(*service_, path_of_method(*method), "", method->server_streaming(), "guessed")
            .second;
    EXPECT_EQ(wrong.code, grpc::StatusCode::UNAUTHENTICATED) << wrong.message;
    EXPECT_EQ(wrong.reason(), "TOKEN_UNKNOWN");
    EXPECT_THAT(wrong.message, Not(HasSubstr("guessed")));
  }

  // no service was forgotten here
  const std::string reflected =
      raw_call(*service_, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
               "\x3a\x01*")
          .first;
  std::size_t found = 0;
  for (std::size_t at = 0; (at = reflected.find("weft.v1.", at)) != std::string::npos; ++at)
    ++found;
  EXPECT_EQ(services.size(), found);
}

TEST_F(AccessTest, HealthWantsNone) {
  EXPECT_EQ(raw_call(*service_, "/grpc.health.v1.Health/Check", "").first, "\x08\x01");
}

// The field that names a session, or nullptr.
const FieldDescriptor* session_field(const MethodDescriptor& method) {
  const bool of_session = method.service()->name() == "SessionService";
  const auto* field = method.input_type()->FindFieldByName(of_session ? "name" : "session");
  for (const char* other : {"session", "parent"})
    if (field == nullptr) field = method.input_type()->FindFieldByName(other);
  return field != nullptr && field->type() == FieldDescriptor::TYPE_STRING ? field : nullptr;
}

TEST_F(AccessTest, ASessionIsNobodyElsesOnAnyMethodAndLooksAsIfThereWereNone) {
  const std::set<std::string> without_session = {
      "CreateSession", "ListSessions", "RunTest",     "GetServerInfo", "GetServerStats",
      "ListTextiles",  "GetTextile",   "UploadAsset", "GetAsset",      "ListAssets",
      "DownloadAsset", "DeleteAsset",  "BuildGarment"};
  const std::string same = " is another's, or there is none";
  const v1::Session before = create("a1", "hers").first;
  EXPECT_EQ(before.owner(), "ann");
  for (const MethodDescriptor* method : all_methods()) {
    SCOPED_TRACE(method->full_name());
    const FieldDescriptor* field = session_field(*method);
    if (field == nullptr) {
      EXPECT_TRUE(without_session.contains(method->name())) << "whose is what it speaks of?";
      continue;
    }
    const std::unique_ptr<Message> request(google::protobuf::MessageFactory::generated_factory()
                                               ->GetPrototype(method->input_type())
                                               ->New());
    if (const auto* credits = method->input_type()->FindFieldByName("credits"))
      request->GetReflection()->SetInt32(request.get(), credits, 1);
    const auto ask = [&](const std::string& token, const std::string& name) {
      const bool of_snapshot = method->name() == "RestoreSession";
      request->GetReflection()->SetString(request.get(), field,
                                          of_snapshot ? name + "/snapshots/it" : name);
      return raw_call(*service_, path_of_method(*method), request->SerializeAsString(),
                      method->server_streaming(), token)
          .second;
    };
    const Error hers = ask("b1", "sessions/hers"), none = ask("b1", "sessions/none");
    EXPECT_EQ(hers.code, grpc::StatusCode::PERMISSION_DENIED) << hers.message;
    EXPECT_EQ(hers.reason(), "SESSION_NOT_YOURS");
    EXPECT_EQ(none.code, hers.code);
    EXPECT_EQ(none.reason(), hers.reason());
    EXPECT_EQ(hers.message, "sessions/hers" + same);
    EXPECT_EQ(none.message, "sessions/none" + same);
    EXPECT_EQ(ask("a1", "sessions/none").code, none.code);
    EXPECT_EQ(ask("r1", "sessions/none").code, grpc::StatusCode::NOT_FOUND);
    if (method->name() != "DeleteSession") {
      EXPECT_NE(ask("a1", "sessions/hers").code, none.code);
      EXPECT_NE(ask("r1", "sessions/hers").code, none.code);
    }
  }
  EXPECT_EQ(get("a1", "hers").first.uid(), before.uid());
}

TEST_F(AccessTest, ListsToEachHisOwnAndToAdminsAll) {
  for (const char* id : {"a", "c", "e"}) create("a1", id);
  for (const char* id : {"b", "d"}) create("b1", id);
  EXPECT_THAT(list("a1", 2), ElementsAre("sessions/a", "sessions/c", "sessions/e"));
  EXPECT_THAT(list("b1"), ElementsAre("sessions/b", "sessions/d"));
  EXPECT_EQ(list("r1").size(), 5);
}

TEST_F(AccessTest, ATakenNameIsRefusedAndOnlyItsOwnerLearnsMore) {
  create("a1", "taken");
  EXPECT_EQ(create("a1", "taken").second.reason(), "SESSION_EXISTS");
  EXPECT_EQ(create("b1", "taken").second.reason(), "SESSION_NOT_YOURS");
  EXPECT_EQ(create("r1", "taken").second.reason(), "SESSION_EXISTS");
  v1::DeleteSessionRequest request;
  request.set_allow_missing(true);
  for (const char* name : {"sessions/taken", "sessions/none"}) {
    request.set_name(name);
    EXPECT_EQ(call("b1", "SessionService/DeleteSession", request).second.reason(),
              "SESSION_NOT_YOURS");
  }
}

TEST_F(AccessTest, OwnersAndTheirRequestsOutliveTheServer) {
  const std::string hers = create("a1", "", "make").first.uid();
  const std::string his = create("b1", "", "make").first.uid();
  EXPECT_NE(hers, his) << "a request_id is each principal's own";
  for (int i = 0; i < 2; ++i) {
    const v1::Session again = create("a1", "", "make").first;
    EXPECT_EQ(again.uid(), hers);
    EXPECT_EQ(again.owner(), "ann");
    EXPECT_EQ(create("b1", "", "make").first.uid(), his);
    EXPECT_EQ(list("a1").size(), 1);
    start();
  }
}

TEST_F(AccessTest, SessionsOfAServerThatDidNotAskAreTheAdmins) {
  const auto tokens = std::exchange(options_.tokens, std::nullopt);
  start();
  create("", "open");
  EXPECT_EQ(get("", "open").first.owner(), "");
  options_.tokens = tokens;
  start();
  EXPECT_EQ(get("a1", "open").second.code, grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(get("r1", "open").first.name(), "sessions/open");
}

TEST_F(AccessTest, ADamagedSessionIsShownToItsOwnerWhoMayDeleteIt) {
  create("a1", "hers");
  v1::StepSessionRequest step;
  step.set_name("sessions/hers");
  step.set_request_id("treacherous");
  call<v1::StepSessionResponse>("a1", "SessionService/StepSession", step);
  service_.reset();
  const std::string file = directory_.path("data/sessions.db");
  std::ostringstream content;
  content << std::ifstream(file, std::ios::binary).rdbuf();
  std::string bytes = content.str();
  const std::size_t place = bytes.find("treacherous");
  ASSERT_NE(place, std::string::npos);
  bytes[place] = 'T';
  std::ofstream(file, std::ios::binary) << bytes;

  start();
  EXPECT_EQ(get("b1", "hers").second.code, grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(create("b1", "hers").second.code, grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(get("a1", "hers").second.code, grpc::StatusCode::DATA_LOSS);
  EXPECT_EQ(create("a1", "hers").second.code, grpc::StatusCode::ALREADY_EXISTS);
  v1::DeleteSessionRequest erase;
  erase.set_name("sessions/hers");
  EXPECT_EQ(call("a1", "SessionService/DeleteSession", erase).second.code, grpc::StatusCode::OK);
  EXPECT_EQ(create("a1", "hers").second.code, grpc::StatusCode::OK);
}

void expect_exhausted(const Error& error, const std::string& subject) {
  EXPECT_EQ(error.code, grpc::StatusCode::RESOURCE_EXHAUSTED) << error.message;
  ASSERT_EQ(error.quota.violations_size(), 1);
  EXPECT_EQ(error.quota.violations(0).subject(), subject);
  EXPECT_TRUE(error.retry);
}

TEST_F(AccessTest, EachPrincipalHasSoManySessionsAndParticles) {
  options_.limits.max_sessions_per_principal = 2;
  options_.limits.max_particles_per_principal = 45;  // a session has 20
  options_.limits.max_total_particles = 70;
  start();
  create("a1", "a");
  create("a1", "b");
  expect_exhausted(create("a1", "c").second, "sessions_per_principal");
  EXPECT_EQ(create("b1", "d").second.code, grpc::StatusCode::OK);
  expect_exhausted(create("b1", "e").second, "total_particles");
  start();
  expect_exhausted(create("a1", "c").second, "sessions_per_principal");
  v1::DeleteSessionRequest request;
  request.set_name("sessions/a");
  EXPECT_EQ(call("a1", "SessionService/DeleteSession", request).second.code, grpc::StatusCode::OK);
  EXPECT_EQ(create("b1", "e").second.code, grpc::StatusCode::OK);

  options_.limits.max_particles_per_principal = 39;
  options_.limits.max_sessions_per_principal = 9;
  options_.data_dir.reset();
  start();
  create("a1", "a");
  expect_exhausted(create("a1", "b").second, "particles_per_principal");
  v1::GetServerInfoRequest ask;
  const auto limits = call<v1::ServerInfo>("a1", "ServerService/GetServerInfo", ask).first.limits();
  EXPECT_EQ(limits.max_sessions_per_principal(), 9);
  EXPECT_EQ(limits.max_particles_per_principal(), 39);
  EXPECT_EQ(limits.max_total_particles(), 70);
  EXPECT_EQ(limits.max_streams_per_principal(), Limits().max_streams_per_principal);
}

TEST_F(AccessTest, EachPrincipalHasSoManyStreamsOfAnyKind) {
  options_.limits.max_streams_per_principal = 1;
  start();
  create("a1", "a");
  create("b1", "b");
  v1::StreamFramesRequest frames;
  frames.set_session("sessions/a");
  grpc::ClientContext context;
  context.AddMetadata("authorization", "Bearer a1");
  auto stream = v1::FrameService::NewStub(service_->channel)->StreamFrames(&context, frames);
  v1::StreamFramesResponse header;
  ASSERT_TRUE(stream->Read(&header));
  for (const char* method :
       {"FrameService/StreamFrames", "FrameService/ViewFrames", "SessionService/Interact"}) {
    expect_exhausted(call("a1", method, frames, true).second, "streams_per_principal");
  }
  frames.set_session("sessions/b");
  EXPECT_EQ(call("b1", "FrameService/StreamFrames", frames, true).second.code,
            grpc::StatusCode::OK);
  context.TryCancel();
  stream->Finish();
  frames.set_session("sessions/a");
  while (call("a1", "FrameService/StreamFrames", frames, true).second.code !=
         grpc::StatusCode::OK) {
  }
}

TEST_F(AccessTest, AFullServerRefusesAtOnceWhileItsSessionsRun) {
  options_.limits.max_sessions_per_principal = 4;
  start();
  for (int i = 0; i < 4; ++i) {
    const std::string id = "run-" + std::to_string(i);
    create("a1", id);
    v1::RunSessionRequest run;
    run.set_name("sessions/" + id);
    ASSERT_EQ(call("a1", "SessionService/RunSession", run).second.code, grpc::StatusCode::OK);
  }
  // the planner is busy with what takes long
  v1::CreateSessionRequest large;
  *large.mutable_session()->mutable_scene() = small_scene();
  large.mutable_session()->mutable_scene()->mutable_sheets(0)->mutable_grid()->set_rows(250);
  large.mutable_session()->mutable_scene()->mutable_sheets(0)->mutable_grid()->set_columns(250);
  const std::jthread other([&] {
    EXPECT_EQ(call("b1", "SessionService/CreateSession", large).second.code, grpc::StatusCode::OK);
  });
  std::chrono::duration<double, std::milli> longest{};
  const std::int64_t before = get("a1", "run-0").first.frame();
  constexpr int kAsked = 100;
  for (int i = 0; i < kAsked; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    expect_exhausted(create("a1", "more").second, "sessions_per_principal");
    longest = std::max<decltype(longest)>(longest, std::chrono::steady_clock::now() - begin);
  }
  while (get("a1", "run-0").first.frame() == before) {
  }
  EXPECT_EQ(list("a1").size(), 4);
  std::printf("the longest of %d refusals took %.1f ms (hold: 50)\n", kAsked, longest.count());
  RecordProperty("longest_refusal_ms", std::to_string(longest.count()));
}

// What a server says that does not start with such a file of tokens.
std::string refusal_of_tokens(const std::string& text) {
  const TemporaryDirectory directory;
  ServerOptions options = Service::in_process();
  options.tokens = directory.path("tokens");
  if (!text.empty()) std::ofstream(*options.tokens) << text;
  try {
    const Service service(options);
  } catch (const std::runtime_error& error) {
    return std::string(error.what()).substr(directory.name().size());
  }
  return "";
}

TEST(Tokens, AreRefusedByLine) {
  const std::string hash(64, 'a'), other(64, 'b');
  EXPECT_EQ(refusal_of_tokens("ann " + hash + "\nbob " + other + " admin"), "");
  EXPECT_THAT(refusal_of_tokens(""), HasSubstr("No such file"));
  EXPECT_THAT(refusal_of_tokens("# nobody\n"), HasSubstr("has no line PRINCIPAL SHA256"));
  EXPECT_THAT(refusal_of_tokens("ann " + hash + "\nbob secret"),
              HasSubstr("/tokens:2: is not PRINCIPAL"));
  EXPECT_THAT(refusal_of_tokens("bob secret"), Not(HasSubstr("secret")));
  EXPECT_THAT(refusal_of_tokens("ann " + hash + " boss"), HasSubstr("/tokens:1: is not"));
  EXPECT_THAT(refusal_of_tokens("ann " + std::string(64, 'g')), HasSubstr("/tokens:1: is not"));
  EXPECT_THAT(refusal_of_tokens("ann " + hash + "\nbob " + hash),
              HasSubstr("/tokens:2: this token"));
}

}  // namespace
}  // namespace weft::testing
