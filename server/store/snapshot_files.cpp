#include "server/store/snapshot_files.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <functional>
#include <memory>
#include <sstream>
#include <system_error>
#include <tuple>
#include <utility>

#include "server/rpc/server_service.h"
#include "server/store/records.h"
#include "server/store/store.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMagic = "weft snapshot 1\n";  // with the version of the file
constexpr std::size_t kMagicBytes = 16, kChecksumBytes = 8;

fs::path file_of(const fs::path& directory, const SnapshotPlace& place) {
  return directory / (std::to_string(place.frame) + "-" + std::to_string(place.entries));
}

// What the name of a file says.
std::optional<SnapshotPlace> place_of(const fs::path& file) {
  const std::string name = file.filename().string();
  SnapshotPlace place;
  const char* end = name.data() + name.size();
  const auto frame = std::from_chars(name.data(), end, place.frame);
  if (frame.ec != std::errc() || frame.ptr == end) return std::nullopt;
  std::from_chars(frame.ptr + 1, end, place.entries);
  return file_of(file.parent_path(), place) == file ? std::optional(place) : std::nullopt;
}

SnapshotPlace place_of(const SessionSnapshot& snapshot) {
  return {snapshot.simulation.frame, snapshot.entries};
}

// In ascending order.
std::vector<SnapshotPlace> places_in(const fs::path& directory) {
  std::vector<SnapshotPlace> places;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory, error)) {
    if (const auto place = place_of(entry.path())) places.push_back(*place);
  }
  std::sort(places.begin(), places.end());
  return places;
}

void discard(const fs::path& path) {
  std::error_code error;
  fs::remove_all(path, error);
  if (error) spdlog::warn("{} cannot be removed: {}", path.string(), error.message());
}

// What make_identity() gives: nothing that leads elsewhere, nor what somebody else has put here.
bool is_uid(const std::string& name) {
  return name.size() == 32 && name.find_first_not_of("0123456789abcdef") == std::string::npos;
}

std::string checksum_text(const std::string& key, const std::string& record) {
  char text[kChecksumBytes + 1];
  std::snprintf(text, sizeof text, "%08x", records::checksum(key, record));
  return text;
}

// Has the names in the directory reach the disk.
void sync(const fs::path& directory) {
  const int descriptor = open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  fsync(descriptor);
  close(descriptor);
}

// Writes the file so that it is there whole or not at all; empty, or what was in the way.
std::string write_whole(const fs::path& path, const std::string& bytes) {
  const fs::path part = path.parent_path() / ".part";
  std::error_code error;
  const bool first = fs::create_directories(path.parent_path(), error);
  const auto close = [](std::FILE* file) { return std::fclose(file); };
  std::unique_ptr<std::FILE, decltype(close)> file(std::fopen(part.c_str(), "wb"), close);
  const bool written = file &&
                       std::fwrite(bytes.data(), 1, bytes.size(), file.get()) == bytes.size() &&
                       std::fflush(file.get()) == 0 && fsync(fileno(file.get())) == 0;
  std::string why = written ? "" : std::strerror(errno);
  file.reset();
  if (!written) {
    fs::remove(part, error);
    return why;
  }
  fs::rename(part, path, error);
  if (error) return error.message();
  sync(path.parent_path());
  if (first) sync(path.parent_path().parent_path());
  return "";
}

std::string content_of(const std::string& uid, const SessionSnapshot& snapshot) {
  const std::string record = records::encode(uid, snapshot);
  return kMagic + checksum_text(uid, record) + record;
}

// Those on demand have a directory within that of their session.
fs::path named_in(const fs::path& directory) { return directory / "named"; }

void keep_latest(const fs::path& directory, const std::string& uid, const SessionSnapshot& snapshot,
                 std::int64_t oldest, const SnapshotFiles::Forget& forget) try {
  constexpr std::int64_t kMostEntries = SnapshotFiles::kMostEntries;
  const fs::path file = file_of(directory, place_of(snapshot));
  const std::string error = write_whole(file, content_of(uid, snapshot));
  if (!error.empty()) return spdlog::warn("{} cannot be written: {}", file.string(), error);

  // what readers could find is let go where the log would grow too long for it
  auto places = places_in(directory);
  const bool is_long = !places.empty() && snapshot.entries - places.front().entries > kMostEntries;
  if (is_long) oldest = snapshot.simulation.frame;
  for (const SnapshotPlace& place : superfluous(places, oldest)) {
    discard(file_of(directory, place));
    std::erase(places, place);
  }
  if (places.size() > 1 && places[1].frame <= oldest) forget(places.front().entries);
} catch (const std::exception& error) {  // out of memory
  spdlog::warn("{}: no snapshot: {}", directory.string(), error.what());
}

NamedSnapshot keep_named(const fs::path& file, const std::string& uid,
                         const SessionSnapshot& snapshot) {
  const std::string content = content_of(uid, snapshot);
  const std::string error = write_whole(file, content);
  if (!error.empty()) throw StoreError(file.string() + " cannot be written: " + error);
  return {file.filename().string(),
          snapshot.simulation.frame,
          snapshot.create_time,
          static_cast<std::int64_t>(content.size()),
          numerics_id(),
          {}};
}

