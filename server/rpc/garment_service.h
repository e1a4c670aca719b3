#pragma once

#include "server/rpc/backend.h"
#include "weft/v1/garment.grpc.pb.h"

namespace weft {

// Makes garments of patterns, one after the other on a thread of their own.
class GarmentService final : public v1::GarmentService::CallbackService {
 public:
  explicit GarmentService(Backend& backend) : backend_(backend) {}

  grpc::ServerUnaryReactor* BuildGarment(grpc::CallbackServerContext* context,
                                         const v1::BuildGarmentRequest* request,
                                         v1::BuildGarmentResponse* response) override;

 private:
  Backend& backend_;
};

}  // namespace weft
