#include "tests/stress/recorded.h"

#include <fmt/format.h>

#include <variant>

#include "client/recording/reader.h"
#include "server/convert/convert.h"
#include "tests/stress/offline.h"

namespace weft::stress {

using Sessions = v1::SessionService::Stub;

std::vector<Recorded> record_sessions(const std::string& directory, client::Connection& connection,
                                      const v1::Scene& scene, Hearing& hearing, double pace) {
  std::vector<Recorded> all(hearing.recorders());
  for (std::size_t i = 0; i < all.size(); ++i) {
    v1::CreateSessionRequest create;
    *create.mutable_session()->mutable_scene() = scene;
    all[i].session = connection.call(&Sessions::CreateSession, create);
    all[i].path = fmt::format("{}/{}.weft", directory, i);
    client::RecordingOrder order;
    order.session = all[i].session.name();
    order.path = all[i].path;
    order.encoding = v1::FRAME_ENCODING_FLOAT64;
    order.run = false;
    all[i].recorder = std::async(std::launch::async, [&, i, order] {
      return client::record(connection, order, [&, i](const client::Tally& tally) {
        if (tally.frames > 0) hearing.note(i, tally.last_frame);
      });
    });
  }
  hearing.wait_for_all_after(Clock::time_point());  // frame 0
  for (const Recorded& one : all) {
    v1::RunSessionRequest run;
    run.set_name(one.session.name());
    run.set_time_scale(pace);
    connection.call(&Sessions::RunSession, run);
  }
  return all;
}

v1::UpdateTextileRequest change_of(const v1::Session& session, int number) {
  v1::UpdateTextileRequest request;
  request.set_name(session.name());
  request.mutable_textile()->mutable_raw()->set_bend_n_m2(1e-6 * (1 + number % 20));
  request.mutable_update_mask()->add_paths("raw.bend_n_m2");
  request.set_request_id(fmt::format("change-{}", number));
  return request;
}

void finish(client::Connection& connection, const v1::Scene& scene, Recorded& one, Faults& faults) {
  v1::PauseSessionRequest pause;
  pause.set_name(one.session.name());
  connection.call(&Sessions::PauseSession, pause);
  one.recorder.get();
  const std::int64_t last = connection.get_session(one.session.name()).frame();
  {
    const client::RecordingReader reader(one.path);
    faults.lost += last - reader.last_frame() + reader.first_frame();
  }
  compare(one.path, scene, one.changes, faults);
}

void compare(const std::string& path, const v1::Scene& scene, const std::vector<Change>& changes,
             Faults& faults) {
  client::RecordingReader reader(path);
  Simulation simulation = simulation_of(scene);
  std::size_t done = 0;
  for (std::int64_t number = 0; number <= reader.last_frame(); ++number) {
    for (; done < changes.size() && changes[done].applied_frame <= number; ++done) {
      const v1::UpdateTextileRequest& request = changes[done].request;
      const Textile& current = simulation.scene().sheets[0].textile;
      const auto textile = merge_textile(current, request.textile(), request.update_mask());
      simulation.set_textile(0, std::get<Textile>(textile));
    }
    if (number > 0 && !simulation.advance_frame()) throw std::runtime_error(simulation.failure());
    if (number < reader.first_frame()) continue;
    ++faults.frames;
    if (reader.read(number).positions_m() != double_planes(simulation)) ++faults.differing;
  }
}

}  // namespace weft::stress
