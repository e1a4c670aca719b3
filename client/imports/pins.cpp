#include "client/imports/pins.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <charconv>
#include <optional>
#include <set>

#include "client/imports/borders.h"

namespace weft::client {
namespace {

std::vector<std::string> split(const std::string& text, char by) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(by, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

template <class Number>
std::optional<Number> number(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

Triangles triangles_of_panel(const ImportedMesh& mesh, const std::string& name) {
  const auto found = std::find(mesh.panels.begin(), mesh.panels.end(), name);
  if (found == mesh.panels.end())
    throw usage_problem(
        fmt::format("the mesh has no panel \"{}\"; it has {}", name, fmt::join(mesh.panels, ", ")));
  Triangles triangles;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (mesh.panel[t] == found - mesh.panels.begin()) triangles.push_back(mesh.triangles[t]);
  return triangles;
}

std::vector<int> on_border(const ImportedMesh& mesh, const Triangles& triangles,
                           const std::string& name) {
  const View view = view_of(mesh.positions);
  std::vector<int> particles = border_called(mesh.positions, triangles, view, name).particles;
  if (particles.empty())
    throw usage_problem(fmt::format(
        "there is no border \"{}\"; a border is {}, or a number from 1 "
        "to {}",
        name, fmt::join(kBorderSides, ", "), find_borders(mesh.positions, triangles, view).size()));
  return particles;
}

std::vector<int> of_panel(const ImportedMesh& mesh, const std::vector<std::string>& words) {
  const Triangles triangles = triangles_of_panel(mesh, words[1]);
  if (words.size() == 4) return on_border(mesh, triangles, words[3]);
  std::set<int> particles;
  for (const auto& triangle : triangles) particles.insert(triangle.begin(), triangle.end());
  return {particles.begin(), particles.end()};
}

Vector3d point(const std::string& text) {
  const std::vector<std::string> words = split(text, ',');
  Vector3d result = Vector3d::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    const auto value = words.size() == 3 ? number<double>(words[i]) : std::nullopt;
    if (!value) throw usage_problem(fmt::format("\"{}\" is no point x,y,z", text));
    result[static_cast<Eigen::Index>(i)] = *value;
  }
  return result;
}

std::vector<int> in_box(const ImportedMesh& mesh, const std::string& from, const std::string& to) {
  Eigen::AlignedBox3d box(point(from));
  box.extend(point(to));
  std::vector<int> particles;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    if (box.contains(mesh.positions[i])) particles.push_back(static_cast<int>(i));
  if (particles.empty())
    throw usage_problem(fmt::format("no particle is in the box {}:{}", from, to));
  return particles;
}

std::vector<int> by_number(const ImportedMesh& mesh, const std::string& words) {
  const auto last = static_cast<int>(mesh.positions.size()) - 1;
  std::set<int> particles;
  for (const std::string& word : split(words, ',')) {
    const std::size_t dash = word.find('-');
    const auto from = number<int>(word.substr(0, dash));
    const auto to = dash == std::string::npos ? from : number<int>(word.substr(dash + 1));
    if (!from || !to)
      throw usage_problem(
          fmt::format("\"{}\" says no particles; write border:top, panel:NAME, "
                      "panel:NAME:border:top, box:x0,y0,z0:x1,y1,z1, or 0,5,7-12",
                      words));
    if (*from < 0 || *to > last || *from > *to)
      throw usage_problem(fmt::format("particles {} are not within 0 to {}", word, last));
    for (int i = *from; i <= *to; ++i) particles.insert(i);
  }
  return {particles.begin(), particles.end()};
}

}  // namespace

std::vector<int> select_particles(const ImportedMesh& mesh, const std::string& words) {
  const std::vector<std::string> parts = split(words, ':');
  if (parts[0] == "border" && parts.size() == 2) return on_border(mesh, mesh.triangles, parts[1]);
  if (parts[0] == "panel" && (parts.size() == 2 || (parts.size() == 4 && parts[2] == "border")))
    return of_panel(mesh, parts);
  if (parts[0] == "box" && parts.size() == 3) return in_box(mesh, parts[1], parts[2]);
  return by_number(mesh, words);
}

}  // namespace weft::client
