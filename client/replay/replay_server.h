#pragma once

#include <memory>
#include <string>

namespace weft::client {

// A server whose one session is a recording that is played: read, run, paused and stepped as any
// other, and never changed.
class ReplayServer {
 public:
  // Serves once constructed. address: "127.0.0.1:7311"; port 0 takes a free one. time_scale:
  // recorded seconds per second; 0: it waits until somebody runs it. Throws where the recording
  // cannot be read, or the address not be had.
  ReplayServer(const std::string& path, const std::string& address, double time_scale);
  ~ReplayServer();

  const std::string& address() const { return address_; }
  std::string session() const;  // "sessions/flag"
  std::int64_t first_frame() const;
  std::int64_t last_frame() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
  std::string address_;
};

}  // namespace weft::client
