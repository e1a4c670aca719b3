#pragma once

#include "core/triangles/rest_shape.h"

namespace weft {

// Curvatures at every particle, by least squares of a quadratic through it over its ring of
// neighbours; at the border over two rings, and where there are fewer than six, over those across
// the edges of the ring too: the whole second ring would be no better and cost twice. At a seam the
// triangles around it are laid flat beside each other first; there a particle has a fit for every
// direction of warp that meets in it.
std::vector<CurvatureFit> fit_curvature(const RestShape& shape);

}  // namespace weft
