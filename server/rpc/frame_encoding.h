#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "core/model/scene.h"
#include "core/simulation.h"
#include "server/session/frame.h"
#include "weft/v1/frame.pb.h"

namespace weft {

// The format with defaults filled in.
v1::FrameFormat with_defaults(v1::FrameFormat format);

// Why frames of so many particles are not sent in the format.
std::vector<Problem> find_problems(const v1::FrameFormat& format, std::int64_t particles);

// How frames of a session are sent.
struct FrameOrder {
  v1::FrameFormat format = {};          // with its defaults filled in and no problems
  std::vector<SheetShape> sheets = {};  // as they are simulated
  std::int64_t most_bytes = 0;          // of a message; 1024 at least
};

// The frame, in several parts where it is too large for a message.
std::vector<v1::Frame> to_proto(const Frame& frame, const FrameOrder& order);

// The messages with this frame; their bytes are made once and shared by all who ask.
std::vector<grpc::ByteBuffer> encoded_frame(const Frame& frame, const FrameOrder& order);

}  // namespace weft
