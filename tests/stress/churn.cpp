#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>
#include <vector>

#include "client/output/text.h"
#include "client/scene_file.h"
#include "client/templates/templates.h"
#include "tests/stress/stress.h"
#include "tests/stress/weftd.h"

namespace weft::stress {
namespace {

using Sessions = v1::SessionService::Stub;

// Creates, steps and deletes sessions, several at a time; returns how often that went wrong.
int come_and_go(client::Connection& connection, int sessions) {
  constexpr int kAtATime = 8;
  const v1::Scene scene = client::make_template("load", {.rows = 8, .columns = 8});
  std::atomic<int> left = sessions, wrong = 0;
  std::vector<std::jthread> callers;
  for (int i = 0; i < kAtATime; ++i) {
    callers.emplace_back([&] {
      while (left-- > 0) try {
          const std::string name = client::create_session(connection, scene).name();
          v1::StepSessionRequest step;
          step.set_name(name);
          if (connection.call(&Sessions::StepSession, step).frame() != 1) ++wrong;
          v1::DeleteSessionRequest remove;
          remove.set_name(name);
          connection.call(&Sessions::DeleteSession, remove);
        } catch (const client::Problem&) {
          ++wrong;
        }
    });
  }
  callers.clear();
  return wrong;
}

// After at most some seconds in which the server may clear up.
Usage settled(const Weftd& weftd, const Usage& wanted) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  Usage usage = weftd.usage();
  while ((usage.threads > wanted.threads || usage.files > wanted.files) &&
         std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    usage = weftd.usage();
  }
  return usage;
}

}  // namespace

Outcome churn(Form form) {
  constexpr double kMostGrowth = 0.05;
  constexpr int kRounds = 5;
  const bool is_short = form == Form::kShort;
  const int sessions = is_short ? 1000 : 20'000;
  const Weftd weftd;
  const auto connection = weftd.connect();
  // what grows once has grown, and as many requests are remembered as ever are (Requests::kMost)
  int wrong = come_and_go(*connection, sessions * 3 / 10);
  Usage before = weftd.usage();
  for (int round = 0; round < kRounds; ++round) {  // gRPC starts some threads late
    wrong += come_and_go(*connection, sessions / 10);
    before.threads = weftd.usage().threads;
  }
  const auto start = std::chrono::steady_clock::now();
  wrong += come_and_go(*connection, sessions);
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  const Usage after = settled(weftd, before);
  const double growth = static_cast<double>(after.memory) / static_cast<double>(before.memory) - 1;
  return {
      .figure = fmt::format("{} sessions, {:.0f} a second, {} wrong; threads {} to {}, files {} "
                            "to {}, memory {} to {} ({:+.1f} %)",
                            sessions, sessions / wall.count(), wrong, before.threads, after.threads,
                            before.files, after.files, client::bytes_text(before.memory),
                            client::bytes_text(after.memory), 100 * growth),
      .hold = "0 wrong; threads and files back, memory within 5 %",
      .counts = wrong == 0 && after.threads <= before.threads && after.files <= before.files,
      .bounds = growth <= kMostGrowth};
}

}  // namespace weft::stress
