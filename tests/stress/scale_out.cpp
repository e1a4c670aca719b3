#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <random>
#include <span>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/frame_feed.h"
#include "client/load/latencies.h"
#include "client/output/text.h"
#include "client/recording/recorder.h"
#include "client/scene_file.h"
#include "client/templates/templates.h"
#include "tests/stress/at_end.h"
#include "tests/stress/caller.h"
#include "tests/stress/fleet.h"
#include "tests/stress/recorded.h"
#include "tests/stress/stress.h"

namespace weft::stress {
namespace {

using Sessions = v1::SessionService::Stub;
using Seconds = std::chrono::duration<double>;

constexpr double kPace = 0.25;  // 15 frames a second

// Sessions of a fleet that run and are recorded, and half of which are changed.
class Production {
 public:
  Production(Fleet& fleet, std::size_t sessions)
      : fleet_(fleet),
        hearing_(sessions),
        all_(record_sessions(fleet.path(""), *recorders_, scene_, hearing_, kPace)) {
    caller_ = std::make_unique<Caller>(fleet.connect(), std::span(all_).first(sessions / 2));
  }
  ~Production() { stop_.request_stop(); }
  Production(const Production&) = delete;
  Production& operator=(const Production&) = delete;

  const v1::Scene& scene() const { return scene_; }
  client::Connection& connection() { return *connection_; }
  const std::vector<Recorded>& all() const { return all_; }
  Caller& caller() { return *caller_; }
  std::map<std::string, std::string> owners() { return Fleet::owners(*connection_); }

  // When each session was heard of again after the moment, those of one replica alone.
  std::vector<Clock::time_point> wait_for(const std::map<std::string, std::string>& owners,
                                          const std::string& replica, Clock::time_point moment) {
    const auto heard = hearing_.wait_for_all_after(moment);
    std::vector<Clock::time_point> times;
    for (std::size_t i = 0; i < all_.size(); ++i) {
      const auto owner = owners.find(all_[i].session.name());
      if (owner != owners.end() && owner->second == replica) times.push_back(heard[i]);
    }
    return times;
  }
  // All sessions go on.
  void wait_for_all() { hearing_.wait_for_all_after(Clock::now()); }

  // All do that nobody changes; a change that waits for the database holds its session up.
  void wait_for_unchanged() { hearing_.wait_for_all_after(Clock::now(), all_.size() / 2); }

  // Ends it, and says what was wrong with the recordings.
  const Faults& finish() {
    caller_->await(&Caller::Counts::acknowledged, 10);
    counts_ = caller_->counts();
    caller_.reset();
    for (Recorded& one : all_) stress::finish(*connection_, scene_, one, faults_);
    return faults_;
  }
  // Once it has ended.
  const Caller::Counts& counts() const { return counts_; }
  std::string text() const {
    return fmt::format(
        "{} frames in {} recordings, {} lost, {} differing from the core with the "
        "{} changes acknowledged",
        faults_.frames, all_.size(), faults_.lost, faults_.differing, counts_.acknowledged);
  }
  bool is_whole() const {
    return faults_.frames > 0 && faults_.lost == 0 && faults_.differing == 0 &&
           counts_.acknowledged > 0;
  }

