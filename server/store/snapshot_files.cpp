#include "server/store/snapshot_files.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>
#include <system_error>
#include <utility>

#include "server/store/store.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

void discard(const fs::path& path) {
  std::error_code error;
  fs::remove_all(path, error);
  if (error) spdlog::warn("{} cannot be removed: {}", path.string(), error.message());
}

// What make_identity() gives: nothing that leads elsewhere, nor what somebody else has put here.
bool is_uid(const std::string& name) {
  return name.size() == 32 && name.find_first_not_of("0123456789abcdef") == std::string::npos;
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

}  // namespace

SnapshotFiles::SnapshotFiles(fs::path directory) : directory_(std::move(directory)) {}

std::string SnapshotFiles::place_of(const std::string& uid, const std::string& name) const {
  return (directory_ / uid / name).string();
}

std::vector<SnapshotShelf::Item> SnapshotFiles::list(const std::string& uid, Folder folder) {
  const fs::path directory = directory_ / uid / (folder == Folder::kNamed ? "named" : "");
  std::vector<Item> items;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with('.') || entry.is_directory(error)) continue;  // not written to its end
    items.push_back({name, static_cast<std::int64_t>(entry.file_size(error))});
  }
  return items;
}

void SnapshotFiles::write(const std::string& uid, const std::string& name,
                          const std::string& bytes) {
  const std::string place = place_of(uid, name);
  const std::string error = write_whole(place, bytes);
  if (!error.empty()) throw StoreError(place + " cannot be written: " + error);
}

std::string SnapshotFiles::read(const std::string& uid, const std::string& name) {
  std::ostringstream content;
  content << std::ifstream(place_of(uid, name), std::ios::binary).rdbuf();
  return content.str();
}

void SnapshotFiles::remove(const std::string& uid, const std::string& name) {
  discard(place_of(uid, name));
}

void SnapshotFiles::remove_all(const std::string& uid) {
  if (is_uid(uid)) discard(directory_ / uid);
}

void SnapshotFiles::keep_only(const std::set<std::string>& uids) const {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory_, error)) {
    const std::string name = entry.path().filename().string();
    if (is_uid(name) && !uids.contains(name)) discard(entry.path());
  }
}

}  // namespace weft
