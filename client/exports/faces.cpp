#include "client/exports/faces.h"

#include <algorithm>

namespace weft::client {

Faces faces_of(const SheetMesh& sheet) {
  Faces faces;
  const std::int32_t first = sheet.layout.first_particle();
  if (is_grid(sheet.layout)) {
    faces.corners = 4;
    for (const Quad& quad : quads_of(sheet.layout))
      faces.particles.insert(faces.particles.end(), quad.begin(), quad.end());
    for (const std::int32_t particle : faces.particles) faces.flat.push_back(particle - first);
    return faces;
  }
  for (std::size_t t = 0; t < sheet.triangles.size(); ++t) {
    for (const std::int32_t particle : sheet.triangles[t])
      faces.particles.push_back(first + particle);
    faces.flat.insert(faces.flat.end(), sheet.flat_triangles[t].begin(),
                      sheet.flat_triangles[t].end());
  }
  return faces;
}

bool have_panels(const std::vector<SheetMesh>& sheets) {
  return !std::all_of(sheets.begin(), sheets.end(),
                      [](const SheetMesh& sheet) { return is_grid(sheet.layout); });
}

std::vector<std::uint32_t> triangles_of(const Faces& faces) {
  std::vector<std::uint32_t> triangles;
  for (std::size_t face = 0; face < faces.particles.size(); face += faces.corners) {
    for (std::size_t last = 2; last < faces.corners; ++last)
      for (const std::size_t corner : {std::size_t{0}, last - 1, last})
        triangles.push_back(static_cast<std::uint32_t>(faces.particles[face + corner]));
  }
  return triangles;
}

}  // namespace weft::client
