#include "server/rpc/errors.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <charconv>
#include <chrono>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace weft::errors {
namespace {

constexpr int kMostViolations = 20;
constexpr std::size_t kMostBytes = 4096;  // of the whole status
constexpr std::size_t kMostText = 300;    // bytes of one text
constexpr std::chrono::milliseconds kRetry{1000}, kRetryElsewhere{50};

std::string text(double value) {
  char buffer[32];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value);
  return {buffer, end};
}

// Shortened where it is long, between two characters of UTF-8.
std::string clipped(const std::string& text) {
  if (text.size() <= kMostText) return text;
  std::size_t end = kMostText;
  while (end > 0 && (text[end] & 0xC0) == 0x80) --end;
  return text.substr(0, end) + " ...";
}

google::rpc::Status make(grpc::StatusCode code, const std::string& reason,
                         const std::string& message, const Metadata& metadata = {}) {
  google::rpc::Status status;
  status.set_code(code);
  status.set_message(clipped(message));
  google::rpc::ErrorInfo info;
  info.set_reason(reason);
  info.set_domain("weft.v1");
  for (const auto& [key, value] : metadata) (*info.mutable_metadata())[key] = clipped(value);
  status.add_details()->PackFrom(info);
  return status;
}

void add_retry(google::rpc::Status& status, std::chrono::milliseconds delay = kRetry) {
  google::rpc::RetryInfo retry;
  *retry.mutable_retry_delay() =
      google::protobuf::util::TimeUtil::MillisecondsToDuration(delay.count());
  status.add_details()->PackFrom(retry);
}

void add_resource(google::rpc::Status& status, const std::string& type, const std::string& name) {
  google::rpc::ResourceInfo resource;
  resource.set_resource_type("weft.v1/" + type);
  resource.set_resource_name(clipped(name));
  status.add_details()->PackFrom(resource);
}

// Adds as many as fit, and answers how many did.
std::size_t add_violations(google::rpc::Status& status, const std::vector<Problem>& problems) {
  google::rpc::BadRequest bad;
  const std::size_t room = kMostBytes - status.ByteSizeLong() - 128;  // 128: type and sizes of bad
  for (const auto& problem : problems) {
    if (bad.field_violations_size() == kMostViolations) break;
    auto* violation = bad.add_field_violations();
    violation->set_field(clipped(problem.field));
    violation->set_description(clipped(problem.message));
    if (bad.ByteSizeLong() <= room) continue;
    bad.mutable_field_violations()->RemoveLast();
    break;
  }
  status.add_details()->PackFrom(bad);
  return static_cast<std::size_t>(bad.field_violations_size());
}

grpc::Status to_grpc(const google::rpc::Status& status) {
  return {static_cast<grpc::StatusCode>(status.code()), status.message(),
          status.SerializeAsString()};
}

}  // namespace

grpc::Status field_invalid(const std::vector<Problem>& problems) {
  const std::string first = problems.front().field + ": " + problems.front().message;
  auto status = make(grpc::StatusCode::INVALID_ARGUMENT, "FIELD_INVALID", first,
                     {{"violations", std::to_string(problems.size())}});
  const std::size_t listed = add_violations(status, problems);
  if (problems.size() > 1) {
    std::string counts = " (1 of " + std::to_string(problems.size()) + " problems";
    if (listed < problems.size()) {
      counts += ", " + std::to_string(problems.size() - listed) + " of them not listed";
    }
    status.set_message(status.message() + counts + ")");
  }
  return to_grpc(status);
}

grpc::Status field_invalid(const std::string& field, const std::string& message) {
  return field_invalid({{field, message}});
}

grpc::Status step_unstable(const StepRefusal& step, const std::string& field) {
  const std::string message =
      step.bound > 0
          ? "a substep of " + text(step.asked) + " s lies above the linear bound of " +
                text(step.bound) + " s; take a smaller one, or set solver.allow_unstable"
          : "this integrator has no stable step for this scene; take another one, add damping, or "
            "set solver.substep_s and solver.allow_unstable";
  auto status = make(grpc::StatusCode::INVALID_ARGUMENT, "STEP_UNSTABLE", message,
                     {{"asked", text(step.asked)}, {"bound", text(step.bound)}});
  add_violations(status, {{field, message}});
  return to_grpc(status);
}

grpc::Status too_many_substeps(const StepRefusal& step, std::int64_t particles,
                               const std::string& field) {
  const std::string needed = "a frame would need " + std::to_string(step.substeps) + " substeps";
  if (step.most_substeps >= kMaxSubsteps) {
    return field_invalid(field,
                         needed + "; at most " + std::to_string(kMaxSubsteps) + " are computed");
  }
  return exhausted("frame_work",
                   field + ": " + needed + " of " + std::to_string(particles) +
                       " particles; this server computes " + std::to_string(step.most_substeps) +
                       " of so many at most (weftd --max-frame-work). A shorter frame step, a "
                       "coarser grid or a textile that resists stretch less takes fewer",
                   false);
}

