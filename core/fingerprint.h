#pragma once

#include <cstdint>

namespace weft {

// Differs between builds and processors that compute other bits: a hash of what small scenes come
// to with every law and solver. Takes some 10 ms.
std::uint64_t fingerprint();

}  // namespace weft
