#pragma once

#include "server/rpc/access.h"
#include "weft/v1/textile.grpc.pb.h"

namespace weft {

// Answers from the catalogue; the same for every caller, at any time.
class TextileService final : public v1::TextileService::CallbackService {
 public:
  explicit TextileService(const Access& access) : access_(access) {}

  grpc::ServerUnaryReactor* ListTextiles(grpc::CallbackServerContext* context,
                                         const v1::ListTextilesRequest* request,
                                         v1::ListTextilesResponse* response) override;
  grpc::ServerUnaryReactor* GetTextile(grpc::CallbackServerContext* context,
                                       const v1::GetTextileRequest* request,
                                       v1::TextilePreset* response) override;

 private:
  const Access& access_;
};

}  // namespace weft
