#include "server/rpc/server_service.h"

#include <sstream>

#include "core/fingerprint.h"
#include "server/convert/numerics.h"
#include "server/rpc/server_stats.h"
#include "server/rpc/unary_call.h"

namespace weft {

grpc::ServerUnaryReactor* ServerService::GetServerInfo(grpc::CallbackServerContext* context,
                                                       const v1::GetServerInfoRequest*,
                                                       v1::ServerInfo* response) {
  const auto caller = backend_.access.caller(*context);
  if (const auto* error = std::get_if<grpc::Status>(&caller)) return answer(context, *error);
  response->set_version(WEFT_VERSION);
  response->set_numerics_id(numerics_id());
  response->set_worker_threads(backend_.worker_threads);
  response->set_sessions(static_cast<std::int64_t>(backend_.registry.size()));
  response->set_replica(backend_.replica);
  v1::Limits* limits = response->mutable_limits();
  limits->set_max_sessions(backend_.limits.max_sessions);
  limits->set_max_particles_per_session(backend_.limits.max_particles_per_session);
  limits->set_history_bytes_per_session(backend_.limits.history_bytes_per_session);
  limits->set_max_total_history_bytes(backend_.limits.max_total_history_bytes);
  limits->set_max_streams(backend_.limits.max_streams);
  limits->set_max_request_bytes(backend_.limits.max_request_bytes);
  limits->set_max_frame_bytes(backend_.limits.max_frame_bytes);
  limits->set_max_snapshots_per_session(backend_.limits.max_snapshots_per_session);
  limits->set_max_frame_work(backend_.limits.max_frame_work);
  limits->set_max_asset_bytes(backend_.limits.max_asset_bytes);
  limits->set_max_asset_bytes_per_principal(backend_.limits.max_asset_bytes_per_principal);
  limits->set_max_total_asset_bytes(backend_.limits.max_total_asset_bytes);
  limits->set_max_tests(backend_.limits.max_tests);
  limits->set_max_total_particles(backend_.limits.max_total_particles);
  limits->set_max_sessions_per_principal(backend_.limits.max_sessions_per_principal);
  limits->set_max_particles_per_principal(backend_.limits.max_particles_per_principal);
  limits->set_max_streams_per_principal(backend_.limits.max_streams_per_principal);
  return answer(context, grpc::Status::OK);
}

grpc::ServerUnaryReactor* ServerService::GetServerStats(grpc::CallbackServerContext* context,
                                                        const v1::GetServerStatsRequest*,
                                                        v1::ServerStats* response) {
  const auto caller = backend_.access.caller(*context);
  if (const auto* error = std::get_if<grpc::Status>(&caller)) return answer(context, *error);
  *response = server_stats(backend_);
  return answer(context, grpc::Status::OK);
}

}  // namespace weft