grpc::Status request_used() {
  return field_invalid("request_id", "was given to another call; give each call one of its own");
}

grpc::Status message_malformed(const std::string& type) {
  return to_grpc(make(grpc::StatusCode::INVALID_ARGUMENT, "MESSAGE_MALFORMED",
                      "the bytes of the request are no " + type));
}

grpc::Status session_not_found(const std::string& name) {
  auto status =
      make(grpc::StatusCode::NOT_FOUND, "SESSION_NOT_FOUND",
           "there is no session " + name + "; ListSessions (weft session list) names them all");
  add_resource(status, "Session", name);
  return to_grpc(status);
}

grpc::Status session_not_yours(const std::string& name) {
  auto status = make(grpc::StatusCode::PERMISSION_DENIED, "SESSION_NOT_YOURS",
                     name + " is another's, or there is none");
  add_resource(status, "Session", name);
  return to_grpc(status);
}

grpc::Status session_exists(const std::string& name) {
  auto status =
      make(grpc::StatusCode::ALREADY_EXISTS, "SESSION_EXISTS", "there is a session " + name);
  add_resource(status, "Session", name);
  return to_grpc(status);
}

grpc::Status session_damaged(const std::string& name, const std::string& why) {
  auto status = make(grpc::StatusCode::DATA_LOSS, "SESSION_DAMAGED",
                     "what was kept of " + name + " is damaged: " + why + "; it can be deleted");
  add_resource(status, "Session", name);
  return to_grpc(status);
}

grpc::Status snapshot_not_found(const std::string& name) {
  auto status = make(
      grpc::StatusCode::NOT_FOUND, "SNAPSHOT_NOT_FOUND",
      "there is no snapshot " + name + "; ListSnapshots (weft session snapshots) names them all");
  add_resource(status, "Snapshot", name);
  return to_grpc(status);
}

grpc::Status snapshot_exists(const std::string& name) {
  auto status =
      make(grpc::StatusCode::ALREADY_EXISTS, "SNAPSHOT_EXISTS", "there is a snapshot " + name);
  add_resource(status, "Snapshot", name);
  return to_grpc(status);
}

grpc::Status snapshot_damaged(const std::string& name, const std::string& why) {
  auto status = make(grpc::StatusCode::DATA_LOSS, "SNAPSHOT_DAMAGED", name + " is damaged: " + why);
  add_resource(status, "Snapshot", name);
  return to_grpc(status);
}

grpc::Status textile_not_found(const std::string& name) {
  auto status =
      make(grpc::StatusCode::NOT_FOUND, "TEXTILE_NOT_FOUND",
           "there is no textile " + name + "; ListTextiles (weft textile list) names them all");
  add_resource(status, "Textile", name);
  return to_grpc(status);
}

grpc::Status asset_not_found(const std::string& name) {
  auto status =
      make(grpc::StatusCode::NOT_FOUND, "ASSET_NOT_FOUND",
           "there is no asset " + name + "; UploadAsset makes one, ListAssets names them all");
  add_resource(status, "Asset", name);
  return to_grpc(status);
}

grpc::Status asset_damaged(const std::string& name, const std::string& why) {
  auto status = make(grpc::StatusCode::DATA_LOSS, "ASSET_DAMAGED", name + " is damaged: " + why);
  add_resource(status, "Asset", name);
  return to_grpc(status);
}

grpc::Status asset_used(const std::string& name) {
  return failed_precondition("ASSET_USED", "a session names " + name + "; delete that first");
}

grpc::Status asset_incomplete(const std::string& name, std::int64_t received) {
  const std::string bytes = std::to_string(received);
  return failed_precondition("ASSET_INCOMPLETE",
                             "of " + name + " there are only " + bytes + " bytes yet",
                             {{"received_bytes", bytes}});
}

grpc::Status hash_differs(const std::string& name, const std::string& hash) {
  auto status = make(grpc::StatusCode::DATA_LOSS, "HASH_DIFFERS",
                     "the bytes that came for " + name + " have the SHA-256 " + hash +
                         "; they are forgotten, send them again from the first",
                     {{"hash", hash}});
  add_resource(status, "Asset", name);
  return to_grpc(status);
}

grpc::Status offset_stale(std::int64_t received) {
  const std::string bytes = std::to_string(received);
  return aborted("OFFSET_STALE", "offset is not the next byte that the server wants, " + bytes,
                 {{"received_bytes", bytes}});
}

