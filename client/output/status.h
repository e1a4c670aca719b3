#pragma once

#include <chrono>
#include <cstddef>
#include <ostream>
#include <string>
#include <vector>

namespace weft::client {

// Lines that change in place while a person watches; without one, nothing is written.
class Status {
 public:
  Status(std::ostream& out, bool watched) : out_(out), watched_(watched) {}
  ~Status() { clear(); }
  Status(const Status&) = delete;
  Status& operator=(const Status&) = delete;

  // Shows these lines instead, at most ten times a second, as far as they fit the terminal.
  void show(std::vector<std::string> lines);
  // Takes the lines away, so that something else can be written.
  void clear();
  // Leaves them for good.
  void keep() { shown_ = 0; }

 private:
  std::ostream& out_;
  bool watched_;
  std::size_t shown_ = 0;
  std::chrono::steady_clock::time_point last_;
};

// "[#####.....]"
std::string bar(double fraction);

}  // namespace weft::client
