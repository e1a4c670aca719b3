#include <fmt/format.h>

#include <chrono>
#include <stop_token>
#include <vector>

#include "client/output/text.h"
#include "client/templates/templates.h"
#include "tests/stress/at_end.h"
#include "tests/stress/caller.h"
#include "tests/stress/recorded.h"
#include "tests/stress/stress.h"
#include "tests/stress/weftd.h"

namespace weft::stress {
namespace {

struct Seen {
  Caller::Counts counts;
  Faults faults;
  std::size_t changes = 0;  // acknowledged
  std::size_t recordings = 0;
};

// The disk turns bad again and again while sessions run, are changed and are recorded, until
// `enough` more calls came to what is to be expected of it; at the end weftd is killed and must
// know every change that it acknowledged.
Seen endure(Disk disk, int rounds, int Caller::Counts::*expected, int enough) {
  const v1::Scene scene = client::make_template("load", {.rows = 8, .columns = 8});
  Weftd weftd;
  const auto connection = weftd.connect();
  Hearing hearing(4);
  std::stop_source stop;
  const auto recorders = weftd.connect(stop.get_token());
  std::vector<Recorded> all = record_sessions(weftd.path(""), *recorders, scene, hearing);
  const AtEnd give_up([&] { stop.request_stop(); });

  Seen seen;
  {
    Caller caller(weftd.connect(), all);
    for (int round = 0; round < rounds; ++round) {
      caller.await(&Caller::Counts::acknowledged, 10);
      weftd.set_disk(disk);
      caller.await(expected, enough);
      hearing.wait_for_all_after(Clock::now());  // sessions go on
      weftd.set_disk(Disk::kGood);
    }
    caller.await(&Caller::Counts::acknowledged, 10);
    seen.counts = caller.counts();
  }
  weftd.kill_and_start();
  hearing.wait_for_all_after(Clock::now());

  for (Recorded& one : all) {
    finish(*connection, scene, one, seen.faults);
    seen.changes += one.changes.size();
  }
  seen.recordings = all.size();
  return seen;
}

Outcome outcome_of(const Seen& seen, const std::string& calls) {
  const Faults& faults = seen.faults;
  return {.figure = fmt::format("{}, {} refused otherwise; {} frames in {} recordings, {} lost, {} "
                                "differing from the core with the {} changes acknowledged",
                                calls, seen.counts.wrong, faults.frames, seen.recordings,
                                faults.lost, faults.differing, seen.changes),
          .hold = "0, 0, 0; sessions go on",
          .counts = faults.frames > 0 && faults.lost == 0 && faults.differing == 0 &&
                    seen.counts.wrong == 0 && seen.changes > 0};
}

Outcome unwritable(Disk disk, const char* what, Form form) {
  const int rounds = form == Form::kShort ? 5 : 100;
  const Seen seen = endure(disk, rounds, &Caller::Counts::refused, 10);
  return outcome_of(seen, fmt::format("{} {} times: {} calls refused as STORE_UNWRITABLE", what,
                                      rounds, seen.counts.refused));
}

}  // namespace

Outcome full_disk(Form form) { return unwritable(Disk::kFull, "full", form); }

Outcome read_only_disk(Form form) { return unwritable(Disk::kReadOnly, "read-only", form); }

Outcome slow_disk(Form form) {
  const int rounds = form == Form::kShort ? 2 : 40;
  Seen seen = endure(Disk::kSlow, rounds, &Caller::Counts::acknowledged, 5);
  seen.counts.wrong += seen.counts.refused;
  return outcome_of(seen,
                    fmt::format("{} times {} for each sync, {} calls refused", rounds,
                                client::seconds_text(std::chrono::duration<double>(kSync).count()),
                                seen.counts.refused));
}

}  // namespace weft::stress
