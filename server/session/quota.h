#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <variant>

namespace weft {

// Something of which principals hold shares, bounded for each and in all. Thread-safe.
class Quota {
 public:
  struct Bound {
    const char* name;  // "sessions_per_principal"
    std::int64_t most;
  };
  // A bound that is in the way.
  struct Excess {
    Bound bound;
    bool for_ever = false;  // whoever gives back what
  };

  // What is held, as long as it lives. The quota outlives it.
  class Share {
   public:
    Share() = default;  // of nothing
    Share(Quota& quota, std::string principal, std::int64_t amount);
    ~Share();
    Share(Share&& other) noexcept;
    Share& operator=(Share&& other) noexcept;

   private:
    Quota* quota_ = nullptr;
    std::string principal_;
    std::int64_t amount_ = 0;
  };

  Quota(Bound in_all, Bound each) : in_all_(in_all), each_(each) {}

  // What is in the way of so much more.
  std::optional<Excess> excess(const std::string& principal, std::int64_t amount) const;
  // A share, or what is in its way.
  std::variant<Share, Excess> take(const std::string& principal, std::int64_t amount);
  // A share, whatever the bounds.
  Share hold(const std::string& principal, std::int64_t amount);

 private:
  // with the mutex held
  std::optional<Excess> excess_locked(const std::string& principal, std::int64_t amount) const;
  void add(const std::string& principal, std::int64_t amount);

  const Bound in_all_, each_;
  mutable std::mutex mutex_;
  std::int64_t held_ = 0;
  std::map<std::string, std::int64_t> held_by_;  // who holds anything
};

}  // namespace weft
