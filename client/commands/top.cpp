#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "client/commands/commands.h"
#include "client/output/status.h"
#include "client/output/text.h"

namespace weft::client {
namespace {

constexpr std::size_t kMostRows = 20;

struct TopOptions {
  double interval_s = 1;
  std::optional<int> looks;
};

// What a server said of itself at one time.
struct Look {
  v1::ServerStats stats;
  v1::ListSessionsResponse sessions;
};

Look look_at(Connection& connection) {
  return {connection.call(&Servers::GetServerStats, v1::GetServerStatsRequest()),
          list_sessions(connection)};
}

// Bound below which 99 of 100 of the values lie that came since, s; absent: there were none.
std::optional<double> largest_of_99(const v1::Histogram& now, const v1::Histogram& before) {
  std::int64_t all = 0, up_to = 0;
  for (int i = 0; i < now.counts_size(); ++i) all += now.counts(i) - before.counts(i);
  if (all == 0) return std::nullopt;
  for (int i = 0; i < now.bounds_size(); ++i) {
    up_to += now.counts(i) - before.counts(i);
    if (100 * up_to >= 99 * all) return now.bounds(i);
  }
  return std::numeric_limits<double>::infinity();
}

std::string rate_text(std::int64_t now, std::int64_t before, double seconds) {
  return fmt::format("{:.3g}", static_cast<double>(now - before) / seconds);
}

std::string server_text(const v1::ServerStats& now, const v1::ServerStats& before) {
  const double seconds = now.uptime_s() - before.uptime_s();
  const v1::SessionCounts& count = now.sessions();
  const double particle_substeps =
      static_cast<double>(now.particle_substeps() - before.particle_substeps());
  const auto late = largest_of_99(now.lateness_s(), before.lateness_s());
  return Facts()
      .add("up", seconds_text(now.uptime_s()))
      .add("sessions", fmt::format("{} running ({} at rest), {} paused, {} failed, {} restoring",
                                   count.running(), count.at_rest(), count.paused(), count.failed(),
                                   count.restoring()))
      .add("computes",
           fmt::format("{} frames/s, {:.3g} million particle-substeps/s, {}",
                       rate_text(now.frames(), before.frames(), seconds),
                       particle_substeps / seconds / 1e6, count_of(now.repairs(), "repair")))
      .add("sends",
           fmt::format("{} frames/s, {}/s on {}",
                       rate_text(now.frames_sent(), before.frames_sent(), seconds),
                       bytes_text(static_cast<std::int64_t>(
                           static_cast<double>(now.bytes_sent() - before.bytes_sent()) / seconds)),
                       count_of(now.streams(), "stream")))
      .add("late",
           late ? "99 of 100 paced frames by less than " + seconds_text(*late) : "no paced frame")
      .text();
}

// The busiest first.
std::string sessions_text(const Look& now, const Look& before, std::size_t columns) {
  const double seconds = now.stats.uptime_s() - before.stats.uptime_s();
  std::map<std::string, double> times;
  for (const auto& session : before.sessions.sessions()) times[session.uid()] = session.time_s();
  std::vector<std::pair<double, const v1::Session*>> rows;
  for (const auto& session : now.sessions.sessions()) {
    if (!is_shown(session)) continue;
    const auto known = times.find(session.uid());
    const double speed = known == times.end() ? 0 : (session.time_s() - known->second) / seconds;
    rows.emplace_back(speed, &session);
  }
  std::stable_sort(rows.begin(), rows.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });

  Table table({"SESSION", "STATE", "FRAME", "TIME", "SPEED", "LATE", "AT REST"});
  const std::size_t shown = std::min(rows.size(), kMostRows);
  for (std::size_t i = 0; i < shown; ++i) {
    const auto& [speed, session] = rows[i];
    table.add({session->name(), state_text(*session), std::to_string(session->frame()),
               seconds_text(session->time_s()), fmt::format("{:.2f} x", speed),
               seconds_text(session->lateness_s()), session->at_rest() ? "yes" : "no"});
  }
  std::string text = rows.empty() ? "no sessions\n" : table.text(columns);
  if (rows.size() > shown) text += fmt::format("{} more are slower\n", rows.size() - shown);
  return text;
}

void show(Context& context, Status& status, const Look& now, const Look& before) {
  if (context.json) {
    Json json = to_json(now.sessions);
    json["stats"] = to_json(now.stats);
    return context.answer(json, "");
  }
  const std::string text = server_text(now.stats, before.stats) + '\n' +
                           sessions_text(now, before, context.terminal.columns);
  if (!context.terminal.out_is_watched) return context.answer({}, text);
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  status.show(std::move(lines));
}

// False: stopped meanwhile.
bool pause_for(const std::stop_token& stop, double seconds) {
  std::mutex mutex;
  std::unique_lock lock(mutex);
  std::condition_variable_any().wait_for(lock, stop, std::chrono::duration<double>(seconds),
                                         [] { return false; });
  return !stop.stop_requested();
}

void run_top(Context& context, const TopOptions& options) {
  Connection& connection = context.connection();
  Status status(context.terminal.out, context.terminal.out_is_watched && !context.json);
  Look before = look_at(connection);
  for (int look = 0; !options.looks || look < *options.looks; ++look) {
    if (!pause_for(context.stop, options.interval_s)) break;
    Look now = look_at(connection);
    show(context, status, now, before);
    before = std::move(now);
  }
  status.keep();
}

}  // namespace

void add_top(CLI::App& app, Context& context) {
  auto options = std::make_shared<TopOptions>();
  CLI::App* command =
      app.add_subcommand("top", "Show what a server and its sessions do, until Ctrl-C");
  command->add_option("--interval", options->interval_s, "Time between two looks, s")
      ->type_name("S")
      ->check(CLI::Range(0.01, 3600.0));
  command->add_option("--looks", options->looks, "End after so many")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  command->callback([&context, options] { run_top(context, *options); });
}

}  // namespace weft::client