 private:
  Fleet& fleet_;
  const v1::Scene scene_ = client::make_template("load", {.rows = 8, .columns = 8});
  const std::unique_ptr<client::Connection> connection_ = fleet_.connect();
  std::stop_source stop_;  // of the recorders, where they do not come to their end
  const std::unique_ptr<client::Connection> recorders_ = fleet_.connect(stop_.get_token());
  Hearing hearing_;
  std::vector<Recorded> all_;
  std::unique_ptr<Caller> caller_;
  Caller::Counts counts_;
  Faults faults_;
};

std::string seconds(double time) { return client::seconds_text(time); }

// A fleet of three with sessions, whose database has a trouble again and again. Sessions go on
// meanwhile; at the end a replica is killed, so that what was acknowledged must have been kept.
Outcome endure(Form form, int rounds, const std::string& what, const std::string& reason,
               const std::function<void(Fleet&, Production&)>& trouble) {
  Fleet fleet(3);
  Production production(fleet, form == Form::kShort ? 6 : 30);
  for (int round = 0; round < rounds; ++round) {
    production.caller().await(&Caller::Counts::acknowledged, 10);
    trouble(fleet, production);
    production.wait_for_all();
  }
  production.caller().await(&Caller::Counts::acknowledged, 10);
  fleet.replica(0).kill_and_start();
  production.wait_for_all();
  production.finish();
  const Caller::Counts& counts = production.counts();
  return {.figure = fmt::format("{} {} times: {} calls refused as {}, {} otherwise; {}", what,
                                rounds, counts.refused, reason, counts.wrong, production.text()),
          .hold = "0 otherwise, 0, 0; sessions go on",
          .counts = production.is_whole() && counts.wrong == 0};
}

}  // namespace

// Replicas are killed at random moments, and started again.
Outcome fleet_kills(Form form) {
  constexpr double kMostly = 2, kLongest = 10;  // s
  const int kills = form == Form::kShort ? 6 : 200;
  Fleet fleet(3);
  Production production(fleet, form == Form::kShort ? 18 : 60);
  std::mt19937 random(20261122);
  client::Latencies resumes;
  for (int i = 0; i < kills; ++i) {
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 1'000'000));
    const std::size_t number = random() % fleet.size();
    const auto owners = production.owners();
    const auto killed = Clock::now();
    fleet.replica(number).kill();
    // what it sent before is on its way no longer
    const auto moment = killed + std::chrono::milliseconds(30);
    std::this_thread::sleep_until(moment);
    fleet.replica(number).start();
    for (const auto& heard : production.wait_for(owners, Fleet::name(number), moment))
      resumes.add(Seconds(heard - killed).count());
  }
  production.finish();
  const double mostly = resumes.quantile(0.95), longest = resumes.quantile(1);
  return {.figure = fmt::format(
              "{} kills of 3 replicas, {}; {} sessions taken over, resumed within "
              "{} p95, {} at most",
              kills, production.text(), resumes.count(), seconds(mostly), seconds(longest)),
          .hold = "0, 0; 2 s, 10 s",
          .counts = production.is_whole() && resumes.count() > 0,
          .bounds = mostly <= kMostly && longest <= kLongest};
}

// An owner stands still until its sessions are taken over, then goes on: it may neither change them
// nor tell of frames that are not theirs.
Outcome fleet_freezes(Form form) {
  const int freezes = form == Form::kShort ? 2 : 20;
  Fleet fleet(3);
  Production production(fleet, form == Form::kShort ? 6 : 12);
  int writes = 0;
  client::Latencies resumes;
  std::vector<std::pair<const Recorded*, std::string>> seen;  // what old owners told of
  for (int i = 0; i < freezes; ++i) {
    const auto owners = production.owners();
    const Recorded& one = production.all()[static_cast<std::size_t>(i) % production.all().size()];
    const std::string owner = owners.at(one.session.name());
    std::size_t number = 0;
    while (Fleet::name(number) != owner) ++number;
    Weftd& old = fleet.replica(number);

    std::stop_source stop;
    const auto straight = old.connect(stop.get_token());
    client::RecordingOrder order;
    order.session = one.session.name();
    order.path = fleet.path(fmt::format("old-{}.weft", i));
    order.encoding = v1::FRAME_ENCODING_FLOAT64;
    order.patience = std::chrono::seconds(0);
    std::atomic<bool> begun = false;
    auto recorder = std::async(std::launch::async, [&] {
      try {
        client::record(*straight, order, [&](const client::Tally& tally) {
          if (tally.frames > 1) begun = true;
          begun.notify_all();
        });
      } catch (const client::Problem&) {
        // it has lost the session
      }
      begun = true;
      begun.notify_all();
    });
    const AtEnd give_up([&] { stop.request_stop(); });
    begun.wait(false);
    seen.emplace_back(&one, order.path);

    const auto frozen = Clock::now();
    old.freeze();
    const auto moment = frozen + std::chrono::milliseconds(50);
    std::this_thread::sleep_until(moment);
    for (const auto& heard : production.wait_for(owners, owner, moment))
      resumes.add(Seconds(heard - frozen).count());
    old.thaw();
    v1::UpdateTextileRequest request = change_of(one.session, 7);
    request.set_request_id(fmt::format("straight-{}", i));
    v1::UpdateTextileResponse response;
    grpc::ClientContext context;
    if (straight->sessions().UpdateTextile(&context, request, &response).ok()) ++writes;
    recorder.get();
    production.wait_for_all();
  }
  production.finish();
  Faults told;
  for (const auto& [one, path] : seen) compare(path, production.scene(), one->changes, told);
  return {.figure = fmt::format("{} times, {} until sessions went on elsewhere at most; the old "
                                "owner: {} writes, {} of {} frames differing; {}",
                                freezes, seconds(resumes.quantile(1)), writes, told.differing,
                                told.frames, production.text()),
          .hold = "0, 0; 0, 0",
          .counts = production.is_whole() && writes == 0 && told.differing == 0};
}

