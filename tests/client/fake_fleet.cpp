#include "tests/client/fake_fleet.h"

#include <google/rpc/error_details.pb.h>
#include <google/rpc/status.pb.h>

#include <chrono>
#include <utility>

namespace weft::testing {
namespace {

std::string metadata(const grpc::ServerContext& context, const char* key) {
  const auto& all = context.client_metadata();
  const auto found = all.find(key);
  return found == all.end() ? "" : std::string(found->second.data(), found->second.size());
}

template <class Message>
Message header_of(std::int64_t start_frame) {
  Message message;
  v1::StreamHeader* header = message.mutable_header();
  header->set_uid("uid-1");
  header->set_start_frame(start_frame);
  header->set_numerics_id("numerics");
  v1::SheetLayout* sheet = header->add_sheets();
  sheet->set_name("sheet");
  sheet->set_rows(1);
  sheet->set_columns(1);
  header->mutable_format()->set_encoding(v1::FRAME_ENCODING_FLOAT32);
  return message;
}

template <class Message>
Message frame_of(std::int64_t number) {
  Message message;
  message.mutable_frame()->set_number(number);
  message.mutable_frame()->set_positions_m(std::string(3 * sizeof(float), '\0'));
  return message;
}

}  // namespace

grpc::Status refusal(grpc::StatusCode code, const std::string& reason, const std::string& replica) {
  google::rpc::Status status;
  google::rpc::ErrorInfo info;
  info.set_domain("weft.v1");
  info.set_reason(reason);
  if (!replica.empty()) (*info.mutable_metadata())["replica"] = replica;
  if (!reason.empty()) status.add_details()->PackFrom(info);
  return {code, reason, status.SerializeAsString()};
}

grpc::Status wrong_replica(const std::string& owner) {
  return refusal(grpc::StatusCode::UNAVAILABLE, "WRONG_REPLICA", owner);
}

grpc::Status draining() { return refusal(grpc::StatusCode::UNAVAILABLE, "SERVER_DRAINING"); }

grpc::Status stream_removed() { return {grpc::StatusCode::UNKNOWN, "Stream removed"}; }

class FakeFleet::Sessions : public v1::SessionService::Service {
 public:
  explicit Sessions(FakeFleet& fleet) : fleet_(fleet) {}

  grpc::Status CreateSession(grpc::ServerContext* context, const v1::CreateSessionRequest* request,
                             v1::Session*) override {
    return fleet_.next(*context, {.request_id = request->request_id()});
  }
  grpc::Status GetSession(grpc::ServerContext* context, const v1::GetSessionRequest* request,
                          v1::Session* response) override {
    response->set_name(request->name());
    return fleet_.next(*context, {});
  }
  grpc::Status StepSession(grpc::ServerContext* context, const v1::StepSessionRequest* request,
                           v1::StepSessionResponse*) override {
    return fleet_.next(*context, {.request_id = request->request_id()});
  }

 private:
  FakeFleet& fleet_;
};

class FakeFleet::Frames : public v1::FrameService::Service {
 public:
  explicit Frames(FakeFleet& fleet) : fleet_(fleet) {}

  grpc::Status StreamFrames(grpc::ServerContext* context, const v1::StreamFramesRequest* request,
                            grpc::ServerWriter<v1::StreamFramesResponse>* writer) override {
    using Message = v1::StreamFramesResponse;
    const std::int64_t start = request->start_frame();
    const grpc::Status end =
        fleet_.next(*context, {.uid = request->uid(), .start_frame = request->start_frame()});
    writer->Write(header_of<Message>(start));
    const std::int64_t last = end.ok() ? request->end_frame() : start + 1;
    for (std::int64_t number = start; number <= last; ++number)
      writer->Write(frame_of<Message>(number));
    if (!end.ok()) {  // amid a frame
      auto part = frame_of<Message>(last + 1);
      part.mutable_frame()->mutable_positions_m()->resize(5);
      part.mutable_frame()->set_continued(true);
      writer->Write(part);
    }
    return end;
  }

  // A frame for each message, to the first of them behind the header.
  grpc::Status ViewFrames(
      grpc::ServerContext* context,
      grpc::ServerReaderWriter<v1::ViewFramesResponse, v1::ViewFramesRequest>* stream) override {
    using Message = v1::ViewFramesResponse;
    v1::ViewFramesRequest request;
    if (!stream->Read(&request)) return grpc::Status::OK;
    const grpc::Status end = fleet_.next(*context, {.uid = request.uid()});
    stream->Write(header_of<Message>(0));
    for (std::int64_t number = 0; end.ok(); ++number) {
      stream->Write(frame_of<Message>(number));
      if (!stream->Read(&request)) break;
    }
    return end;
  }

 private:
  FakeFleet& fleet_;
};

FakeFleet::FakeFleet(std::deque<grpc::Status> errors)
    : errors_(std::move(errors)),
      sessions_(std::make_unique<Sessions>(*this)),
      frames_(std::make_unique<Frames>(*this)) {
  int port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(sessions_.get());
  builder.RegisterService(frames_.get());
  server_ = builder.BuildAndStart();
  address_ = "127.0.0.1:" + std::to_string(port);
}

FakeFleet::~FakeFleet() {
  server_->Shutdown(std::chrono::system_clock::now());
  server_->Wait();
}

std::vector<Attempt> FakeFleet::attempts() const {
  const std::lock_guard lock(mutex_);
  return attempts_;
}

grpc::Status FakeFleet::next(const grpc::ServerContext& context, Attempt attempt) {
  attempt.session = metadata(context, "weft-session");
  attempt.replica = metadata(context, "weft-replica");
  const std::lock_guard lock(mutex_);
  attempts_.push_back(std::move(attempt));
  if (errors_.empty()) return grpc::Status::OK;
  const grpc::Status error = errors_.front();
  errors_.pop_front();
  return error;
}

}  // namespace weft::testing
