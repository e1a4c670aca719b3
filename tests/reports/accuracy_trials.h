#pragma once

#include "tests/reports/report.h"

namespace weft::reports {

// Parts of the accuracy page that have runs of their own.

// What is lost where fewer rows and columns are simulated than frames show.
void interpolation(Page& page);
// What slow forces that act rarely cost in error.
void slow_forces(Page& page);
// How far runs at different steps are from each other as damping goes down.
void less_damping(Page& page);
// Where the paper's equations are wrong about cloth.
void model_errors(Page& page);

}  // namespace weft::reports
