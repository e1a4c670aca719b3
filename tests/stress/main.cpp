#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "tests/stress/stress.h"

namespace {

using weft::stress::Form;
using weft::stress::Outcome;

struct Test {
  const char* name;
  Outcome (*run)(Form);
};

constexpr std::array kTests{
    Test{"lossless", weft::stress::lossless},
    Test{"real-time", weft::stress::real_time},
    Test{"fan-out", weft::stress::fan_out},
    Test{"long-frames", weft::stress::long_frames},
    Test{"contact", weft::stress::contacts},
    Test{"churn", weft::stress::churn},
    Test{"slow-readers", weft::stress::slow_readers},
    Test{"view-age", weft::stress::view_age},
    Test{"kill", weft::stress::kills},
    Test{"full-disk", weft::stress::full_disk},
    Test{"read-only-disk", weft::stress::read_only_disk},
    Test{"slow-disk", weft::stress::slow_disk},
    Test{"drain", weft::stress::drain},
    Test{"sizing", weft::stress::sizing},
    Test{"scale-out-kill", weft::stress::fleet_kills},
    Test{"scale-out-freeze", weft::stress::fleet_freezes},
    Test{"scale-out-resize", weft::stress::fleet_resize},
    Test{"scale-out-drain", weft::stress::fleet_drain},
    Test{"scale-out-database", weft::stress::fleet_database},
    Test{"scale-out-full", weft::stress::fleet_full},
    Test{"scale-out-reload", weft::stress::fleet_reload},
};

// "scale-out" names all whose names begin with "scale-out-".
bool is_meant(const Test& test, const std::string& name) {
  return test.name == name || std::string(test.name).starts_with(name + '-');
}

int usage() {
  std::string names;
  for (const Test& test : kTests) names += std::string(" ") + test.name;
  fmt::print(stderr, "usage: weft-stress [short|long] [TEST...]; there are{}\n", names);
  return 2;
}

// Ends the process where a test of the short form does not come to its end.
class Watchdog {
 public:
  Watchdog(const Test& test, Form form) {
    if (form == Form::kShort) thread_ = std::jthread(&Watchdog::watch, test.name);
  }

 private:
  static void watch(const std::stop_token& stop, const char* test) {
    constexpr std::chrono::minutes kLongest{10};
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any().wait_for(lock, stop, kLongest, [] { return false; });
    if (stop.stop_requested()) return;
    fmt::print("{}: does not end within ten minutes SHORT\n", test);
    std::fflush(stdout);
    std::_Exit(1);
  }

  std::jthread thread_;
};

// False where what was seen decides against it.
bool run(const Test& test, Form form) {
  const Watchdog watchdog(test, form);
  Outcome outcome;
  try {
    outcome = test.run(form);
  } catch (const std::exception& error) {
    outcome = {error.what(), "runs to its end", false, false};
  }
  fmt::print("{}: {} (hold: {}) {}\n", test.name, outcome.figure, outcome.hold,
             outcome.counts && outcome.bounds ? "ok" : "SHORT");
  std::fflush(stdout);
  return outcome.counts && (outcome.bounds || form == Form::kShort);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> names(argv + 1, argv + argc);
  Form form = Form::kShort;
  if (!names.empty() && (names[0] == "short" || names[0] == "long")) {
    form = names[0] == "long" ? Form::kLong : Form::kShort;
    names.erase(names.begin());
  }
  for (const std::string& name : names) {
    if (std::none_of(kTests.begin(), kTests.end(),
                     [&](const Test& t) { return is_meant(t, name); }))
      return usage();
  }
  bool good = true;
  for (const Test& test : kTests) {
    if (names.empty() || std::any_of(names.begin(), names.end(),
                                     [&](const auto& name) { return is_meant(test, name); }))
      good = run(test, form) && good;
  }
  return good ? 0 : 1;
}
