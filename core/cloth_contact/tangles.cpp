#include "core/cloth_contact/tangles.h"

#include <algorithm>
#include <array>
#include <span>

#include "core/cloth_contact/cuts.h"
#include "core/cloth_contact/pairs.h"
#include "core/model/text.h"

namespace weft {
namespace {

constexpr std::size_t kMostTold = 3;

// Of the first triangle that has these corners; none where there are no two panels.
const Panel* panel_of(const SheetShape& shape, std::span<const int> corners) {
  const auto* mesh = std::get_if<Triangles>(&shape);
  if (mesh == nullptr || (*mesh)->panels.size() < 2) return nullptr;
  const auto has_all = [&](const std::array<int, 3>& triangle) {
    return std::ranges::all_of(
        corners, [&](int i) { return std::ranges::find(triangle, i) != triangle.end(); });
  };
  auto left = std::ranges::find_if((*mesh)->triangles, has_all) - (*mesh)->triangles.begin();
  for (const Panel& panel : (*mesh)->panels)
    if ((left -= panel.triangles) < 0) return &panel;
  return nullptr;
}

std::string name_particles(const Scene& scene, std::size_t sheet, std::span<const int> particles) {
  std::string text = join(scene.sheets[sheet].name, " ");
  for (std::size_t k = 0; k < particles.size(); ++k) text += join(k == 0 ? "" : "-", particles[k]);
  if (const Panel* panel = panel_of(scene.sheets[sheet].shape, particles))
    text += " of panel " + panel->name;
  return text;
}

std::string describe_cuts(const Scene& scene, const ClothCuts& cuts) {
  std::string text = join(cuts.count, " edges pass through triangles");
  for (std::size_t k = 0; k < cuts.first.size(); ++k) {
    const ClothCut& cut = cuts.first[k];
    text += join(k == 0 ? ": " : ", ", name_particles(scene, cut.edge_sheet, cut.edge), " through ",
                 name_particles(scene, cut.triangle_sheet, cut.triangle));
  }
  return text;
}

std::string describe_near(const Scene& scene, const Cloth& cloth, const ClothPairs& near) {
  std::string text =
      join(near.corners.size() + near.edges.size(), " pairs are nearer than their thickness");
  for (std::size_t k = 0; k < std::min(kMostTold, near.corners.size()); ++k) {
    const int i = near.corners[k].first;
    const int own = cloth.own_number(i);
    text += join(k == 0 ? ": at " : ", ",
                 name_particles(scene, static_cast<std::size_t>(cloth.sheet_of(i)), {&own, 1}));
  }
  return text;
}

}  // namespace

std::optional<Warning> find_tangles(const Scene& scene, const std::vector<Matrix3Xd>& x,
                                    const LeftOut& left_out) {
  const Cloth cloth(scene.sheets, left_out);
  const Matrix3Xd all = cloth.positions(x);
  NearBlocks blocks(cloth);
  blocks.set(all);
  constexpr double kRounding = 1e-9;  // m
  ClothPairs near;
  NearBlocks::Search search;
  for (const BlockPair& each : blocks.meet(cloth.thickest)) {
    if (blocks.distance(each) > cloth.thickest) continue;
    double others = -kRounding;
    const ClothPairs found = find_pairs(cloth, blocks, each, all, -kRounding, others, search);
    near.corners.insert(near.corners.end(), found.corners.begin(), found.corners.end());
    near.edges.insert(near.edges.end(), found.edges.begin(), found.edges.end());
  }
  const ClothCuts cuts = count_cuts(cloth, blocks, all, kMostTold);
  if (near.empty() && cuts.count == 0) return std::nullopt;
  std::string text;
  if (cuts.count > 0) {
    text += describe_cuts(scene, cuts) + ". ";
    if (const double end = end_of_untangling(scene); end > 0)
      text += join("What has passed through is led apart until ", end, " s. ");
    else
      text += "What has passed through stays so, unless untangle_s is given. ";
  }
  if (!near.empty()) text += describe_near(scene, cloth, near) + ". They are pushed apart";
  return Warning{"TANGLED_START", "sheets", text};
}

}  // namespace weft
