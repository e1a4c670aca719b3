#include "core/tether_warnings.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/model/self_weight.h"
#include "core/model/text.h"

namespace weft {
namespace {

// Particles that lie beyond a tether.
std::vector<int> beyond(const PlannedSheet& planned) {
  constexpr double kRounding = 1 + 1e-6;
  std::vector<int> found;
  for (const Attachment& attachment : planned.tethers)
    for (std::size_t i = 0; i < attachment.length.size(); ++i) {
      const auto particle = static_cast<Eigen::Index>(i);
      const int end = attachment.held[static_cast<std::size_t>(attachment.nearest[i])];
      if ((planned.x.col(particle) - planned.x.col(end)).norm() > kRounding * attachment.length[i])
        found.push_back(static_cast<int>(i));
    }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

}  // namespace

void describe_tethers(const Scene& scene, std::size_t index, const PlannedSheet& planned,
                      Plan& plan) {
  const SheetDefinition& sheet = scene.sheets[index];
  if (!sheet.tether_stretch) return;
  const std::string pass = join(sheet.name, ": tethers");
  const std::string field = join("sheets[", index, "].tether_stretch");
  const auto warn = [&](const char* code, std::string message) {
    plan.warnings.push_back({code, field, std::move(message)});
  };
  if (planned.tethers.empty()) {
    plan.skipped.push_back({pass, "nothing is held"});
    return warn("TETHERS_IDLE", "nothing is held, so there is nothing to tether particles to");
  }
  plan.passes.push_back(join(pass, ", up to ", planned.tethers.size(), " from each particle"));

  if (!scene.colliders.empty())
    warn("TETHERS_STRAIGHT",
         "tethers know of no collider: cloth that lies over one on its way from where it is held "
         "stretches as its textile does");
  const SelfWeightStrain strain = self_weight_strain(sheet, scene.environment);
  constexpr double kSeen = 0.01;
  if (std::max({strain.warp, strain.weft, strain.bias}) > *sheet.tether_stretch + kSeen)
    warn("TETHERS_STIFFEN",
         join("hung by an edge, the textile stretches under its own weight by ",
              100 * std::max(strain.warp, strain.weft), " % along its threads and, by shear, by ",
              100 * strain.bias, " % along the bias; tethers let it by ",
              100 * *sheet.tether_stretch, " %"));
  if (const std::vector<int> far = beyond(planned); !far.empty())
    warn("TETHERS_TAUT",
         join(far.size(),
              " particles lie farther from where they are held than tethers let them, "
              "the first of them ",
              far.front(), ": they come back at ", kInward, " m/s"));
}

}  // namespace weft
