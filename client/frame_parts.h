#pragma once

#include <cstddef>

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

}  // namespace weft::client
