#include "client/recording/phases.h"

#include <algorithm>

namespace weft::client {

std::vector<Phase> phases_of(const v1::Scene& scene) {
  if (!scene.has_dressing()) return {};
  const v1::Dressing& dressing = scene.dressing();
  const double settled = dressing.close_s() + dressing.settle_s();
  double held = settled;
  for (const v1::Hold& hold : dressing.holds())
    held = std::max(held, dressing.close_s() + hold.until_s());
  std::vector<Phase> phases{
      {"seams close", dressing.close_s()},
      {dressing.deflate_m() > 0 ? "body back, weight comes in" : "weight comes in", settled}};
  if (held > settled) phases.push_back({"held up", held});
  phases.push_back({"comes to rest", std::nullopt});
  return phases;
}

Json phases_json(const v1::Scene& scene) {
  Json json = Json::array();
  for (const Phase& phase : phases_of(scene)) {
    json.push_back({{"name", phase.name}});
    if (phase.until_s) json.back()["until_s"] = *phase.until_s;
  }
  return json;
}

}  // namespace weft::client
