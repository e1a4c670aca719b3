#pragma once

#include <vector>

#include "client/recording/points.h"
#include "client/render/body.h"
#include "weft/v1/scene.pb.h"

// What pictures of a grid have that those of other sheets lack: it is drawn smoother than its
// particles are dense, and its bending is what the solver has of it.
namespace weft::client {

// Of a cell along each side, so that a frame has no more cells than are seen.
int pieces_of(const v1::StreamHeader& header);

// The grid with each cell in so many pieces along each side.
v1::SheetLayout divided(const v1::SheetLayout& sheet, int pieces);

// Values of its particles: smooth by bicubic interpolation (Catmull and Rom), else linear.
std::vector<double> divided(const v1::SheetLayout& sheet, std::vector<double> values, int pieces,
                            bool smooth);

// Points between the particles, led out of bodies that the particles themselves keep off.
Points divided(const v1::SheetLayout& layout, const v1::Sheet& sheet, const Points& points,
               int pieces, const std::vector<Body>& bodies);

// Of each particle, J/m^2: of the curvatures along warp and weft and of the twist, by the
// rigidities of the textile. Differences as in the isometric law; a particle's twist is the mean of
// its cells.
std::vector<double> bending_of(const v1::SheetLayout& layout, const v1::Sheet& sheet,
                               const Points& points);

}  // namespace weft::client
