#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <span>
#include <stdexcept>
#include <stop_token>
#include <thread>
#include <utility>

#include "client/connection.h"
#include "client/problem.h"
#include "tests/stress/recorded.h"

namespace weft::stress {

// Changes textiles, one after the other, each call until it is acknowledged.
class Caller {
 public:
  Caller(std::unique_ptr<client::Connection> connection, std::span<Recorded> all)
      : connection_(std::move(connection)), thread_([this, all](const std::stop_token& stop) {
          for (int number = 0; !stop.stop_requested(); ++number)
            change(all[static_cast<std::size_t>(number) % all.size()], number, stop);
        }) {}

  // Calls that were refused as they should be, with anything else, and acknowledged.
  struct Counts {
    int refused = 0, wrong = 0, acknowledged = 0;
  };
  Counts counts() const {
    const std::lock_guard lock(mutex_);
    return counts_;
  }

  // Waits until so many more are counted.
  void await(int Counts::*count, int more) {
    std::unique_lock lock(mutex_);
    const int enough = counts_.*count + more;
    if (!changed_.wait_for(lock, std::chrono::minutes(2), [&] { return counts_.*count >= enough; }))
      throw std::runtime_error("calls stay away for two minutes");
  }

 private:
  static constexpr std::chrono::milliseconds kPace{20}, kRetry{5};

  // One that is stopped and not acknowledged may have been carried out.
  void change(Recorded& one, int number, const std::stop_token& stop) {
    Change change{change_of(one.session, number)};
    for (;;) try {
        change.applied_frame =
            connection_->call(&v1::SessionService::Stub::UpdateTextile, change.request)
                .applied_frame();
        one.changes.push_back(change);
        note(&Counts::acknowledged);
        return std::this_thread::sleep_for(kPace);
      } catch (const client::Problem& problem) {
        note(problem.reason == "STORE_UNWRITABLE" ? &Counts::refused : &Counts::wrong);
        if (stop.stop_requested()) return;
        std::this_thread::sleep_for(kRetry);
      }
  }

  void note(int Counts::*count) {
    const std::lock_guard lock(mutex_);
    ++(counts_.*count);
    changed_.notify_all();
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Counts counts_;
  const std::unique_ptr<client::Connection> connection_;
  std::jthread thread_;
};

}  // namespace weft::stress
