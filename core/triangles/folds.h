#pragma once

#include <vector>

#include "core/model/mesh.h"
#include "core/triangles/rest_shape.h"

namespace weft {

// A fold is a strip that wide whose textile is curved at rest, m.
inline constexpr double kFoldWidth = 2e-3;

// The edges that folds lie along, those without stiffness left out. bend: of each panel.
// Precondition: find_problems() has none about the folds.
std::vector<Hinge> make_hinges(const RestShape& shape, const std::vector<Fold>& folds,
                               const std::vector<BendStiffness>& bend);

// fit_curvature(), where no fit reaches across a fold.
std::vector<CurvatureFit> fit_curvature(const RestShape& shape, const std::vector<Fold>& folds);

}  // namespace weft
