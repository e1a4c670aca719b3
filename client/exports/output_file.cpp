#include "client/exports/output_file.h"

#include <cerrno>
#include <cstring>

#include "client/problem.h"

namespace weft::client {

OutputFile::OutputFile(std::string path)
    : path_(std::move(path)), file_(path_, std::ios::binary | std::ios::trunc) {
  check();
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
}

void OutputFile::check() {
  if (!file_) throw unwritable(path_, std::strerror(errno));
}

}  // namespace weft::client
