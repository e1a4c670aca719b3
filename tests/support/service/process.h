#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace weft::testing {

// A program, running: one of those that were built, or one named by its whole path.
class Process {
 public:
  // What it writes goes to the file `output`. A limit of 0 bytes for files it writes: none. It has
  // this process's environment and what `environment` adds, "NAME=value".
  Process(const std::string& program, const std::vector<std::string>& arguments,
          const std::string& output, std::size_t file_size_limit = 0,
          std::vector<std::string> environment = {});
  ~Process();  // kills it
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t id() const { return pid_; }
  void signal(int number) const;
  // Its exit code, or 128 + the signal that ended it.
  int wait();

 private:
  pid_t pid_ = -1;
};

}  // namespace weft::testing
