#pragma once

#include <cstdint>

namespace weft {

// Bytes of this machine, or fewer where the control group of the process is not given as many.
std::int64_t memory_there_is();

}  // namespace weft
