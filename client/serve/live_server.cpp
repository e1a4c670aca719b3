#include "client/serve/live_server.h"

#include <google/protobuf/util/json_util.h>

#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "client/assets.h"
#include "client/commands/commands.h"
#include "client/frame_parts.h"
#include "client/page/page.h"
#include "client/recording/phases.h"

namespace weft::client {
namespace {

template <class Message>
Message read_message(const std::string& json) {
  Message message;
  const auto status = google::protobuf::util::JsonStringToMessage(json, &message);
  if (!status.ok())
    throw usage_problem(Message::descriptor()->full_name() + ": " + std::string(status.message()));
  return message;
}

// ---- methods that answer with one message

using Method = std::function<Json(Connection&, const std::string& json)>;

template <class Stub, class Request, class Response>
Method method(grpc::Status (Stub::*rpc)(grpc::ClientContext*, const Request&, Response*)) {
  return [rpc](Connection& connection, const std::string& json) {
    return to_json(connection.call(rpc, read_message<Request>(json)));
  };
}

// Every session, without what only one that is shown needs.
Json list_all(Connection& connection, const std::string&) {
  v1::ListSessionsResponse all = list_sessions(connection);
  for (v1::Session& session : *all.mutable_sessions()) {
    session.clear_scene();
    session.clear_plan();
  }
  return to_json(all);
}

// A session, without its start: frames show where it is. Bodies have their triangles; phases are
// those of its dressing.
Json get(Connection& connection, const std::string& json) {
  v1::Session session = connection.get_session(read_message<v1::GetSessionRequest>(json).name());
  for (v1::Sheet& sheet : *session.mutable_scene()->mutable_sheets()) {
    sheet.clear_start_positions_m();
    sheet.clear_start_velocities_m_per_s();
  }
  v1::Scene bodies;
  *bodies.mutable_colliders() = session.scene().colliders();
  const Assets assets = assets_of(connection, bodies);
  *session.mutable_scene() = with_bodies(session.scene(), assets);
  Json shown = to_json(session);
  shown["phases"] = phases_json(session.scene());
  return shown;
}

const std::map<std::string, Method>& methods() {
  static const std::map<std::string, Method> all{
      {"/weft.v1.SessionService/ListSessions", list_all},
      {"/weft.v1.SessionService/GetSession", get},
      {"/weft.v1.SessionService/RunSession", method(&Sessions::RunSession)},
      {"/weft.v1.SessionService/PauseSession", method(&Sessions::PauseSession)},
      {"/weft.v1.SessionService/StepSession", method(&Sessions::StepSession)},
      {"/weft.v1.SessionService/GetVerdict", method(&Sessions::GetVerdict)},
      {"/weft.v1.SessionService/UpdateTextile", method(&Sessions::UpdateTextile)},
      {"/weft.v1.SessionService/ApplyActions", method(&Sessions::ApplyActions)},
      {"/weft.v1.TextileService/ListTextiles", method(&Textiles::ListTextiles)},
  };
  return all;
}

// ---- streams

WebMessage message_of(const v1::InteractResponse& response) {
  return {.bytes = to_json(response).dump()};
}

struct Parts {
  FrameParts frames;
  TopologyParts topology;
};

// False where the rest of a frame, or of a sheet's triangles, is still to come.
bool is_whole(const v1::InteractResponse& /*response*/, Parts& /*parts*/) { return true; }

bool is_whole(v1::ViewFramesResponse& response, Parts& parts) {
  if (response.has_header()) {
    parts.frames.begin(response.header());
    parts.topology.begin(response.header());
  }
  if (response.has_topology()) return parts.topology.join(*response.mutable_topology());
  return !response.has_frame() || parts.frames.join(*response.mutable_frame());
}

WebMessage message_of(v1::ViewFramesResponse response) {
  if (!response.has_frame()) return {.bytes = to_json(response).dump()};
  v1::Frame& frame = *response.mutable_frame();
  std::string arrays;
  for (std::string* array :
       {frame.mutable_positions_m(), frame.mutable_pressure_pa(), frame.mutable_clearance_m()}) {
    arrays += *array;
    array->clear();
  }
  std::string json = to_json(response).dump();
  json.append((4 - json.size() % 4) % 4, ' ');
  const auto length = static_cast<std::uint32_t>(json.size());
  std::string bytes(sizeof length, '\0');
  std::memcpy(bytes.data(), &length, sizeof length);
  return {.bytes = bytes + json + arrays, .binary = true};
}

// A stream of the server: passes on what the browser says, if anything, and answers with the next
// message of the server. One that only reads is begun anew where it breaks.
template <class Request, class Response>
class Stream : public Conversation {
 public:
  using Reader = grpc::ClientReaderWriter<Request, Response>;
  using Stub = std::function<std::unique_ptr<Reader>(grpc::ClientContext*)>;

