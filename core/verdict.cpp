#include "core/verdict.h"

#include <algorithm>
#include <cmath>

#include "core/cloth_contact/cuts.h"
#include "core/frame_values.h"
#include "core/model/strain.h"
#include "core/model/text.h"
#include "core/moving_sheet.h"
#include "core/sheet_factory.h"

namespace weft {
namespace {

constexpr double kMostStrain99 = 0.1;  // of cloth that fits
constexpr double kMostSlid = 0.03;     // of what was held, m
constexpr double kMostFallen = 0.15;   // of what hangs on shoulders, m
constexpr double kMostDepth = 1e-4;    // of a particle in a collider, m

struct Strained {
  double strain, area;  // 1, m^2 when flat
};

// Above which 1 % of the area is strained.
double percentile_99(std::vector<Strained> all) {
  std::sort(all.begin(), all.end(),
            [](const Strained& a, const Strained& b) { return a.strain > b.strain; });
  double left = 0;
  for (const Strained& each : all) left += 0.01 * each.area;
  for (const Strained& each : all)
    if ((left -= each.area) < 0) return each.strain;
  return 0;
}

double flat_area(const SheetShape& shape, std::size_t triangle) {
  if (const auto* grid = std::get_if<Grid>(&shape)) return grid->spacing * grid->spacing / 2;
  const TriangleMesh& mesh = *std::get<Triangles>(shape);
  const Vector2d corner = flat_corner(mesh, triangle, 0),
                 first = flat_corner(mesh, triangle, 1) - corner,
                 second = flat_corner(mesh, triangle, 2) - corner;
  return std::abs(first.x() * second.y() - first.y() * second.x()) / 2;
}

// Adds up areas that are strained too much by panels of a sheet, and names the one with most.
class TightPanels {
 public:
  explicit TightPanels(const SheetShape& shape) {
    const auto* mesh = std::get_if<Triangles>(&shape);
    if (mesh != nullptr) panels_ = (*mesh)->panels;
    area_.resize(panels_.size() + 1);
  }
  // One triangle after the other.
  void add(const Strained& most) {
    while (panel_ < panels_.size() && panels_[panel_].triangles == triangle_)
      ++panel_, triangle_ = 0;
    ++triangle_;
    if (most.strain > kMostStrain99) area_[panel_] += most.area;
  }
  double most() const { return *std::ranges::max_element(area_); }
  std::string name() const {
    const auto panel = static_cast<std::size_t>(std::ranges::max_element(area_) - area_.begin());
    return panel < panels_.size() ? panels_[panel].name : "";
  }

 private:
  std::vector<Panel> panels_;
  std::vector<double> area_;
  std::size_t panel_ = 0;
  int triangle_ = 0;
};

void find_strains(const Scene& scene, const std::vector<Matrix3Xd>& x, Verdict& verdict) {
  std::vector<Strained> warp, weft;
  double most = 0;
  for (std::size_t s = 0; s < x.size(); ++s) {
    const SheetShape& shape = scene.sheets[s].shape;
    const Eigen::MatrixX3d planes = x[s].transpose();
    const std::vector<double> all =
        strains_of({planes.data(), planes.data() + planes.size()}, {shape});
    const std::size_t count = all.size() / 3;
    TightPanels tight(shape);
    for (std::size_t t = 0; t < count; ++t) {
      const double area = flat_area(shape, t);
      warp.push_back({all[t], area});
      weft.push_back({all[count + t], area});
      tight.add({std::max(all[t], all[count + t]), area});
    }
    if (tight.most() > most) {
      most = tight.most();
      verdict.tightest = tight.name();
    }
  }
  verdict.strain_warp = percentile_99(std::move(warp));
  verdict.strain_weft = percentile_99(std::move(weft));
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

std::string cuts_text(const Scene& scene, std::int64_t cuts, double time) {
  std::string text = join(cuts, " edges pass through cloth");
  if (const double end = end_of_untangling(scene); end > 0 && time >= end)
    text += join(", which could not be led apart within ", end, " s");
  return text;
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
  if (verdict.slid > kMostSlid)
    fault("SLID_DOWN",
          join("what was held has come down by ", 1000 * verdict.slid, " mm, more than ",
               1000 * kMostSlid, " mm: it is too wide there, or too smooth"));
  if (verdict.fallen > kMostFallen)
    fault("SLID_DOWN", join("the garment has come down by ", 1000 * verdict.fallen,
                            " mm, more than ", 1000 * kMostFallen, " mm: nothing holds it up"));
  if (const double strain = std::max(verdict.strain_warp, verdict.strain_weft);
      verdict.dressed && strain > kMostStrain99)
    fault(
        "TOO_TIGHT",
        join("1 % of the cloth is strained by ", 100 * strain, " %, more than ",
             100 * kMostStrain99, " %",
             verdict.tightest.empty() ? "" : ", most of it in panel \"" + verdict.tightest + "\""));
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
  for (std::size_t s = 0; s < sheets.size(); ++s)
    if (!scene.colliders.empty() && x[s].cols() > 0)
      verdict.largest_pressure =
          std::max(verdict.largest_pressure,
                   pressures(scene, bodies, scene.sheets[s], sheets[s], x[s], time).maxCoeff());
  find_faults(scene, time, verdict);
  return verdict;
}

}  // namespace weft
