#include "client/exports/output_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "client/problem.h"

namespace weft::client {
namespace {

// Where a file is written until it is whole. Links, devices and pipes are written to at once.
std::string unfinished_name(const std::string& path) {
  std::error_code error;
  const auto status = std::filesystem::symlink_status(path, error);
  const bool other = std::filesystem::exists(status) && !std::filesystem::is_regular_file(status);
  return other ? path : path + ".part";
}

}  // namespace

OutputFile::OutputFile(std::string path)
    : path_(std::move(path)),
      unfinished_(unfinished_name(path_)),
      file_(unfinished_, std::ios::binary | std::ios::trunc) {
  check();
}

OutputFile::~OutputFile() {
  if (closed_ || unfinished_ == path_) return;
  std::error_code error;  // there is nobody to tell
  std::filesystem::remove(unfinished_, error);
}

void OutputFile::write(std::string_view bytes) {
  file_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  check();
}

void OutputFile::seek(std::streamoff place) {
  file_.seekp(place);
  check();
}

void OutputFile::close() {
  file_.close();
  check();
  std::error_code error;
  if (unfinished_ != path_) std::filesystem::rename(unfinished_, path_, error);
  if (error) throw unwritable(path_, error.message());
  closed_ = true;
}

void OutputFile::check() {
  if (!file_) throw unwritable(path_, std::strerror(errno));
}

void write_new_file(const std::string& path, std::string_view text, bool replace) {
  if (!replace && std::filesystem::exists(path))
    throw unwritable(path, "the file exists; --force replaces it");
  OutputFile file(path);
  file.write(text);
  file.close();
}

}  // namespace weft::client
