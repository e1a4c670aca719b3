#include "client/input_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "client/problem.h"

namespace weft::client {

std::string read_text(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file.is_open() || std::filesystem::is_directory(path)) {
    throw unreadable(path, std::strerror(file.is_open() ? EISDIR : errno));
  }
  return text.str();
}

}  // namespace weft::client
