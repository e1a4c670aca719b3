#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

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

// Of a share that is worth another thread.
inline constexpr std::int64_t kParticlesOfShare = 2048;

// Shares of `count`, each of `least` or more but where it is alone: so many that threads which are
// done with theirs take others'.
inline std::size_t shares_of(const ThreadPool& pool, std::int64_t count, std::int64_t least) {
  constexpr std::int64_t kOfThread = 4;
  const std::int64_t most = pool.threads() == 1 ? 1 : kOfThread * pool.threads();
  return static_cast<std::size_t>(std::clamp<std::int64_t>(count / least, 1, most));
}

// Calls f(share, begin, end) for shares of 0 ... count - 1.
template <class F>
void run_shares(ThreadPool& pool, std::size_t shares, std::int64_t count, const F& f) {
  const auto parts = static_cast<std::int64_t>(shares);
  const auto run = [&](int share) {
    f(static_cast<std::size_t>(share), count * share / parts, count * (share + 1) / parts);
  };
  parts == 1 ? run(0) : pool.run(static_cast<int>(parts), run);
}

// Calls f(begin, end) for shares of 0 ... count - 1.
template <class F>
void for_shares(ThreadPool& pool, std::int64_t count, std::int64_t least, const F& f) {
  run_shares(pool, shares_of(pool, count, least), count,
             [&](std::size_t, std::int64_t begin, std::int64_t end) { f(begin, end); });
}

// What f(begin, end, found) finds in shares of 0 ... count - 1, in their order.
template <class Found, class F>
std::vector<Found> find_in_shares(ThreadPool& pool, std::int64_t count, std::int64_t least,
                                  const F& f) {
  std::vector<std::vector<Found>> found(shares_of(pool, count, least));
  run_shares(pool, found.size(), count,
             [&](std::size_t share, std::int64_t begin, std::int64_t end) {
               f(begin, end, found[share]);
             });
  std::vector<Found> all = std::move(found.front());
  for (std::size_t k = 1; k < found.size(); ++k)
    all.insert(all.end(), found[k].begin(), found[k].end());
  return all;
}

}  // namespace weft
