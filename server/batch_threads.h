#pragma once

#include <pthread.h>
#include <sched.h>

namespace weft {

// Threads that are started meanwhile by this one, and by them, do not interrupt one that runs when
// they are woken (SCHED_BATCH): they wait until it pauses. An interruption for each frame that was
// sent took a tenth of the time of a busy server.
class BatchThreads {
 public:
  BatchThreads() {
    if (pthread_getschedparam(pthread_self(), &policy_, &own_) != 0) return;
    changed_ =
        policy_ == SCHED_OTHER && pthread_setschedparam(pthread_self(), SCHED_BATCH, &own_) == 0;
  }
  ~BatchThreads() {
    if (changed_) pthread_setschedparam(pthread_self(), policy_, &own_);
  }
  BatchThreads(const BatchThreads&) = delete;
  BatchThreads& operator=(const BatchThreads&) = delete;

 private:
  int policy_ = SCHED_OTHER;
  sched_param own_{};
  bool changed_ = false;
};

}  // namespace weft
