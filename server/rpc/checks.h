#pragma once

#include <grpcpp/support/status.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/model/scene.h"
#include "weft/v1/frame.pb.h"
#include "weft/v1/session.pb.h"

// What is wrong with requests, whatever the session that they ask.
namespace weft {

std::vector<Problem> find_problems(const v1::RunSessionRequest& request);
std::vector<Problem> find_problems(const v1::StepSessionRequest& request);
// Where so many credits were granted before and are open.
std::vector<Problem> find_problems(const v1::ViewFramesRequest& request, int open_credits);

// What is wrong with an id that a caller gave; empty: the server picks one.
std::optional<grpc::Status> refusal_of_id(const std::string& field, const std::string& id);

// Frames that a step asks for.
std::int64_t frames_of(const v1::StepSessionRequest& request);

}  // namespace weft
