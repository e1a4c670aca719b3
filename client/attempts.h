#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <optional>
#include <stop_token>
#include <string>

namespace weft::client {

class Connection;

// How long attempts are made after the first that failed.
inline constexpr std::chrono::seconds kPatience{10};

// Gives a call that changes something a request_id where it has a field for one and none in it.
void name_call(google::protobuf::Message& request);

// The attempts to have a call answered. There may be several servers behind one address: calls say
// in their metadata which session they speak of (weft-session) and, where a server answered that
// another one has it, which one that is (weft-replica), for a load balancer to go by. An attempt
// that was refused as WRONG_REPLICA is followed by another; so is one that met a server that is
// draining or cannot ask its database, or that ended on the road, as far as sending it again does
// no harm: it only reads, has a request_id, or brings an asset.
class Attempts {
 public:
  // Of a call, or of a stream that begins with this request. Where a server was draining, patience
  // is kPatience at most.
  Attempts(Connection& connection, const google::protobuf::Message& request,
           std::chrono::milliseconds patience = kPatience);
  Attempts(Connection& connection, const google::protobuf::Message& request,
           std::chrono::milliseconds patience, std::stop_token stop);

  // Tells a load balancer where the attempt belongs.
  void address(grpc::ClientContext& context) const;
  // A message came: patience begins anew. A stream that cannot be repeated has no more attempts.
  void note_message();
  // After an attempt that ended so, not well: waits until it is time for the next, or throws the
  // reason why there is none.
  void go_on_after(const grpc::Status& status);

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kFirstPause{50};

  bool is_hopeless(const grpc::Status& status) const;

  Connection& connection_;
  std::chrono::milliseconds patience_;
  std::stop_token stop_;
  bool repeatable_;
  bool heard_ = false;
  std::string session_, replica_;
  // since the last message
  std::optional<Clock::time_point> first_failure_;
  std::optional<grpc::Status> refusal_;  // of a server, the latest
  std::chrono::milliseconds pause_ = kFirstPause;
};

}  // namespace weft::client
