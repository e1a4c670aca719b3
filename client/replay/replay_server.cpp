#include "client/replay/replay_server.h"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>

#include <chrono>
#include <cstdint>
#include <utility>
#include <variant>

#include "client/problem.h"
#include "client/replay/player.h"
#include "client/sheet_layout.h"
#include "server/rpc/bytes.h"
#include "server/rpc/checks.h"
#include "server/rpc/errors.h"
#include "server/rpc/frame_encoding.h"
#include "server/rpc/textile_service.h"
#include "server/rpc/topology.h"
#include "server/session/limits.h"
#include "weft/v1/asset.grpc.pb.h"
#include "weft/v1/frame.grpc.pb.h"
#include "weft/v1/server.grpc.pb.h"
#include "weft/v1/session.grpc.pb.h"

namespace weft::client {
namespace {

using grpc::ServerContext, grpc::Status;
using std::chrono::milliseconds;

constexpr milliseconds kLook{200};           // for calls that were cancelled
constexpr milliseconds kProgressDue{1'750};  // with kLook within two seconds

// As far as frames need it: of triangles without their start.
SheetShape shape_of(const SheetMesh& sheet, const v1::Sheet& recorded) {
  const v1::SheetLayout& layout = sheet.layout;
  if (is_grid(layout)) {
    return Grid{
        .rows = layout.rows(), .columns = layout.columns(), .spacing = recorded.grid().spacing_m()};
  }
  TriangleMesh mesh;
  mesh.triangles = sheet.triangles;
  mesh.start.resize(particle_count(layout), Vector3d::Zero());
  for (const auto& [u, v] : sheet.flat) mesh.flat.emplace_back(u, v);
  mesh.flat_triangles = sheet.flat_triangles;
  for (const PanelRun& panel : sheet.panels)
    mesh.panels.push_back({panel.name, static_cast<int>(panel.count), panel.grain_rad});
  return complete(std::move(mesh));
}

std::vector<SheetShape> shapes_of(const Player& player) {
  std::vector<SheetShape> shapes;
  for (const SheetMesh& sheet : meshes_of(player.header(), player.topology())) {
    const auto index = static_cast<int>(shapes.size());
    const bool known = index < player.scene().sheets_size();
    shapes.push_back(shape_of(sheet, known ? player.scene().sheets(index) : v1::Sheet()));
  }
  return shapes;
}

}  // namespace

// What all services know.
class Replay {
 public:
  explicit Replay(const std::string& path) : player(path), shapes(shapes_of(player)), path_(path) {}

  Status find(const std::string& name) const {
    return name == player.header().session() ? Status::OK : errors::session_not_found(name);
  }
  Status refuse() const {
    return errors::failed_precondition(
        "REPLAY", path_ + " is replayed: it can be run, paused, stepped and read, nothing else");
  }
  Status failed(const Player::Place& place) const {
    return errors::solver_failed(place.failure, place.newest->number);
  }
  Status ended() const {
    return errors::failed_precondition(
        "RECORDING_ENDED", fmt::format("{} ends with frame {}", path_, player.last_frame()));
  }
  v1::Session session() const {
    const Player::Place place = player.place();
    v1::Session session;
    session.set_name(player.header().session());
    session.set_uid(player.header().uid());
    *session.mutable_scene() = player.scene();
    session.set_state(place.state);
    session.set_frame(place.newest->number);
    session.set_time_s(place.newest->time);
    session.set_at_rest(place.newest->at_rest);
    if (place.newest->residual) session.set_residual(*place.newest->residual);
    session.set_failure(place.failure);
    session.set_numerics_id(player.header().numerics_id());
    google::protobuf::util::TimeUtil::FromString(player.recorded_at(),
                                                 session.mutable_create_time());
    return session;
  }

  Player player;
  const std::vector<SheetShape> shapes;

 private:
  std::string path_;
};

class SessionReplay final : public v1::SessionService::Service {
 public:
  explicit SessionReplay(Replay& replay) : replay_(replay), player_(replay.player) {}

  Status GetSession(ServerContext*, const v1::GetSessionRequest* request,
                    v1::Session* response) override {
    Status status = replay_.find(request->name());
    if (status.ok()) *response = replay_.session();
    return status;
  }

  Status ListSessions(ServerContext*, const v1::ListSessionsRequest*,
                      v1::ListSessionsResponse* response) override {
    *response->add_sessions() = replay_.session();
    return Status::OK;
  }

