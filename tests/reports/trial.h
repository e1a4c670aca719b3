#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/model/mesh.h"
#include "core/simulation.h"

namespace weft::reports {

// Tropical wool, with a drag that a sheet in still air has.
inline constexpr MeasuredTextile kWool{.areal_density = 0.168,
                                       .tensile_warp = 2133,
                                       .tensile_weft = 1671,
                                       .shear = 26.17,
                                       .bend_rigidity_warp = 5.56e-6,
                                       .bend_rigidity_weft = 5.02e-6,
                                       .air_drag = 0.02};

// A scene that accuracy is measured in, on a square of 1 m.
struct Case {
  std::string name;
  int side = 0;               // particles
  Scene scene;                // frame step 1/60 s
  std::int64_t substeps = 0;  // of a frame, as planned for the defaults
  bool smooth = false;        // no connection switches, nothing is touched
  bool triangles = false;     // isometric, whatever a setting says of bending

  std::string title() const;
};

// k_d, kg/s. With a tenth of it connections chatter between slack and taut, and paths part.
inline constexpr double kDamping = 2e-2;

// hang, buckle, flag, sphere, box, and taut, the smooth one.
Case make_case(const std::string& name, int side, double damping = kDamping);
// hang, flag, sphere or box on triangles between moved points of that lattice.
Case make_triangle_case(const std::string& name, int side);

// How a case is computed.
struct Setting {
  ChoiKo law{};
  IntegratorKind integrator = IntegratorKind::kVerlet;
  Precision precision = Precision::kSingle;
  int finer = 1;       // substeps over the planned ones
  bool plain = false;  // one connection after the other, in double
};

// "32 segments", "exact".
std::string evaluator_name(const ChoiKo& law);
std::string integrator_name(IntegratorKind kind);

// Where a case stands after some frames.
struct Outcome {
  Matrix3Xd x;         // (3 x particles) m
  double energy = 0;   // kinetic, elastic and in gravity, J
  double time = 0;     // of one core for a simulated second, s
  double substep = 0;  // s
  bool finite = false;
};
Outcome run(const Case& given, const Setting& setting, int frames);
// What a scene states that states no more.
struct NamedAccuracy {
  const char* name;
  Accuracy accuracy;
  std::optional<StepBound> step_bound{};
  std::optional<IntegratorKind> integrator{};
  std::optional<double> self_weight_strain{};
  std::optional<int> slow_forces_every{};
  std::optional<BendingLaw> bending{};
};
Outcome run(const Case& given, const NamedAccuracy& stated, int frames);

// Frames, at most `most`, in which runs at the planned step and at half of it stay within 1 mm.
int calm_frames(const Case& given, int most);

// How far apart runs in single and in double precision are at the planned step (RMS), m.
double rounding(const Case& given, const BendingLaw& law, int frames);

double rms(const Matrix3Xd& difference);
double largest(const Matrix3Xd& difference);

// What a case comes to as the step goes to 0.
struct Truth {
  Matrix3Xd x;        // m
  double energy = 0;  // J
  double error = 0;   // RMS of what the extrapolation added to the finest run, m
  double order = 0;   // observed
};

// Richardson's extrapolation of runs with an 8th, a 16th and a 32nd of the planned step, in double,
// with a polynomial of degree 24 for the bending function; by Verlet, smooth cases by Runge-Kutta.
Truth find_truth(const Case& given, int frames);

// Largest relative error of the polynomial of degree 24 against the exact function.
double error_of_truths_bending();

}  // namespace weft::reports