// A replica comes, and goes again.
Outcome fleet_resize(Form form) {
  Fleet fleet(3);
  Weftd& spare = fleet.replica(2);
  spare.terminate();
  Production production(fleet, form == Form::kShort ? 6 : 30);
  const auto moved_since = [&](const std::map<std::string, std::string>& before) {
    const auto now = production.owners();
    return std::count_if(before.begin(), before.end(), [&](const auto& owner) {
      return owner.second != Fleet::name(2) && now.at(owner.first) != owner.second;
    });
  };
  const auto before = production.owners();
  spare.start();
  // it has sessions when new ones come to it
  v1::CreateSessionRequest create;
  *create.mutable_session()->mutable_scene() = production.scene();
  const auto end = Clock::now() + std::chrono::minutes(1);
  while (production.connection().call(&Sessions::CreateSession, create).replica() !=
         Fleet::name(2)) {
    if (Clock::now() > end)
      throw std::runtime_error("the new replica gets no sessions in a minute");
  }
  production.wait_for_all();
  const auto moved_by_coming = moved_since(before);
  const auto with_it = production.owners();
  const auto alone = std::count_if(with_it.begin(), with_it.end(), [](const auto& owner) {
    return owner.second == Fleet::name(2);
  });
  const int exit = spare.terminate();
  production.wait_for_all();
  const auto moved_by_going = moved_since(with_it);
  production.finish();
  return {
      .figure = fmt::format("{} sessions moved when one came, {} of others when it went with {}, "
                            "exit code {}; {}",
                            moved_by_coming, moved_by_going, alone, exit, production.text()),
      .hold = "0, 0, 0",
      .counts = production.is_whole() && moved_by_coming == 0 && moved_by_going == 0 && exit == 0};
}

// A replica is taken out while it works; its sessions go on elsewhere.
Outcome fleet_drain(Form form) {
  constexpr double kLongest = 3;  // s
  const int drains = form == Form::kShort ? 2 : 20;
  Fleet fleet(3);
  Production production(fleet, form == Form::kShort ? 12 : 60);
  client::Latencies resumes;
  double longest = 0;
  int failed = 0;
  for (int i = 0; i < drains; ++i) {
    const std::size_t number = static_cast<std::size_t>(i) % fleet.size();
    const auto owners = production.owners();
    const auto start = Clock::now();
    if (fleet.replica(number).terminate() != 0) ++failed;
    const auto gone = Clock::now();
    longest = std::max(longest, Seconds(gone - start).count());
    for (const auto& heard : production.wait_for(owners, Fleet::name(number), gone))
      resumes.add(Seconds(heard - start).count());
    fleet.replica(number).start();
  }
  production.finish();
  const double resumed = resumes.quantile(1);
  return {.figure = fmt::format("{} drains, gone within {}, {} not in order, {} sessions heard "
                                "elsewhere within {} of the signal; {}",
                                drains, seconds(longest), failed, resumes.count(), seconds(resumed),
                                production.text()),
          .hold = "3 s, 0, 3 s; 0, 0",
          .counts = production.is_whole() && failed == 0 && resumes.count() > 0,
          .bounds = longest <= kLongest && resumed <= kLongest};
}

