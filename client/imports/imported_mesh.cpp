#include "client/imports/imported_mesh.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "client/output/text.h"

namespace weft::client {
namespace {

constexpr std::size_t kFaultsShown = 5;  // faults of a kind
constexpr std::size_t kMostPanels = 256;

template <class T>
void keep(std::vector<T>& values, const std::vector<bool>& kept) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (kept[i]) values[count++] = values[i];
  values.resize(count);
}

template <class T>
std::vector<T> in_order(const std::vector<T>& values, const std::vector<std::size_t>& order) {
  std::vector<T> result;
  result.reserve(order.size());
  for (const std::size_t i : order) result.push_back(values[i]);
  return result;
}

}  // namespace

std::string place(const ImportedMesh& mesh, int triangle) {
  const auto& source = mesh.source[as_index(triangle)];
  if (mesh.parts.empty()) return fmt::format("line {} (face {})", source.line, source.face);
  return fmt::format("{}, triangle {}", mesh.parts[as_index(source.part)], source.face);
}

std::string surroundings(const ImportedMesh& mesh, int triangle) {
  const auto t = as_index(triangle);
  Vector3d centre = Vector3d::Zero();
  for (const int i : mesh.triangles[t]) centre += mesh.positions[as_index(i)] / 3;
  return fmt::format("panel {}, at {}", mesh.panels[static_cast<std::size_t>(mesh.panel[t])],
                     position_text(centre));
}

std::string position_text(const Vector3d& position) {
  const auto shown = [](double x) { return std::round(x * 1e6) / 1e6 + 0.0; };  // -0 is 0
  return fmt::format("({:.4g}, {:.4g}, {:.4g})", shown(position.x()), shown(position.y()),
                     shown(position.z()));
}

std::string plain_name(std::string_view text, std::string_view without) {
  constexpr std::size_t kMost = 63;
  std::string name;
  for (const char c : text.substr(0, kMost)) {
    const bool upper = c >= 'A' && c <= 'Z';
    const bool plain = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
    name += upper ? static_cast<char>(c - 'A' + 'a') : plain ? c : '_';
  }
  return name.empty() ? std::string(without) : name;
}

int add_panel(ImportedMesh& mesh, std::string_view name) {
  if (mesh.panels.size() == kMostPanels)
    throw malformed("mesh", fmt::format("has more than {} panels", kMostPanels));
  constexpr std::size_t kMostBefore = 56;
  const std::string first = plain_name(name);
  std::string unique = first;
  const auto taken = [&] {
    return std::find(mesh.panels.begin(), mesh.panels.end(), unique) != mesh.panels.end();
  };
  for (int n = 2; taken(); ++n) unique = fmt::format("{}-{}", first.substr(0, kMostBefore), n);
  mesh.panels.push_back(unique);
  return static_cast<int>(mesh.panels.size()) - 1;
}

void keep_triangles(ImportedMesh& mesh, const std::vector<bool>& kept) {
  keep(mesh.triangles, kept);
  keep(mesh.corners, kept);
  keep(mesh.panel, kept);
  keep(mesh.source, kept);
}

int drop_unused_points(ImportedMesh& mesh) {
  std::vector<bool> used(mesh.positions.size(), false);
  for (const auto& triangle : mesh.triangles)
    for (const int i : triangle) used[as_index(i)] = true;
  std::vector<int> now(used.size());
  int count = 0;
  for (std::size_t i = 0; i < used.size(); ++i) now[i] = used[i] ? count++ : -1;
  for (auto& triangle : mesh.triangles)
    for (int& i : triangle) i = now[as_index(i)];
  const auto before = static_cast<int>(mesh.positions.size());
  keep(mesh.positions, used);
  return before - count;
}

void order_by_panel(ImportedMesh& mesh) {
  // panels as they come
  std::vector<int> now(mesh.panels.size(), -1);
  std::vector<std::string> names;
  for (int& panel : mesh.panel) {
    int& number = now[as_index(panel)];
    if (number < 0) {
      number = static_cast<int>(names.size());
      names.push_back(mesh.panels[as_index(panel)]);
    }
    panel = number;
  }
  mesh.panels = std::move(names);

  std::vector<std::size_t> order(mesh.panel.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return mesh.panel[a] < mesh.panel[b]; });
  mesh.triangles = in_order(mesh.triangles, order);
  mesh.corners = in_order(mesh.corners, order);
  mesh.source = in_order(mesh.source, order);
  mesh.panel = in_order(mesh.panel, order);
}

double size_of(const std::vector<Vector3d>& positions) {
  Eigen::AlignedBox3d box;
  for (const Vector3d& position : positions) box.extend(position);
  return box.isEmpty() ? 0 : box.diagonal().norm();
}

void add_some(std::vector<Fault>& faults, const std::vector<Fault>& kind) {
  const std::size_t shown = std::min(kind.size(), kFaultsShown);
  faults.insert(faults.end(), kind.begin(), kind.begin() + static_cast<std::ptrdiff_t>(shown));
  if (kind.size() > shown)
    faults.push_back({"...", fmt::format("and {} more like this one", kind.size() - shown)});
}

Problem mesh_problem(const std::string& path, const std::vector<Fault>& faults) {
  Problem problem = malformed(
      path, faults.size() == 1
                ? faults[0].place + ": " + faults[0].what
                : fmt::format("the mesh cannot be used as it is, for {}",
                              count_of(static_cast<std::int64_t>(faults.size()), "reason")));
  for (const auto& [place, what] : faults) problem.violations.push_back({place, what});
  return problem;
}

}  // namespace weft::client
