#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <utility>

namespace weft {

// Bytes held by many objects together, which are also counted in `all`. Thread-safe.
class ByteMeter {
 public:
  explicit ByteMeter(std::shared_ptr<ByteMeter> all = nullptr) : all_(std::move(all)) {}
  ~ByteMeter() { remove(bytes_); }
  ByteMeter(const ByteMeter&) = delete;
  ByteMeter& operator=(const ByteMeter&) = delete;

  void add(std::size_t bytes);
  void remove(std::size_t bytes);
  std::size_t bytes() const { return bytes_; }

 private:
  const std::shared_ptr<ByteMeter> all_;
  std::atomic<std::size_t> bytes_ = 0;
};

// What the frames that all sessions keep may take together. A session that is read gets four times
// as much of it as one that nobody reads, and none gets more than `each`. Thread-safe.
class HistoryBudget {
 public:
  // Bytes of all, and of one session at most.
  HistoryBudget(std::size_t all, std::size_t each) : all_(all), each_(each) {}

  // What a session may keep now.
  std::size_t share(bool read) const;
  // Taken together by all who count in meter().
  bool exceeded() const { return kept_->bytes() > all_; }
  const std::shared_ptr<ByteMeter>& meter() const { return kept_; }

  // A session that keeps frames comes, or goes.
  void add(bool read) { weights_ += weight(read); }
  void remove(bool read) { weights_ -= weight(read); }

 private:
  static std::size_t weight(bool read) { return read ? 4 : 1; }

  const std::size_t all_, each_;
  std::atomic<std::size_t> weights_ = 0;
  const std::shared_ptr<ByteMeter> kept_ = std::make_shared<ByteMeter>();
};

}  // namespace weft
