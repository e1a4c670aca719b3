#pragma once

#include <atomic>
#include <thread>
#include <vector>

namespace weft::client {

// Calls f(0) ... f(count - 1), on all processors at once. Precondition: f does not throw.
template <class F>
void on_all_processors(int count, const F& f) {
  std::atomic<int> next = 0;
  const auto work = [&] {
    for (int i = next++; i < count; i = next++) f(i);
  };
  std::vector<std::jthread> threads;
  for (unsigned i = 1; i < std::thread::hardware_concurrency(); ++i) threads.emplace_back(work);
  work();
}

}  // namespace weft::client
