#include "server/rpc/textile_service.h"

#include "server/rpc/errors.h"
#include "server/textiles/catalogue.h"

namespace weft {
namespace {

grpc::ServerUnaryReactor* finish(grpc::CallbackServerContext* context, const grpc::Status& status) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(status);
  return reactor;
}

}  // namespace

grpc::ServerUnaryReactor* TextileService::ListTextiles(grpc::CallbackServerContext* context,
                                                       const v1::ListTextilesRequest* /*request*/,
                                                       v1::ListTextilesResponse* response) {
  for (const v1::TextilePreset& preset : presets()) *response->add_textiles() = preset;
  return finish(context, grpc::Status::OK);
}

grpc::ServerUnaryReactor* TextileService::GetTextile(grpc::CallbackServerContext* context,
                                                     const v1::GetTextileRequest* request,
                                                     v1::TextilePreset* response) {
  if (request->name().empty()) {
    return finish(context, errors::field_invalid("name", "is empty; must be textiles/{textile}"));
  }
  const v1::TextilePreset* preset = find_preset(request->name());
  if (preset == nullptr) return finish(context, errors::textile_not_found(request->name()));
  *response = *preset;
  return finish(context, grpc::Status::OK);
}

}  // namespace weft
