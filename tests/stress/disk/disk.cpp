// To be preloaded: calls that change files fail, or take their time, as on the disks of disk.h.
#include "tests/stress/disk/disk.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <thread>

namespace {

using weft::stress::Disk;

const volatile char* byte_of_disk() {
  static constexpr char kGood = static_cast<char>(Disk::kGood);
  const char* path = std::getenv("WEFT_BAD_DISK");
  const int file = path != nullptr ? open(path, O_RDONLY | O_CLOEXEC) : -1;
  if (file < 0) return &kGood;
  void* shared = mmap(nullptr, 1, PROT_READ, MAP_SHARED, file, 0);
  close(file);
  return shared == MAP_FAILED ? &kGood : static_cast<const char*>(shared);
}

Disk disk() {
  static const volatile char* const byte = byte_of_disk();
  return static_cast<Disk>(*byte);
}

int write_error() { return disk() == Disk::kFull ? ENOSPC : disk() == Disk::kReadOnly ? EROFS : 0; }
int change_error() { return disk() == Disk::kReadOnly ? EROFS : 0; }

int error_at(int file, size_t size, off64_t at) {
  struct stat64 now;
  const bool grows = disk() == Disk::kCrowded && fstat64(file, &now) == 0 &&
                     at + static_cast<off64_t>(size) > now.st_size;
  return grows ? ENOSPC : write_error();
}

// What the library behind this one does, unless there is an error.
template <class Call, class... Arguments>
auto go_on(const char* name, int error, Call /*own*/, Arguments... arguments) {
  const auto call = reinterpret_cast<Call>(dlsym(RTLD_NEXT, name));
  using Result = decltype(call(arguments...));
  if (error == 0) return call(arguments...);
  errno = error;
  return Result{-1};
}

void take_time() {
  if (disk() == Disk::kSlow) std::this_thread::sleep_for(weft::stress::kSync);
}

constexpr int kFirstFile = 3;  // behind the standard streams

}  // namespace

extern "C" {

ssize_t write(int file, const void* data, size_t size) {
  return go_on("write", file < kFirstFile ? 0 : write_error(), write, file, data, size);
}
ssize_t pwrite64(int file, const void* data, size_t size, off64_t at) {
  return go_on("pwrite64", error_at(file, size, at), pwrite64, file, data, size, at);
}
ssize_t pwrite(int file, const void* data, size_t size, off_t at) {
  return go_on("pwrite", error_at(file, size, at), pwrite, file, data, size, at);
}
int ftruncate64(int file, off64_t size) noexcept {
  return go_on("ftruncate64", change_error(), ftruncate64, file, size);
}
int fsync(int file) {
  take_time();
  return go_on("fsync", write_error(), fsync, file);
}
int fdatasync(int file) {
  take_time();
  return go_on("fdatasync", write_error(), fdatasync, file);
}
int unlink(const char* path) noexcept { return go_on("unlink", change_error(), unlink, path); }
int rename(const char* from, const char* to) noexcept {
  return go_on("rename", change_error(), rename, from, to);
}
int open64(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  const bool reads = (flags & (O_ACCMODE | O_CREAT | O_TRUNC)) == O_RDONLY;
  return go_on("open64", reads ? 0 : change_error(), open64, path, flags, mode);
}

}  // extern "C"
