#pragma once

#include <vector>

namespace weft {

// Particles that keep the height they start at, against gravity, while a garment is put on.
struct Hold {
  int sheet = 0;
  std::vector<int> particles;
  double until = 0.5;  // s after the seams are closed
};

// How garments are put on before they hang by themselves. Sheets of triangles have no strain where
// they start; while seams close, without weight, they are given their flat shape back, which draws
// together what lies between the panels. Then weight comes in.
struct Dressing {
  double close = 1;     // in which seams close, s
  double settle = 0.2;  // in which weight comes in, and bodies grow, s
  double drag = 20;     // of particles until it has, 1/s
  double deflate = 0;   // by which bodies are smaller while seams close, m
  std::vector<Hold> holds;

  // When nothing of it goes on, s.
  double end() const;
};

// What a dressing does at a time.
struct DressingState {
  double ease = 1;      // share of the way from the shape at the start to the flat one
  double weight = 1;    // share of gravity
  double friction = 1;  // share of that on colliders
  double drag = 0;      // 1/s, beside that of the textile
  double deflate = 0;   // m

  bool operator==(const DressingState&) const = default;
};
DressingState dressing_at(const Dressing& dressing, double time);

}  // namespace weft
