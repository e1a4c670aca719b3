#pragma once

#include <fstream>
#include <string>
#include <string_view>
#include <vector>

namespace weft::client {

// Numbers as they are in memory: little-endian.
template <class Number>
std::string_view bytes_of(const std::vector<Number>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

// A file that is written; what fails is a Problem. It has its name when it is closed, and until
// then the name with ".part", under which it is removed if it is never closed. Links and devices
// are written to at once.
class OutputFile {
 public:
  explicit OutputFile(std::string path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  void write(std::string_view bytes);
  void seek(std::streamoff place);
  void close();

 private:
  void check();

  std::string path_;
  std::string unfinished_;
  std::ofstream file_;
  bool closed_ = false;
};

// Writes all of a file; one that exists only where it may be replaced.
void write_new_file(const std::string& path, std::string_view text, bool replace);

}  // namespace weft::client