  Status RunSession(ServerContext*, const v1::RunSessionRequest* request,
                    v1::RunSessionResponse* response) override {
    if (Status status = replay_.find(request->name()); !status.ok()) return status;
    if (const auto problems = find_problems(*request); !problems.empty())
      return errors::field_invalid(problems);
    Player::Run run;
    if (request->has_time_scale()) run.time_scale = request->time_scale();
    const std::int64_t newest = player_.place().newest->number;
    if (request->has_until_frame()) {
      run.until_frame = request->until_frame();
      if (*run.until_frame <= newest) return errors::not_ahead(newest);
    }
    run.until_rest = request->until_rest();
    const Player::Place place = player_.run(run);
    if (place.state == v1::SESSION_STATE_FAILED) return replay_.failed(place);
    if (place.state != v1::SESSION_STATE_RUNNING) return replay_.ended();
    response->set_applied_frame(place.newest->number + 1);
    return Status::OK;
  }

  Status PauseSession(ServerContext*, const v1::PauseSessionRequest* request,
                      v1::PauseSessionResponse* response) override {
    if (Status status = replay_.find(request->name()); !status.ok()) return status;
    response->set_applied_frame(player_.pause().newest->number + 1);
    return Status::OK;
  }

  Status StepSession(ServerContext*, const v1::StepSessionRequest* request,
                     v1::StepSessionResponse* response) override {
    if (Status status = replay_.find(request->name()); !status.ok()) return status;
    if (const auto problems = find_problems(*request); !problems.empty())
      return errors::field_invalid(problems);
    const std::int64_t frames = frames_of(*request);
    const std::int64_t newest = player_.place().newest->number;
    if (request->has_expected_frame() && request->expected_frame() != newest)
      return errors::frame_stale(newest);
    if (frames > player_.last_frame() - newest) return replay_.ended();
    const Player::Place place = player_.step(frames);
    if (place.state == v1::SESSION_STATE_FAILED) return replay_.failed(place);
    if (place.state == v1::SESSION_STATE_RUNNING)
      return errors::session_running(request->name(), newest);
    response->set_applied_frame(newest + 1);
    response->set_frame(place.newest->number);
    response->set_time_s(place.newest->time);
    response->set_at_rest(place.newest->at_rest);
    return Status::OK;
  }

  Status CreateSession(ServerContext*, const v1::CreateSessionRequest*, v1::Session*) override {
    return replay_.refuse();
  }
  Status DeleteSession(ServerContext*, const v1::DeleteSessionRequest*,
                       v1::DeleteSessionResponse*) override {
    return replay_.refuse();
  }
  Status UpdateTextile(ServerContext*, const v1::UpdateTextileRequest*,
                       v1::UpdateTextileResponse*) override {
    return replay_.refuse();
  }
  Status ApplyActions(ServerContext*, const v1::ApplyActionsRequest*,
                      v1::ApplyActionsResponse*) override {
    return replay_.refuse();
  }
  Status CreateSnapshot(ServerContext*, const v1::CreateSnapshotRequest*, v1::Snapshot*) override {
    return replay_.refuse();
  }
  Status ListSnapshots(ServerContext*, const v1::ListSnapshotsRequest* request,
                       v1::ListSnapshotsResponse*) override {
    return replay_.find(request->parent());  // there are none
  }
  Status RestoreSession(ServerContext*, const v1::RestoreSessionRequest*, v1::Session*) override {
    return replay_.refuse();
  }
  Status Interact(ServerContext*,
                  grpc::ServerReaderWriter<v1::InteractResponse, v1::InteractRequest>*) override {
    return replay_.refuse();
  }

 private:
  Replay& replay_;
  Player& player_;
};

class ServerReplay final : public v1::ServerService::Service {
 public:
  explicit ServerReplay(Replay& replay) : replay_(replay) {}

  Status GetServerInfo(ServerContext*, const v1::GetServerInfoRequest*,
                       v1::ServerInfo* response) override {
    response->set_version(WEFT_VERSION);
    response->set_numerics_id(replay_.player.header().numerics_id());
    response->set_sessions(1);
    response->mutable_limits()->set_max_frame_bytes(Limits().max_frame_bytes);
    return Status::OK;
  }
  Status GetServerStats(ServerContext*, const v1::GetServerStatsRequest*,
                        v1::ServerStats*) override {
    return replay_.refuse();
  }

 private:
  Replay& replay_;
};

// Only what a recorder asks for.
class AssetReplay final : public v1::AssetService::Service {
 public:
  explicit AssetReplay(Replay& replay) : replay_(replay) {}

