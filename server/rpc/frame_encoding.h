#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <cstdint>
#include <vector>

#include "core/simulation.h"
#include "server/session/frame.h"
#include "weft/v1/frame.pb.h"

namespace weft {

// The format with defaults filled in.
v1::FrameFormat with_defaults(v1::FrameFormat format);

// Bytes of a message with a frame of a session of so many particles, at most. Of QUANTIZED_ZSTD: as
// long as no two neighbours are 2^31 grid steps apart.
std::int64_t frame_bytes(const v1::FrameFormat& format, std::int64_t particles);

// Why frames of such a session are not sent in the format, each within `most_bytes`.
std::vector<Problem> find_problems(const v1::FrameFormat& format, std::int64_t particles,
                                   std::int64_t most_bytes);

// The frame in a format that has its defaults filled in and no problems.
v1::Frame to_proto(const Frame& frame, const v1::FrameFormat& format);

// The message with this frame; its bytes are made once and shared by all who ask.
grpc::ByteBuffer encoded_frame(const Frame& frame, const v1::FrameFormat& format);

}  // namespace weft
