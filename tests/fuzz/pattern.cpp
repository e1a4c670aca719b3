#include <cstdint>
#include <string>

#include "client/imports/garment_code.h"
#include "client/problem.h"
#include "server/convert/garment.h"

// JSON of GarmentCode, of any bytes: a garment is built of it, or it is refused with a Problem or
// by its fields.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto json = weft::client::Json::parse(data, data + size, nullptr, false);
  if (json.is_discarded() || !weft::client::is_garment_code(json)) return 0;
  try {
    weft::v1::BuildGarmentRequest request;
    *request.mutable_pattern() = weft::client::read_garment_code("it.json", json).pattern;
    request.set_edge_m(0.05);
    weft::build_garment(request);
  } catch (const weft::client::Problem&) {
    return 0;
  }
  return 0;
}