  Status DownloadAsset(ServerContext*, const v1::DownloadAssetRequest* request,
                       grpc::ServerWriter<v1::DownloadAssetResponse>* writer) override try {
    constexpr std::size_t kPiece = 1 << 20;
    const Assets assets = replay_.player.assets();
    const auto asset = assets.find(request->name());
    if (asset == assets.end()) return errors::asset_not_found(request->name());
    const std::string& bytes = asset->second;
    if (request->offset() < 0 || static_cast<std::size_t>(request->offset()) > bytes.size())
      return errors::field_invalid(
          "offset", fmt::format("{} is not within 0 to {}", request->offset(), bytes.size()));
    v1::DownloadAssetResponse message;
    for (auto at = static_cast<std::size_t>(request->offset()); at < bytes.size(); at += kPiece) {
      message.set_data(bytes.substr(at, kPiece));
      writer->Write(message);
    }
    return Status::OK;
  } catch (const Problem& problem) {
    return {grpc::StatusCode::DATA_LOSS, problem.what()};
  }

 private:
  Replay& replay_;
};

class FrameReplay final : public v1::FrameService::Service {
 public:
  explicit FrameReplay(Replay& replay) : replay_(replay), player_(replay.player) {}

  Status StreamFrames(ServerContext* context, const v1::StreamFramesRequest* request,
                      grpc::ServerWriter<v1::StreamFramesResponse>* writer) override {
    const auto header = open(*request, request->has_start_frame() ? request->start_frame()
                                                                  : player_.place().newest->number);
    if (const auto* error = std::get_if<Status>(&header)) return *error;
    std::int64_t next = std::get<v1::StreamHeader>(header).start_frame();
    if (request->has_end_frame() && request->end_frame() < next) {
      return errors::field_invalid("end_frame", fmt::format("{} lies before the first frame, {}",
                                                            request->end_frame(), next));
    }
    Writing<v1::StreamFramesResponse, decltype(*writer)> writing(
        *this, *context, *writer, std::get<v1::StreamHeader>(header));
    while (!request->has_end_frame() || next <= request->end_frame()) {
      const auto place = writing.await(next);
      if (const auto* error = std::get_if<Status>(&place)) return *error;
      if (Status status = writing.write_frame(next++, 0); !status.ok()) return status;
    }
    return Status::OK;
  }

  Status ViewFrames(
      ServerContext* context,
      grpc::ServerReaderWriter<v1::ViewFramesResponse, v1::ViewFramesRequest>* stream) override {
    v1::ViewFramesRequest first, request;
    if (!stream->Read(&first)) return Status::OK;
    const auto header = open(first, player_.place().newest->number);
    if (const auto* error = std::get_if<Status>(&header)) return *error;
    std::int64_t next = std::get<v1::StreamHeader>(header).start_frame();
    Writing<v1::ViewFramesResponse, decltype(*stream)> writing(*this, *context, *stream,
                                                               std::get<v1::StreamHeader>(header));
    request.set_credits(first.credits());
    do {
      if (const auto problems = find_problems(request, 0); !problems.empty())
        return errors::field_invalid(problems);
      for (int credit = 0; credit < request.credits(); ++credit) {
        const auto place = writing.await(next);
        if (const auto* error = std::get_if<Status>(&place)) return *error;
        const std::int64_t newest = std::get<Player::Place>(place).newest->number;
        if (Status status = writing.write_frame(newest, newest - next); !status.ok()) return status;
        next = newest + 1;
      }
    } while (stream->Read(&request));
    return Status::OK;
  }

 private:
  // What a call writes, frames apart.
  template <class Response, class Writer>
  class Writing {
   public:
    Writing(FrameReplay& frames, ServerContext& context, Writer writer,
            const v1::StreamHeader& header)
        : frames_(frames),
          context_(context),
          writer_(writer),
          order_{.format = header.format(),
                 .sheets = frames.replay_.shapes,
                 .most_bytes = Limits().max_frame_bytes} {
      Response message;
      *message.mutable_header() = header;
      write(message);
      if (order_.format.topology()) {
        for (const auto& part : encoded_topology(order_.sheets, order_.most_bytes))
          if (decode(part, message)) write(message);
      }
      changes_ = frames_.player_.place().changes;
    }

    // Waits until the frame has come, and says meanwhile how things stand; or why it will not come.
    std::variant<Player::Place, Status> await(std::int64_t next) {
      for (;;) {
        const Player::Place place = frames_.player_.wait(next, changes_, kLook);
        if (context_.IsCancelled()) return errors::cancelled();
        if (place.closed) return errors::server_draining();
        if (place.newest->number >= next) return place;
        if (place.state == v1::SESSION_STATE_FAILED) return frames_.replay_.failed(place);
        if (place.changes == changes_ && Clock::now() - last_write_ < kProgressDue) continue;
        changes_ = place.changes;
        Response message;
        v1::Progress* progress = message.mutable_progress();
        progress->set_latest_frame(place.newest->number);
        progress->set_oldest_frame(frames_.player_.first_frame());
        progress->set_state(place.state);
        progress->set_at_rest(place.newest->at_rest);
        write(message);
      }
    }

