#include <cstdint>

#include "tests/fuzz/import_all.h"

// An OBJ file, of any bytes: a scene is made of it, or it is refused with a Problem.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  weft::import_all("it.obj", {reinterpret_cast<const char*>(data), size});
  return 0;
}
