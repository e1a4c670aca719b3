#pragma once

#include <functional>

#include "core/motion/thread_pool.h"

namespace weft::testing {

// So many threads that come to their work in turn, the last part first.
class LastFirst : public ThreadPool {
 public:
  explicit LastFirst(int threads) : threads_(threads) {}
  int threads() const override { return threads_; }
  void run(int parts, const std::function<void(int)>& part) override {
    for (int i = parts; i-- > 0;) part(i);
  }

 private:
  const int threads_;
};

}  // namespace weft::testing
