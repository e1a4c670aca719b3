#include <cstdint>

#include "tests/fuzz/import_all.h"

// A glTF file, text or binary, of any bytes: a scene is made of it, or it is refused with a
// Problem.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  weft::import_all("it.gltf", {reinterpret_cast<const char*>(data), size});
  return 0;
}
