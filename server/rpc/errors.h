#pragma once

#include <grpcpp/support/status.h>

#include <map>
#include <string>
#include <vector>

#include "core/simulation.h"
#include "server/session/quota.h"
#include "server/session/subscription.h"

// Every error of the service in one place: code, reason, details. Each carries google.rpc.ErrorInfo
// with domain "weft.v1"; details stay below 4 KB, since larger ones destroy the whole answer.
namespace weft::errors {

using Metadata = std::map<std::string, std::string>;

// At most 20 problems are listed; the message says how many there were.
grpc::Status field_invalid(const std::vector<Problem>& problems);
grpc::Status field_invalid(const std::string& field, const std::string& message);

// A frame of so many particles would need more substeps than are computed. `field` is to blame for
// the step, here and below.
grpc::Status too_many_substeps(const StepRefusal& step, std::int64_t particles,
                               const std::string& field);
grpc::Status step_unstable(const StepRefusal& step, const std::string& field);

// The request's name came with another call before.
grpc::Status request_used();

grpc::Status message_malformed(const std::string& type);

grpc::Status session_not_found(const std::string& name);
// Does not say whether there is such a session.
grpc::Status session_not_yours(const std::string& name);
grpc::Status session_exists(const std::string& name);
grpc::Status session_damaged(const std::string& name, const std::string& why);
grpc::Status snapshot_not_found(const std::string& name);
grpc::Status snapshot_exists(const std::string& name);
grpc::Status snapshot_damaged(const std::string& name, const std::string& why);
grpc::Status textile_not_found(const std::string& name);
grpc::Status asset_not_found(const std::string& name);
grpc::Status asset_damaged(const std::string& name, const std::string& why);
grpc::Status asset_used(const std::string& name);
grpc::Status asset_incomplete(const std::string& name, std::int64_t received);
// Bytes that came are not those that the asset's name says.
grpc::Status hash_differs(const std::string& name, const std::string& hash);
// The next bytes to send are others than those that came.
grpc::Status offset_stale(std::int64_t received);
grpc::Status upload_stalled(std::int64_t received);

grpc::Status failed_precondition(const std::string& reason, const std::string& message,
                                 const Metadata& metadata = {});
grpc::Status aborted(const std::string& reason, const std::string& message,
                     const Metadata& metadata);
grpc::Status cancelled();
// The name belongs to another session than the one with the uid that was asked for.
grpc::Status uid_changed(const std::string& uid);
grpc::Status session_running(const std::string& name, std::int64_t latest_frame);
grpc::Status frame_stale(std::int64_t latest_frame);
grpc::Status not_ahead(std::int64_t latest_frame);

grpc::Status frame_expired(std::int64_t wanted, const Progress& progress);
grpc::Status solver_failed(const std::string& failure, std::int64_t latest_frame);

// Something the server has only so much of. `subject` names it, such as "sessions".
grpc::Status exhausted(const std::string& subject, const std::string& message, bool retry);

grpc::Status exhausted(const Quota::Excess& excess);

// A call of nobody that the server knows.
grpc::Status unauthenticated(const std::string& reason, const std::string& message);

// A call that could not be written down, and was not carried out.
grpc::Status store_unwritable(const std::string& why);

// What the call needs to know of other servers' sessions cannot be read.
grpc::Status store_unreachable(const std::string& why);

// Another server has the session.
grpc::Status wrong_replica(const std::string& name, const std::string& replica);

grpc::Status server_draining(const Metadata& metadata = {});

}  // namespace weft::errors
