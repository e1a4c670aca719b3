#pragma once

#include <functional>

namespace weft {

// Threads that share the work of a step. The result does not depend on how many they are.
class ThreadPool {
 public:
  virtual ~ThreadPool() = default;
  // How many may work now, at least 1.
  virtual int threads() const = 0;
  // Runs part(0) ... part(parts - 1), perhaps at the same time, and returns when all have returned.
  virtual void run(int parts, const std::function<void(int)>& part) = 0;
};

// The thread that calls, alone.
ThreadPool& calling_thread();

}  // namespace weft
