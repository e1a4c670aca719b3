#include <algorithm>
#include <cmath>
#include <utility>

#include "core/model/scene.h"
#include "core/model/text.h"

namespace weft {
namespace {

// A vertex and how far it goes from a pose to the next, m.
struct Way {
  std::size_t vertex = 0;
  double length = 0;
};

// The longest, less what all of them go.
Way longest_way(const Poses& poses, std::size_t pose, const Vector3d& common) {
  Way longest;
  for (std::size_t v = 0; v < poses.vertices(); ++v) {
    const double length = (poses.position(pose + 1, v) - poses.position(pose, v) - common).norm();
    if (length > longest.length) longest = {v, length};
  }
  return longest;
}

}  // namespace

Vector3d Poses::position(std::size_t pose, std::size_t vertex) const {
  const std::size_t count = vertices();
  const float* const at = positions.data() + 3 * count * pose + vertex;
  return {double{at[0]}, double{at[count]}, double{at[2 * count]}};
}

std::shared_ptr<const Poses> complete(Poses poses) {
  const std::size_t count = poses.vertices();
  for (std::size_t p = 0; p < poses.times.size(); ++p) {
    Vector3d sum = Vector3d::Zero();
    for (std::size_t v = 0; v < count; ++v) sum += poses.position(p, v);
    poses.middles.emplace_back(sum / static_cast<double>(count));
  }
  for (std::size_t p = 0; p + 1 < poses.times.size(); ++p) {
    const Vector3d common = poses.middles[p + 1] - poses.middles[p];
    poses.ways.push_back(longest_way(poses, p, Vector3d::Zero()).length);
    poses.own_ways.push_back(longest_way(poses, p, common).length);
  }
  return std::make_shared<const Poses>(std::move(poses));
}

double fastest(const Poses& poses, double begin, double end) {
  double speed = 0;
  for (std::size_t p = 0; p < poses.ways.size(); ++p)
    if (poses.times[p + 1] > begin && poses.times[p] < end)
      speed = std::max(speed, poses.ways[p] / (poses.times[p + 1] - poses.times[p]));
  return speed;
}

double pose_time(const Collider& collider, double time) {
  if (!collider.lead) return time;
  const auto& [begin, end, from, to] = *collider.lead;
  if (time >= end) return to;
  return time <= begin ? from : from + (time - begin) / (end - begin) * (to - from);
}

double pose_speed(const Collider& collider, double begin, double end) {
  if (!collider.poses) return 0;
  if (!collider.lead) return fastest(*collider.poses, begin, end);
  const PoseLead& lead = *collider.lead;
  if (begin >= lead.end || end <= lead.begin) return 0;
  const double from = pose_time(collider, begin), to = pose_time(collider, end);
  return fastest(*collider.poses, std::min(from, to), std::max(from, to)) *
         std::abs(lead.to - lead.from) / (lead.end - lead.begin);
}

std::vector<Problem> find_problems(const Poses& poses, std::size_t vertices,
                                   const std::string& field) {
  constexpr std::size_t kMostPoses = 10'000, kMostProblems = 100;
  constexpr double kLatest = 1e6, kMostDistance = 1e4;  // s, m
  constexpr double kRounding = 1e-6;                    // of a way between positions in float
  std::vector<Problem> problems;
  const auto problem = [&](const std::string& name, const auto&... message) {
    if (problems.size() < kMostProblems) problems.push_back({field + "." + name, join(message...)});
  };
  const auto& times = poses.times;
  if (times.empty() || times.size() > kMostPoses)
    problem("times_s", "has ", times.size(), " times; 1 to ", kMostPoses, " are needed");
  if (const std::size_t wanted = 3 * vertices * times.size(); poses.positions.size() != wanted)
    problems.push_back(
        {field, join("positions_m has ", poses.positions.size(), " values; ", wanted, " (",
                     times.size(), " poses x 3 x ", vertices, " vertices) are needed")});
  for (std::size_t p = 0; p < times.size(); ++p) {
    const std::string name = join("times_s[", p, "]");
    if (!(times[p] >= 0 && times[p] <= kLatest))
      problem(name, times[p], " s is not within 0 to ", kLatest, " s");
    else if (p > 0 && times[p] <= times[p - 1])
      problem(name, times[p], " s does not come after the pose before it, ", times[p - 1], " s");
  }
  if (!problems.empty()) return problems;

  for (std::size_t p = 0; p < times.size(); ++p)
    for (std::size_t v = 0; v < vertices; ++v)
      if (!(poses.position(p, v).array().abs() <= kMostDistance).all())
        problem("positions_m", "vertex ", v, " of pose ", p, " does not lie within ", kMostDistance,
                " m of the origin along each axis");
  if (!problems.empty()) return problems;
  for (std::size_t p = 0; p + 1 < times.size(); ++p) {
    const auto [vertex, way] = longest_way(poses, p, Vector3d::Zero());
    const double time = times[p + 1] - times[p];
    if (way > (1 + kRounding) * kMostColliderSpeed * time)
      problem("positions_m", "vertex ", vertex, " moves ", way, " m in ", time, " s to pose ",
              p + 1, ", ", way / time, " m/s; colliders move at most ", kMostColliderSpeed, " m/s");
  }
  return problems;
}

}  // namespace weft
