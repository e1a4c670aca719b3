#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <utility>

namespace weft {

// Names a call, so that it is carried out once however often it is sent.
struct Request {
  std::string id;              // with the caller's principal before it; empty: it has no name
  std::uint32_t checksum = 0;  // of all that the call says
};

// The answers to the latest calls that were named, at most `most`. Not thread-safe.
template <class Answer>
class Answers {
 public:
  struct Known {
    std::uint32_t checksum = 0;  // of the request it answered
    Answer answer;
  };

  explicit Answers(std::size_t most) : most_(most) {}

  // What is known of the request's id, or nullptr.
  const Known* find(const Request& request) const {
    const auto found = request.id.empty() ? known_.end() : known_.find(request.id);
    return found == known_.end() ? nullptr : &found->second;
  }

  void remember(const Request& request, Answer answer) {
    if (request.id.empty()) return;
    if (!known_.emplace(request.id, Known{request.checksum, std::move(answer)}).second) return;
    order_.push_back(request.id);
    if (order_.size() <= most_) return;
    known_.erase(order_.front());
    order_.pop_front();
  }

  // Calls `f` with each request and its answer, oldest first.
  template <class F>
  void for_each(const F& f) const {
    for (const std::string& id : order_) {
      const Known& known = known_.at(id);
      f(Request{id, known.checksum}, known.answer);
    }
  }

 private:
  std::size_t most_;
  std::map<std::string, Known> known_;
  std::deque<std::string> order_;  // oldest first
};

}  // namespace weft
