#include "client/attempts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <condition_variable>
#include <mutex>
#include <random>
#include <string_view>
#include <utility>

#include "client/connection.h"
#include "client/problem.h"

namespace weft::client {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr std::chrono::milliseconds kLongestPause{250};
constexpr std::chrono::milliseconds kRefusedPause{75};
constexpr const char* kWrongReplica = "WRONG_REPLICA";
constexpr const char* kDraining = "SERVER_DRAINING";
constexpr const char* kUnreachable = "STORE_UNREACHABLE";

const FieldDescriptor* text_field(const Message& message, const char* name) {
  const FieldDescriptor* field = message.GetDescriptor()->FindFieldByName(name);
  const bool is_text = field != nullptr && field->cpp_type() == FieldDescriptor::CPPTYPE_STRING &&
                       !field->is_repeated();
  return is_text ? field : nullptr;
}

std::string text_in(const Message& message, const char* name) {
  const FieldDescriptor* field = text_field(message, name);
  return field != nullptr ? message.GetReflection()->GetString(message, field) : std::string();
}

// "flag" of "sessions/flag/snapshots/frame-9"; none where it could not be the name of a session.
std::string session_of(const Message& request) {
  constexpr std::string_view kPrefix = "sessions/";
  constexpr std::size_t kLongest = 63;
  std::string session = text_in(request, "session_id");
  for (const char* field : {"name", "parent", "session"}) {
    const std::string name = text_in(request, field);
    if (name.starts_with(kPrefix))
      session = name.substr(kPrefix.size(), name.find('/', kPrefix.size()) - kPrefix.size());
  }
  const bool is_name = std::all_of(session.begin(), session.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-';
  });
  return is_name && session.size() <= kLongest ? session : std::string();
}

bool is_repeatable(const Message& request) {
  const std::string& type = request.GetDescriptor()->name();
  constexpr std::array kHarmless{"Get",         "List",          "StreamFrames", "ViewFrames",
                                 "UploadAsset", "DownloadAsset", "BuildGarment"};
  return !text_in(request, "request_id").empty() ||
         std::any_of(kHarmless.begin(), kHarmless.end(),
                     [&](const char* verb) { return type.starts_with(verb); });
}

// Of an error that is not weftd's: a proxy's, or gRPC's own where a connection broke, and not what
// the call is to blame for.
bool is_of_the_road(const grpc::Status& status) {
  constexpr std::array kCodes{grpc::StatusCode::UNAVAILABLE, grpc::StatusCode::UNKNOWN,
                              grpc::StatusCode::INTERNAL, grpc::StatusCode::CANCELLED};
  return std::find(kCodes.begin(), kCodes.end(), status.error_code()) != kCodes.end();
}

void wait(std::chrono::milliseconds time, const std::stop_token& stop) {
  std::mutex mutex;
  std::unique_lock lock(mutex);
  std::condition_variable_any().wait_for(lock, stop, time, [] { return false; });
}

}  // namespace

void name_call(Message& request) {
  const FieldDescriptor* field = text_field(request, "request_id");
  if (field == nullptr || !text_in(request, "request_id").empty()) return;
  std::random_device random;
  request.GetReflection()->SetString(
      &request, field,
      fmt::format("{:08x}{:08x}{:08x}{:08x}", random(), random(), random(), random()));
}

Attempts::Attempts(Connection& connection, const Message& request,
                   std::chrono::milliseconds patience)
    : Attempts(connection, request, patience, connection.stop()) {}

Attempts::Attempts(Connection& connection, const Message& request,
                   std::chrono::milliseconds patience, std::stop_token stop)
    : connection_(connection),
      patience_(patience),
      stop_(std::move(stop)),
      repeatable_(is_repeatable(request)),
      session_(session_of(request)) {}

void Attempts::address(grpc::ClientContext& context) const {
  if (!session_.empty()) context.AddMetadata("weft-session", session_);
  if (!replica_.empty()) context.AddMetadata("weft-replica", replica_);
}

void Attempts::note_message() {
  connection_.note_answer();
  heard_ = true;
  first_failure_.reset();
  refusal_.reset();
  pause_ = kFirstPause;
}

void Attempts::go_on_after(const grpc::Status& status) {
  if (is_hopeless(status)) connection_.check(status);
  const bool is_first = !std::exchange(first_failure_, first_failure_.value_or(Clock::now()));
  replica_.clear();
  auto pause = pause_;
  if (const auto info = error_info(status)) {
    connection_.note_answer();
    refusal_ = status;
    pause = kRefusedPause;
    if (info->reason() == kDraining)
      patience_ = std::min<std::chrono::milliseconds>(patience_, kPatience);
    if (const auto replica = info->metadata().find("replica"); replica != info->metadata().end())
      replica_ = replica->second;
    if (is_first && info->reason() == kWrongReplica) return;
  } else {
    pause_ = std::min(2 * pause_, kLongestPause);
  }

  if (Clock::now() - *first_failure_ >= patience_) connection_.check(refusal_.value_or(status));
  wait(pause, stop_);
  connection_.await_server(kLongestPause);
}

bool Attempts::is_hopeless(const grpc::Status& status) const {
  if (stop_.stop_requested()) return true;
  const auto info = error_info(status);
  if (info && info->reason() == kWrongReplica) return heard_ && !repeatable_;
  if (!repeatable_ || connection_.stop().stop_requested()) return true;
  if (info) return info->reason() != kDraining && info->reason() != kUnreachable;
  const bool nobody_there = status.error_code() == grpc::StatusCode::UNAVAILABLE &&
                            !connection_.was_reached() && !connection_.is_open();
  return nobody_there || !is_of_the_road(status);
}

}  // namespace weft::client
