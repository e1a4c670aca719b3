#include "server/rpc/frame_stream.h"

#include <grpcpp/impl/codegen/proto_utils.h>

#include <utility>

#include "server/rpc/convert.h"
#include "server/rpc/errors.h"
#include "server/rpc/frame_encoding.h"
#include "server/rpc/frame_streams.h"
#include "server/rpc/names.h"
#include "server/rpc/server_service.h"

namespace weft {

void FrameStream::start(const grpc::ByteBuffer& request) {
  std::lock_guard lock(mutex_);
  self_ = shared_from_this();
  if (auto status = open(request); !status.ok()) return finish(status);
  write_header();
}

grpc::Status FrameStream::open(const grpc::ByteBuffer& request) {
  grpc::ByteBuffer bytes(request);
  if (!grpc::SerializationTraits<v1::StreamFramesRequest>::Deserialize(&bytes, &request_).ok()) {
    return errors::message_malformed("weft.v1.StreamFramesRequest");
  }
  *request_.mutable_format() = with_defaults(request_.format());
  const auto found = find_session(backend_.registry, request_.session(), "session");
  if (const auto* error = std::get_if<grpc::Status>(&found)) return *error;
  session_ = std::get<std::shared_ptr<Session>>(found);
  if (auto status = check(); !status.ok()) return status;
  if (auto status = streams_.add(self_); !status.ok()) return status;

  const bool hold = request_.slow_reader() == v1::SLOW_READER_HOLD_SESSION;
  subscription_ = session_->subscribe(
      weak_from_this(),
      request_.has_start_frame() ? std::optional(request_.start_frame()) : std::nullopt,
      hold ? SlowReader::kHoldSession : SlowReader::kDisconnect);
  const Progress progress = subscription_->progress();
  state_changes_ = progress.state_changes;
  const std::int64_t first = subscription_->next_frame();
  if (first < progress.oldest_frame) return errors::frame_expired(first, progress);
  if (request_.has_end_frame() && request_.end_frame() < first) {
    return errors::field_invalid("end_frame", std::to_string(request_.end_frame()) +
                                                  " lies before the first frame, " +
                                                  std::to_string(first));
  }
  return grpc::Status::OK;
}

// What the request says, as far as it does not depend on the newest frame.
grpc::Status FrameStream::check() const {
  if (!request_.uid().empty() && request_.uid() != session_->uid()) {
    return errors::aborted("UID_CHANGED", "this name belongs to another session now",
                           {{"uid", session_->uid()}});
  }
  std::vector<Problem> problems;
  if (request_.start_frame() < 0) {
    problems.push_back({"start_frame", std::to_string(request_.start_frame()) + " is below 0"});
  }
  if (!v1::FrameEncoding_IsValid(request_.format().encoding())) {
    problems.push_back({"format.encoding", std::to_string(request_.format().encoding()) +
                                               " is no weft.v1.FrameEncoding"});
  }
  if (!v1::SlowReader_IsValid(request_.slow_reader())) {
    problems.push_back(
        {"slow_reader", std::to_string(request_.slow_reader()) + " is no weft.v1.SlowReader"});
  }
  const auto particles = static_cast<std::int64_t>(session_->status().newest->positions.size()) / 3;
  const std::int64_t bytes = frame_bytes(request_.format(), particles);
  if (bytes > backend_.limits.max_frame_bytes) {
    problems.push_back({"format", "a frame of " + std::to_string(particles) + " particles takes " +
                                      std::to_string(bytes) + " bytes in this format; at most " +
                                      std::to_string(backend_.limits.max_frame_bytes) +
                                      " are sent"});
  }
  return problems.empty() ? grpc::Status::OK : errors::field_invalid(problems);
}

void FrameStream::offer() {
  std::lock_guard lock(mutex_);
  read_on(false);
}

void FrameStream::tick(Clock::time_point now) {
  std::lock_guard lock(mutex_);
  read_on(now - last_write_ >= FrameStreams::kProgressInterval);
}

void FrameStream::drain() {
  std::lock_guard lock(mutex_);
  ending_ = errors::server_draining(
      last_frame_ ? errors::Metadata{{"last_frame", std::to_string(*last_frame_)}}
                  : errors::Metadata{});
  read_on(false);
}

void FrameStream::OnWriteDone(bool ok) {
  std::lock_guard lock(mutex_);
  writing_ = false;
  message_.Clear();
  if (!ok) ending_ = errors::cancelled();
  read_on(false);
}

void FrameStream::OnCancel() {
  std::lock_guard lock(mutex_);
  ending_ = errors::cancelled();
  read_on(false);
}

void FrameStream::OnDone() {
  const auto self = std::move(self_);
  streams_.remove(self);
}

void FrameStream::read_on(bool progress_due) {
  if (writing_ || finished_) return;
  if (ending_) return finish(*ending_);
  if (!repairs_.empty()) return write_repair();
  if (last_frame_ && request_.has_end_frame() && *last_frame_ >= request_.end_frame()) {
    return finish(grpc::Status::OK);
  }
  const Reading reading = subscription_->read();
  switch (reading.kind) {
    case Reading::Kind::kFrame:
      last_frame_ = reading.frame->number;
      repairs_.assign(reading.frame->repairs.begin(), reading.frame->repairs.end());
      return write_frame(*reading.frame);
    case Reading::Kind::kNothingYet:
      if (progress_due || reading.progress.state_changes != state_changes_) {
        write_progress(reading.progress);
      }
      return;
    case Reading::Kind::kExpired:
      ++backend_.stats.slow_readers;
      return finish(errors::frame_expired(subscription_->next_frame(), reading.progress));
    case Reading::Kind::kFailed:
      return finish(
          errors::solver_failed(session_->status().failure, reading.progress.latest_frame));
    case Reading::Kind::kDeleted:
      return finish(errors::session_not_found(request_.session()));
  }
}

void FrameStream::write(grpc::ByteBuffer message) {
  message_.Swap(&message);
  writing_ = true;
  last_write_ = Clock::now();
  StartWrite(&message_);
}

void FrameStream::write_frame(const Frame& frame) {
  grpc::ByteBuffer message = encoded_frame(frame, request_.format());
  ++backend_.stats.frames_sent;
  backend_.stats.bytes_sent += static_cast<std::int64_t>(message.Length());
  write(message);
}

void FrameStream::write_header() {
  v1::StreamFramesResponse message;
  v1::StreamHeader* header = message.mutable_header();
  header->set_session(request_.session());
  header->set_uid(session_->uid());
  header->set_numerics_id(numerics_id());
  header->set_frame_step_s(session_->scene().solver.frame_step);
  std::int32_t first_particle = 0;
  for (const auto& sheet : session_->scene().sheets) {
    v1::SheetLayout* layout = header->add_sheets();
    layout->set_name(sheet.name);
    layout->set_first_particle(first_particle);
    layout->set_rows(sheet.grid.rows);
    layout->set_columns(sheet.grid.columns);
    first_particle += sheet.particle_count();
  }
  *header->mutable_format() = request_.format();
  header->set_start_frame(subscription_->next_frame());
  write(encoded(message));
}

void FrameStream::write_progress(const Progress& progress) {
  state_changes_ = progress.state_changes;
  v1::StreamFramesResponse message;
  v1::Progress* to = message.mutable_progress();
  to->set_latest_frame(progress.latest_frame);
  to->set_oldest_frame(progress.oldest_frame);
  to->set_state(to_proto(progress.state));
  to->set_at_rest(progress.at_rest);
  write(encoded(message));
}

void FrameStream::write_repair() {
  v1::StreamFramesResponse message;
  *message.mutable_repair() = to_proto(repairs_.front());
  repairs_.pop_front();
  write(encoded(message));
}

void FrameStream::finish(const grpc::Status& status) {
  finished_ = true;
  subscription_.reset();
  Finish(status);
}

}  // namespace weft
