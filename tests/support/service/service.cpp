#include "tests/support/service/service.h"

#include <arpa/inet.h>
#include <grpcpp/generic/generic_stub.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <utility>

#include "google/rpc/status.pb.h"
#include "weft/v1/garment.pb.h"
#include "weft/v1/lab.pb.h"
#include "weft/v1/textile.pb.h"

namespace weft::testing {
namespace {

void expect_ok(const grpc::Status& status) {
  EXPECT_TRUE(status.ok()) << status.error_code() << ": " << status.error_message();
}

v1::CreateSessionRequest create_request(const v1::Scene& scene, const std::string& id) {
  v1::CreateSessionRequest request;
  *request.mutable_session()->mutable_scene() = scene;
  request.set_session_id(id);
  return request;
}

}  // namespace

v1::Scene small_scene() {
  v1::Scene scene;
  v1::Sheet* sheet = scene.add_sheets();
  sheet->mutable_grid()->set_rows(4);
  sheet->mutable_grid()->set_columns(5);
  sheet->mutable_grid()->set_spacing_m(0.05);
  v1::RawTextile* raw = sheet->mutable_textile()->mutable_raw();
  raw->set_particle_mass_kg(1e-3);
  raw->set_stretch_n_per_m(200);
  raw->set_shear_n_per_m(200);
  raw->set_bend_n_m2(1e-5);
  raw->set_air_drag_kg_per_s(1e-3);
  v1::Pin* pin = sheet->add_pins();
  pin->add_particles(0);
  pin->add_particles(4);
  return scene;
}

v1::Scene diverging_scene() {
  v1::Scene scene = small_scene();
  scene.mutable_solver()->set_frame_step_s(1);
  scene.mutable_solver()->set_substep_s(0.05);
  scene.mutable_solver()->set_allow_unstable(true);
  scene.mutable_solver()->set_max_repairs(0);
  return scene;
}

Error::Error(const grpc::Status& status)
    : code(status.error_code()), message(status.error_message()) {
  google::rpc::Status details;
  details.ParseFromString(status.error_details());
  for (const auto& detail : details.details()) {
    google::rpc::RetryInfo retry_info;
    detail.UnpackTo(&info);
    detail.UnpackTo(&bad);
    detail.UnpackTo(&resource);
    detail.UnpackTo(&quota);
    retry |= detail.UnpackTo(&retry_info);
  }
}

std::string Error::metadata(const std::string& key) const {
  const auto found = info.metadata().find(key);
  return found == info.metadata().end() ? "" : found->second;
}

std::vector<std::string> Error::fields() const {
  std::vector<std::string> fields;
  for (const auto& violation : bad.field_violations()) fields.push_back(violation.field());
  return fields;
}

Service::Service(ServerOptions options) : server(options) {}

ServerOptions Service::in_process() {
  ServerOptions options;
  options.host.reset();
  options.worker_threads = 2;
  return options;
}

v1::Session Service::create(const v1::Scene& scene, const std::string& id) {
  v1::Session session;
  expect_ok(call(&Sessions::CreateSession, create_request(scene, id), &session));
  return session;
}

Error Service::create_error(const v1::Scene& scene, const std::string& id) {
  return error(&Sessions::CreateSession, create_request(scene, id));
}

v1::Session Service::get(const v1::Session& session) {
  v1::GetSessionRequest request;
  request.set_name(session.name());
  v1::Session response;
  expect_ok(call(&Sessions::GetSession, request, &response));
  return response;
}

v1::StepSessionResponse Service::step(const v1::Session& session, std::int64_t count) {
  v1::StepSessionRequest request;
  request.set_name(session.name());
  request.set_frames(count);
  v1::StepSessionResponse response;
  expect_ok(call(&Sessions::StepSession, request, &response));
  return response;
}

v1::RunSessionResponse Service::run(const v1::Session& session, std::int64_t until_frame) {
  v1::RunSessionRequest request;
  request.set_name(session.name());
  request.set_until_frame(until_frame);
  v1::RunSessionResponse response;
  expect_ok(call(&Sessions::RunSession, request, &response));
  return response;
}

v1::PauseSessionResponse Service::pause(const v1::Session& session) {
  v1::PauseSessionRequest request;
  request.set_name(session.name());
  v1::PauseSessionResponse response;
  expect_ok(call(&Sessions::PauseSession, request, &response));
  return response;
}

void Service::erase(const v1::Session& session) {
  v1::DeleteSessionRequest request;
  request.set_name(session.name());
  v1::DeleteSessionResponse response;
  expect_ok(call(&Sessions::DeleteSession, request, &response));
}

v1::ServerInfo Service::info() {
  grpc::ClientContext context;
  v1::ServerInfo info;
  expect_ok(servers->GetServerInfo(&context, {}, &info));
  return info;
}

Stream::Stream(Service& service, const v1::StreamFramesRequest& request)
    : reader_(service.frames->StreamFrames(&context_, request)) {}

Stream::~Stream() { cancel(); }

std::optional<v1::StreamFramesResponse> Stream::read() {
  v1::StreamFramesResponse message;
  if (!reader_->Read(&message)) return std::nullopt;
  return message;
}

v1::StreamHeader Stream::header() {
  const auto message = read();
  EXPECT_TRUE(message && message->has_header()) << "no header";
  return message ? message->header() : v1::StreamHeader();
}

v1::Frame Stream::frame() {
  while (auto message = read()) {
    if (message->has_frame()) return std::move(*message->mutable_frame());
  }
  ADD_FAILURE() << "the stream has ended";
  return {};
}

std::vector<v1::Frame> Stream::rest() {
  std::vector<v1::Frame> all;
  while (auto message = read()) {
    if (message->has_frame()) all.push_back(std::move(*message->mutable_frame()));
  }
  return all;
}

Error Stream::finish() {
  while (read()) {
  }
  return Error(reader_->Finish());
}

std::pair<std::string, Error> raw_call(Service& service, const std::string& method,
                                       const std::string& request, bool streams,
                                       const std::string& token) {
  grpc::GenericStub stub(service.channel);
  grpc::CompletionQueue queue;
  grpc::ClientContext context;
  if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
  const auto done = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    EXPECT_TRUE(queue.Next(&tag, &ok));
    return ok;
  };
  const auto call = stub.PrepareCall(&context, method, &queue);
  call->StartCall(nullptr);
  if (done()) {
    const grpc::Slice slice(request);
    call->WriteLast(grpc::ByteBuffer(&slice, 1), {}, nullptr);
    done();
  }
  grpc::ByteBuffer response;
  call->Read(&response, nullptr);
  const bool answered = done();
  if (answered && streams) context.TryCancel();
  grpc::Status status;
  call->Finish(&status, nullptr);
  done();
  if (answered && streams) status = grpc::Status::OK;
  grpc::Slice bytes;
  if (response.Valid()) response.DumpToSingleSlice(&bytes);
  return {std::string(bytes.begin(), bytes.end()), Error(status)};
}

