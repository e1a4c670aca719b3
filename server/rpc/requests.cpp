#include "server/rpc/requests.h"

#include <zlib.h>

#include <algorithm>
#include <utility>

#include "server/rpc/errors.h"

namespace weft {

std::variant<Request, grpc::Status> named_request(const Caller& caller,
                                                  const google::protobuf::Message& message,
                                                  const std::string& request_id) {
  constexpr std::size_t kLongest = 128;
  const bool printable =
      std::all_of(request_id.begin(), request_id.end(), [](char c) { return c > ' ' && c <= '~'; });
  if (!printable || request_id.size() > kLongest) {
    return errors::field_invalid("request_id",
                                 "is not up to 128 printable ASCII characters without spaces");
  }
  if (request_id.empty()) return Request{};
  const std::string content = message.GetDescriptor()->full_name() + message.SerializeAsString();
  const auto checksum = crc32_z(0, reinterpret_cast<const Bytef*>(content.data()), content.size());
  const std::string whose = caller.principal.empty() ? "" : caller.principal + " ";
  return Request{whose + request_id, static_cast<std::uint32_t>(checksum)};
}

std::variant<std::optional<std::string>, grpc::Status> Requests::find(
    const Request& request) const {
  std::lock_guard lock(mutex_);
  const auto found = known_.find(std::pmr::string(request.id));
  if (request.id.empty() || found == known_.end()) return std::nullopt;
  const Known& known = found->second;
  if (known.checksum != request.checksum) return errors::request_used();
  return std::string(known.uid);
}

void Requests::remember(const Request& request, const std::string& uid) {
  std::lock_guard lock(mutex_);
  if (request.id.empty()) return;
  Known known{request.checksum, std::pmr::string(uid, &memory_)};
  if (!known_.emplace(request.id, std::move(known)).second) return;
  order_.emplace_back(request.id);
  if (order_.size() <= kMost) return;
  known_.erase(order_.front());
  order_.pop_front();
}

}  // namespace weft
