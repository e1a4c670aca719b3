#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace weft {

// A thread that writes: what is posted while it commits is committed together, in order.
// Thread-safe.
template <class Job>
class WriteQueue {
 public:
  using Commit = std::function<void(std::deque<Job> jobs)>;

  explicit WriteQueue(Commit commit) : commit_(std::move(commit)), thread_([this] { work(); }) {}
  ~WriteQueue() { stop(); }
  WriteQueue(const WriteQueue&) = delete;
  WriteQueue& operator=(const WriteQueue&) = delete;

  void post(Job job) {
    std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
    changed_.notify_all();
  }

  // Once what was posted is committed. What comes later never is.
  void stop() {
    {
      std::lock_guard lock(mutex_);
      stopping_ = true;
      changed_.notify_all();
    }
    if (thread_.joinable()) thread_.join();
  }

  // Waits so long; false, and at once, where it is to stop.
  template <class Duration>
  bool pause(Duration time) {
    std::unique_lock lock(mutex_);
    return !changed_.wait_for(lock, time, [&] { return stopping_; });
  }

 private:
  void work() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [&] { return stopping_ || !jobs_.empty(); });
      if (jobs_.empty()) return;
      auto jobs = std::exchange(jobs_, {});
      lock.unlock();
      commit_(std::move(jobs));
      lock.lock();
    }
  }

  const Commit commit_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace weft