    Status write_frame(std::int64_t number, std::int64_t skipped) try {
      for (v1::Frame& part : to_proto(*frames_.player_.frame(number), order_)) {
        Response message;
        *message.mutable_frame() = std::move(part);
        if constexpr (requires { message.set_skipped_count(skipped); })
          message.set_skipped_count(skipped);
        write(message);
      }
      return Status::OK;
    } catch (const Problem& problem) {
      return errors::solver_failed(problem.what(), number - 1);
    }

    void write(const Response& message) {
      writer_.Write(message);
      last_write_ = Clock::now();
    }

   private:
    using Clock = std::chrono::steady_clock;

    FrameReplay& frames_;
    ServerContext& context_;
    Writer writer_;
    FrameOrder order_;
    std::uint64_t changes_ = 0;
    Clock::time_point last_write_;
  };

  // The header of a call that begins at a frame, or why there is none.
  std::variant<v1::StreamHeader, Status> open(const auto& request, std::int64_t start) const {
    if (Status status = replay_.find(request.session()); !status.ok()) return status;
    v1::StreamHeader header = player_.header();
    if (!request.uid().empty() && request.uid() != header.uid()) {
      return errors::uid_changed(header.uid());
    }
    const auto newest = player_.place().newest;
    auto problems =
        find_problems(request.format(), static_cast<std::int64_t>(newest->positions.size()) / 3);
    if (request.format().velocities() && newest->velocities.empty())
      problems.push_back({"format.velocities", "were not recorded; weft record --velocities does"});
    if (request.format().pressure() && newest->pressures.empty())
      problems.push_back({"format.pressure", "was not recorded; weft record --pressure does"});
    if (request.format().clearance() && newest->clearances.empty())
      problems.push_back({"format.clearance", "was not recorded; weft record --clearance does"});
    if (!problems.empty()) return errors::field_invalid(problems);
    if (start < player_.first_frame()) {
      return errors::frame_expired(
          start, {.oldest_frame = player_.first_frame(), .latest_frame = newest->number});
    }
    *header.mutable_format() = with_defaults(request.format());
    header.set_start_frame(start);
    return header;
  }

  Replay& replay_;
  Player& player_;
};

struct ReplayServer::Parts {
  explicit Parts(const std::string& path) : replay(path) {}

  Replay replay;
  SessionReplay sessions{replay};
  FrameReplay frames{replay};
  ServerReplay servers{replay};
  AssetReplay assets{replay};
  Access access{{}, false};
  TextileService textiles{access};
  std::unique_ptr<grpc::Server> grpc;
};

ReplayServer::ReplayServer(const std::string& path, const std::string& address, double time_scale)
    : parts_(std::make_unique<Parts>(path)) {
  grpc::EnableDefaultHealthCheckService(true);
  grpc::ServerBuilder builder;
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  int port = 0;
  builder.AddListeningPort(address, grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&parts_->sessions);
  builder.RegisterService(&parts_->frames);
  builder.RegisterService(&parts_->servers);
  builder.RegisterService(&parts_->assets);
  builder.RegisterService(&parts_->textiles);
  parts_->grpc = builder.BuildAndStart();
  if (!parts_->grpc || port == 0) {
    throw Problem(
        Exit::kRefused, "UNAVAILABLE", "ADDRESS_TAKEN",
        fmt::format("cannot listen on {}; is weftd there? choose another --listen", address));
  }
  address_ = fmt::format("{}:{}", address.substr(0, address.rfind(':')), port);
  parts_->grpc->GetHealthCheckService()->SetServingStatus("", true);
  if (time_scale > 0) parts_->replay.player.run({.time_scale = time_scale});
}

ReplayServer::~ReplayServer() {
  parts_->replay.player.close();
  parts_->grpc->Shutdown(std::chrono::system_clock::now() + std::chrono::seconds(2));
}

std::string ReplayServer::session() const { return parts_->replay.player.header().session(); }
std::int64_t ReplayServer::first_frame() const { return parts_->replay.player.first_frame(); }
std::int64_t ReplayServer::last_frame() const { return parts_->replay.player.last_frame(); }

}  // namespace weft::client
