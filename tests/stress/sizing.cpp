#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <iterator>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "client/load/load.h"
#include "client/output/text.h"
#include "client/templates/templates.h"
#include "tests/stress/stress.h"
#include "tests/stress/weftd.h"
#include "tests/support/service/postgres.h"

namespace weft::stress {
namespace {

// What sessions of a server use together.
struct Cost {
  double cores = 0;   // of weftd
  double sent = 0;    // bytes/s
  double stored = 0;  // bytes/s, to disk
  double memory = 0;  // bytes, kHistory of frames of each among them
  bool clean = false;
  double database = 0;  // cores of PostgreSQL, where there is one

  Cost times(double count) const {
    return {count * cores, count * sent, count * stored, count * memory, clean, count * database};
  }
};

constexpr std::int64_t kHistory = 1 << 20;  // bytes of frames that a session keeps

std::int64_t bytes_sent(client::Connection& connection) {
  return connection.call(&v1::ServerService::Stub::GetServerStats, v1::GetServerStatsRequest())
      .bytes_sent();
}

// Sessions of `load` in real time, a subscriber each.
Cost cost_of(const Weftd& weftd, int sessions, std::chrono::duration<double> duration) {
  const auto connection = weftd.connect();
  client::LoadOrder order{.scene = client::make_template("load"), .sessions = sessions};
  order.duration = duration;
  const Usage before = weftd.usage();
  const std::int64_t sent = bytes_sent(*connection);
  const client::LoadResult load = client::apply_load(*connection, order);
  const Usage after = weftd.usage();
  const double seconds = load.wall.count();
  return {.cores = (after.cpu_s - before.cpu_s) / seconds,
          .sent = static_cast<double>(bytes_sent(*connection) - sent) / seconds,
          .stored = static_cast<double>(after.stored - before.stored) / seconds,
          .memory = static_cast<double>(after.most_memory - before.memory),
          .clean = load.clean()};
}

// The same for several servers at a time, together; they may share a database.
Cost cost_of_replicas(int replicas, int sessions, std::chrono::duration<double> duration,
                      const testing::Postgres* database = nullptr) {
  std::vector<std::unique_ptr<Weftd>> all;
  std::vector<std::future<Cost>> costs;
  for (int i = 0; i < replicas; ++i) {
    std::vector<std::string> flags{"--history-bytes", std::to_string(kHistory)};
    if (database != nullptr) {
      flags.insert(flags.end(),
                   {"--database", database->url(), "--replica", fmt::format("weftd-{}", i + 1)});
    }
    all.push_back(std::make_unique<Weftd>(flags));
  }
  const auto begin = std::chrono::steady_clock::now();
  const double before = database != nullptr ? database->cpu_s() : 0;
  for (const auto& weftd : all)
    costs.push_back(std::async(std::launch::async, cost_of, std::cref(*weftd), sessions, duration));
  Cost sum{.clean = true};
  for (auto& future : costs) {
    const Cost cost = future.get();
    sum = {sum.cores + cost.cores, sum.sent + cost.sent, sum.stored + cost.stored,
           sum.memory + cost.memory, sum.clean && cost.clean};
  }
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
  if (database != nullptr) sum.database = (database->cpu_s() - before) / wall.count();
  return sum;
}

// Machines like this one for so many sessions, each to be used to seven tenths, and what there is
// too little of first.
std::string machines_for(int sessions, const Cost& each) {
  constexpr double kUsed = 0.7, kNetwork = 125e6, kDisk = 100e6;  // bytes/s: 1 Gbit/s, a slow SSD
  const double memory =
      static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  const Cost all = each.times(sessions);
  const std::pair<double, const char*> needs[] = {
      {all.cores / std::thread::hardware_concurrency(), "cores"},
      {all.memory / memory, "memory"},
      {all.sent / kNetwork, "network"},
      {all.stored / kDisk, "disk"}};
  const auto& [most, what] = *std::max_element(std::begin(needs), std::end(needs));
  return fmt::format("{} sessions: {:.0f} machines ({})", sessions, std::ceil(most / kUsed), what);
}

}  // namespace

// What a session of `load` at 60 frames/s with one subscriber costs, and how many machines like
// this one that makes. Held to replicas that share this machine, with disks of their own and with a
// database: what several use must be as many times what one does.
Outcome sizing(Form form) {
  constexpr double kHold = 0.2;
  const bool is_short = form == Form::kShort;
  const int sessions = is_short ? 4 : 10;
  const std::chrono::duration<double> duration(is_short ? 3 : 30);
  const Cost one = cost_of_replicas(1, sessions, duration);
  const Cost each = one.times(1.0 / sessions);
  Outcome outcome{
      .figure =
          fmt::format("a session: {:.4f} of a core, {} of memory with {} of "
                      "frames, {}/s sent, {}/s stored",
                      each.cores, client::bytes_text(std::llround(each.memory)),
                      client::bytes_text(kHistory), client::bytes_text(std::llround(each.sent)),
                      client::bytes_text(std::llround(each.stored))),
      .hold = fmt::format("replicas: as many times as much, within {:.0f} %", 100 * kHold),
      .counts = one.clean};
  for (const int count : {1000, 10'000, 100'000})
    outcome.figure += "; " + machines_for(count, each);
  const auto hold = [&](int replicas, const Cost& cost) {
    const double off = cost.cores / (replicas * one.cores) - 1;
    outcome.counts = outcome.counts && cost.clean;
    outcome.bounds = outcome.bounds && std::abs(off) <= kHold;
    return fmt::format("; {} replicas: cores {:+.1f} %", replicas, 100 * off);
  };
  for (const int replicas : {2, 3})
    outcome.figure += hold(replicas, cost_of_replicas(replicas, sessions, duration));
  outcome.figure += "; with a database";
  for (const int replicas : {1, 2, 3}) {
    const testing::Postgres database;
    const Cost cost = cost_of_replicas(replicas, sessions, duration, &database);
    outcome.figure += hold(replicas, cost) + fmt::format(", PostgreSQL {:.4f} a session",
                                                         cost.database / (replicas * sessions));
  }
  return outcome;
}

}  // namespace weft::stress
