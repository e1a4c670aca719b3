#include "server/store/snapshot_files.h"

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
#include <utility>

#include "server/store/records.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMagic = "weft snapshot 1\n";  // with the version of the file
constexpr std::size_t kMagicBytes = 16, kChecksumBytes = 8;

// The frame in the name of a file.
std::optional<std::int64_t> frame_of(const fs::path& file) {
  const std::string name = file.filename().string();
  std::int64_t frame = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), frame);
  if (error != std::errc() || end != name.data() + name.size()) return std::nullopt;
  return frame;
}

// In ascending order.
std::vector<std::int64_t> frames_in(const fs::path& directory) {
  std::vector<std::int64_t> frames;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory, error)) {
    if (const auto frame = frame_of(entry.path())) frames.push_back(*frame);
  }
  std::sort(frames.begin(), frames.end());
  return frames;
}

fs::path file_of(const fs::path& directory, std::int64_t frame) {
  return directory / std::to_string(frame);
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

// Writes the file so that it is there whole or not at all; empty, or what was in the way.
std::string write_whole(const fs::path& path, const std::string& bytes) {
  const fs::path part = path.parent_path() / "part";
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
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
  return error ? error.message() : "";
}

void keep(const fs::path& directory, const std::string& uid, const SessionSnapshot& snapshot,
          std::optional<std::int64_t> history_from) try {
  const fs::path file = file_of(directory, snapshot.simulation.frame);
  const std::string record = records::encode(uid, snapshot);
  const std::string error = write_whole(file, kMagic + checksum_text(uid, record) + record);
  if (!error.empty()) spdlog::warn("{} cannot be written: {}", file.string(), error);
  for (const std::int64_t frame : superfluous(frames_in(directory), history_from))
    discard(file_of(directory, frame));
} catch (const std::exception& error) {  // out of memory
  spdlog::warn("{}: no snapshot: {}", directory.string(), error.what());
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

bool SnapshotFiles::write(const std::string& uid, const SessionLog::Take& take,
                          std::optional<std::int64_t> history_from) {
  {
    std::lock_guard lock(mutex_);
    if (!writing_.insert(uid).second) return false;
  }
  const auto done = [this, uid] {
    std::lock_guard lock(mutex_);
    writing_.erase(uid);
  };
  const auto snapshot = take();
  const auto work = [directory = directory_ / uid, uid, snapshot, history_from, done] {
    keep(directory, uid, *snapshot, history_from);
    done();
  };
  const bool posted = snapshot && thread_.post(work);
  if (!posted) done();
  return posted;
}

std::optional<SessionSnapshot> SnapshotFiles::read(const std::string& uid,
                                                   std::optional<std::int64_t> not_after) const {
  const fs::path directory = directory_ / uid;
  auto frames = frames_in(directory);
  for (; !frames.empty(); frames.pop_back()) {
    const fs::path file = file_of(directory, frames.back());
    if (!not_after || frames.back() <= *not_after) try {
        SessionSnapshot snapshot = read_whole(file, uid);
        if (snapshot.simulation.frame != frames.back()) throw StoreError("it has another name");
        return snapshot;
      } catch (const StoreError& error) {
        spdlog::warn("{} is damaged, an older one serves: {}", file.string(), error.what());
      }
    discard(file);
  }
  return std::nullopt;
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

std::vector<std::int64_t> superfluous(std::vector<std::int64_t> frames,
                                      std::optional<std::int64_t> history_from) {
  std::vector<std::int64_t> removed;
  const auto take_out = [&](std::size_t i) {
    removed.push_back(frames[i]);
    frames.erase(frames.begin() + static_cast<std::ptrdiff_t>(i));
  };
  while (frames.size() > 2 && (!history_from || frames[1] <= *history_from)) take_out(0);
  while (frames.size() > SnapshotFiles::kMost) {
    // where the least gap is left
    std::size_t least = 1;
    for (std::size_t i = 1; i + 2 < frames.size(); ++i)
      if (frames[i + 1] - frames[i - 1] < frames[least + 1] - frames[least - 1]) least = i;
    take_out(least);
  }
  return removed;
}

}  // namespace weft
