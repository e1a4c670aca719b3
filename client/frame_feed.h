#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>

#include "client/connection.h"
#include "client/frame_parts.h"

namespace weft::client {

// The frames of a session, in order and each once, whatever happens on the road: a stream that
// breaks is opened again behind the last frame received, and so is one whose server is draining or
// has lost the session to another.
class FrameFeed {
 public:
  // Gives up when nothing is received for that time after a stream broke.
  FrameFeed(Connection& connection, v1::StreamFramesRequest request, std::chrono::seconds patience);
  // With a stop of its own instead of the connection's.
  FrameFeed(Connection& connection, v1::StreamFramesRequest request, std::chrono::seconds patience,
            std::stop_token stop);
  ~FrameFeed();
  FrameFeed(const FrameFeed&) = delete;
  FrameFeed& operator=(const FrameFeed&) = delete;

  // The next message, the header first and once. None: the stream has ended as asked, or a stop was
  // requested. Throws what else ends it.
  std::optional<v1::StreamFramesResponse> next();

  // Where it was asked for: there when the header is.
  const Topology& topology() const { return topology_.topology(); }

  int reconnections() const { return reconnections_; }

 private:
  void open();
  bool note(v1::StreamFramesResponse& message);

  Connection& connection_;
  v1::StreamFramesRequest request_;
  std::stop_token stop_;
  Attempts attempts_;
  std::optional<v1::StreamHeader> header_;  // the latest
  FrameParts parts_;
  TopologyParts topology_;
  bool begun_ = false;  // the caller has the header
  int reconnections_ = 0;

  std::unique_ptr<grpc::ClientContext> context_;
  std::optional<std::stop_callback<std::function<void()>>> cancel_;
  std::unique_ptr<grpc::ClientReader<v1::StreamFramesResponse>> reader_;
};

}  // namespace weft::client
