#include "client/problem.h"

#include <fmt/format.h>
#include <google/rpc/status.pb.h>

#include <array>

namespace weft::client {
namespace {

std::string code_name(grpc::StatusCode code) {
  constexpr std::array kNames{"OK",
                              "CANCELLED",
                              "UNKNOWN",
                              "INVALID_ARGUMENT",
                              "DEADLINE_EXCEEDED",
                              "NOT_FOUND",
                              "ALREADY_EXISTS",
                              "PERMISSION_DENIED",
                              "RESOURCE_EXHAUSTED",
                              "FAILED_PRECONDITION",
                              "ABORTED",
                              "OUT_OF_RANGE",
                              "UNIMPLEMENTED",
                              "INTERNAL",
                              "UNAVAILABLE",
                              "DATA_LOSS",
                              "UNAUTHENTICATED"};
  const auto index = static_cast<std::size_t>(code);
  return index < kNames.size() ? kNames[index] : "UNKNOWN";
}

template <class Detail>
std::optional<Detail> find_detail(const grpc::Status& status) {
  google::rpc::Status details;
  Detail detail;
  if (!details.ParseFromString(status.error_details())) return std::nullopt;
  for (const auto& any : details.details()) {
    if (any.UnpackTo(&detail)) return detail;
  }
  return std::nullopt;
}

}  // namespace

Problem usage_problem(const std::string& message) {
  return {Exit::kUsage, "INVALID_ARGUMENT", "USAGE", message};
}

Problem unreadable(std::string_view path, std::string_view why) {
  return {Exit::kFile, "NOT_FOUND", "FILE_UNREADABLE",
          fmt::format("cannot read {}: {}", path, why)};
}

Problem unwritable(std::string_view path, std::string_view why) {
  return {Exit::kFile, "FAILED_PRECONDITION", "FILE_UNWRITABLE",
          fmt::format("cannot write {}: {}", path, why)};
}

Problem malformed(std::string_view path, std::string_view why) {
  return {Exit::kFile, "INVALID_ARGUMENT", "FILE_MALFORMED", fmt::format("{}: {}", path, why)};
}

Problem damaged(std::string_view path, std::string_view why) {
  return {Exit::kFile, "DATA_LOSS", "FILE_DAMAGED", fmt::format("{} is damaged: {}", path, why)};
}

Problem interrupted() { return {Exit::kInterrupted, "CANCELLED", "INTERRUPTED", "interrupted"}; }

std::optional<google::rpc::ErrorInfo> error_info(const grpc::Status& status) {
  return find_detail<google::rpc::ErrorInfo>(status);
}

Problem server_problem(const grpc::Status& status) {
  const auto info = error_info(status);
  if (!info && status.error_code() == grpc::StatusCode::UNAVAILABLE) {
    return {Exit::kNoConnection, "UNAVAILABLE", "NO_CONNECTION", status.error_message()};
  }
  if (!info && status.error_code() == grpc::StatusCode::UNIMPLEMENTED) {
    return {Exit::kRefused, "UNIMPLEMENTED", "",
            "the server has no such method; is it a replay, or of another version?"};
  }
  Problem problem(Exit::kRefused, code_name(status.error_code()), info ? info->reason() : "",
                  status.error_message());
  if (const auto bad = find_detail<google::rpc::BadRequest>(status)) {
    for (const auto& violation : bad->field_violations()) {
      problem.violations.push_back({violation.field(), violation.description()});
    }
  }
  return problem;
}

}  // namespace weft::client
