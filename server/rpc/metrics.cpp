#include "server/rpc/metrics.h"

#include <prometheus/client_metric.h>
#include <prometheus/collectable.h>
#include <prometheus/exposer.h>
#include <prometheus/metric_family.h>
#include <prometheus/metric_type.h>

#include <exception>
#include <limits>
#include <stdexcept>
#include <vector>

#include "server/rpc/server_stats.h"

namespace weft {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;

MetricFamily counter(const char* name, const char* help, std::int64_t value) {
  ClientMetric metric;
  metric.counter.value = static_cast<double>(value);
  return {name, help, MetricType::Counter, {metric}};
}

MetricFamily gauge(const char* name, const char* help, double value) {
  ClientMetric metric;
  metric.gauge.value = value;
  return {name, help, MetricType::Gauge, {metric}};
}

MetricFamily sessions(const v1::SessionCounts& counts) {
  MetricFamily family{"weft_sessions", "Sessions by state", MetricType::Gauge, {}};
  const auto add = [&](const char* state, std::int64_t count) {
    ClientMetric& metric = family.metric.emplace_back();
    metric.label = {{"state", state}};
    metric.gauge.value = static_cast<double>(count);
  };
  add("paused", counts.paused());
  add("running", counts.running() - counts.at_rest());
  add("running_at_rest", counts.at_rest());
  add("failed", counts.failed());
  add("restoring", counts.restoring());
  return family;
}

MetricFamily histogram(const char* name, const char* help, const v1::Histogram& from) {
  ClientMetric metric;
  std::uint64_t up_to = 0;
  for (int bucket = 0; bucket < from.counts_size(); ++bucket) {
    up_to += static_cast<std::uint64_t>(from.counts(bucket));
    const double bound =
        bucket < from.bounds_size() ? from.bounds(bucket) : std::numeric_limits<double>::infinity();
    metric.histogram.bucket.push_back({up_to, bound});
  }
  metric.histogram.sample_count = up_to;
  metric.histogram.sample_sum = from.sum();
  return {name, help, MetricType::Histogram, {metric}};
}

}  // namespace

struct Metrics::Exposed : prometheus::Collectable {
  Exposed(const Backend& served, const std::string& address)
      : backend(served), exposer(address, 1) {}

  std::vector<MetricFamily> Collect() const override {
    const v1::ServerStats stats = server_stats(backend);
    return {
        gauge("weft_uptime_seconds", "Since the server began", stats.uptime_s()),
        sessions(stats.sessions()),
        gauge("weft_streams", "Open streams", static_cast<double>(stats.streams())),
        counter("weft_frames_total", "Frames computed", stats.frames()),
        counter("weft_sleeping_frames_total", "Of them, without a substep",
                stats.sleeping_frames()),
        counter("weft_substeps_total", "Substeps of all sessions", stats.substeps()),
        counter("weft_particle_substeps_total", "Substeps times particles",
                stats.particle_substeps()),
        counter("weft_repairs_total", "Frames computed again", stats.repairs()),
        counter("weft_failures_total", "Sessions that failed", stats.failures()),
        counter("weft_frames_sent_total", "Frames sent on streams", stats.frames_sent()),
        counter("weft_bytes_sent_total", "Bytes of frame messages", stats.bytes_sent()),
        counter("weft_slow_readers_total", "Streams that ended because they were too slow",
                stats.slow_readers()),
        counter("weft_sessions_taken_over_total",
                "Sessions that came from another server or the store", stats.sessions_taken_over()),
        counter("weft_sessions_given_away_total",
                "Sessions that went to another server or the store", stats.sessions_given_away()),
        gauge("weft_history_bytes", "Bytes of the frames that sessions keep",
              static_cast<double>(stats.history_bytes())),
        gauge("weft_assets", "Assets in the store", static_cast<double>(stats.assets())),
        gauge("weft_asset_bytes", "Bytes of all assets in the store",
              static_cast<double>(stats.asset_bytes())),
        counter("weft_asset_bytes_received_total", "Bytes of assets that came on streams",
                stats.asset_bytes_received()),
        counter("weft_asset_bytes_sent_total", "Bytes of assets sent on streams",
                stats.asset_bytes_sent()),
        histogram("weft_frame_time_seconds", "Time to compute a frame", stats.frame_time_s()),
        histogram("weft_lateness_seconds", "How late frames of paced sessions were",
                  stats.lateness_s())};
  }

  const Backend& backend;
  prometheus::Exposer exposer;
};

Metrics::Metrics(const Backend& backend, const std::string& address) try
    : exposed_(std::make_shared<Exposed>(backend, address)) {
  exposed_->exposer.RegisterCollectable(exposed_);
  const std::string host = address.substr(0, address.rfind(':'));
  address_ = host + ":" + std::to_string(exposed_->exposer.GetListeningPorts().front());
} catch (const std::exception& error) {
  throw std::runtime_error("cannot serve metrics at " + address + ": " + error.what());
}

Metrics::~Metrics() = default;

}  // namespace weft
