#include "client/load/garments.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <future>
#include <mutex>
#include <vector>

#include "client/problem.h"
#include "client/scene_file.h"
#include "client/script/observer.h"

namespace weft::client {
namespace {

using Sessions = v1::SessionService::Stub;

// Puts one on, and says how it sits.
v1::Verdict put_one_on(Connection& connection, const v1::Session& session, double seconds) {
  v1::FrameFormat format;
  format.set_encoding(v1::FRAME_ENCODING_FLOAT32);
  Observer observer(connection, session, format);
  v1::RunSessionRequest run;
  run.set_name(session.name());
  run.set_until_rest(true);
  run.set_until_frame(
      static_cast<std::int64_t>(std::ceil(seconds / session.scene().solver().frame_step_s())));
  const std::int64_t first = connection.call(&Sessions::RunSession, run).applied_frame();
  observer.await([&](const Sight& sight) {
    return sight.progress.state() != v1::SESSION_STATE_RUNNING &&
           sight.progress.latest_frame() >= first &&
           sight.frame.number() >= sight.progress.latest_frame();
  });
  v1::GetVerdictRequest ask;
  ask.set_name(session.name());
  return connection.call(&Sessions::GetVerdict, ask);
}

void remove(Connection& connection, const v1::Session& session) {
  v1::DeleteSessionRequest request;
  request.set_name(session.name());
  request.set_allow_missing(true);
  connection.call(&Sessions::DeleteSession, request);
}

}  // namespace

GarmentsResult put_on(Connection& connection, const GarmentsOrder& order,
                      const std::function<void(const GarmentsResult&)>& progress) {
  const auto start = std::chrono::steady_clock::now();
  GarmentsResult result;
  std::mutex mutex;
  std::atomic<int> next = 0;
  const auto add = [&](const std::function<void()>& count) {
    const std::lock_guard lock(mutex);
    count();
    result.wall = std::chrono::steady_clock::now() - start;
    progress(result);
  };
  const auto work = [&] {
    while (next++ < order.garments && !connection.stop().stop_requested()) {
      v1::Session session;
      try {
        session = create_session(connection, order.scene);
        const v1::Verdict verdict = put_one_on(connection, session, order.seconds);
        add([&] {
          ++result.done;
          if (verdict.good()) ++result.good;
          for (const v1::Fault& fault : verdict.faults()) ++result.faults[fault.code()];
          result.substeps += verdict.substep_count();
          result.computing_s += verdict.computing_s();
        });
      } catch (const Problem& problem) {
        if (problem.exit == Exit::kNoConnection) throw;
        if (problem.exit != Exit::kInterrupted) add([&] { ++result.errors[problem.reason]; });
      }
      if (!session.name().empty()) remove(connection, session);
    }
  };
  std::vector<std::future<void>> workers;
  for (int i = 0; i < order.at_once; ++i) workers.push_back(std::async(std::launch::async, work));
  for (auto& worker : workers) worker.wait();
  for (auto& worker : workers) worker.get();
  return result;
}

}  // namespace weft::client