grpc::Status upload_stalled(std::int64_t received) {
  const std::string bytes = std::to_string(received);
  return to_grpc(make(grpc::StatusCode::DEADLINE_EXCEEDED, "UPLOAD_STALLED",
                      "no message came for long; go on at byte " + bytes,
                      {{"received_bytes", bytes}}));
}

grpc::Status failed_precondition(const std::string& reason, const std::string& message,
                                 const Metadata& metadata) {
  return to_grpc(make(grpc::StatusCode::FAILED_PRECONDITION, reason, message, metadata));
}

grpc::Status aborted(const std::string& reason, const std::string& message,
                     const Metadata& metadata) {
  return to_grpc(make(grpc::StatusCode::ABORTED, reason, message, metadata));
}

grpc::Status uid_changed(const std::string& uid) {
  return aborted("UID_CHANGED", "this name belongs to another session now", {{"uid", uid}});
}

grpc::Status session_running(const std::string& name, std::int64_t latest_frame) {
  return failed_precondition("SESSION_RUNNING", name + " runs by itself; pause it before stepping",
                             {{"latest_frame", std::to_string(latest_frame)}});
}

grpc::Status frame_stale(std::int64_t latest_frame) {
  const std::string latest = std::to_string(latest_frame);
  return aborted("FRAME_STALE", "expected_frame is not the newest frame, " + latest,
                 {{"latest_frame", latest}});
}

grpc::Status not_ahead(std::int64_t latest_frame) {
  return field_invalid("until_frame",
                       "does not lie ahead of the newest frame, " + std::to_string(latest_frame));
}

grpc::Status cancelled() {
  return to_grpc(make(grpc::StatusCode::CANCELLED, "CANCELLED", "the caller cancelled"));
}

grpc::Status frame_expired(std::int64_t wanted, const Progress& progress) {
  const std::string oldest = std::to_string(progress.oldest_frame);
  const std::string latest = std::to_string(progress.latest_frame);
  return to_grpc(make(grpc::StatusCode::OUT_OF_RANGE, "FRAME_EXPIRED",
                      "frame " + std::to_string(wanted) + " is no longer kept; there are frames " +
                          oldest + " to " + latest,
                      {{"oldest_frame", oldest}, {"latest_frame", latest}}));
}

grpc::Status solver_failed(const std::string& failure, std::int64_t latest_frame) {
  return failed_precondition("SOLVER_FAILED", failure,
                             {{"latest_frame", std::to_string(latest_frame)}});
}

grpc::Status exhausted(const std::string& subject, const std::string& message, bool retry) {
  auto status =
      make(grpc::StatusCode::RESOURCE_EXHAUSTED, "QUOTA_EXCEEDED", message, {{"subject", subject}});
  google::rpc::QuotaFailure quota;
  auto* violation = quota.add_violations();
  violation->set_subject(subject);
  violation->set_description(clipped(message));
  status.add_details()->PackFrom(quota);
  if (retry) add_retry(status);
  return to_grpc(status);
}

grpc::Status exhausted(const Quota::Excess& excess) {
  const auto& bound = excess.bound;
  std::string what = bound.name;
  std::replace(what.begin(), what.end(), '_', ' ');
  return exhausted(bound.name,
                   "the server holds no more than " + std::to_string(bound.most) + " " + what,
                   !excess.for_ever);
}

grpc::Status unauthenticated(const std::string& reason, const std::string& message) {
  return to_grpc(make(grpc::StatusCode::UNAUTHENTICATED, reason, message));
}

grpc::Status store_unwritable(const std::string& why) {
  auto status = make(grpc::StatusCode::UNAVAILABLE, "STORE_UNWRITABLE",
                     "the call was not carried out, because it cannot be written down: " + why);
  add_retry(status);
  return to_grpc(status);
}

grpc::Status store_unreachable(const std::string& why) {
  auto status = make(grpc::StatusCode::UNAVAILABLE, "STORE_UNREACHABLE",
                     "the server cannot look it up now: " + why);
  add_retry(status);
  return to_grpc(status);
}

grpc::Status wrong_replica(const std::string& name, const std::string& replica) {
  auto status = make(grpc::StatusCode::UNAVAILABLE, "WRONG_REPLICA",
                     name + (replica.empty() ? " is not with this server any more; ask again"
                                             : " is with another server, " + replica),
                     {{"replica", replica}});
  add_retry(status, kRetryElsewhere);
  return to_grpc(status);
}

grpc::Status server_draining(const Metadata& metadata) {
  auto status = make(grpc::StatusCode::UNAVAILABLE, "SERVER_DRAINING",
                     "the server is going down; ask another one, or again later", metadata);
  add_retry(status);
  return to_grpc(status);
}

}  // namespace weft::errors
