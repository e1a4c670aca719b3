#include "server/store/records.h"

#include <google/protobuf/util/time_util.h>
#include <zlib.h>

#include "server/convert/convert.h"
#include "server/convert/mesh.h"
#include "server/convert/names.h"
#include "weft/storage/v1/storage.pb.h"

namespace weft::records {
namespace {

namespace stored = storage::v1;
using google::protobuf::util::TimeUtil;

template <class Message>
Message parse(const std::string& bytes) {
  Message message;
  if (!message.ParseFromString(bytes)) {
    throw StoreError("no " + message.GetDescriptor()->full_name());
  }
  return message;
}

template <class Value>
Value trusted(Converted<Value> converted) {
  if (const auto* problems = std::get_if<std::vector<Problem>>(&converted)) {
    throw StoreError(problems->front().field + ": " + problems->front().message);
  }
  return std::get<Value>(std::move(converted));
}

void set(stored::LogEntry* to, const StepsBegun& from) {
  to->mutable_steps_begun()->set_frames(from.frames);
}

void set(stored::LogEntry* to, const StepsEnded&) { to->mutable_steps_ended(); }

void set(stored::LogEntry* to, const RunBegun& from) {
  stored::RunBegun* run = to->mutable_run_begun();
  if (from.time_scale) run->set_time_scale(*from.time_scale);
  if (from.until_frame) run->set_until_frame(*from.until_frame);
  run->set_until_rest(from.until_rest);
}

void set(stored::LogEntry* to, const Paused&) { to->mutable_paused(); }

void set(stored::LogEntry* to, const TextileSet& from) {
  to->mutable_textile_set()->set_sheet(static_cast<std::int32_t>(from.sheet));
  *to->mutable_textile_set()->mutable_textile() = as_given(from.textile);
  to->mutable_textile_set()->set_duration_s(from.duration);
}

void set(stored::LogEntry* to, const Acted& from) {
  to->mutable_acted()->set_hand(from.actions.front().hand);
  for (const Action& action : from.actions) {
    if (action.kind == Action::Kind::kLetGo) continue;
    *to->mutable_acted()->add_actions() = to_proto(action);
  }
}

void set(stored::LogEntry* to, const SnapshotKept& from) {
  to->mutable_snapshot_kept()->set_id(from.id);
}

SessionIdentity identity_of(const stored::KeptSession& from) {
  return {from.id(),    from.uid(),           from.numerics_id(), time_of(from.create_time()),
          from.owner(), from.max_frame_work()};
}

Acted acted_of(const stored::Acted& from) {
  Acted acted;
  for (const auto& action : from.actions()) {
    acted.actions.push_back(trusted(to_action(action, "actions")));
  }
  if (acted.actions.empty()) acted.actions.push_back({.kind = Action::Kind::kLetGo});
  for (Action& action : acted.actions) action.hand = from.hand();
  return acted;
}

RunBegun run_of(const stored::RunBegun& from) {
  RunBegun run;
  if (from.has_time_scale()) run.time_scale = from.time_scale();
  if (from.has_until_frame()) run.until_frame = from.until_frame();
  run.until_rest = from.until_rest();
  return run;
}

Event event_of(const stored::LogEntry& from) {
  switch (from.event_case()) {
    case stored::LogEntry::kStepsBegun:
      return StepsBegun{from.steps_begun().frames()};
    case stored::LogEntry::kStepsEnded:
      return StepsEnded{};
    case stored::LogEntry::kRunBegun:
      return run_of(from.run_begun());
    case stored::LogEntry::kPaused:
      return Paused{};
    case stored::LogEntry::kTextileSet:
      return TextileSet{static_cast<std::size_t>(from.textile_set().sheet()),
                        trusted(to_textile(from.textile_set().textile(), "textile")),
                        from.textile_set().duration_s()};
    case stored::LogEntry::kActed:
      return acted_of(from.acted());
    case stored::LogEntry::kSnapshotKept:
      return SnapshotKept{from.snapshot_kept().id()};
    case stored::LogEntry::EVENT_NOT_SET:
      break;
  }
  throw StoreError("an entry of its log that this version does not know");
}

}  // namespace

std::chrono::system_clock::time_point time_of(const google::protobuf::Timestamp& timestamp) {
  const std::chrono::nanoseconds since_epoch(TimeUtil::TimestampToNanoseconds(timestamp));
  return std::chrono::system_clock::time_point(
      std::chrono::duration_cast<std::chrono::system_clock::duration>(since_epoch));
}

std::string encode(const KeptSession& session) {
  stored::KeptSession to;
  to.set_id(session.identity.id);
  to.set_uid(session.identity.uid);
  to.set_numerics_id(session.identity.numerics_id);
  *to.mutable_create_time() = timestamp_of(session.identity.create_time);
  *to.mutable_scene() = as_given(session.scene);
  to.set_owner(session.identity.owner);
  to.set_max_frame_work(session.identity.max_frame_work);
  return to.SerializeAsString();
}

std::string encode(const Progress& progress) {
  stored::KeptProgress to;
  to.set_entries(progress.entries);
  to.set_frame(progress.limit.frame);
  to.set_holders(progress.limit.holders);
  if (progress.limit.history_from) to.set_history_from(*progress.limit.history_from);
  to.set_readers(progress.limit.readers);
  return to.SerializeAsString();
}

std::string encode(const LogEntry& entry) {
  stored::LogEntry to;
  to.set_frame(entry.frame);
  to.set_request_id(entry.request.id);
  to.set_request_checksum(entry.request.checksum);
  std::visit([&](const auto& event) { set(&to, event); }, entry.event);
  return to.SerializeAsString();
}

KeptSession decode_session(const std::string& bytes, Assets& assets) {
  const auto from = parse<stored::KeptSession>(bytes);
  const auto find_mesh = [&](const std::string& name) {
    const auto asset = assets.find(hash_of(name), from.owner());
    return asset && asset->create_time ? read_mesh(assets, *asset) : nullptr;
  };
  return {identity_of(from), trusted(to_scene(from.scene(), "scene", find_mesh))};
}

std::shared_ptr<const v1::MeshData> read_mesh(Assets& assets, const KeptAsset& asset) {
  const std::string bytes = assets.bytes(asset);
  auto mesh = std::make_shared<v1::MeshData>();
  if (sha256(bytes) != asset.hash || !mesh->ParseFromString(bytes))
    throw StoreError(asset_name(asset.hash) +
                     " is damaged: its bytes are others than its name says");
  return mesh;
}

Progress decode_progress(const std::string& bytes) {
  const auto from = parse<stored::KeptProgress>(bytes);
  Progress progress{from.entries(), {from.frame(), from.holders()}};
  if (from.has_history_from()) progress.limit.history_from = from.history_from();
  progress.limit.readers = from.readers();
  return progress;
}

LogEntry decode_entry(const std::string& bytes) {
  const auto from = parse<stored::LogEntry>(bytes);
  return {from.frame(), {from.request_id(), from.request_checksum()}, event_of(from)};
}

std::string entry_key(const std::string& uid, std::int64_t number) {
  return uid + "/" + std::to_string(number);
}

std::optional<ListedSession> listed(const std::string& uid, const Row& session) {
  stored::KeptSession kept;
  const bool sound =
      session.checksum == checksum(uid, session.record) && kept.ParseFromString(session.record);
  if (!sound) return std::nullopt;
  return ListedSession{identity_of(kept), std::move(*kept.mutable_scene()), ""};
}

std::optional<std::string> owner_of(const std::string& uid, const Row& session) {
  stored::KeptSession kept;
  const bool sound =
      session.checksum == checksum(uid, session.record) && kept.ParseFromString(session.record);
  return sound ? std::optional(kept.owner()) : std::nullopt;
}

LeftSession assemble(const std::string& uid, const std::string& id, const Row& session,
                     const Row& progress, const std::vector<NumberedRow>& entries, Assets& assets) {
  if (session.checksum != checksum(uid, session.record))
    throw StoreError("the checksum of its scene is wrong");
  LeftSession left{decode_session(session.record, assets), {}};
  if (left.session.identity.id != id || left.session.identity.uid != uid)
    throw StoreError("it has another name");
  if (progress.checksum != checksum(uid, progress.record))
    throw StoreError("the checksum of how far it came is wrong");
  const Progress come = decode_progress(progress.record);
  left.saved.limit = come.limit;

  // where the first ones are missing for another reason than that they were forgotten, no snapshot
  // will fit
  std::int64_t next = entries.empty() ? come.entries : entries.front().number;
  left.saved.first = next;
  auto& log = left.saved.log;
  for (const NumberedRow& row : entries) {
    if (row.number != next || row.checksum != checksum(entry_key(uid, next), row.record)) {
      throw StoreError("entry " + std::to_string(next) +
                       " of its log is missing, or its checksum is wrong");
    }
    log.push_back(decode_entry(row.record));
    if (log.size() > 1 && log.back().frame < log[log.size() - 2].frame)
      throw StoreError("its log is out of order");
    ++next;
  }
  if (next != come.entries) throw StoreError("its log has lost its end");
  return left;
}

std::uint32_t checksum(const std::string& key, const std::string& record) {
  const auto bytes = [](const std::string& text) {
    return reinterpret_cast<const Bytef*>(text.data());
  };
  return static_cast<std::uint32_t>(
      crc32_z(crc32_z(0, bytes(key), key.size()), bytes(record), record.size()));
}

}  // namespace weft::records
