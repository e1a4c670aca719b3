#include "core/verdict.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <utility>

#include "core/cloth_contact/cuts.h"
#include "core/frame_values.h"
#include "core/model/self_weight.h"
#include "core/model/strain.h"
#include "core/model/text.h"
#include "core/moving_sheet.h"
#include "core/sheet_factory.h"
#include "core/triangles/triangles.h"

namespace weft {
namespace {

constexpr double kMostStrain = 0.1;  // of cloth that fits
// Of knits, to which ASTM D2594 stretches those for loose garments along their courses.
constexpr double kMostStrainOfKnits = 0.3;
// What cloth between these may be stretched by, N/m: it presses a waist with 0.2 kPa, a tenth of
// what a waistband does that is worn with comfort (Sen'i Gakkaishi 47, 282, 1991).
constexpr double kLightPull = 30;
constexpr double kMostSlid = 0.03;    // of what was held, m
constexpr double kMostFallen = 0.15;  // of what hangs on shoulders, m
constexpr double kMostDepth = 1e-4;   // of a particle in a collider, m

// Along the warp or the weft.
struct Strained {
  double strain = 0, most = 0;  // as it is, and of cloth that fits
  double area = 0;              // when flat, m^2

  double excess() const { return strain - most; }
};

// That above whose value 1 % of the area is.
template <class Value>
Strained percentile_99(std::vector<Strained> all, const Value& value) {
  std::ranges::sort(all, std::greater(), value);
  double left = 0;
  for (const Strained& each : all) left += 0.01 * each.area;
  for (const Strained& each : all)
    if ((left -= each.area) < 0) return each;
  return {};
}

// Of cloth that fits, with a stiffness of `tensile` N/m.
double most_strain(double tensile) {
  return std::clamp(tensile > 0 ? kLightPull / tensile : 0, kMostStrain, kMostStrainOfKnits);
}

double flat_area(const SheetShape& shape, std::size_t triangle) {
  if (const auto* grid = std::get_if<Grid>(&shape)) return grid->spacing * grid->spacing / 2;
  const TriangleMesh& mesh = *std::get<Triangles>(shape);
  const Vector2d corner = flat_corner(mesh, triangle, 0),
                 first = flat_corner(mesh, triangle, 1) - corner,
                 second = flat_corner(mesh, triangle, 2) - corner;
  return std::abs(first.x() * second.y() - first.y() * second.x()) / 2;
}

// Of each panel of a sheet, or of all of it, along warp and weft.
std::vector<std::array<double, 2>> most_strains(const SheetDefinition& sheet) {
  const auto* mesh = std::get_if<Triangles>(&sheet.shape);
  std::vector<std::array<double, 2>> most(mesh ? std::max<std::size_t>(1, (*mesh)->panels.size())
                                               : 1);
  for (std::size_t p = 0; p < most.size(); ++p) {
    const auto* textile =
        std::get_if<MeasuredTextile>(&textile_of(sheet, static_cast<int>(p)).model);
    most[p] =
        textile ? std::array{most_strain(textile->tensile_warp), most_strain(textile->tensile_weft)}
                : std::array{kMostStrain, kMostStrain};
  }
  return most;
}

// Adds to the strained triangles of warp and weft those of a sheet. Gives the area that is strained
// too much in the panel with most of it, and its name.
std::pair<double, std::string> add_strains(const SheetDefinition& sheet, const Matrix3Xd& x,
                                           std::array<std::vector<Strained>, 2>& strained) {
  const Eigen::MatrixX3d planes = x.transpose();
  const std::vector<double> all =
      strains_of({planes.data(), planes.data() + planes.size()}, {sheet.shape});
  const std::size_t count = all.size() / 3;
  const auto most = most_strains(sheet);
  const auto* mesh = std::get_if<Triangles>(&sheet.shape);
  const std::vector<Panel> panels = mesh ? (*mesh)->panels : std::vector<Panel>();
  std::vector<double> tight(most.size());
  std::size_t panel = 0;
  int in_panel = 0;
  for (std::size_t t = 0; t < count; ++t, ++in_panel) {
    while (panel < panels.size() && panels[panel].triangles == in_panel) ++panel, in_panel = 0;
    const double area = flat_area(sheet.shape, t);
    bool too_much = false;
    for (std::size_t way = 0; way < 2; ++way) {
      strained[way].push_back({all[way * count + t], most[panel][way], area});
      too_much |= strained[way].back().excess() > 0;
    }
    if (too_much) tight[panel] += area;
  }
  const auto worst = std::ranges::max_element(tight);
  const auto p = static_cast<std::size_t>(worst - tight.begin());
  return {*worst, p < panels.size() ? panels[p].name : ""};
}

void find_strains(const Scene& scene, const std::vector<Matrix3Xd>& x, Verdict& verdict) {
  std::array<std::vector<Strained>, 2> strained;
  std::pair<double, std::string> tightest{0, ""};
  for (std::size_t s = 0; s < x.size(); ++s) {
    auto in_sheet = add_strains(scene.sheets[s], x[s], strained);
    if (in_sheet.first > tightest.first) tightest = std::move(in_sheet);
  }
  verdict.strain_warp = percentile_99(strained[0], &Strained::strain).strain;
  verdict.strain_weft = percentile_99(strained[1], &Strained::strain).strain;
  const auto beyond = [&](std::size_t way) {
    return percentile_99(std::move(strained[way]), &Strained::excess);
  };
  const Strained worst = std::max(beyond(0), beyond(1), [](const Strained& a, const Strained& b) {
    return a.excess() < b.excess();
  });
  if (worst.excess() > 0) verdict.too_tight = {worst.strain, worst.most, tightest.second};
}

void find_inside(const Scene& scene, const MovingBodies& bodies, const std::vector<Matrix3Xd>& x,
                 double time, Verdict& verdict) {
  for (const Matrix3Xd& sheet : x)
    for (const auto& position : sheet.colwise()) {
      const double depth = -distance_from_any(scene, bodies, position, time).value;
      if (depth <= kMostDepth) continue;
      ++verdict.particles_inside;
      verdict.deepest = std::max(verdict.deepest, depth);
    }
}

void find_slid(const Scene& scene, const std::vector<MovingSheet>& sheets,
               const std::vector<Matrix3Xd>& x, Verdict& verdict) {
  const Vector3d& gravity = scene.environment.gravity;
  if (!scene.dressing || gravity.isZero()) return;
  const Vector3d down = gravity.normalized();
  for (const Hold& hold : scene.dressing->holds) {
    const auto s = static_cast<std::size_t>(hold.sheet);
    double sum = 0;
    for (const int i : hold.particles) sum += (x[s].col(i) - sheets[s].start(i)).dot(down);
    verdict.slid = std::max(verdict.slid, sum / static_cast<double>(hold.particles.size()));
  }
}

void find_fallen(const Scene& scene, const std::vector<Matrix3Xd>& x, Verdict& verdict) {
  const Vector3d& gravity = scene.environment.gravity;
  if (!scene.dressing || gravity.isZero()) return;
  const Vector3d down = gravity.normalized();
  for (std::size_t s = 0; s < x.size(); ++s) {
    const bool held = std::ranges::any_of(scene.dressing->holds, [&](const Hold& hold) {
      return static_cast<std::size_t>(hold.sheet) == s;
    });
    const auto sewn = triangles_at_open_seams(scene.sheets[s]);
    if (held || std::ranges::find(sewn, true) == sewn.end()) continue;
    const Vector3d start = start_positions(scene.sheets[s]).rowwise().mean();
    verdict.fallen = std::max(verdict.fallen, (x[s].rowwise().mean() - start).dot(down));
  }
}

void find_loose_borders(const Scene& scene, const MovingBodies& bodies,
                        const std::vector<Matrix3Xd>& x, double time, Verdict& verdict) {
  if (!scene.dressing || !verdict.dressed || scene.colliders.empty()) return;
  for (std::size_t s = 0; s < x.size(); ++s)
    if (std::holds_alternative<Triangles>(scene.sheets[s].shape))
      std::ranges::move(loose_borders(scene, bodies, scene.sheets[s], x[s], time),
                        std::back_inserter(verdict.loose_borders));
}

std::string cuts_text(const Scene& scene, std::int64_t cuts, double time) {
  std::string text = join(cuts, " edges pass through cloth");
  if (const double end = end_of_untangling(scene); end > 0 && time >= end)
    text += join(", which could not be led apart within ", end, " s");
  return text;
}

std::string loose_borders_text(const std::vector<LooseBorder>& borders) {
  std::string text = join(borders.size(), borders.size() == 1 ? " border goes" : " borders go",
                          " around no part of a body, as that of a sleeve or a strap beside it");
  for (const auto& [length, panel] : borders)
    text += join(&borders.front().length == &length ? ": " : ", ", 1000 * length, " mm",
                 panel.empty() ? "" : " in panel \"" + panel + "\"");
  return text;
}

bool any_is_capped(const Scene& scene) {
  for (std::size_t s = 0; s < scene.sheets.size(); ++s) {
    const SheetDefinition& given = scene.sheets[s];
    const SheetDefinition simulated = capped(scene, s);
    if (simulated.textile != given.textile ||
        !std::ranges::equal(simulated.panel_textiles, given.panel_textiles, {},
                            &PanelTextile::textile, &PanelTextile::textile))
      return true;
  }
  return false;
}

std::string slid_text(const Scene& scene, double slid) {
  return join("what was held has come down by ", 1000 * slid, " mm, more than ", 1000 * kMostSlid,
              " mm: it is too wide there, or too smooth",
              any_is_capped(scene) ? ", or, its stretch capped, too soft to hold" : "");
}

void find_faults(const Scene& scene, double time, Verdict& verdict) {
  const auto fault = [&](const char* code, const std::string& message) {
    verdict.faults.push_back({code, message});
  };
  if (!verdict.dressed)
    fault("NOT_DRESSED",
          join("seams close, weight comes in and holds end by ", scene.dressing->end(), " s"));
  if (!verdict.at_rest) fault("NOT_AT_REST", "the cloth still moves");
  if (verdict.cloth_cuts > 0) fault("CLOTH_CUTS", cuts_text(scene, verdict.cloth_cuts, time));
  if (verdict.particles_inside > 0)
    fault("INSIDE_BODY", join(verdict.particles_inside, " particles are inside a collider, up to ",
                              1000 * verdict.deepest, " mm deep"));
  if (verdict.slid > kMostSlid) fault("SLID_DOWN", slid_text(scene, verdict.slid));
  if (verdict.fallen > kMostFallen)
    fault("SLID_DOWN", join("the garment has come down by ", 1000 * verdict.fallen,
                            " mm, more than ", 1000 * kMostFallen, " mm: nothing holds it up"));
  if (!verdict.loose_borders.empty())
    fault("BESIDE_BODY", loose_borders_text(verdict.loose_borders));
  if (verdict.dressed && verdict.too_tight) {
    const auto& [strain, most, panel] = *verdict.too_tight;
    fault("TOO_TIGHT",
          join("1 % of the cloth is strained by ", 100 * strain, " %, more than ", 100 * most, " %",
               panel.empty() ? "" : ", most of it in panel \"" + panel + "\""));
  }
}

}  // namespace

Verdict judge(const Scene& scene, const MovingBodies& bodies,
              const std::vector<MovingSheet>& sheets, double time, bool at_rest) {
  Verdict verdict;
  verdict.dressed = !scene.dressing || time >= scene.dressing->end();
  verdict.at_rest = at_rest;
  std::vector<Matrix3Xd> x;
  for (const MovingSheet& sheet : sheets) x.push_back(sheet.good().x);
  verdict.cloth_cuts = count_cuts(scene.sheets, x, 0).count;
  find_strains(scene, x, verdict);
  find_inside(scene, bodies, x, time, verdict);
  find_slid(scene, sheets, x, verdict);
  find_fallen(scene, x, verdict);
  find_loose_borders(scene, bodies, x, time, verdict);
  for (std::size_t s = 0; s < sheets.size(); ++s)
    if (!scene.colliders.empty() && x[s].cols() > 0)
      verdict.largest_pressure =
          std::max(verdict.largest_pressure,
                   pressures(scene, bodies, scene.sheets[s], sheets[s], x[s], time).maxCoeff());
  find_faults(scene, time, verdict);
  return verdict;
}

}  // namespace weft
