#include <fuzzer/FuzzedDataProvider.h>
#include <google/protobuf/stubs/logging.h>

#include <string>

#include "server/convert/convert.h"
#include "server/store/assets.h"
#include "server/store/records.h"
#include "server/store/sqlite_tables.h"
#include "tests/support/service/service.h"

namespace {

using namespace weft;

// What such a scene is computed from.
Simulation small_simulation() {
  return Simulation(std::get<Scene>(to_scene(weft::testing::small_scene(), "scene")));
}

}  // namespace

// Whatever a disk gives back as a session, its progress, its log or a snapshot is understood, or
// refused with a StoreError; a snapshot fits a simulation or leaves it as it was.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) try {
  const google::protobuf::LogSilencer silence;
  static Simulation simulation = small_simulation();
  static Assets assets(open_sqlite_tables(":memory:"));
  FuzzedDataProvider input(data, size);
  const int kind = input.ConsumeIntegralInRange(0, 3);
  const std::string bytes = input.ConsumeRemainingBytesAsString();
  if (kind == 0) {
    records::decode_session(bytes, assets);
  } else if (kind == 1) {
    records::decode_progress(bytes);
  } else if (kind == 2) {
    records::decode_entry(bytes);
  } else {
    const SessionSnapshot snapshot = records::decode_snapshot("", bytes);
    if (simulation.restore(snapshot.simulation)) simulation = small_simulation();
  }
  return 0;
} catch (const weft::StoreError&) {
  return 0;
}
