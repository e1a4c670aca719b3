#include "client/serve/recordings.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <iterator>
#include <utility>

#include "client/recording/recorder.h"

namespace weft::client {
namespace {

constexpr std::ptrdiff_t kMostActive = 16;
constexpr std::size_t kMostListed = 50;

Problem refused(const std::string& reason, const std::string& message) {
  return {Exit::kRefused, "FAILED_PRECONDITION", reason, message};
}

// "drape-20261122-030405.weft" in the directory, with a number where there is one already.
std::string new_file(const std::string& directory, const std::string& session) {
  const std::string name = fmt::format("{}-{:%Y%m%d-%H%M%S}", session.substr(session.find('/') + 1),
                                       fmt::gmtime(std::time(nullptr)));
  const std::filesystem::path place = directory;
  std::filesystem::path path = place / (name + ".weft");
  for (int number = 2; std::filesystem::exists(path); ++number)
    path = place / fmt::format("{}-{}.weft", name, number);
  return path.string();
}

}  // namespace

Recordings::Recordings(const Connection& connection, std::string directory)
    : connection_(connection), directory_(std::move(directory)) {}

Recordings::~Recordings() {
  for (Recording& recording : recordings_) recording.stop.request_stop();
}

Json Recordings::start(const std::string& session) {
  if (session.find('/') == std::string::npos ||
      session.find('/', session.find('/') + 1) != std::string::npos)
    throw usage_problem("session: write sessions/NAME");
  const std::lock_guard lock(mutex_);
  if (find_active(session) != nullptr)
    throw refused("RECORDING", fmt::format("{} is being recorded already", session));
  const auto active = std::count_if(recordings_.begin(), recordings_.end(),
                                    [](const Recording& each) { return !each.done; });
  if (active >= kMostActive)
    throw refused("TOO_MANY_RECORDINGS",
                  fmt::format("at most {} recordings at a time", kMostActive));
  forget_old();
  Recording& recording = recordings_.emplace_front();
  recording.file = new_file(directory_, session);
  recording.session = session;
  recording.thread = std::jthread([this, &recording] { record_into(recording); });
  return to_json(recording);
}

Json Recordings::stop(const std::string& session) {
  std::unique_lock lock(mutex_);
  Recording* recording = find_active(session);
  if (recording == nullptr)
    throw refused("NOT_RECORDING", fmt::format("{} is not being recorded", session));
  recording->stop.request_stop();
  ended_.wait(lock, [&] { return recording->done; });
  return to_json(*recording);
}

Json Recordings::list() const {
  const std::lock_guard lock(mutex_);
  Json listed = Json::array();
  for (const Recording& recording : recordings_) listed.push_back(to_json(recording));
  return {{"recordings", std::move(listed)}};
}

Json Recordings::to_json(const Recording& recording) {
  const char* ended = recording.problem ? "failed" : "done";
  return {{"file", recording.file},
          {"session", recording.session},
          {"state", recording.done ? ended : "recording"},
          {"frames", recording.tally.frames},
          {"last_frame", recording.tally.last_frame},
          {"last_time_s", recording.tally.last_time_s},
          {"bytes", recording.tally.bytes},
          {"message", recording.problem ? recording.problem->what() : ""}};
}

Recordings::Recording* Recordings::find_active(const std::string& session) {
  for (Recording& each : recordings_)
    if (each.session == session && !each.done) return &each;
  return nullptr;
}

void Recordings::record_into(Recording& recording) {
  std::optional<Problem> problem;
  try {
    const auto connection = connection_.another(recording.stop.get_token());
    RecordingOrder order;
    order.session = recording.session;
    order.path = recording.file;
    order.through_pauses = true;
    record(*connection, order, [&](const Tally& tally) {
      const std::lock_guard lock(mutex_);
      recording.tally = tally;
    });
  } catch (const Problem& caught) {
    if (caught.exit != Exit::kInterrupted) problem = caught;
  } catch (const std::exception& caught) {
    problem = Problem(Exit::kRefused, "INTERNAL", "INTERNAL", caught.what());
  }
  {
    const std::lock_guard lock(mutex_);
    recording.problem = problem;
    recording.done = true;
  }
  ended_.notify_all();
}

// Those that ended long ago.
void Recordings::forget_old() {
  while (recordings_.size() >= kMostListed) {
    const auto oldest = std::find_if(recordings_.rbegin(), recordings_.rend(),
                                     [](const Recording& each) { return each.done; });
    recordings_.erase(std::next(oldest).base());
  }
}

}  // namespace weft::client
