#include "server/session/scheduler.h"

#include <algorithm>
#include <utility>

namespace weft {

Scheduler::Scheduler(int threads) : count_(std::max(1, threads)) {
  for (int i = 0; i < count_; ++i) threads_.emplace_back([this] { work(); });
}

Scheduler::~Scheduler() { stop(); }

void Scheduler::wake(const std::shared_ptr<Task>& task) {
  std::lock_guard lock(mutex_);
  if (stopping_) return;
  switch (task->phase_) {
    case Task::Phase::kWaiting:
      std::erase_if(waiting_, [&](const auto& entry) { return entry.second == task; });
      note_due();
      [[fallthrough]];
    case Task::Phase::kIdle:
      queue(task, From::kWake);
      return;
    case Task::Phase::kRunning:
      task->phase_ = Task::Phase::kRunningAndWoken;
      return;
    case Task::Phase::kQueued:
    case Task::Phase::kRunningAndWoken:
      return;
  }
}

bool Scheduler::post(std::function<void()> work) {
  std::lock_guard lock(mutex_);
  if (stopping_ || posted_ >= kMaxPosted) return false;
  ++posted_;
  push(posted_turns_, From::kWake, {nullptr, std::move(work), false});
  return true;
}

bool Scheduler::help(std::function<void()> work) {
  std::lock_guard lock(mutex_);
  if (stopping_ || idle_ <= ready_.size()) return false;
  ++posted_;
  push(posted_turns_, From::kWake, {nullptr, std::move(work), true});
  return true;
}

void Scheduler::push(std::int64_t& turns, From from, Job job) {
  if (!job.helps) ++wanted_;
  turns = std::max(turns, turns_ - (from == From::kWake ? kShare / kTurn : 0));
  ready_.emplace(turns, std::move(job));
  note_urgent();
  changed_.notify_one();
}

Scheduler::Job Scheduler::pop() {
  auto next = ready_.extract(ready_.begin());
  turns_ = std::max(turns_, next.key());
  note_urgent();
  Job job = std::move(next.mapped());
  if (!job.helps) --wanted_;
  return job;
}

void Scheduler::stop() {
  {
    std::lock_guard lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  threads_.clear();  // joins
  std::lock_guard lock(mutex_);
  ready_.clear();
  waiting_.clear();
}

void Scheduler::work() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    queue_due();
    if (!ready_.empty()) {
      run(lock, pop());
      continue;
    }
    ++idle_;
    if (waiting_.empty())
      changed_.wait(lock);
    else
      changed_.wait_until(lock, Clock::time_point(waiting_.begin()->first));
    --idle_;
  }
}

void Scheduler::note_urgent() { urgent_ = !ready_.empty() && ready_.begin()->first < turns_; }

// Precondition: the task is in no queue.
void Scheduler::queue(std::shared_ptr<Task> task, From from) {
  task->phase_ = Task::Phase::kQueued;
  std::int64_t& turns = task->turns_;
  push(turns, from, {std::move(task), nullptr, false});
}

void Scheduler::queue_due() {
  const auto now = Clock::now();
  while (!waiting_.empty() && waiting_.begin()->first <= now) {
    auto entry = waiting_.extract(waiting_.begin());
    queue(std::move(entry.mapped()), From::kWake);
  }
  note_due();
}

void Scheduler::note_due() {
  next_due_ = waiting_.empty() ? kNever : waiting_.begin()->first.time_since_epoch().count();
}

void Scheduler::run(std::unique_lock<std::mutex>& lock, Job job) {
  const auto begin = Clock::now();
  const auto turns = [&] { return std::max<std::int64_t>(1, (Clock::now() - begin) / kTurn); };
  if (job.work) {
    --posted_;
    lock.unlock();
    job.work();
    job.work = nullptr;  // what it holds is destroyed outside the lock
    lock.lock();
    if (!job.helps) posted_turns_ += turns();
    return;
  }
  job.task->phase_ = Task::Phase::kRunning;
  lock.unlock();
  const auto due = job.task->run_slice();
  lock.lock();
  job.task->turns_ += turns();

  if (job.task->phase_ == Task::Phase::kRunningAndWoken || (due && *due <= Clock::now())) {
    queue(std::move(job.task), From::kSlice);
  } else if (due) {
    job.task->phase_ = Task::Phase::kWaiting;
    waiting_.emplace(*due, std::move(job.task));
    note_due();
    changed_.notify_one();  // the next due time may be an earlier one now
  } else {
    job.task->phase_ = Task::Phase::kIdle;
    lock.unlock();
    job.task.reset();  // perhaps the last reference
    lock.lock();
  }
}

}  // namespace weft
