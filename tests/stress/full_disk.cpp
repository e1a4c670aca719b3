#include <fmt/format.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#include "client/problem.h"
#include "client/templates/templates.h"
#include "tests/stress/recorded.h"
#include "tests/stress/stress.h"
#include "tests/stress/weftd.h"

namespace weft::stress {
namespace {

using Sessions = v1::SessionService::Stub;

// Changes textiles, each call until it is acknowledged.
class Caller {
 public:
  Caller(const Weftd& weftd, std::vector<Recorded>& all)
      : connection_(weftd.connect()), thread_([this, &all](const std::stop_token& stop) {
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

  void change(Recorded& one, int number, const std::stop_token& stop) {
    Change change{change_of(one.session, number)};
    while (!stop.stop_requested()) try {
        change.applied_frame =
            connection_->call(&Sessions::UpdateTextile, change.request).applied_frame();
        one.changes.push_back(change);
        note(&Counts::acknowledged);
        return std::this_thread::sleep_for(kPace);
      } catch (const client::Problem& problem) {
        note(problem.reason == "STORE_UNWRITABLE" ? &Counts::refused : &Counts::wrong);
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

}  // namespace

// The disk is full again and again while sessions run, are changed and are recorded; at the end
// weftd is killed and must know every change that it acknowledged.
Outcome full_disk(Form form) {
  const int rounds = form == Form::kShort ? 5 : 100;
  const v1::Scene scene = client::make_template("load", {.rows = 8, .columns = 8});
  Weftd weftd;
  const auto connection = weftd.connect();
  Hearing hearing(4);
  std::vector<Recorded> all = record_sessions(weftd, *connection, scene, hearing);

  Caller::Counts counts;
  {
    Caller caller(weftd, all);
    for (int round = 0; round < rounds; ++round) {
      caller.await(&Caller::Counts::acknowledged, 10);
      weftd.fill_disk(true);
      caller.await(&Caller::Counts::refused, 10);
      hearing.wait_for_all_after(Clock::now());  // sessions go on
      weftd.fill_disk(false);
    }
    caller.await(&Caller::Counts::acknowledged, 10);
    counts = caller.counts();
  }
  weftd.kill_and_start();
  hearing.wait_for_all_after(Clock::now());

  Faults faults;
  std::size_t changes = 0;
  for (Recorded& one : all) {
    v1::PauseSessionRequest pause;
    pause.set_name(one.session.name());
    connection->call(&Sessions::PauseSession, pause);
    one.recorder.get();
    compare(scene, one, connection->get_session(one.session.name()).frame(), faults);
    changes += one.changes.size();
  }
  return {
      .figure = fmt::format("full {} times: {} calls refused as STORE_UNWRITABLE, {} otherwise; "
                            "{} frames in {} recordings, {} lost, {} differing from the core "
                            "with the {} changes acknowledged",
                            rounds, counts.refused, counts.wrong, faults.frames, all.size(),
                            faults.lost, faults.differing, changes),
      .hold = "0, 0, 0; sessions go on",
      .counts = faults.frames > 0 && faults.lost == 0 && faults.differing == 0 &&
                counts.wrong == 0 && counts.acknowledged > 0};
}

}  // namespace weft::stress
