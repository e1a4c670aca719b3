#include "tests/stress/offline.h"

#include <stdexcept>
#include <variant>

#include "server/convert/convert.h"

namespace weft::stress {
namespace {

template <class Number>
std::string planes_of(const Simulation& simulation) {
  std::vector<double> values(3 * static_cast<std::size_t>(simulation.particle_count()));
  simulation.copy_positions(values);
  const std::vector<Number> numbers(values.begin(), values.end());
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

}  // namespace

Simulation simulation_of(const v1::Scene& scene) {
  auto converted = to_scene(scene, "scene");
  if (auto* good = std::get_if<Scene>(&converted)) return Simulation(std::move(*good));
  throw std::logic_error("a scene that cannot be simulated");
}

std::string float_planes(const Simulation& simulation) { return planes_of<float>(simulation); }
std::string double_planes(const Simulation& simulation) { return planes_of<double>(simulation); }

std::vector<std::size_t> offline_checksums(const v1::Scene& scene, std::int64_t last) {
  Simulation simulation = simulation_of(scene);
  std::vector<std::size_t> checksums{checksum_of(float_planes(simulation))};
  for (std::int64_t frame = 1; frame <= last; ++frame) {
    if (!simulation.advance_frame()) throw std::logic_error(simulation.failure());
    checksums.push_back(checksum_of(float_planes(simulation)));
  }
  return checksums;
}

}  // namespace weft::stress
