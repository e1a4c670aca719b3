#include "client/frame_feed.h"

#include <fmt/format.h>

#include "client/recording/points.h"

namespace weft::client {
FrameFeed::FrameFeed(Connection& connection, v1::StreamFramesRequest request,
                     std::chrono::seconds patience)
    : FrameFeed(connection, std::move(request), patience, connection.stop()) {}

FrameFeed::FrameFeed(Connection& connection, v1::StreamFramesRequest request,
                     std::chrono::seconds patience, std::stop_token stop)
    : connection_(connection),
      request_(std::move(request)),
      stop_(std::move(stop)),
      attempts_(connection, request_, patience, stop_) {
  open();
}

FrameFeed::~FrameFeed() {
  cancel_.reset();
  context_->TryCancel();
}

std::optional<v1::StreamFramesResponse> FrameFeed::next() {
  for (;;) {
    v1::StreamFramesResponse message;
    if (reader_->Read(&message)) {
      if (note(message)) return message;
      continue;
    }
    const grpc::Status status = reader_->Finish();
    const bool complete = header_ && request_.has_end_frame() && request_.has_start_frame() &&
                          request_.start_frame() > request_.end_frame();
    if (status.ok() || complete || stop_.stop_requested()) return std::nullopt;
    attempts_.go_on_after(status);
    ++reconnections_;
    open();
  }
}

void FrameFeed::open() {
  cancel_.reset();
  reader_.reset();
  context_ = std::make_unique<grpc::ClientContext>();
  attempts_.address(*context_);
  cancel_.emplace(stop_, [context = context_.get()] { context->TryCancel(); });
  reader_ = connection_.frames().StreamFrames(context_.get(), request_);
}

// Notes what is wanted next; false for a message that the caller has had, or that is a part.
bool FrameFeed::note(v1::StreamFramesResponse& message) {
  attempts_.note_message();
  if (message.has_header()) {
    const std::string& numerics = message.header().numerics_id();
    if (header_ && numerics != header_->numerics_id()) {
      throw Problem(Exit::kRefused, "FAILED_PRECONDITION", "NUMERICS_CHANGED",
                    fmt::format("the server went from numerics {} to {}: the frames to come do not "
                                "continue those before to the bit",
                                header_->numerics_id(), numerics));
    }
    parts_.begin(message.header());
    request_.set_uid(message.header().uid());
    if (!request_.has_start_frame()) request_.set_start_frame(message.header().start_frame());
    header_ = message.header();
    if (!request_.format().topology()) return !std::exchange(begun_, true);
    topology_.begin(*header_);
    return false;
  }
  if (!header_) {
    throw Problem(Exit::kRefused, "INTERNAL", "HEADER_MISSING",
                  "the server sent something else before the header");
  }
  if (message.has_topology()) {
    topology_.join(*message.mutable_topology());
    if (!topology_.is_complete()) return false;
    request_.mutable_format()->clear_topology();  // it stays as it is
    *message.mutable_header() = *header_;
    return !std::exchange(begun_, true);
  }
  if (!begun_) {
    throw Problem(Exit::kRefused, "INTERNAL", "TOPOLOGY_MISSING",
                  "the server sent something else before the triangles of the sheets");
  }
  if (message.has_frame()) {
    if (!parts_.join(*message.mutable_frame())) return false;
    if (!is_whole(message.frame(), *header_)) {
      throw Problem(Exit::kRefused, "INTERNAL", "FRAME_INCOMPLETE",
                    fmt::format("the server sent frame {}, but not as long as its header says",
                                message.frame().number()));
    }
    if (message.frame().number() != request_.start_frame()) {
      throw Problem(Exit::kRefused, "INTERNAL", "FRAME_OUT_OF_ORDER",
                    fmt::format("the server sent frame {} where frame {} was due",
                                message.frame().number(), request_.start_frame()));
    }
    request_.set_start_frame(message.frame().number() + 1);
  }
  return true;
}

}  // namespace weft::client
