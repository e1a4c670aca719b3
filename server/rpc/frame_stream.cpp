#include "server/rpc/frame_stream.h"

#include <string>
#include <utility>

#include "server/convert/convert.h"
#include "server/rpc/bytes.h"
#include "server/rpc/errors.h"

namespace weft {

void FrameStream::start(const grpc::ServerContextBase& context, const grpc::ByteBuffer& request) {
  std::lock_guard lock(mutex_);
  if (!begin(context)) return;
  if (!decode(request, request_))
    return finish(errors::message_malformed("weft.v1.StreamFramesRequest"));
  std::vector<Problem> problems;
  if (request_.start_frame() < 0) {
    problems.push_back({"start_frame", std::to_string(request_.start_frame()) + " is below 0"});
  }
  if (!v1::SlowReader_IsValid(request_.slow_reader())) {
    problems.push_back(
        {"slow_reader", std::to_string(request_.slow_reader()) + " is no weft.v1.SlowReader"});
  }
  find(request_.session(), request_.uid(), request_.format(), std::move(problems));
  read_on();
}

grpc::Status FrameStream::open() {
  const bool hold = request_.slow_reader() == v1::SLOW_READER_HOLD_SESSION;
  subscribe(request_.has_start_frame() ? std::optional(request_.start_frame()) : std::nullopt,
            hold ? SlowReader::kHoldSession : SlowReader::kDisconnect);
  const Progress progress = subscription().progress();
  const std::int64_t first = subscription().next_frame();
  if (first < progress.oldest_frame) return errors::frame_expired(first, progress);
  if (request_.has_end_frame() && request_.end_frame() < first) {
    return errors::field_invalid("end_frame", std::to_string(request_.end_frame()) +
                                                  " lies before the first frame, " +
                                                  std::to_string(first));
  }
  write_header();
  return grpc::Status::OK;
}

bool FrameStream::do_first() {
  if (!repairs_.empty()) {
    v1::StreamFramesResponse message;
    *message.mutable_repair() = to_proto(repairs_.front());
    repairs_.pop_front();
    write(encoded(message));
    return true;
  }
  if (!last_frame() || !request_.has_end_frame() || *last_frame() < request_.end_frame()) {
    return false;
  }
  finish(grpc::Status::OK);
  return true;
}

std::vector<grpc::ByteBuffer> FrameStream::messages_of(const Reading& reading) {
  repairs_.assign(reading.frame->repairs.begin(), reading.frame->repairs.end());
  return encoded_frame(*reading.frame, order());
}

}  // namespace weft
