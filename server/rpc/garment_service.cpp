#include "server/rpc/garment_service.h"

#include <memory>
#include <utility>

#include "server/convert/garment.h"
#include "server/rpc/errors.h"
#include "server/rpc/unary_call.h"

namespace weft {

grpc::ServerUnaryReactor* GarmentService::BuildGarment(grpc::CallbackServerContext* context,
                                                       const v1::BuildGarmentRequest* request,
                                                       v1::BuildGarmentResponse* response) {
  const auto caller = backend_.access.caller(*context);
  if (const auto* error = std::get_if<grpc::Status>(&caller)) return answer(context, *error);
  auto* call = new UnaryCall(backend_.calls);
  const auto built = std::make_shared<v1::BuildGarmentResponse>();
  // copies: it may outlive the call
  backend_.garments.ask(
      [built, asked = *request] {
        auto garment = build_garment(asked);
        if (const auto* problems = std::get_if<std::vector<Problem>>(&garment))
          return errors::field_invalid(*problems);
        *built = std::get<v1::BuildGarmentResponse>(std::move(garment));
        return grpc::Status::OK;
      },
      [call, response, built](const grpc::Status& status) {
        if (status.ok()) response->Swap(built.get());
        call->Finish(status);
      });
  return call;
}

}  // namespace weft
