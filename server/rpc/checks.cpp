#include "server/rpc/checks.h"

#include <string>

#include "core/model/text.h"
#include "server/convert/names.h"
#include "server/rpc/errors.h"

namespace weft {

std::vector<Problem> find_problems(const v1::RunSessionRequest& request) {
  const double scale = request.time_scale();
  if (!request.has_time_scale() || (scale >= 1e-3 && scale <= 1000)) return {};  // NaN is not
  return {{"time_scale", join(scale, " is not within 0.001 to 1000")}};
}

std::int64_t frames_of(const v1::StepSessionRequest& request) {
  return request.has_frames() ? request.frames() : 1;
}

std::vector<Problem> find_problems(const v1::StepSessionRequest& request) {
  constexpr std::int64_t kMostFrames = 100'000;
  const std::int64_t frames = frames_of(request);
  if (frames >= 1 && frames <= kMostFrames) return {};
  return {{"frames", std::to_string(frames) + " is not within 1 to 100000"}};
}

std::vector<Problem> find_problems(const v1::ViewFramesRequest& request, int open_credits) {
  constexpr int kMostCredits = 64;
  const int credits = request.credits();
  const std::string most = std::to_string(kMostCredits);
  if (credits < 1 || credits > kMostCredits)
    return {{"credits", std::to_string(credits) + " is not within 1 to " + most}};
  if (open_credits + credits > kMostCredits)
    return {{"credits",
             std::to_string(open_credits + credits) + " would be open; at most " + most + " are"}};
  return {};
}

std::optional<grpc::Status> refusal_of_id(const std::string& field, const std::string& id) {
  if (id.empty() || is_session_id(id)) return std::nullopt;
  return errors::field_invalid(field, "\"" + id +
                                          "\" is not 1 to 63 characters of a-z, 0-9 and -, "
                                          "beginning with a letter");
}

}  // namespace weft
