#pragma once

#include <chrono>
#include <deque>
#include <utility>

namespace weft::client {

// Simulated seconds per second of wall time, over the last second or so.
class Pace {
 public:
  double update(double time_s) {
    const auto now = Clock::now();
    marks_.emplace_back(now, time_s);
    while (marks_.size() > 2 && now - marks_[1].first > std::chrono::seconds(1)) marks_.pop_front();
    const std::chrono::duration<double> wall = now - marks_.front().first;
    return wall.count() > 0 ? (time_s - marks_.front().second) / wall.count() : 0;
  }

 private:
  using Clock = std::chrono::steady_clock;
  std::deque<std::pair<Clock::time_point, double>> marks_;
};

}  // namespace weft::client
