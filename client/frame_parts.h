#pragma once

#include <cstddef>

#include "client/sheet_layout.h"
#include "weft/v1/frame.pb.h"

namespace weft::client {

// Puts the frames of a stream together, whose larger ones come in several messages.
class FrameParts {
 public:
  // Of the stream, which begins (anew). Throws as particle_count does.
  void begin(const v1::StreamHeader& header);

  // False while more of the frame is to come; else it is whole. Throws where its parts are not one
  // frame's, or more than a frame of such a stream has.
  bool join(v1::Frame& part);

 private:
  std::size_t most_bytes_ = 0;
  v1::Frame frame_;  // as far as it has come, `continued`
};

// Puts the topology of a stream together, of which each sheet comes in one or several messages.
class TopologyParts {
 public:
  // Of the stream, which begins (anew).
  void begin(const v1::StreamHeader& header);

  // False while more of the sheet is to come; else it is whole. Throws where its parts are not of
  // the stream's next sheet.
  bool join(v1::Topology& part);
  // Whether every sheet is there.
  bool is_complete() const;
  const Topology& topology() const { return topology_; }

 private:
  v1::StreamHeader header_;
  Topology topology_;
  bool continued_ = false;  // of the last sheet there is more to come
};

}  // namespace weft::client
