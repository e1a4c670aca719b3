#include <fmt/format.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <future>
#include <mutex>
#include <vector>

#include "client/load/load.h"
#include "client/output/text.h"
#include "client/templates/templates.h"
#include "tests/stress/offline.h"
#include "tests/stress/stress.h"
#include "tests/stress/weftd.h"

namespace weft::stress {
namespace {

constexpr int kSide = 21;          // particles
constexpr double kSpacing = 0.02;  // m

v1::Sheet& add_sheet(v1::Scene& scene, double height) {
  v1::Sheet& sheet = *scene.add_sheets();
  sheet.mutable_grid()->set_rows(kSide);
  sheet.mutable_grid()->set_columns(kSide);
  sheet.mutable_grid()->set_spacing_m(kSpacing);
  sheet.mutable_textile()->set_preset("wool_tropical");
  sheet.mutable_placement()->mutable_origin_m()->set_y(height);
  return sheet;
}

v1::Scene with_contact() {
  v1::Scene scene;
  scene.set_cloth_contact(true);
  return scene;
}

// A sheet that stands on its edge falls into folds.
v1::Scene heap() {
  v1::Scene scene = with_contact();
  v1::Sheet& sheet = add_sheet(scene, 0);
  for (int row = 0; row < kSide; ++row)
    for (int column = 0; column < kSide; ++column) {
      const double up = kSpacing * row, along = kSpacing * column;
      for (const double value :
           {along, up + 0.01, 0.02 * std::sin(20 * up) + 1e-3 * std::sin(200 * along)})
        sheet.add_start_positions_m(value);
    }
  scene.add_colliders()->mutable_plane();
  return scene;
}

// Three sheets fall onto a ball, one on the other.
v1::Scene pile() {
  v1::Scene scene = with_contact();
  for (int layer = 0; layer < 3; ++layer) add_sheet(scene, 0.01 * layer);
  v1::Sphere& ball = *scene.add_colliders()->mutable_sphere();
  ball.set_radius_m(0.1);
  ball.mutable_center_m()->set_x(0.2);
  ball.mutable_center_m()->set_y(-0.11);
  ball.mutable_center_m()->set_z(0.2);
  return scene;
}

// A corner of a sheet is dragged through another one at 20 m/s, and back.
v1::Scene dragged() {
  v1::Scene scene = with_contact();
  for (int layer = 0; layer < 2; ++layer) {
    v1::Sheet& sheet = add_sheet(scene, 0.02 * layer);
    sheet.add_pins()->add_particles(0);
    sheet.add_pins()->add_particles(kSide - 1);
  }
  v1::Pin& pin = *scene.mutable_sheets(1)->add_pins();
  pin.add_particles(kSide * kSide - 1);
  for (const auto& [time, height] : {std::pair(0.1, 0.0), {0.12, -0.4}, {0.2, -0.4}, {0.22, 0.0}}) {
    v1::Keyframe& key = *pin.add_path();
    key.set_time_s(time);
    key.mutable_offset_m()->set_y(height);
  }
  return scene;
}

// Frames as the core computes them alone.
struct Alone {
  std::vector<std::size_t> positions;  // checksums
  std::vector<std::int64_t> cuts;

  Alone(const v1::Scene& scene, std::int64_t last) {
    Simulation simulation = simulation_of(scene);
    for (std::int64_t frame = 0; frame <= last; ++frame) {
      if (frame > 0 && !simulation.advance_frame()) throw std::logic_error(simulation.failure());
      positions.push_back(checksum_of(float_planes(simulation)));
      cuts.push_back(simulation.stats().cloth_cuts.value_or(-1));
    }
  }

  bool has(const v1::Frame& frame) const {
    const auto number = static_cast<std::size_t>(frame.number());
    return checksum_of(frame.positions_m()) == positions[number] &&
           frame.stats().cloth_cut_count() == cuts[number];
  }
};

}  // namespace

// Sessions whose cloth touches cloth: their frames, with the cuts that they tell, are the core's,
// and paced sessions beside them are on time.
Outcome contacts(Form form) {
  using Clock = std::chrono::steady_clock;
  const bool is_short = form == Form::kShort;
  const int sessions = is_short ? 1 : 8;  // of each scene
  const std::int64_t frames = is_short ? 16 : 240;
  const Weftd weftd({"--max-sessions", "100"});
  const auto connection = weftd.connect();

  const std::array scenes{heap(), pile(), dragged()};
  std::vector<Alone> alone;
  for (const v1::Scene& scene : scenes) alone.emplace_back(scene, frames);

  client::LoadOrder paced{.scene = client::make_template("load"), .sessions = 10};
  paced.ramp = std::chrono::milliseconds(500);
  paced.duration = std::chrono::milliseconds(is_short ? 2000 : 30'000);
  const auto before = client::apply_load(*connection, paced);

  std::atomic<std::int64_t> differing = 0, with_cuts = 0;
  std::mutex mutex;
  std::chrono::duration<double> longest{};
  const auto run = [&](const v1::Scene& scene, const Alone& core) {
    std::vector<Clock::time_point> heard(static_cast<std::size_t>(sessions));
    client::LoadOrder order{.scene = scene, .sessions = sessions, .drive = client::Drive::kFree};
    order.frames = frames;
    order.duration = std::chrono::hours(24);
    order.on_frame = [&](int session, int, const v1::Frame& frame) {
      if (!core.has(frame)) ++differing;
      if (frame.stats().cloth_cut_count() > 0) ++with_cuts;
      Clock::time_point& last = heard[static_cast<std::size_t>(session)];
      const Clock::time_point now = Clock::now();
      const std::lock_guard lock(mutex);
      if (frame.number() > 1)
        longest = std::max<std::chrono::duration<double>>(longest, now - last);
      last = now;
    };
    return client::apply_load(*connection, order);
  };
  std::vector<std::future<client::LoadResult>> all;
  for (std::size_t i = 0; i < scenes.size(); ++i)
    all.push_back(std::async(std::launch::async, run, std::ref(scenes[i]), std::ref(alone[i])));
  const auto beside = client::apply_load(*connection, paced);
  bool clean = before.clean() && beside.clean();
  std::int64_t received = 0;
  for (auto& each : all) {
    const client::LoadResult result = each.get();
    clean = clean && result.clean();
    received += result.frames_received;
  }
  const std::int64_t wanted = static_cast<std::int64_t>(all.size()) * sessions * frames;
  const double late = beside.frame.quantile(0.99), late_before = before.frame.quantile(0.99);
  return {.figure = fmt::format(
              "{} sessions x {} frames: {} of {} received, {} differing, {} with cuts; each within "
              "{} of the one before; p99 lateness of 10 paced sessions beside them {}, {} without",
              all.size() * static_cast<std::size_t>(sessions), frames, received, wanted,
              differing.load(), with_cuts.load(), client::seconds_text(longest.count()),
              client::seconds_text(late), client::seconds_text(late_before)),
          .hold = "all, 0; a frame late",
          .counts = clean && differing == 0 && received == wanted,
          .bounds = late < 1 / paced.rate_per_s};
}

}  // namespace weft::stress
