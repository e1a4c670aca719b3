#include "server/session/timeline.h"

#include <algorithm>
#include <iterator>
#include <thread>
#include <utility>

#include "server/session/idle_threads.h"

namespace weft {
namespace {

// Once one of them was led.
std::vector<double> pose_times(const Scene& scene, double time) {
  std::vector<double> times;
  bool led = false;
  for (const Collider& collider : scene.colliders) {
    if (!collider.poses) continue;
    const auto& own = collider.poses->times;
    times.push_back(std::clamp(pose_time(collider, time), own.front(), own.back()));
    led = led || collider.lead;
  }
  return led ? times : std::vector<double>();
}

}  // namespace

Timeline::Timeline(Simulation given, std::int64_t max_frame_work, Duration snapshot_after)
    : simulation(std::move(given)),
      snapshot_after_(snapshot_after),
      meter_(std::make_shared<FrameMeter>(simulation.scene())) {
  if (max_frame_work > 0) simulation.limit_frame_work(max_frame_work);
}

FramePart Timeline::advance(Scheduler& scheduler) {
  constexpr std::chrono::microseconds kSlice{20'000}, kBusySlice = Scheduler::kTurn;
  constexpr std::chrono::microseconds kYield{1000};  // that calls wait for, or a substep
  const auto begin = Clock::now();
  const auto processor = thread_time();
  auto yielded = begin;
  const Enough enough = [&] {
    const auto now = Clock::now();
    if (now - yielded >= kYield) {  // to the threads of calls and streams, where they wait
      std::this_thread::yield();
      yielded = now;
    }
    return now - begin >= kSlice || (now - begin >= Scheduler::kShare && scheduler.busy()) ||
           (now - begin >= kBusySlice && scheduler.urgent());
  };
  const int most_threads = simulation.most_threads();
  FramePart part{};
  if (most_threads == 1) {
    part = simulation.advance_frame(enough);
  } else {
    IdleThreads pool(scheduler, most_threads, helped_);
    part = simulation.advance_frame(enough, pool);
  }
  const Duration time = Clock::now() - begin;
  work_ += time;
  frame_work_ += time;
  frame_processor_ += thread_time() - processor;
  return part;
}

Judgement Timeline::judge() const {
  const Duration helped = std::chrono::nanoseconds(helped_->load());
  return {simulation.verdict(), substeps_, (processor_ + helped).count()};
}

void Timeline::count_frame(Stats& stats) {
  const Duration time = std::exchange(frame_work_, {});
  const Duration processor = std::exchange(frame_processor_, {});
  ++stats.frames;
  if (simulation.substeps() == 0) {
    ++stats.sleeping_frames;
    return;
  }
  processor_ += processor;
  substeps_ += simulation.substeps();
  stats.substeps += simulation.substeps();
  stats.particle_substeps += simulation.substeps() * simulation.particle_count();
  stats.frame_time.add(time);
}

bool Timeline::drop_frame() {
  if (!simulation.drop_frame()) return false;
  frame_work_ = frame_processor_ = {};
  return true;
}

std::shared_ptr<const Frame> Timeline::make_frame(std::vector<Repair> repairs,
                                                  bool with_stats) const {
  auto frame = std::make_shared<Frame>();
  const std::size_t values = 3 * static_cast<std::size_t>(simulation.particle_count());
  frame->number = simulation.frame();
  frame->time = simulation.time();
  frame->positions.resize(values);
  frame->velocities.resize(values);
  simulation.copy_positions(frame->positions);
  simulation.copy_velocities(frame->velocities);
  frame->kinetic_energy = simulation.kinetic_energy();
  frame->cloth_cuts = simulation.cloth_cuts();
  if (with_stats) frame->deformation = simulation.deformation();
  frame->at_rest = simulation.at_rest();
  frame->residual = simulation.residual();
  frame->pose_times = pose_times(simulation.scene(), frame->time);
  frame->substeps = simulation.substeps();
  frame->substep = simulation.plan().step.substep;
  frame->repairs = std::move(repairs);
  frame->scene = simulation.scene_of_frame();
  frame->meter = meter_;
  return frame;
}

void Timeline::release_memory() {
  simulation.release_memory();
  meter_->release_memory();
}

std::vector<Repair> Timeline::repairs_of_frame() const {
  const std::vector<Repair>& all = simulation.repairs();
  std::vector<Repair> of_frame;
  std::copy_if(all.begin(), all.end(), std::back_inserter(of_frame),
               [&](const Repair& repair) { return repair.frame == simulation.frame(); });
  return of_frame;
}

// Large sessions have snapshots written more rarely.
bool Timeline::snapshot_due() const {
  constexpr double kParticles = 20'000;
  return work_ > snapshot_after_ * std::max(1.0, simulation.particle_count() / kParticles);
}

// So many calls since the last snapshot that the log should not grow without one.
bool Timeline::log_grew() const {
  constexpr std::int64_t kManyEntries = 500;
  return entries - entries_in_snapshot_ >= kManyEntries;
}

void Timeline::note_snapshot() {
  work_ = {};
  entries_in_snapshot_ = entries;
}

bool Timeline::begin_at(const SessionSnapshot& snapshot) {
  if (!simulation.restore(snapshot.simulation)) return false;
  entries = entries_in_snapshot_ = snapshot.entries;
  return true;
}

}  // namespace weft
