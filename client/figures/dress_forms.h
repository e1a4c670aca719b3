#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "client/figures/dress_form.h"

namespace weft::client {

// Forms that are asked for again, each made once. Thread-safe.
class DressForms {
 public:
  std::shared_ptr<const DressForm> of(const Measures& measures);

 private:
  std::mutex mutex_;
  std::vector<std::pair<Measures, std::shared_ptr<const DressForm>>> made_;
};

}  // namespace weft::client
