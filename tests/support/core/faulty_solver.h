#pragma once

#include "core/simulation.h"

namespace weft::testing {

// A fault that strikes a sheet while a frame is computed.
struct Fault {
  std::int64_t frame = 1;
  int times = 1;    // attempts at that frame, and at later ones, that it strikes
  double jump = 0;  // one particle's displacement in a step, m
};

// Solvers as ever, but for the fault.
SolverFactory faulty_solvers(const Fault& fault);

}  // namespace weft::testing
