#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/status.h>

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/rpc/backend.h"
#include "server/rpc/find.h"
#include "server/rpc/frame_encoding.h"
#include "weft/v1/frame.pb.h"

namespace weft {

class FrameStreams;

// A call that sends the frames of a session. It holds a place in them and one message in flight, no
// queue: whenever a write is done or something is new, it reads on. Lives until its reactor is
// done.
class FrameCall : public FrameSink, public std::enable_shared_from_this<FrameCall> {
 public:
  FrameCall(Backend& backend, FrameStreams& streams)
      : backend_(backend), streams_(streams), ticket_(backend.calls) {}

  void offer() override;
  void tick(Clock::time_point now);  // sends Progress when it is due
  void drain();                      // ends the call with SERVER_DRAINING

 protected:
  ~FrameCall() override = default;

  // What the reactor says.
  void on_write_done(bool ok);
  void on_cancel();
  void on_done();

  // all below with the mutex held
  // First; false where the call is not taken, and finished.
  bool begin(const grpc::ServerContextBase& context);
  // Looks for the session and format asked for, then opens the call or ends it; more `problems` may
  // be known.
  void find(const std::string& name, const std::string& uid, const v1::FrameFormat& format,
            std::vector<Problem> problems);
  void subscribe(std::optional<std::int64_t> start, SlowReader policy);
  void write_header();
  void write(const grpc::ByteBuffer& message);
  void read_on(Clock::duration silence = {});
  void finish(const grpc::Status& status);

  const FrameOrder& order() const { return order_; }
  const Session& session() const { return *session_; }
  Subscription& subscription() { return *subscription_; }
  bool is_subscribed() const { return subscription_ != nullptr; }
  void end(const grpc::Status& status) { ending_ = status; }
  bool has_ended() const { return ending_ || finished_; }
  std::optional<std::int64_t> last_frame() const { return last_frame_; }

  std::mutex mutex_;  // guards all below, and what derived classes have

 private:
  // What is left to do once session() is there: subscribes, and writes the header.
  virtual grpc::Status open() = 0;
  // Whether something came before reading on, which is now done.
  virtual bool do_first() = 0;
  virtual bool wants_frame() const { return true; }
  virtual std::vector<grpc::ByteBuffer> messages_of(const Reading& reading) = 0;
  virtual void start_write(const grpc::ByteBuffer* message) = 0;
  virtual void finish_call(const grpc::Status& status) = 0;

  grpc::Status take(const FoundSession& found, const std::string& uid,
                    std::vector<Problem> problems);
  void write_progress(const Progress& progress);
  void write_topology();
  void write_part();

  Backend& backend_;
  FrameStreams& streams_;
  OpenCalls::Ticket ticket_;
  std::shared_ptr<FrameCall> self_;  // until the reactor is done

  StreamCaller caller_;
  std::string name_;  // of the session
  FrameOrder order_;
  std::shared_ptr<Session> session_;
  std::unique_ptr<Subscription> subscription_;
  grpc::ByteBuffer message_;  // in flight
  bool writing_ = false;
  bool finished_ = false;
  std::optional<grpc::Status> ending_;      // as soon as nothing is in flight
  std::vector<grpc::ByteBuffer> topology_;  // after the header, still to be written
  std::vector<grpc::ByteBuffer> parts_;     // of frame_, still to be written
  std::int64_t frame_ = 0;
  std::optional<std::int64_t> last_frame_;  // of which no part is left
  std::uint64_t state_changes_ = 0;
  Clock::time_point last_write_;
};

}  // namespace weft
