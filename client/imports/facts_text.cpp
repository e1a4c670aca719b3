#include <fmt/format.h>

#include <cmath>

#include "client/imports/mesh_facts.h"
#include "client/output/text.h"

namespace weft::client {
namespace {

constexpr std::size_t kLinesShown = 16;  // of panels, borders, seams

// Adds one line for each, as far as they are few.
template <class Each, class Text>
void add_lines(Facts& facts, const char* label, const std::vector<Each>& all, const Text& text) {
  for (std::size_t i = 0; i < std::min(all.size(), kLinesShown); ++i)
    facts.add(label, text(all[i], i));
  if (all.size() > kLinesShown)
    facts.add(label, fmt::format("... and {} more", all.size() - kLinesShown));
}

std::string border_text(const Border& border, std::size_t i) {
  const std::string number = fmt::format("border:{}", i + 1);
  return fmt::format(
      "{}: {:.4g} m, {}, around {}",
      border.name.empty() ? number : fmt::format("border:{}, {}", border.name, number),
      border.length, count_of(static_cast<std::int64_t>(border.particles.size()), "particle"),
      position_text(border.centre));
}

std::string sides_text(const MeshFacts& facts) {
  std::string text;
  for (const auto& [name, length] : facts.sides)
    text += fmt::format("{}border:{} {:.4g} m", text.empty() ? "" : ", ", name, length);
  return "edges that look there: " + text;
}

// A gather shows in the lengths of its sides.
std::string seam_text(const SeamFacts& seam) {
  constexpr double kEven = 0.02;
  const bool even = std::abs(seam.first_flat / seam.second_flat - 1) <= kEven;
  return fmt::format(
      "{} - {}: {:.4g} m{}", seam.first, seam.second, seam.length,
      even ? ""
           : fmt::format(", flat {:.4g} m sewn to {:.4g} m", seam.first_flat, seam.second_flat));
}

std::string scale_text(const Import& import) {
  if (!import.has_uv) return "none needed: the mesh is flat";
  const ScaleFound& found = *import.found;
  return fmt::format(
      "{:.6g} m for a unit of UV; lengths in space over those in UV are {:.4g}, "
      "{:.4g} to {:.4g} of nine edges in ten",
      import.flat_scale, found.median, found.low, found.high);
}

// Where space and UV do not go together.
std::vector<std::string> scale_notes(const Import& import) {
  constexpr double kSpread = 1.5, kApart = 0.1;
  std::vector<std::string> notes;
  if (!import.has_uv || import.found->median <= 0) return notes;
  const ScaleFound& found = *import.found;
  if (found.high > kSpread * found.low)
    notes.emplace_back(
        "the mesh is stretched beside its UV, or they have no common scale: check "
        "them, or give --flat-scale");
  if (std::abs(import.flat_scale / found.median - 1) > kApart)
    notes.push_back(
        fmt::format("at that scale the mesh begins {:.3g} times as long as its flat shape",
                    found.median / import.flat_scale));
  for (std::size_t p = 0; p < found.median_of_panel.size(); ++p) {
    const double ratio = found.median_of_panel[p] / found.median;
    if (ratio > 0 && std::abs(ratio - 1) > kApart)
      notes.push_back(fmt::format("panel {} is {:.3g} times as long beside its UV as the others",
                                  import.mesh.panels[p], ratio));
  }
  return notes;
}

}  // namespace

std::string facts_text(const Import& import, const MeshFacts& facts) {
  Facts lines;
  lines.add(
      "mesh",
      fmt::format("{}, {}, {} of {:.4g} x {:.4g} x {:.4g} m", count_of(facts.particles, "particle"),
                  count_of(facts.triangles, "triangle"), count_of(facts.pieces, "piece"),
                  facts.size.x(), facts.size.y(), facts.size.z()));
  lines.add("panels", import.mesh.panels_by.empty()
                          ? count_of(static_cast<std::int64_t>(facts.panels.size()), "panel")
                          : fmt::format("{}, by {}", facts.panels.size(), import.mesh.panels_by));
  add_lines(lines, "panels", facts.panels, [](const PanelFacts& panel, std::size_t) {
    return fmt::format("{}: {}, {:.4g} m^2, {:.4g} x {:.4g} m", panel.name,
                       count_of(panel.triangles, "triangle"), panel.area, panel.size.x(),
                       panel.size.y());
  });
  if (facts.borders.empty()) lines.add("borders", "none: it is closed");
  add_lines(lines, "borders", facts.borders, border_text);
  if (!facts.sides.empty()) lines.add("borders", sides_text(facts));
  add_lines(lines, "seams", facts.seams,
            [](const SeamFacts& seam, std::size_t) { return seam_text(seam); });
  lines.add("flat scale", scale_text(import));
  lines.add("lowest",
            fmt::format("the step goes with a triangle's least height; the median is {:.4g} mm",
                        facts.median_height * 1e3));
  for (const LowTriangle& each : facts.lowest)
    lines.add("lowest", fmt::format("{}: {:.4g} mm, {:.3g} times the substeps; {}", each.place,
                                    each.height * 1e3, each.cost, each.around));
  for (const std::string& note : import.mesh.notes) lines.add("note", note);
  for (const std::string& note : scale_notes(import)) lines.add("note", note);
  return lines.text();
}

Json facts_json(const Import& import, const MeshFacts& facts) {
  Json json{{"particles", facts.particles},
            {"triangles", facts.triangles},
            {"pieces", facts.pieces},
            {"size_m", {facts.size.x(), facts.size.y(), facts.size.z()}},
            {"flat_scale_m", import.flat_scale},
            {"panels", Json::array()},
            {"borders", Json::array()},
            {"seams", Json::array()},
            {"median_height_m", facts.median_height},
            {"lowest", Json::array()},
            {"notes", import.mesh.notes}};
  if (import.found)
    json["flat_scale_found"] = {
        {"median", import.found->median}, {"low", import.found->low}, {"high", import.found->high}};
  for (const PanelFacts& panel : facts.panels)
    json["panels"].push_back({{"name", panel.name},
                              {"triangles", panel.triangles},
                              {"area_m2", panel.area},
                              {"size_m", {panel.size.x(), panel.size.y()}}});
  for (const Border& border : facts.borders)
    json["borders"].push_back(
        {{"name", border.name},
         {"particles", border.particles.size()},
         {"length_m", border.length},
         {"center_m", {border.centre.x(), border.centre.y(), border.centre.z()}}});
  for (const SeamFacts& seam : facts.seams)
    json["seams"].push_back({{"panels", {seam.first, seam.second}},
                             {"length_m", seam.length},
                             {"flat_lengths_m", {seam.first_flat, seam.second_flat}}});
  for (const LowTriangle& each : facts.lowest)
    json["lowest"].push_back(
        {{"place", each.place}, {"height_m", each.height}, {"cost", each.cost}});
  for (const std::string& note : scale_notes(import)) json["notes"].push_back(note);
  return json;
}

}  // namespace weft::client
