#pragma once

#include "server/rpc/backend.h"
#include "weft/v1/server.pb.h"

namespace weft {

v1::ServerStats server_stats(const Backend& backend);

}  // namespace weft