std::string damaged(std::string bytes, std::mt19937& random) {
  const std::size_t place = random() % bytes.size();
  switch (random() % 3) {
    case 0:
      bytes[place] = static_cast<char>(bytes[place] ^ (1 << random() % 8));
      break;
    case 1:
      bytes.resize(place);
      break;
    default:
      bytes.insert(place, 1, static_cast<char>(random()));
  }
  return bytes;
}

std::string metrics_at(const std::string& address) {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port =
      htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(connect(socket, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  const std::string request = "GET /metrics HTTP/1.0\r\n\r\n";
  EXPECT_EQ(send(socket, request.data(), request.size(), 0), static_cast<ssize_t>(request.size()));
  std::string answer;
  char bytes[4096];
  for (ssize_t n; (n = recv(socket, bytes, sizeof bytes, 0)) > 0;)
    answer.append(bytes, static_cast<std::size_t>(n));
  close(socket);
  return answer;
}

std::vector<const google::protobuf::MethodDescriptor*> all_methods() {
  std::vector<const google::protobuf::MethodDescriptor*> methods;
  for (const auto* file :
       {v1::Asset::descriptor()->file(), v1::StreamFramesRequest::descriptor()->file(),
        v1::RunTestRequest::descriptor()->file(), v1::ServerInfo::descriptor()->file(),
        v1::Session::descriptor()->file(), v1::Textile::descriptor()->file(),
        v1::Pattern::descriptor()->file()}) {
    for (int i = 0; i < file->service_count(); ++i) {
      for (int k = 0; k < file->service(i)->method_count(); ++k)
        methods.push_back(file->service(i)->method(k));
    }
  }
  return methods;
}

v1::StreamFramesRequest frames_of(const v1::Session& session, std::int64_t start,
                                  std::int64_t end) {
  v1::StreamFramesRequest request;
  request.set_session(session.name());
  request.set_uid(session.uid());
  request.set_start_frame(start);
  if (end >= 0) request.set_end_frame(end);
  request.mutable_format()->set_encoding(v1::FRAME_ENCODING_FLOAT64);
  return request;
}

}  // namespace weft::testing
