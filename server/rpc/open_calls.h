#pragma once

#include <condition_variable>
#include <cstddef>
#include <mutex>

#include "server/session/scheduler.h"

namespace weft {

// Calls under way that we finish ourselves, so that a server that stops can wait for their answers
// to have left: gRPC may drop what is not sent when it shuts down.
class OpenCalls {
 public:
  // Counts as a call as long as it lives.
  class Ticket {
   public:
    explicit Ticket(OpenCalls& calls);
    ~Ticket();
    Ticket(const Ticket&) = delete;
    Ticket& operator=(const Ticket&) = delete;

   private:
    OpenCalls& calls_;
  };

  // False where some were left at the deadline.
  bool wait_for_none(Clock::time_point deadline);

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t count_ = 0;
};

}  // namespace weft
