#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>

#include "server/rpc/backend.h"
#include "weft/v1/frame.pb.h"

namespace weft {

class FrameStreams;

// One call of StreamFrames. It holds a place in the session's frames and one message in flight, no
// queue: whenever a write is done or something is new, it reads on. Lives until OnDone.
class FrameStream final : public grpc::ServerWriteReactor<grpc::ByteBuffer>,
                          public FrameSink,
                          public std::enable_shared_from_this<FrameStream> {
 public:
  FrameStream(Backend& backend, FrameStreams& streams)
      : backend_(backend), streams_(streams), ticket_(backend.calls) {}

  // Called once, first.
  void start(const grpc::ByteBuffer& request);

  void offer() override;
  void tick(Clock::time_point now);  // sends Progress when it is due
  void drain();                      // ends the stream with SERVER_DRAINING

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  // with the mutex held
  grpc::Status open(const grpc::ByteBuffer& request);
  grpc::Status check() const;
  void read_on(bool progress_due);
  void write(grpc::ByteBuffer message);
  void write_frame(const Frame& frame);
  void write_header();
  void write_progress(const Progress& progress);
  void write_repair();
  void finish(const grpc::Status& status);

  Backend& backend_;
  FrameStreams& streams_;
  OpenCalls::Ticket ticket_;
  std::shared_ptr<FrameStream> self_;  // until OnDone

  std::mutex mutex_;  // guards all below
  v1::StreamFramesRequest request_;
  std::shared_ptr<Session> session_;
  std::unique_ptr<Subscription> subscription_;
  grpc::ByteBuffer message_;  // in flight
  bool writing_ = false;
  bool finished_ = false;
  std::optional<grpc::Status> ending_;  // as soon as nothing is in flight
  std::optional<std::int64_t> last_frame_;
  std::deque<Repair> repairs_;  // of the last frame, still to be written
  std::uint64_t state_changes_ = 0;
  Clock::time_point last_write_;
};

}  // namespace weft
