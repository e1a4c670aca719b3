#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/support/status.h>

#include <mutex>
#include <optional>
#include <string>
#include <variant>

#include "server/rpc/access.h"
#include "server/session/request.h"

namespace weft {

// How the caller named the call, or what is wrong with the name. Names are those of each principal.
std::variant<Request, grpc::Status> named_request(const Caller& caller,
                                                  const google::protobuf::Message& message,
                                                  const std::string& request_id);

// The latest creations and deletions that were named. Thread-safe.
class Requests {
 public:
  static constexpr std::size_t kMost = 10'000;

  // The uid of the session it made or deleted, where it was carried out; an error where its name
  // was given to another call.
  std::variant<std::optional<std::string>, grpc::Status> find(const Request& request) const;
  void remember(const Request& request, const std::string& uid);

 private:
  mutable std::mutex mutex_;
  Answers<std::string> uids_{kMost};
};

}  // namespace weft
