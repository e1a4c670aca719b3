#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/support/status.h>

#include <cstdint>
#include <deque>
#include <map>
#include <memory_resource>
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
  struct Known {
    std::uint32_t checksum = 0;
    std::pmr::string uid;
  };

  mutable std::mutex mutex_;  // guards all below
  // They lie beside each other: scattered, they would keep the memory of sessions that are gone.
  std::pmr::unsynchronized_pool_resource memory_;
  std::pmr::map<std::pmr::string, Known> known_{&memory_};
  std::pmr::deque<std::pmr::string> order_{&memory_};  // oldest first
};

}  // namespace weft
