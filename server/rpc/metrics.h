#pragma once

#include <memory>
#include <string>

#include "server/rpc/backend.h"

namespace weft {

// The stats of a server for Prometheus, at http://ADDRESS/metrics as long as it lives.
class Metrics {
 public:
  // address: "127.0.0.1:9464"; port 0 takes a free one. Throws std::runtime_error where it cannot
  // be had.
  Metrics(const Backend& backend, const std::string& address);
  ~Metrics();

  const std::string& address() const { return address_; }

 private:
  struct Exposed;
  std::shared_ptr<Exposed> exposed_;
  std::string address_;
};

}  // namespace weft