  Stream(Connection& connection, Stub stub) : connection_(connection), stub_(std::move(stub)) {}
  ~Stream() override {
    if (context_) context_->TryCancel();
  }

  WebMessage answer(const std::string& said) override try {
    if (!stream_) {
      first_ = read_message<Request>(said);
      attempts_.emplace(connection_, first_);
      open();
    } else if (!said.empty()) {
      stream_->Write(read_message<Request>(said));
    }
    for (Response response;;) {
      if (stream_->Read(&response)) {
        attempts_->note_message();
        if (!is_whole(response, parts_)) continue;
        return message_of(std::move(response));
      }
      const grpc::Status status = stream_->Finish();
      if (status.ok()) return {.last = true};
      attempts_->go_on_after(status);
      open();
    }
  } catch (const Problem& problem) {
    return {.bytes = to_json(problem).dump(), .last = true};
  }

 private:
  void open() {
    cancel_.reset();
    stream_.reset();
    context_ = std::make_unique<grpc::ClientContext>();
    attempts_->address(*context_);
    cancel_.emplace(connection_.stop(), [context = context_.get()] { context->TryCancel(); });
    stream_ = stub_(context_.get());
    stream_->Write(first_);
  }

  Connection& connection_;
  const Stub stub_;
  Request first_;  // says which session it is of
  std::optional<Attempts> attempts_;
  std::unique_ptr<grpc::ClientContext> context_;
  std::optional<std::stop_callback<std::function<void()>>> cancel_;
  std::unique_ptr<Reader> stream_;
  Parts parts_;
};

// ---- answers

int http_status(const Problem& problem) {
  if (problem.code == "INVALID_ARGUMENT") return 400;
  if (problem.exit == Exit::kNoConnection || problem.exit == Exit::kInterrupted) return 503;
  return problem.code == "NOT_FOUND" ? 404 : 409;
}

std::string session_in(const std::string& json) try {
  return Json::parse(json).at("session").get<std::string>();
} catch (const Json::exception&) {
  throw usage_problem("write {\"session\": \"sessions/NAME\"}");
}

}  // namespace

LiveServer::LiveServer(Connection& connection, const LiveOrder& order)
    : connection_(connection),
      recordings_(connection, order.recordings),
      http_(order.host, order.port,
            {[this](const HttpRequest& request) { return answer(request); },
             [this](const std::string& path) { return converse(path); }}) {}

HttpResponse LiveServer::answer(const HttpRequest& request) try {
  const auto& [verb, path, body] = request;
  if (path == "/") {
    if (verb != "GET") return {.status = 405, .type = "text/plain", .body = "GET it\n"};
    return {.type = "text/html; charset=utf-8", .body = live_page()};
  }
  const auto found = methods().find(path);
  const bool of_recordings = path.starts_with("/recordings/");
  if (found == methods().end() && !of_recordings)
    return {.status = 404, .type = "text/plain", .body = "there is no such page or method\n"};
  if (verb != "POST") return {.status = 405, .type = "text/plain", .body = "POST to it\n"};
  if (found != methods().end()) return {.body = found->second(connection_, body).dump()};
  if (path == "/recordings/list") return {.body = recordings_.list().dump()};
  if (path == "/recordings/start") return {.body = recordings_.start(session_in(body)).dump()};
  if (path == "/recordings/stop") return {.body = recordings_.stop(session_in(body)).dump()};
  return {
      .status = 404, .type = "text/plain", .body = "recordings are listed, started and stopped\n"};
} catch (const Problem& problem) {
  return {.status = http_status(problem), .body = to_json(problem).dump()};
}

std::unique_ptr<Conversation> LiveServer::converse(const std::string& path) {
  if (path == "/weft.v1.FrameService/ViewFrames") {
    return std::make_unique<Stream<v1::ViewFramesRequest, v1::ViewFramesResponse>>(
        connection_, [this](auto* context) { return connection_.frames().ViewFrames(context); });
  }
  if (path == "/weft.v1.SessionService/Interact") {
    return std::make_unique<Stream<v1::InteractRequest, v1::InteractResponse>>(
        connection_, [this](auto* context) { return connection_.sessions().Interact(context); });
  }
  return nullptr;
}

}  // namespace weft::client
