#include "server/rpc/slow_calls.h"

#include <new>
#include <utility>

#include "server/rpc/errors.h"

namespace weft {

class SlowCalls::Call {
 public:
  explicit Call(Then then) : then_(std::move(then)) {}

  void answer(const grpc::Status& status) {
    Then then;
    {
      std::lock_guard lock(mutex_);
      then.swap(then_);
    }
    if (then) then(status);
  }

 private:
  std::mutex mutex_;
  Then then_;  // none: answered
};

void SlowCalls::ask(Work work, Then then) {
  const auto call = std::make_shared<Call>(std::move(then));
  {
    std::lock_guard lock(mutex_);
    if (!draining_) calls_.insert(call);
    if (draining_) work = nullptr;
  }
  if (!work) return call->answer(errors::server_draining());
  const bool posted = thread_.post([this, call, work = std::move(work)] {
    try {
      end(call, work());
    } catch (const std::bad_alloc&) {
      end(call, errors::exhausted("memory", "the server has no memory for this", true));
    }
  });
  if (!posted) end(call, errors::exhausted(subject_, complaint_, true));
}

void SlowCalls::end(const std::shared_ptr<Call>& call, const grpc::Status& status) {
  call->answer(status);
  std::lock_guard lock(mutex_);
  calls_.erase(call);
}

void SlowCalls::drain() {
  std::set<std::shared_ptr<Call>> calls;
  {
    std::lock_guard lock(mutex_);
    draining_ = true;
    calls.swap(calls_);
  }
  for (const auto& call : calls) call->answer(errors::server_draining());
}

}  // namespace weft
