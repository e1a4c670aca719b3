#pragma once

#include <atomic>
#include <chrono>
#include <ctime>

namespace weft {

// Processor time of the calling thread.
inline std::chrono::nanoseconds thread_time() {
  std::timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
}

// Of threads that help, added up as they leave, ns.
using HelpedTime = std::atomic<std::chrono::nanoseconds::rep>;

}  // namespace weft
