#include "server/rpc/textile_service.h"

#include "server/rpc/errors.h"
#include "server/rpc/unary_call.h"
#include "server/textiles/catalogue.h"

namespace weft {

grpc::ServerUnaryReactor* TextileService::ListTextiles(grpc::CallbackServerContext* context,
                                                       const v1::ListTextilesRequest* /*request*/,
                                                       v1::ListTextilesResponse* response) {
  const auto caller = access_.caller(*context);
  if (const auto* error = std::get_if<grpc::Status>(&caller)) return answer(context, *error);
  for (const v1::TextilePreset& preset : presets()) *response->add_textiles() = preset;
  return answer(context, grpc::Status::OK);
}

grpc::ServerUnaryReactor* TextileService::GetTextile(grpc::CallbackServerContext* context,
                                                     const v1::GetTextileRequest* request,
                                                     v1::TextilePreset* response) {
  const auto caller = access_.caller(*context);
  if (const auto* error = std::get_if<grpc::Status>(&caller)) return answer(context, *error);
  if (request->name().empty()) {
    return answer(context, errors::field_invalid("name", "is empty; must be textiles/{textile}"));
  }
  const v1::TextilePreset* preset = find_preset(request->name());
  if (preset == nullptr) return answer(context, errors::textile_not_found(request->name()));
  *response = *preset;
  return answer(context, grpc::Status::OK);
}

}  // namespace weft
