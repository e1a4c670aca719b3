#pragma once

#include <cstdint>
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

// Frames that a step asks for.
std::int64_t frames_of(const v1::StepSessionRequest& request);

}  // namespace weft
