#include "server/session/quota.h"

#include <utility>

namespace weft {

Quota::Share::Share(Quota& quota, std::string principal, std::int64_t amount)
    : quota_(&quota), principal_(std::move(principal)), amount_(amount) {}

Quota::Share::~Share() {
  if (quota_ == nullptr) return;
  std::lock_guard lock(quota_->mutex_);
  quota_->add(principal_, -amount_);
}

Quota::Share::Share(Share&& other) noexcept
    : quota_(std::exchange(other.quota_, nullptr)),
      principal_(std::move(other.principal_)),
      amount_(other.amount_) {}

Quota::Share& Quota::Share::operator=(Share&& other) noexcept {
  std::swap(quota_, other.quota_);
  std::swap(principal_, other.principal_);
  std::swap(amount_, other.amount_);
  return *this;
}

std::optional<Quota::Excess> Quota::excess(const std::string& principal,
                                           std::int64_t amount) const {
  std::lock_guard lock(mutex_);
  return excess_locked(principal, amount);
}

std::variant<Quota::Share, Quota::Excess> Quota::take(const std::string& principal,
                                                      std::int64_t amount) {
  std::lock_guard lock(mutex_);
  if (const auto excess = excess_locked(principal, amount)) return *excess;
  add(principal, amount);
  return Share(*this, principal, amount);
}

Quota::Share Quota::hold(const std::string& principal, std::int64_t amount) {
  std::lock_guard lock(mutex_);
  add(principal, amount);
  return {*this, principal, amount};
}

std::optional<Quota::Excess> Quota::excess_locked(const std::string& principal,
                                                  std::int64_t amount) const {
  if (amount > in_all_.most - held_) return Excess{in_all_, amount > in_all_.most};
  const auto held = held_by_.find(principal);
  if (amount > each_.most - (held == held_by_.end() ? 0 : held->second))
    return Excess{each_, amount > each_.most};
  return std::nullopt;
}

void Quota::add(const std::string& principal, std::int64_t amount) {
  held_ += amount;
  if ((held_by_[principal] += amount) == 0) held_by_.erase(principal);
}

}  // namespace weft
