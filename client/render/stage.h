#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "client/exports/normals.h"
#include "client/recording/points.h"
#include "client/recording/reader.h"
#include "client/render/body.h"

namespace weft::client {

// What the cloth's colours mean.
enum class Colouring {
  kCloth,   // nothing: a front and a back
  kPanels,  // the panel, or the sheet that has none
  kStrain,  // see Strain
  kWarp,
  kWeft,
  kShear,
  kSpeed,    // m/s, on the way from the frame before; of the first frame 0
  kBending,  // energy, J/m^2, whatever the bending law: of the curvatures along warp and weft and
             // of the twist, by the rigidities that the textile had when the recording began
};

// A sheet as it is drawn: a grid between its particles too, see client/render/lattice.h; other
// triangles as they are.
struct Surface {
  Points points;
  std::vector<std::array<float, 3>> normals;
  std::vector<float> values;  // of the colouring
  std::vector<std::uint32_t> triangles;
  std::vector<int> panels;  // of each triangle, counted over all sheets
};

// A frame of a recording in space. Bodies stand where their paths lead; those that actions moved
// are not in a recording.
struct Stage {
  std::vector<Surface> surfaces;
  std::vector<Body> bodies;
  std::int64_t frame = 0;
  double time_s = 0;
};

Stage read_stage(RecordingReader& recording, std::int64_t number, Colouring colouring);

}  // namespace weft::client
