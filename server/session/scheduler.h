#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace weft {

using Clock = std::chrono::steady_clock;

// Work done in slices. One thread at a time runs a task.
class Task {
 public:
  virtual ~Task() = default;

  // Does a little, and says when to go on; nullopt: not before the next wake().
  virtual std::optional<Clock::time_point> run_slice() = 0;

 private:
  friend class Scheduler;
  enum class Phase { kIdle, kWaiting, kQueued, kRunning, kRunningAndWoken };
  // guarded by the scheduler
  Phase phase_ = Phase::kIdle;
  std::int64_t turns_ = 0;  // that it has had
};

// A pool of threads. Runnable tasks share their time: the one that has had the least of it runs a
// slice, of equal ones the first to come; what one let pass while it had nothing to do is not made
// up for. Posted work counts as one task. Tasks that wait for a time join when it has come; idle
// ones cost nothing. All methods are thread-safe.
class Scheduler {
 public:
  static constexpr std::size_t kMaxPosted = 256;
  static constexpr std::chrono::microseconds kTurn{200};  // what a shorter slice counts as
  // For which those that share time may go on at once; by so much less had, at most, those that are
  // woken come first.
  static constexpr std::chrono::microseconds kShare{5000};

  explicit Scheduler(int threads);
  ~Scheduler();  // stops

  int threads() const { return count_; }

  // Lets the task run a slice soon, after the one it is in, if any.
  void wake(const std::shared_ptr<Task>& task);

  // Runs `work` once, in its turn. False, and nothing done, when kMaxPosted already wait.
  [[nodiscard]] bool post(std::function<void()> work);

  // Runs `work` at once on a thread that has nothing else to do. False, and nothing done, where
  // there is none. It ends soon once busy().
  [[nodiscard]] bool help(std::function<void()> work);

  // Whether something waits for a thread.
  bool busy() const { return wanted_ > 0 || is_due(); }

  // Whether what waits shall not wait for long: it was woken, and has had less time than others.
  bool urgent() const { return urgent_ || is_due(); }

  // Lets each thread finish its slice, and drops the rest.
  void stop();

 private:
  static constexpr Clock::rep kNever = std::numeric_limits<Clock::rep>::max();
  struct Job {  // one of the two
    std::shared_ptr<Task> task;
    std::function<void()> work;
    bool helps = false;  // of help()
  };

  enum class From { kWake, kSlice };  // where a task comes from

  bool is_due() const { return Clock::now().time_since_epoch().count() >= next_due_; }
  void work();
  void push(std::int64_t& turns, From from, Job job);
  Job pop();
  void note_due();
  void note_urgent();
  void queue(std::shared_ptr<Task> task, From from);
  void queue_due();
  void run(std::unique_lock<std::mutex>& lock, Job job);

  std::mutex mutex_;
  std::condition_variable changed_;
  std::multimap<std::int64_t, Job> ready_;  // by turns that the task has had
  std::int64_t turns_ = 0;                  // most of those that ran: others begin near them
  std::int64_t posted_turns_ = 0;
  std::atomic<bool> urgent_ = false;  // whether the first of ready_ has had fewer
  std::atomic<int> wanted_ = 0;       // jobs in ready_ that do not help
  std::size_t idle_ = 0;              // threads that wait
  std::size_t posted_ = 0;            // jobs in ready_ with work
  std::multimap<Clock::time_point, std::shared_ptr<Task>> waiting_;  // by due time
  std::atomic<Clock::rep> next_due_ = kNever;                        // of waiting_
  bool stopping_ = false;
  const int count_;  // of threads
  std::vector<std::jthread> threads_;
};

}  // namespace weft
