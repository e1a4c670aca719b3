#pragma once

#include <google/rpc/error_details.pb.h>
#include <grpcpp/support/status.h>

#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace weft::client {

// What `weft` ends with.
enum class Exit {
  kDone = 0,
  kRefused = 1,
  kUsage = 2,
  kNoConnection = 3,
  kFile = 4,
  kInterrupted = 130,
};

// A bad field: its path, and what is wrong with its value.
struct Violation {
  std::string field;
  std::string description;
};

// Why a command could not do its work, for people and for scripts.
struct Problem : std::runtime_error {
  Problem(Exit exit_code, std::string code_name, std::string reason_name,
          const std::string& message)
      : runtime_error(message),
        exit(exit_code),
        code(std::move(code_name)),
        reason(std::move(reason_name)) {}

  Exit exit;
  std::string code;    // of gRPC, "NOT_FOUND"
  std::string reason;  // of google.rpc.ErrorInfo, or ours: USAGE, FILE_DAMAGED ...
  std::vector<Violation> violations;
};

Problem usage_problem(const std::string& message);
Problem unreadable(std::string_view path, std::string_view why);
Problem unwritable(std::string_view path, std::string_view why);
Problem malformed(std::string_view path, std::string_view why);
Problem damaged(std::string_view path, std::string_view why);
Problem interrupted();

// What a server answered. Answers without google.rpc.ErrorInfo are not from weftd but from the road
// to it.
Problem server_problem(const grpc::Status& status);
std::optional<google::rpc::ErrorInfo> error_info(const grpc::Status& status);

}  // namespace weft::client
