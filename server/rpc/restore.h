#pragma once

#include "server/rpc/backend.h"

namespace weft {

// Makes the sessions that the store has from an earlier process, on as many threads as there are
// workers. They go on by themselves. Throws StoreError where the store cannot be read.
void restore_sessions(Backend& backend);

// Makes one that was left, which goes on by itself.
void restore_session(Backend& backend, LeftSession left);
void add_damaged(Backend& backend, const DamagedSession& damaged);

}  // namespace weft
