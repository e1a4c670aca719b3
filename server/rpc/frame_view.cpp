#include "server/rpc/frame_view.h"

#include <string>
#include <utility>

#include "server/rpc/bytes.h"
#include "server/rpc/checks.h"
#include "server/rpc/errors.h"

namespace weft {

void FrameView::start(const grpc::ServerContextBase& context) {
  std::lock_guard lock(mutex_);
  if (begin(context)) StartRead(&request_);
}

void FrameView::OnReadDone(bool ok) {
  std::lock_guard lock(mutex_);
  if (has_ended()) return;
  if (!ok) {
    no_more_ = true;
  } else {
    v1::ViewFramesRequest request;
    const bool decoded = decode(request_, request);
    request_.Clear();
    if (decoded) {
      take(request);
    } else {
      end(errors::message_malformed("weft.v1.ViewFramesRequest"));
    }
  }
  read_on();
}

void FrameView::take(const v1::ViewFramesRequest& request) {
  std::vector<Problem> problems = find_problems(request, credits_);
  const auto first_alone = [&](const char* field, bool given) {
    if (given) problems.push_back({field, "belongs to the first message alone"});
  };
  if (problems.empty()) credits_ += request.credits();
  if (!is_subscribed())
    return find(request.session(), request.uid(), request.format(), std::move(problems));
  first_alone("session", !request.session().empty());
  first_alone("uid", !request.uid().empty());
  first_alone("format", request.has_format());
  if (!problems.empty()) return end(errors::field_invalid(problems));
  StartRead(&request_);
}

grpc::Status FrameView::open() {
  subscribe({}, SlowReader::kSkip);
  write_header();
  StartRead(&request_);
  return grpc::Status::OK;
}

bool FrameView::do_first() {
  if (!no_more_ || credits_ > 0) return false;
  finish(grpc::Status::OK);
  return true;
}

std::vector<grpc::ByteBuffer> FrameView::messages_of(const Reading& reading) {
  --credits_;
  auto parts = encoded_frame(*reading.frame, order());
  if (reading.skipped == 0) return parts;
  // a message's fields may follow each other in any order and in pieces
  v1::ViewFramesResponse rest;
  rest.set_skipped_count(reading.skipped);
  for (grpc::ByteBuffer& part : parts) {
    std::vector<grpc::Slice> slices;
    part.Dump(&slices);
    slices.emplace_back(rest.SerializeAsString());
    part = {slices.data(), slices.size()};
  }
  return parts;
}

}  // namespace weft
