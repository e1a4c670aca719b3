#include <cstdint>
#include <string_view>

#include "tests/fuzz/scratch.h"

// A damaged file: it is read, or refused with a Problem.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const weft::Scratch scratch;
  scratch.write({reinterpret_cast<const char*>(data), size});
  scratch.use();
  return 0;
}
