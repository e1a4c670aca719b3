#include "server/rpc/server_stats.h"

#include <chrono>
#include <limits>

namespace weft {
namespace {

void set(v1::Histogram* to, const DurationHistogram& from) {
  for (std::size_t bucket = 0; bucket < DurationHistogram::kBuckets; ++bucket) {
    if (bucket + 1 < DurationHistogram::kBuckets) to->add_bounds(DurationHistogram::bound(bucket));
    to->add_counts(from.count(bucket));
  }
  to->set_sum(from.sum());
}

void count(const SessionStatus& status, v1::SessionCounts* counts) {
  switch (status.state) {
    case SessionState::kPaused:
      return counts->set_paused(counts->paused() + 1);
    case SessionState::kRunning:
      counts->set_running(counts->running() + 1);
      if (status.newest->at_rest) counts->set_at_rest(counts->at_rest() + 1);
      return;
    case SessionState::kFailed:
      return counts->set_failed(counts->failed() + 1);
    case SessionState::kRestoring:
      return counts->set_restoring(counts->restoring() + 1);
  }
}

}  // namespace

v1::ServerStats server_stats(const Backend& backend) {
  const Stats& stats = backend.stats;
  v1::ServerStats result;
  result.set_uptime_s(std::chrono::duration<double>(Clock::now() - stats.start).count());
  for (const auto& session : backend.registry.list("", std::numeric_limits<std::size_t>::max()))
    count(session->status(), result.mutable_sessions());
  result.set_streams(stats.streams);
  result.set_frames(stats.frames);
  result.set_sleeping_frames(stats.sleeping_frames);
  result.set_substeps(stats.substeps);
  result.set_particle_substeps(stats.particle_substeps);
  result.set_repairs(stats.repairs);
  result.set_failures(stats.failures);
  result.set_frames_sent(stats.frames_sent);
  result.set_bytes_sent(stats.bytes_sent);
  result.set_slow_readers(stats.slow_readers);
  result.set_sessions_taken_over(stats.taken_over);
  result.set_sessions_given_away(stats.given_away);
  result.set_assets(stats.assets);
  result.set_asset_bytes(stats.asset_bytes);
  result.set_asset_bytes_received(stats.asset_bytes_received);
  result.set_asset_bytes_sent(stats.asset_bytes_sent);
  result.set_history_bytes(static_cast<std::int64_t>(backend.history->meter()->bytes()));
  set(result.mutable_frame_time_s(), stats.frame_time);
  set(result.mutable_lateness_s(), stats.lateness);
  return result;
}

}  // namespace weft
