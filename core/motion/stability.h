#pragma once

#include "core/model/mesh.h"

namespace weft {

// Steps up to which the linearized motion of a sheet does not grow, s; infinity where nothing
// limits.
struct StableStep {
  double linear_bound = 0;   // for every shape; 0: the integrator has none
  double estimate = 0;       // for the present shape
  double damping_ratio = 0;  // of the stiffest mode, 1 is critical
  // The same, of what connections damp alone; infinity where nothing is stiff.
  double connection_ratio = 0;
  int limiting_particle = -1;  // of a sheet of triangles: the one that the bound is for
};

// With K and C the stiffness and damping matrices, Verlet with extrapolated damping is stable while
// dt^2 K + 4 dt C < 4 M, with lagged damping while dt^2 K + 2 dt C < 4 M. The bound replaces K by
// the graph Laplacian of the largest stiffness of each connection, whatever its direction, and of
// triangles by diagonal matrices that bound theirs (surface_bound.h); the estimate takes the
// Jacobian at x. air_rate: damping by wind, 1/s. x: (3 x n) m; empty, of a lattice: without an
// estimate.
StableStep stable_step(const Mesh& mesh, const VectorXd& inverse_mass, IntegratorKind integrator,
                       double air_rate, const Matrix3Xd& x);

// The linear bound of triangles alone, in a fraction of the time, where each is strained by no more
// than kBoundStrain or as much as at x, s.
double linear_bound(const Mesh& mesh, const VectorXd& inverse_mass, IntegratorKind integrator,
                    double air_rate, const Matrix3Xd& x);

// How many times as long Verlet's linear bound is for shapes in which threads cross as in the flat
// one, however they are bent; 1 or more. flat: positions of a lattice in its plane (3 x n) m;
// triangles have their own.
double unsheared_gain(const Mesh& mesh, const VectorXd& inverse_mass, IntegratorKind integrator,
                      double air_rate, const Matrix3Xd& flat);

// The k_d with which the stiffest mode of a sheet that nothing holds has a damping ratio, kg/s; 0
// where nothing is stiff.
double damping_for(const Mesh& mesh, double ratio);

// The share of its linear bound up to which Verlet's step lets connections that switch between taut
// and slack (eq. 2) gain no energy, 1 or less. From campaigns of random sheets, see the page of
// `./dev bench stability`: at 0.9 of the bound growth begins below ratios of 1e-4 to 9e-4, at 0.45
// below 1e-4.
double safe_share(double connection_ratio);
// The share of its linear bound that a sheet's step may be: the solver's safety, or less where its
// damping bears less.
double borne_share(const SolverSettings& solver, const StableStep& stable);

// The share of what unsheared_gain() adds that may be taken: longer steps feed connections that
// switch and are damped little. From campaigns of random sheets, as safe_share() is.
double unsheared_share(const Mesh& mesh, double connection_ratio);

}  // namespace weft
