#pragma once

#include <grpcpp/grpcpp.h>

#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "weft/v1/frame.grpc.pb.h"
#include "weft/v1/session.grpc.pb.h"

namespace weft::testing {

// Errors as a fleet answers them; without a reason as a proxy does.
grpc::Status refusal(grpc::StatusCode code, const std::string& reason,
                     const std::string& replica = {});
grpc::Status wrong_replica(const std::string& owner);
grpc::Status draining();
grpc::Status stream_removed();

// What a load balancer and weftd could see of an attempt.
struct Attempt {
  std::string session{}, replica{};  // of the metadata
  std::string request_id{};
  std::string uid{};             // of a stream
  std::int64_t start_frame = 0;  // of a stream

  bool operator==(const Attempt&) const = default;
};

// Servers behind one address that end as many attempts as there are errors with those, in order,
// and answer the others. Frames have one particle; a stream that is to end with an error does so
// after two.
class FakeFleet {
 public:
  explicit FakeFleet(std::deque<grpc::Status> errors);
  ~FakeFleet();
  FakeFleet(const FakeFleet&) = delete;
  FakeFleet& operator=(const FakeFleet&) = delete;

  const std::string& address() const { return address_; }
  std::vector<Attempt> attempts() const;

 private:
  class Sessions;
  class Frames;

  // Of the attempt, which it notes.
  grpc::Status next(const grpc::ServerContext& context, Attempt attempt);

  mutable std::mutex mutex_;
  std::deque<grpc::Status> errors_;
  std::vector<Attempt> attempts_;
  std::unique_ptr<Sessions> sessions_;
  std::unique_ptr<Frames> frames_;
  std::string address_;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace weft::testing
