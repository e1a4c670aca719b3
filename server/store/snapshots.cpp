#include "server/store/snapshots.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <exception>
#include <tuple>
#include <utility>

#include "server/convert/numerics.h"
#include "server/store/records.h"
#include "server/store/store.h"

namespace weft {
namespace {

using Folder = SnapshotShelf::Folder;

constexpr const char* kMagic = "weft snapshot 1\n";  // with the version of the bytes
constexpr std::size_t kMagicBytes = 16, kChecksumBytes = 8;

std::string name_of(const SnapshotPlace& place) {
  return std::to_string(place.frame) + "-" + std::to_string(place.entries);
}

// On demand.
std::string name_of(const std::string& id) { return "named/" + id; }

std::optional<SnapshotPlace> place_in(const std::string& name) {
  SnapshotPlace place;
  const char* end = name.data() + name.size();
  const auto frame = std::from_chars(name.data(), end, place.frame);
  if (frame.ec != std::errc() || frame.ptr == end) return std::nullopt;
  std::from_chars(frame.ptr + 1, end, place.entries);
  return name_of(place) == name ? std::optional(place) : std::nullopt;
}

SnapshotPlace place_of(const SessionSnapshot& snapshot) {
  return {snapshot.simulation.frame, snapshot.entries};
}

std::string checksum_text(const std::string& key, const std::string& record) {
  char text[kChecksumBytes + 1];
  std::snprintf(text, sizeof text, "%08x", records::checksum(key, record));
  return text;
}

std::string content_of(const std::string& uid, const SessionSnapshot& snapshot) {
  const std::string record = records::encode(uid, snapshot);
  return kMagic + checksum_text(uid, record) + record;
}

}  // namespace

// In ascending order.
std::vector<SnapshotPlace> Snapshots::places(const std::string& uid) const {
  std::vector<SnapshotPlace> places;
  for (const auto& item : shelf_->list(uid, Folder::kLatest))
    if (const auto place = place_in(item.name)) places.push_back(*place);
  std::sort(places.begin(), places.end());
  return places;
}

SessionSnapshot Snapshots::read_whole(const std::string& uid, const std::string& name) const {
  const std::string bytes = shelf_->read(uid, name);
  if (!bytes.starts_with(kMagic) || bytes.size() < kMagicBytes + kChecksumBytes)
    throw StoreError("it is none of this version");
  const std::string record = bytes.substr(kMagicBytes + kChecksumBytes);
  if (bytes.substr(kMagicBytes, kChecksumBytes) != checksum_text(uid, record))
    throw StoreError("its checksum is wrong");
  return records::decode_snapshot(uid, record);
}

void Snapshots::keep_latest(const std::string& uid, const SessionSnapshot& snapshot,
                            std::int64_t oldest, const Forget& forget) const try {
  shelf_->write(uid, name_of(place_of(snapshot)), content_of(uid, snapshot));

  // what readers could find is let go where the log would grow too long for it
  auto kept = places(uid);
  const bool is_long = !kept.empty() && snapshot.entries - kept.front().entries > kMostEntries;
  if (is_long) oldest = snapshot.simulation.frame;
  for (const SnapshotPlace& place : superfluous(kept, oldest)) {
    shelf_->remove(uid, name_of(place));
    std::erase(kept, place);
  }
  if (kept.size() > 1 && kept[1].frame <= oldest) forget(kept.front().entries);
} catch (const std::exception& error) {  // out of memory, too
  spdlog::warn("no snapshot of session {}: {}", uid, error.what());
}

NamedSnapshot Snapshots::keep_named(const std::string& uid, const std::string& id,
                                    const SessionSnapshot& snapshot) const {
  const std::string content = content_of(uid, snapshot);
  shelf_->write(uid, name_of(id), content);
  return {id,
          snapshot.simulation.frame,
          snapshot.create_time,
          static_cast<std::int64_t>(content.size()),
          numerics_id(),
          {}};
}

bool Snapshots::write(const std::string& uid, const SessionLog::Take& take, std::int64_t oldest,
                      const Forget& forget) {
  {
    std::lock_guard lock(mutex_);
    if (!writing_.insert(uid).second) return false;
  }
  const auto done = [this, uid] {
    std::lock_guard lock(mutex_);
    writing_.erase(uid);
  };
  const auto snapshot = take();
  const auto work = [this, uid, snapshot, oldest, forget, done] {
    keep_latest(uid, *snapshot, oldest, forget);
    done();
  };
  const bool posted = snapshot && thread_.post(work);
  if (!posted) done();
  return posted;
}

std::optional<SessionSnapshot> Snapshots::read(const std::string& uid,
                                               std::optional<std::int64_t> not_after,
                                               std::int64_t first) const {
  auto all = places(uid);
  std::erase_if(all, [&](const SnapshotPlace& place) { return place.entries < first; });
  const auto after = std::find_if(all.begin(), all.end(), [&](const SnapshotPlace& place) {
    return not_after && place.frame > *not_after;
  });
  std::reverse(all.begin(), after);
  if (first == 0) all.erase(after, all.end());

  std::optional<SessionSnapshot> found;
  for (auto place = all.begin(); !found && place != all.end(); ++place) {
    const std::string name = name_of(*place);
    try {
      SessionSnapshot snapshot = read_whole(uid, name);
      if (place_of(snapshot) != *place) throw StoreError("it has another name");
      found = std::move(snapshot);
    } catch (const StoreError& error) {
      spdlog::warn("{} is damaged, another one serves: {}", shelf_->place_of(uid, name),
                   error.what());
      shelf_->remove(uid, name);
    }
  }
  for (const SnapshotPlace& place : places(uid))
    if (!found || place > place_of(*found)) shelf_->remove(uid, name_of(place));
  return found;
}

void Snapshots::begin(const std::string& uid, const SessionSnapshot& snapshot) {
  shelf_->write(uid, name_of(place_of(snapshot)), content_of(uid, snapshot));
}

void Snapshots::keep(const std::string& uid, const std::string& id,
                     std::shared_ptr<const SessionSnapshot> snapshot,
                     const SessionLog::Kept& kept) {
  const auto work = [this, uid, id, snapshot = std::move(snapshot), kept] {
    NamedSnapshot made;
    std::string error;
    try {
      made = keep_named(uid, id, *snapshot);
    } catch (const std::exception& what) {  // out of memory, too
      error = what.what();
    }
    kept(error, made);
  };
  if (!thread_.post(work)) kept("too many snapshots wait to be written", {});
}

void Snapshots::drop(const std::string& uid, const std::string& id) {
  const auto work = [this, uid, id] { shelf_->remove(uid, name_of(id)); };
  if (!thread_.post(work)) work();
}

SessionSnapshot Snapshots::read(const std::string& uid, const std::string& id) const {
  return read_whole(uid, name_of(id));
}

std::vector<NamedSnapshot> Snapshots::named(const std::string& uid, std::int64_t entries) const {
  std::vector<NamedSnapshot> found;
  for (const auto& item : shelf_->list(uid, Folder::kNamed)) {
    NamedSnapshot named;
    named.id = item.name;
    named.bytes = item.bytes;
    try {
      const SessionSnapshot snapshot = read(uid, item.name);
      named.frame = snapshot.simulation.frame;
      named.create_time = snapshot.create_time;
      named.numerics_id = snapshot.numerics_id;
      if (snapshot.entries >= entries) {
        shelf_->remove(uid, name_of(item.name));
        continue;
      }
    } catch (const StoreError& what) {
      spdlog::warn("{} is damaged: {}", shelf_->place_of(uid, name_of(item.name)), what.what());
      named.damage = what.what();
    }
    found.push_back(std::move(named));
  }
  std::sort(found.begin(), found.end(), [](const NamedSnapshot& a, const NamedSnapshot& b) {
    return std::tie(a.frame, a.id) < std::tie(b.frame, b.id);
  });
  return found;
}

void Snapshots::erase(const std::string& uid) {
  const auto work = [this, uid] { shelf_->remove_all(uid); };
  if (!thread_.post(work)) work();
}

std::vector<SnapshotPlace> superfluous(std::vector<SnapshotPlace> places, std::int64_t oldest) {
  std::vector<SnapshotPlace> removed;
  const auto take_out = [&](std::size_t i) {
    removed.push_back(places[i]);
    places.erase(places.begin() + static_cast<std::ptrdiff_t>(i));
  };
  while (places.size() > 2 && places[2].frame <= oldest) take_out(0);
  while (places.size() > Snapshots::kMost) {
    // where the least gap is left
    const auto gap = [&](std::size_t i) { return places[i + 1].frame - places[i - 1].frame; };
    std::size_t least = 2;
    for (std::size_t i = 2; i + 2 < places.size(); ++i)
      if (gap(i) < gap(least)) least = i;
    take_out(least);
  }
  return removed;
}

}  // namespace weft
