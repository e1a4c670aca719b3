#pragma once

#include <functional>
#include <utility>

namespace weft::stress {

// Undoes a trouble, whatever came of it.
class AtEnd {
 public:
  explicit AtEnd(std::function<void()> work) : work_(std::move(work)) {}
  ~AtEnd() { work_(); }
  AtEnd(const AtEnd&) = delete;
  AtEnd& operator=(const AtEnd&) = delete;

 private:
  const std::function<void()> work_;
};

}  // namespace weft::stress
