#include "server/rpc/backend.h"

#include "server/rpc/errors.h"

namespace weft {

std::variant<StreamCaller, grpc::Status> Backend::admit(const grpc::ServerContextBase& context) {
  auto caller = access.caller(context);
  if (const auto* error = std::get_if<grpc::Status>(&caller)) return *error;
  auto share = streams.take(std::get<Caller>(caller).principal, 1);
  if (const auto* excess = std::get_if<Quota::Excess>(&share)) return errors::exhausted(*excess);
  return StreamCaller{std::get<Caller>(std::move(caller)),
                      std::get<Quota::Share>(std::move(share))};
}

}  // namespace weft
