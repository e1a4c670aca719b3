#include "client/recording/recorder.h"

#include "client/assets.h"
#include "client/frame_feed.h"
#include "client/recording/writer.h"

namespace weft::client {
namespace {

using Sessions = v1::SessionService::Stub;

v1::StreamFramesRequest stream_request(const v1::Session& session, const RecordingOrder& order) {
  v1::StreamFramesRequest request;
  request.set_session(session.name());
  request.set_uid(session.uid());
  request.set_start_frame(order.from.value_or(session.frame()));
  if (order.to) request.set_end_frame(*order.to);
  request.mutable_format()->set_encoding(order.encoding);
  request.mutable_format()->set_velocities(order.velocities);
  request.mutable_format()->set_pressure(order.pressure);
  request.mutable_format()->set_clearance(order.clearance);
  request.mutable_format()->set_stats(true);
  request.mutable_format()->set_topology(needs_topology(session.scene()));
  request.set_slow_reader(v1::SLOW_READER_HOLD_SESSION);
  return request;
}

void let_run(Connection& connection, const RecordingOrder& order) {
  if (order.relax) connection.relax(order.session);
  v1::RunSessionRequest request;
  request.set_name(order.session);
  if (order.to) request.set_until_frame(*order.to);
  request.set_until_rest(order.until_rest);
  connection.call(&Sessions::RunSession, request);
}

// Whether nothing more will come: the run has ended and its last frame is here.
bool has_ended(const v1::Progress& progress, const Tally& tally) {
  const bool advanced = tally.frames > 1;
  return advanced && progress.state() != v1::SESSION_STATE_RUNNING &&
         progress.state() != v1::SESSION_STATE_RESTORING &&
         progress.latest_frame() == tally.last_frame;
}

}  // namespace

RecordingResult record(Connection& connection, const RecordingOrder& order,
                       const std::function<void(const Tally&)>& progress) {
  const v1::Session session = connection.get_session(order.session);
  FrameFeed feed(connection, stream_request(session, order), order.patience);
  const Assets assets = assets_of(connection, session.scene());
  std::optional<RecordingWriter> writer;
  RecordingResult result;

  while (!result.complete) {
    const auto message = feed.next();
    if (!message) break;
    switch (message->message_case()) {
      case v1::StreamFramesResponse::kHeader:
        writer.emplace(order.path, order.replace, session.scene(), message->header(),
                       feed.topology(), assets);
        if (order.run) let_run(connection, order);
        break;
      case v1::StreamFramesResponse::kFrame:
        writer->add(message->frame());
        result.tally.add(message->frame());
        result.complete = order.until_rest && message->frame().stats().at_rest();
        break;
      case v1::StreamFramesResponse::kProgress:
        writer->commit();
        result.complete = !order.to && !order.until_rest && !order.through_pauses &&
                          has_ended(message->progress(), result.tally);
        break;
      case v1::StreamFramesResponse::kTopology:  // the feed has it
      case v1::StreamFramesResponse::kRepair:    // counted with its frame
      case v1::StreamFramesResponse::MESSAGE_NOT_SET:
        break;
    }
    progress(result.tally);
  }
  if (writer) writer->commit();
  result.complete = result.complete || !connection.stop().stop_requested();
  result.reconnections = feed.reconnections();
  return result;
}

}  // namespace weft::client
