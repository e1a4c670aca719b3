#include "core/motion/thread_pool.h"

namespace weft {
namespace {

class CallingThread : public ThreadPool {
 public:
  int threads() const override { return 1; }
  void run(int parts, const std::function<void(int)>& part) override {
    for (int i = 0; i < parts; ++i) part(i);
  }
};

}  // namespace

ThreadPool& calling_thread() {
  static CallingThread alone;
  return alone;
}

}  // namespace weft
