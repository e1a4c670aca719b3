#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <cstdint>

#include "server/session/frame.h"
#include "weft/v1/frame.pb.h"

namespace weft {

// The format with defaults filled in.
v1::FrameFormat with_defaults(v1::FrameFormat format);

// Bytes of a message with a frame of so many particles, at most.
std::int64_t frame_bytes(const v1::FrameFormat& format, std::int64_t particles);

// The message with this frame; its bytes are made once and shared by all who ask.
grpc::ByteBuffer encoded_frame(const Frame& frame, const v1::FrameFormat& format);

// Any other message.
grpc::ByteBuffer encoded(const v1::StreamFramesResponse& message);

}  // namespace weft
