#include "client/replay/player.h"

#include <algorithm>

#include "client/problem.h"
#include "client/recording/points.h"

namespace weft::client {
namespace {

std::vector<double> planes(const std::string& array, const v1::StreamHeader& header) {
  Points points = read_points(array, header);
  std::vector<double> values = std::move(points.x);
  values.insert(values.end(), points.y.begin(), points.y.end());
  values.insert(values.end(), points.z.begin(), points.z.end());
  return values;
}

std::shared_ptr<const Frame> frame_of(const v1::Frame& recorded, const v1::StreamHeader& header) {
  const v1::FrameStats& stats = recorded.stats();
  auto frame = std::make_shared<Frame>();
  frame->number = recorded.number();
  frame->time = recorded.time_s();
  frame->positions = planes(recorded.positions_m(), header);
  if (header.format().velocities())
    frame->velocities = planes(recorded.velocities_m_per_s(), header);
  if (header.format().pressure()) frame->pressures = read_pressures(recorded, header);
  if (header.format().clearance()) frame->clearances = read_clearances(recorded, header);
  frame->kinetic_energy = stats.kinetic_energy_j();
  frame->deformation = {stats.potential_energy_j(), stats.largest_strain()};
  if (stats.has_cloth_cut_count()) frame->cloth_cuts = stats.cloth_cut_count();
  if (stats.has_residual()) frame->residual = stats.residual();
  frame->pose_times.assign(stats.pose_times_s().begin(), stats.pose_times_s().end());
  frame->at_rest = stats.at_rest();
  frame->substeps = stats.substep_count();
  frame->substep = stats.substep_s();
  frame->repairs.resize(static_cast<std::size_t>(stats.repair_count()));
  return frame;
}

}  // namespace

Player::Player(const std::string& path) : recording_(path) {
  if (last_frame() < first_frame()) throw malformed(path, "the recording holds no frame");
  place_.newest = load(first_frame());
  thread_ = std::jthread([this](const std::stop_token& stop) { play(stop); });
}

Player::Place Player::place() const {
  std::lock_guard lock(mutex_);
  return place_;
}

Player::Place Player::wait(std::int64_t next, std::uint64_t changes,
                           std::chrono::milliseconds longest) const {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, longest, [&] {
    return place_.newest->number >= next || place_.changes != changes || place_.closed;
  });
  return place_;
}

std::shared_ptr<const Frame> Player::frame(std::int64_t number) {
  std::lock_guard lock(mutex_);
  return number == place_.newest->number ? place_.newest : load(number);
}

Assets Player::assets() {
  std::lock_guard lock(mutex_);
  return recording_.assets();
}

Player::Place Player::run(const Run& run) {
  std::lock_guard lock(mutex_);
  if (place_.state != v1::SESSION_STATE_FAILED && place_.newest->number < last_frame()) {
    run_ = run;
    start_time_ = Clock::now();
    start_s_ = place_.newest->time;
    change(v1::SESSION_STATE_RUNNING);
  }
  return place_;
}

Player::Place Player::pause() {
  std::lock_guard lock(mutex_);
  if (place_.state == v1::SESSION_STATE_RUNNING) change(v1::SESSION_STATE_PAUSED);
  return place_;
}

Player::Place Player::step(std::int64_t frames) {
  std::lock_guard lock(mutex_);
  if (place_.state == v1::SESSION_STATE_PAUSED)
    advance_to(place_.newest->number + std::min(frames, last_frame() - place_.newest->number));
  return place_;
}

void Player::close() {
  std::lock_guard lock(mutex_);
  place_.closed = true;
  changed_.notify_all();
}

void Player::play(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const auto is_running = [&] { return place_.state == v1::SESSION_STATE_RUNNING; };
  while (changed_.wait(lock, stop, is_running) && !stop.stop_requested()) {
    const std::uint64_t changes = place_.changes;
    const bool changed =
        changed_.wait_until(lock, stop, due(), [&] { return place_.changes != changes; });
    if (changed || stop.stop_requested()) continue;
    advance_to(place_.newest->number + 1);
    const bool reached = place_.newest->number >= run_.until_frame.value_or(last_frame()) ||
                         (run_.until_rest && place_.newest->at_rest) ||
                         place_.newest->number == last_frame();
    if (is_running() && reached) change(v1::SESSION_STATE_PAUSED);
    lock.unlock();  // others read, too
    lock.lock();
  }
}

std::shared_ptr<const Frame> Player::load(std::int64_t number) {
  return frame_of(recording_.read(number), header());
}

void Player::advance_to(std::int64_t number) {
  try {
    place_.newest = load(number);
  } catch (const Problem& problem) {
    place_.failure = problem.what();
    change(v1::SESSION_STATE_FAILED);
  }
  changed_.notify_all();
}

Player::Clock::time_point Player::due() const {
  if (!run_.time_scale) return start_time_;
  const double next_s = place_.newest->time + header().frame_step_s();
  const std::chrono::duration<double> after((next_s - start_s_) / *run_.time_scale);
  return start_time_ + std::chrono::duration_cast<Clock::duration>(after);
}

void Player::change(v1::SessionState state) {
  place_.state = state;
  ++place_.changes;
  changed_.notify_all();
}

}  // namespace weft::client
