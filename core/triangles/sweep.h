#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/motion/step_motion.h"
#include "core/triangles/law.h"

namespace weft {

// A sheet of triangles in motion. Of every particle, four values of each, the last of them 0.
template <class T>
struct TriangleState {
  TriangleState(int particles, bool compensated, T velocity_lead = 3);

  T lead;  // of velocities, see lead_of()

  AlignedArray<T> x;        // position, m
  AlignedArray<T> w;        // lead d - (lead - 2) d_previous: velocity x 2 dt, m
  AlignedArray<T> d;        // displacement of the last step, m
  AlignedArray<T> x_error;  // what rounding has added to x, m; with compensation only, as the next
  AlignedArray<T> d_error;  // what rounding has added to d, m

  AlignedArray<T> turn;  // forces of hinges in this step, N; or empty

  // What follows from mass, drag and the step.
  AlignedArray<T> step2;  // dt^2 / mass, s^2/kg; 0 holds a particle
  AlignedArray<T> drag;   // c dt / m; or empty
  // What only sweeps need: the next x and w.
  AlignedArray<T> next_x, next_w;
  // A patch at work: its particles and those around them, tensions (a group of 0, then groups x 3 x
  // kLanes), pushes of wind on a triangle's corners. One for each band.
  struct PatchCopy {
    AlignedArray<T> x, w, tension, wind;
  };
  std::vector<PatchCopy> copies;
  // Lets go of these, until they are prepared; step2 and drag are then to be set.
  void release_memory();
  void prepare(const TriangleLaw<T>& law);
  void prepare(const TriangleLaw<T>& law, std::size_t bands);

  std::size_t size() const { return x.size(); }
};

// Along each axis: the largest displacement, and the largest change of one, m.
template <class T>
struct Farthest {
  std::array<T, 4> moved = {}, changed = {};
};

// One substep. Equal bits on every processor with FMA, and for every number of bands.
template <class T>
Largest<T> sweep(const TriangleLaw<T>& law, TriangleState<T>& state, int bands, ThreadPool& pool);

}  // namespace weft
