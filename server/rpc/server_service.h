#pragma once

#include "server/rpc/backend.h"
#include "weft/v1/server.grpc.pb.h"

namespace weft {

class ServerService final : public v1::ServerService::CallbackService {
 public:
  explicit ServerService(const Backend& backend) : backend_(backend) {}

  grpc::ServerUnaryReactor* GetServerInfo(grpc::CallbackServerContext* context,
                                          const v1::GetServerInfoRequest* request,
                                          v1::ServerInfo* response) override;
  grpc::ServerUnaryReactor* GetServerStats(grpc::CallbackServerContext* context,
                                           const v1::GetServerStatsRequest* request,
                                           v1::ServerStats* response) override;

 private:
  const Backend& backend_;
};

}  // namespace weft
