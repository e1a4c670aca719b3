#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <cstdint>
#include <vector>

#include "core/model/scene.h"

namespace weft {

// The messages of a stream that say the triangles of each sheet, none longer than most_bytes.
std::vector<grpc::ByteBuffer> encoded_topology(const std::vector<SheetShape>& sheets,
                                               std::int64_t most_bytes);

}  // namespace weft
