#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/util/json_util.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <utility>
#include <variant>

#include "core/simulation.h"
#include "server/convert/convert.h"

namespace weft {
namespace {

constexpr std::int64_t kMostParticles = 400, kMostSubsteps = 40;  // so that a run takes a moment

std::int64_t particles_of(const Scene& scene) {
  std::int64_t particles = 0;
  for (const auto& sheet : scene.sheets) particles += sheet.particle_count();
  return particles;
}

// Every scene is refused with named problems, or can be planned and run.
void take(const v1::Scene& message) {
  auto read = to_scene(message, "scene");
  if (const auto* problems = std::get_if<std::vector<Problem>>(&read)) {
    for (const auto& problem : *problems)
      if (!problem.field.starts_with("scene.") || problem.message.empty()) std::abort();
    return;
  }
  Scene& scene = std::get<Scene>(read);
  if (particles_of(scene) > kMostParticles) return;
  Simulation simulation(std::move(scene));
  if (simulation.refusal() || simulation.plan().step.substeps > kMostSubsteps) return;
  for (int frame = 0; frame < 2 && simulation.advance_frame(); ++frame) {
    if (!std::isfinite(simulation.stats().kinetic_energy)) std::abort();
  }
}

}  // namespace
}  // namespace weft

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const google::protobuf::LogSilencer silence;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  weft::v1::Scene scene;
  if (google::protobuf::util::JsonStringToMessage({text.data(), text.size()}, &scene).ok()) {
    weft::take(scene);
  } else if (scene.Clear(); scene.ParseFromArray(data, static_cast<int>(size))) {
    weft::take(scene);
  }
  return 0;
}