SessionSnapshot read_whole(const fs::path& path, const std::string& uid) {
  std::ostringstream content;
  content << std::ifstream(path, std::ios::binary).rdbuf();
  const std::string bytes = content.str();
  if (!bytes.starts_with(kMagic) || bytes.size() < kMagicBytes + kChecksumBytes)
    throw StoreError("it is none of this version");
  const std::string record = bytes.substr(kMagicBytes + kChecksumBytes);
  if (bytes.substr(kMagicBytes, kChecksumBytes) != checksum_text(uid, record))
    throw StoreError("its checksum is wrong");
  return records::decode_snapshot(uid, record);
}

}  // namespace

SnapshotFiles::SnapshotFiles(std::filesystem::path directory) : directory_(std::move(directory)) {}

bool SnapshotFiles::write(const std::string& uid, const SessionLog::Take& take, std::int64_t oldest,
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
  const auto work = [directory = directory_ / uid, uid, snapshot, oldest, forget, done] {
    keep_latest(directory, uid, *snapshot, oldest, forget);
    done();
  };
  const bool posted = snapshot && thread_.post(work);
  if (!posted) done();
  return posted;
}

std::optional<SessionSnapshot> SnapshotFiles::read(const std::string& uid,
                                                   std::optional<std::int64_t> not_after,
                                                   std::int64_t first) const {
  const fs::path directory = directory_ / uid;
  auto places = places_in(directory);
  std::erase_if(places, [&](const SnapshotPlace& place) { return place.entries < first; });
  const auto after = std::find_if(places.begin(), places.end(), [&](const SnapshotPlace& place) {
    return not_after && place.frame > *not_after;
  });
  std::reverse(places.begin(), after);
  if (first == 0) places.erase(after, places.end());

  std::optional<SessionSnapshot> found;
  for (auto place = places.begin(); !found && place != places.end(); ++place) {
    const fs::path file = file_of(directory, *place);
    try {
      SessionSnapshot snapshot = read_whole(file, uid);
      if (place_of(snapshot) != *place) throw StoreError("it has another name");
      found = std::move(snapshot);
    } catch (const StoreError& error) {
      spdlog::warn("{} is damaged, another one serves: {}", file.string(), error.what());
      discard(file);
    }
  }
  for (const SnapshotPlace& place : places_in(directory))
    if (!found || place > place_of(*found)) discard(file_of(directory, place));
  return found;
}

void SnapshotFiles::begin(const std::string& uid, const SessionSnapshot& snapshot) {
  const fs::path file = file_of(directory_ / uid, place_of(snapshot));
  const std::string error = write_whole(file, content_of(uid, snapshot));
  if (!error.empty()) throw StoreError(file.string() + " cannot be written: " + error);
}

void SnapshotFiles::keep(const std::string& uid, const std::string& id,
                         std::shared_ptr<const SessionSnapshot> snapshot,
                         const SessionLog::Kept& kept) {
  const auto work = [file = named_in(directory_ / uid) / id, uid, snapshot = std::move(snapshot),
                     kept] {
    NamedSnapshot made;
    std::string error;
    try {
      made = keep_named(file, uid, *snapshot);
    } catch (const std::exception& what) {  // out of memory, too
      error = what.what();
    }
    kept(error, made);
  };
  if (!thread_.post(work)) kept("too many snapshots wait to be written", {});
}

void SnapshotFiles::drop(const std::string& uid, const std::string& id) {
  const auto work = [file = named_in(directory_ / uid) / id] { discard(file); };
  if (!thread_.post(work)) work();
}

SessionSnapshot SnapshotFiles::read(const std::string& uid, const std::string& id) const {
  return read_whole(named_in(directory_ / uid) / id, uid);
}

std::vector<NamedSnapshot> SnapshotFiles::named(const std::string& uid,
                                                std::int64_t entries) const {
  std::vector<NamedSnapshot> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(named_in(directory_ / uid), error)) {
    NamedSnapshot named;
    named.id = entry.path().filename().string();
    named.bytes = static_cast<std::int64_t>(entry.file_size(error));
    try {
      const SessionSnapshot snapshot = read_whole(entry.path(), uid);
      named.frame = snapshot.simulation.frame;
      named.create_time = snapshot.create_time;
      named.numerics_id = snapshot.numerics_id;
      if (snapshot.entries >= entries) {
        discard(entry.path());
        continue;
      }
    } catch (const StoreError& what) {
      if (named.id.starts_with('.')) continue;  // not written to its end
      spdlog::warn("{} is damaged: {}", entry.path().string(), what.what());
      named.damage = what.what();
    }
    found.push_back(std::move(named));
  }
  std::sort(found.begin(), found.end(), [](const NamedSnapshot& a, const NamedSnapshot& b) {
    return std::tie(a.frame, a.id) < std::tie(b.frame, b.id);
  });
  return found;
}

void SnapshotFiles::erase(const std::string& uid) {
  if (!is_uid(uid)) return;
  const auto work = [directory = directory_ / uid] { discard(directory); };
  if (!thread_.post(work)) work();
}

void SnapshotFiles::keep_only(const std::set<std::string>& uids) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory_, error)) {
    const std::string name = entry.path().filename().string();
    if (is_uid(name) && !uids.contains(name)) discard(entry.path());
  }
}

std::vector<SnapshotPlace> superfluous(std::vector<SnapshotPlace> places, std::int64_t oldest) {
  std::vector<SnapshotPlace> removed;
  const auto take_out = [&](std::size_t i) {
    removed.push_back(places[i]);
    places.erase(places.begin() + static_cast<std::ptrdiff_t>(i));
  };
  while (places.size() > 2 && places[2].frame <= oldest) take_out(0);
  while (places.size() > SnapshotFiles::kMost) {
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
