#include "client/script/observer.h"

#include "client/frame_feed.h"

namespace weft::client {

Observer::Observer(Connection& connection, const v1::Session& session,
                   const v1::FrameFormat& format)
    : connection_(connection),
      stop_with_connection_(connection.stop(), [this] { stop_.request_stop(); }) {
  v1::StreamFramesRequest request;
  request.set_session(session.name());
  request.set_uid(session.uid());
  request.set_start_frame(session.frame());
  *request.mutable_format() = format;
  request.mutable_format()->set_stats(true);
  request.mutable_format()->set_topology(needs_topology(session.scene()));
  request.set_slow_reader(v1::SLOW_READER_HOLD_SESSION);
  thread_ = std::thread([this, request] { observe(request); });
}

Observer::~Observer() {
  stop_.request_stop();
  thread_.join();
}

Sight Observer::await(const std::function<bool(const Sight&)>& holds) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, connection_.stop(), [&] { return holds(sight_) || end_; });
  if (holds(sight_)) return sight_;
  if (end_) std::rethrow_exception(end_);
  throw interrupted();
}

void Observer::record(const std::string& path, bool replace, const v1::Scene& scene) {
  await([](const Sight& sight) { return sight.tally.frames > 0; });
  const Assets assets = assets_of(connection_, scene);
  const std::lock_guard lock(mutex_);
  writer_.reset();
  v1::StreamHeader header = sight_.header;
  header.set_start_frame(sight_.frame.number());
  writer_.emplace(path, replace, scene, header, sight_.topology, assets);
  writer_->add(sight_.frame);
}

void Observer::commit() {
  const std::lock_guard lock(mutex_);
  if (writer_) writer_->commit();
}

void Observer::observe(v1::StreamFramesRequest request) {
  std::exception_ptr end = std::make_exception_ptr(interrupted());
  try {
    FrameFeed feed(connection_, std::move(request), std::chrono::seconds(60), stop_.get_token());
    while (const auto message = feed.next()) {
      {
        const std::lock_guard lock(mutex_);
        take(*message, feed.topology());
      }
      changed_.notify_all();
    }
  } catch (...) {
    end = std::current_exception();
  }
  {
    const std::lock_guard lock(mutex_);
    end_ = end;
  }
  changed_.notify_all();
}

void Observer::take(const v1::StreamFramesResponse& message, const Topology& topology) {
  if (message.has_header()) {
    sight_.header = message.header();
    sight_.topology = topology;
  }
  if (message.has_progress()) {
    sight_.progress = message.progress();
    if (writer_) writer_->commit();
  }
  if (!message.has_frame()) return;
  const v1::Frame& frame = message.frame();
  sight_.frame = frame;
  sight_.tally.add(frame);
  if (!frame.stats().at_rest()) sight_.rest_time_s.reset();
  if (frame.stats().at_rest() && !sight_.rest_time_s) sight_.rest_time_s = frame.time_s();
  if (writer_) writer_->add(frame);
}

}  // namespace weft::client
