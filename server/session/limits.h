#pragma once

#include <cstdint>

#include "server/session/memory.h"

namespace weft {

// What a server accepts. Published in GetServerInfo.
struct Limits {
  std::int64_t max_sessions = 256;
  std::int64_t max_sessions_per_principal = 100'000;
  std::int64_t max_particles_per_session = 1'000'000;
  std::int64_t max_total_particles = 10'000'000;  // of all sessions
  std::int64_t max_frame_work = 1'000'000'000;    // particles x substeps
  std::int64_t max_particles_per_principal = 1'000'000'000;
  std::int64_t history_bytes_per_session = 64 << 20;  // frames with their encodings
  std::int64_t max_total_history_bytes = memory_there_is() / 4;
  std::int64_t max_streams = 1024;  // but tests of textiles
  std::int64_t max_streams_per_principal = 100'000;
  std::int64_t max_snapshots_per_session = 16;  // on demand
  std::int64_t max_tests = 8;                   // that run or wait
  std::int64_t max_request_bytes = 16 << 20;
  std::int64_t max_frame_bytes = 4 << 20;  // gRPC's default receive limit
  std::int64_t max_asset_bytes = 128 << 20;
  std::int64_t max_asset_bytes_per_principal = std::int64_t{1} << 30;
  std::int64_t max_total_asset_bytes = std::int64_t{16} << 30;
};

}  // namespace weft
