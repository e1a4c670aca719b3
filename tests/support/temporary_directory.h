#pragma once

#include <stdlib.h>

#include <filesystem>
#include <stdexcept>
#include <string>

namespace weft::testing {

// An empty directory, removed at the end with all that is in it.
class TemporaryDirectory {
 public:
  TemporaryDirectory() {
    if (mkdtemp(name_.data()) == nullptr) throw std::runtime_error("no temporary directory");
  }
  ~TemporaryDirectory() { std::filesystem::remove_all(name_); }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

  const std::string& name() const { return name_; }
  // Of a file in it.
  std::string path(const std::string& file) const { return name_ + "/" + file; }

 private:
  std::string name_ = (std::filesystem::temp_directory_path() / "weft-XXXXXX").string();
};

}  // namespace weft::testing
