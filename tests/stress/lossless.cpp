#include <fmt/format.h>

#include <atomic>
#include <future>
#include <vector>

#include "client/load/load.h"
#include "client/recording/reader.h"
#include "client/recording/recorder.h"
#include "client/scene_file.h"
#include "client/templates/templates.h"
#include "tests/stress/offline.h"
#include "tests/stress/stress.h"
#include "tests/stress/weftd.h"

namespace weft::stress {
namespace {

// Frames 1 to `last` of a new session, in a file.
std::string write_recording(client::Connection& connection, const v1::Scene& scene,
                            std::int64_t last, const std::string& path) {
  client::RecordingOrder order;
  order.session = client::create_session(connection, scene).name();
  order.path = path;
  order.from = 1;
  order.to = last;
  order.run = true;
  client::record(connection, order, [](const client::Tally&) {});
  return path;
}

}  // namespace

// Sessions that run as fast as they can, most of them hashed, some written to files.
Outcome lossless(Form form) {
  const bool is_short = form == Form::kShort;
  const int hashed = is_short ? 18 : 190, written = is_short ? 2 : 10;
  const std::int64_t frames = is_short ? 60 : 18'000;
  const v1::Scene scene = client::make_template("load");
  const std::vector<std::size_t> expected = offline_checksums(scene, frames);

  const Weftd weftd({"--max-sessions", "300"});
  const auto connection = weftd.connect();
  std::vector<std::future<std::string>> recordings;
  for (int i = 0; i < written; ++i) {
    recordings.push_back(std::async(std::launch::async, write_recording, std::ref(*connection),
                                    scene, frames, weftd.path(fmt::format("{}.weft", i))));
  }
  std::atomic<std::int64_t> differing = 0;
  const auto compare = [&](const v1::Frame& frame) {
    if (checksum_of(frame.positions_m()) != expected[static_cast<std::size_t>(frame.number())])
      ++differing;
  };
  client::LoadOrder order{.scene = scene, .sessions = hashed, .drive = client::Drive::kFree};
  order.frames = frames;
  order.duration = std::chrono::hours(24);
  order.on_frame = [&](int, int, const v1::Frame& frame) { compare(frame); };
  client::LoadResult result = client::apply_load(*connection, order);

  for (auto& recording : recordings) {
    client::RecordingReader reader(recording.get());
    for (std::int64_t number = 1; number <= reader.last_frame(); ++number, ++result.frames_received)
      compare(reader.read(number));
    result.frames_lost += frames - reader.last_frame();
  }
  const std::int64_t wanted = frames * (hashed + written);
  return {.figure = fmt::format("{} sessions x {} frames, {} substeps hashed: {} of {} received, "
                                "{} lost, {} doubled, {} differing, {} errors",
                                hashed + written, frames, result.planned_substeps,
                                result.frames_received, wanted, result.frames_lost,
                                result.frames_doubled, differing.load(), result.error_count()),
          .hold = "all, 0, 0, 0, 0",
          .counts = result.clean() && differing == 0 && result.planned_substeps > 0 &&
                    result.frames_received == wanted};
}

}  // namespace weft::stress
