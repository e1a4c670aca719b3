#pragma once

#include <cstddef>

#include "core/plan.h"

namespace weft {

// What a plan says of a sheet of triangles: its passes, and what its mesh costs or lacks.
void describe_surface(const SheetDefinition& sheet, const Mesh& mesh, Plan& plan);
void warn_of_triangles(const Scene& scene, std::size_t index, const PlannedSheet& planned,
                       int limiting_particle, Plan& plan);

}  // namespace weft
