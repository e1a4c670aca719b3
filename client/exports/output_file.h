#pragma once

#include <fstream>
#include <string>
#include <string_view>

namespace weft::client {

// A file that is written; what fails is a Problem.
class OutputFile {
 public:
  explicit OutputFile(std::string path);
  void write(std::string_view bytes);
  void seek(std::streamoff place);
  void close();

 private:
  void check();

  std::string path_;
  std::ofstream file_;
};

}  // namespace weft::client