// PostgreSQL is restarted, is away for a while, and stands still for a while.
Outcome fleet_database(Form form) {
  const auto away = std::chrono::seconds(form == Form::kShort ? 1 : 5);
  return endure(form, form == Form::kShort ? 1 : 10, "restarted, away, still", "STORE_UNWRITABLE",
                [&](Fleet& fleet, Production& production) {
                  testing::Postgres& database = fleet.database();
                  database.restart();
                  production.caller().await(&Caller::Counts::acknowledged, 10);
                  {
                    database.stop();
                    const AtEnd start([&] { database.start(); });
                    production.wait_for_unchanged();
                    std::this_thread::sleep_for(away);
                  }
                  production.caller().await(&Caller::Counts::acknowledged, 10);
                  {
                    database.freeze();
                    const AtEnd thaw([&] { database.thaw(); });
                    production.wait_for_unchanged();
                    std::this_thread::sleep_for(away);
                  }
                });
}

// The files of PostgreSQL cannot grow.
Outcome fleet_full(Form form) {
  return endure(form, form == Form::kShort ? 2 : 40, "full", "STORE_UNWRITABLE",
                [](Fleet& fleet, Production& production) {
                  fleet.set_disk(Disk::kCrowded);
                  const AtEnd heal([&] { fleet.set_disk(Disk::kGood); });
                  production.caller().await(&Caller::Counts::refused, 10);
                  production.wait_for_unchanged();
                });
}

// HAProxy is reloaded under streams; the process before it ends theirs.
Outcome fleet_reload(Form form) {
  constexpr std::size_t kStreams = 200, kStreamsOfASession = 10;
  const int reloads = form == Form::kShort ? 1 : 10;
  Fleet fleet(2, "500ms");
  const v1::Scene scene = client::make_template("load", {.rows = 8, .columns = 8});
  const auto connection = fleet.connect();
  Hearing hearing(kStreams);
  std::vector<std::unique_ptr<client::Connection>> connections;
  std::vector<std::future<int>> readers;  // how often each began anew
  std::stop_source stop;
  const AtEnd give_up([&] { stop.request_stop(); });
  for (std::size_t i = 0; i < kStreams; i += kStreamsOfASession) {
    v1::RunSessionRequest run;
    run.set_name(client::create_session(*connection, scene).name());
    run.set_time_scale(kPace);
    connection->call(&Sessions::RunSession, run);
    connections.push_back(fleet.connect());
    for (std::size_t k = i; k < i + kStreamsOfASession; ++k) {
      readers.push_back(
          std::async(std::launch::async, [&, k, name = run.name(), &own = *connections.back()] {
            v1::StreamFramesRequest request;
            request.set_session(name);
            request.set_start_frame(1);
            client::FrameFeed feed(own, request, std::chrono::seconds(60), stop.get_token());
            while (const auto message = feed.next()) {
              if (message->has_frame()) hearing.note(k, message->frame().number());
            }
            return feed.reconnections();
          }));
    }
  }
  hearing.wait_for_all_after(Clock::time_point());
  client::Latencies resumes;
  for (int i = 0; i < reloads; ++i) {
    fleet.reload();
    std::this_thread::sleep_for(std::chrono::seconds(1));  // the process before is gone
    const auto moment = Clock::now();
    for (const auto& heard : hearing.wait_for_all_after(moment))
      resumes.add(Seconds(heard - moment).count());
  }
  stop.request_stop();
  int failed = 0, begun_anew = 0;
  for (auto& reader : readers) try {
      if (reader.get() >= reloads) ++begun_anew;
    } catch (const client::Problem&) {
      ++failed;
    }
  return {
      .figure = fmt::format("{} times under {} streams: {} began anew each time, {} ended with "
                            "an error, the last heard within {}",
                            reloads, kStreams, begun_anew, failed, seconds(resumes.quantile(1))),
      .hold = "all, 0",
      .counts = failed == 0 && begun_anew == static_cast<int>(kStreams)};
}

}  // namespace weft::stress
