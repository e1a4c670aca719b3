#include "server/rpc/frame_call.h"

#include <utility>

#include "core/lattice/shown.h"
#include "server/convert/convert.h"
#include "server/convert/names.h"
#include "server/convert/numerics.h"
#include "server/rpc/bytes.h"
#include "server/rpc/errors.h"
#include "server/rpc/frame_streams.h"
#include "server/rpc/server_service.h"
#include "server/rpc/topology.h"

namespace weft {

// what both calls send is encoded once
using Streamed = v1::StreamFramesResponse;
using Viewed = v1::ViewFramesResponse;
static_assert(int{Viewed::kHeaderFieldNumber} == int{Streamed::kHeaderFieldNumber} &&
              int{Viewed::kFrameFieldNumber} == int{Streamed::kFrameFieldNumber} &&
              int{Viewed::kProgressFieldNumber} == int{Streamed::kProgressFieldNumber} &&
              int{Viewed::kTopologyFieldNumber} == int{Streamed::kTopologyFieldNumber});

bool FrameCall::begin(const grpc::ServerContextBase& context) {
  self_ = shared_from_this();
  auto admitted = backend_.admit(context);
  grpc::Status status;
  if (const auto* error = std::get_if<grpc::Status>(&admitted)) {
    status = *error;
  } else {
    caller_ = std::get<StreamCaller>(std::move(admitted));
    status = streams_.add(self_);
  }
  if (!status.ok()) finish(status);
  return status.ok();
}

void FrameCall::find(const std::string& name, const std::string& uid, const v1::FrameFormat& format,
                     std::vector<Problem> problems) {
  name_ = name;
  order_.format = format;
  if (const auto found = find_here(backend_, caller_.caller, name, "session")) {
    if (const auto status = take(*found, uid, std::move(problems)); !status.ok()) end(status);
    return;
  }
  find_elsewhere(backend_, caller_.caller, name,
                 [self = shared_from_this(), uid, problems](const FoundSession& found) {
                   std::lock_guard lock(self->mutex_);
                   if (self->has_ended()) return;
                   const auto status = self->take(found, uid, problems);
                   if (!status.ok()) self->end(status);
                   self->read_on();
                 });
}

grpc::Status FrameCall::take(const FoundSession& found, const std::string& uid,
                             std::vector<Problem> problems) {
  if (const auto* error = std::get_if<grpc::Status>(&found)) return *error;
  session_ = std::get<std::shared_ptr<Session>>(found);
  if (!uid.empty() && uid != session_->uid()) {
    return errors::uid_changed(session_->uid());
  }
  std::int64_t particles = 0;
  for (const auto& sheet : session_->scene().sheets) {
    order_.sheets.push_back(sheet.shape);
    particles += particle_count(shown(sheet.shape));
  }
  for (auto& problem : find_problems(order_.format, particles)) {
    problems.push_back(std::move(problem));
  }
  if (order_.format.clearance() && session_->scene().colliders.empty())
    problems.push_back({"format.clearance", "the scene has no collider"});
  if (!problems.empty()) return errors::field_invalid(problems);
  order_.format = with_defaults(order_.format);
  order_.most_bytes = backend_.limits.max_frame_bytes;
  return open();
}

void FrameCall::subscribe(std::optional<std::int64_t> start, SlowReader policy) {
  subscription_ = session_->subscribe(weak_from_this(), start, policy, order_.format.stats());
  state_changes_ = subscription_->progress().state_changes;
}

void FrameCall::offer() {
  std::lock_guard lock(mutex_);
  read_on();
}

void FrameCall::tick(Clock::time_point now) {
  std::lock_guard lock(mutex_);
  read_on(now - last_write_);
}

void FrameCall::drain() {
  std::lock_guard lock(mutex_);
  ending_ = errors::server_draining(
      last_frame_ ? errors::Metadata{{"last_frame", std::to_string(*last_frame_)}}
                  : errors::Metadata{});
  read_on();
}

void FrameCall::on_write_done(bool ok) {
  std::lock_guard lock(mutex_);
  writing_ = false;
  message_.Clear();
  if (!ok) ending_ = errors::cancelled();
  read_on();
}

void FrameCall::on_cancel() {
  std::lock_guard lock(mutex_);
  ending_ = errors::cancelled();
  read_on();
}

void FrameCall::on_done() {
  const auto self = std::move(self_);
  streams_.remove(self);
}

// silence: since something was written, where it is time to think of Progress.
void FrameCall::read_on(Clock::duration silence) {
  if (writing_ || finished_) return;
  if (ending_) return finish(*ending_);
  if (!topology_.empty()) return write_topology();
  if (!parts_.empty()) return write_part();
  if (do_first() || !subscription_) return;
  const Reading reading = subscription_->read(wants_frame());
  switch (reading.kind) {
    case Reading::Kind::kFrame: {
      parts_ = messages_of(reading);
      frame_ = reading.frame->number;
      ++backend_.stats.frames_sent;
      return write_part();
    }
    case Reading::Kind::kNothingYet: {
      const auto interval = reading.progress.frame_share > 0 ? FrameStreams::kLongFrameInterval
                                                             : FrameStreams::kProgressInterval;
      const bool due = silence >= interval || reading.progress.state_changes != state_changes_;
      if (wants_frame() && due) write_progress(reading.progress);
      return;
    }
    case Reading::Kind::kExpired:
      ++backend_.stats.slow_readers;
      return finish(errors::frame_expired(subscription_->next_frame(), reading.progress));
    case Reading::Kind::kFailed:
      return finish(
          errors::solver_failed(session_->status().failure, reading.progress.latest_frame));
    case Reading::Kind::kDeleted:
      return finish(errors::session_not_found(name_));
    case Reading::Kind::kEvicted:
      return finish(errors::wrong_replica(name_, ""));
  }
}

void FrameCall::write_part() {
  const grpc::ByteBuffer part = parts_.front();
  parts_.erase(parts_.begin());
  if (parts_.empty()) last_frame_ = frame_;
  backend_.stats.bytes_sent += static_cast<std::int64_t>(part.Length());
  write(part);
}

void FrameCall::write_topology() {
  const grpc::ByteBuffer part = topology_.front();
  topology_.erase(topology_.begin());
  backend_.stats.bytes_sent += static_cast<std::int64_t>(part.Length());
  write(part);
}

void FrameCall::write(const grpc::ByteBuffer& message) {
  message_ = message;  // shares the bytes
  writing_ = true;
  last_write_ = Clock::now();
  start_write(&message_);
}

void FrameCall::write_header() {
  v1::StreamFramesResponse message;
  v1::StreamHeader* header = message.mutable_header();
  header->set_session(name_);
  header->set_uid(session_->uid());
  header->set_numerics_id(numerics_id());
  header->set_frame_step_s(session_->scene().solver.frame_step);
  std::int32_t first_particle = 0;
  for (const auto& sheet : session_->scene().sheets) {
    v1::SheetLayout* layout = header->add_sheets();
    layout->set_name(sheet.name);
    layout->set_first_particle(first_particle);
    const SheetShape shape = shown(sheet.shape);
    if (const auto* grid = std::get_if<Grid>(&shape)) {
      layout->set_rows(grid->rows);
      layout->set_columns(grid->columns);
      layout->set_simulated_every(std::get<Grid>(sheet.shape).simulated_every);
    }
    layout->set_particle_count(particle_count(shape));
    layout->set_triangle_count(triangle_count(shape));
    first_particle += layout->particle_count();
  }
  *header->mutable_format() = order_.format;
  header->set_start_frame(subscription_->next_frame());
  if (order_.format.topology())
    topology_ = encoded_topology(shown(order_.sheets), backend_.limits.max_frame_bytes);
  write(encoded(message));
}

void FrameCall::write_progress(const Progress& progress) {
  state_changes_ = progress.state_changes;
  v1::StreamFramesResponse message;
  v1::Progress* to = message.mutable_progress();
  to->set_latest_frame(progress.latest_frame);
  to->set_oldest_frame(progress.oldest_frame);
  to->set_state(to_proto(progress.state));
  to->set_at_rest(progress.at_rest);
  to->set_frame_share(progress.frame_share);
  write(encoded(message));
}

void FrameCall::finish(const grpc::Status& status) {
  finished_ = true;
  subscription_.reset();
  finish_call(status);
}

}  // namespace weft
