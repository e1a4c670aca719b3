#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/model/shape.h"

namespace weft {

// Values of particles: (values of each x particles).
using Planes = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Values of the particles of a grid at those of another that lies over it, bicubic (Catmull-Rom);
// beyond the border as straight as there. Where both have a particle it keeps its bits.
Planes resample(const Planes& values, const Grid& from, const Grid& to);

// As frames show them.
std::vector<SheetShape> shown(const std::vector<SheetShape>& sheets);

// Values of the particles of all sheets, planes one after the other, at those that frames show.
std::vector<double> shown_values(const std::vector<double>& planes,
                                 const std::vector<SheetShape>& sheets);

}  // namespace weft
