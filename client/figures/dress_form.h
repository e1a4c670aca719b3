#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/figures/surface_nets.h"

namespace weft::client {

enum class FigureKind { kFemale, kMale };

// A person by the tape, girths as in ISO 8559-1, m. What is absent follows from the rest.
struct Measures {
  FigureKind figure = FigureKind::kFemale;
  std::optional<double> stature{}, bust{}, underbust{}, waist{}, top_hip{}, hip{};
  double arm_angle = 40;  // below the level, degrees
};

// A standing figure with its feet at y = 0 that looks along z, without face, fingers or toes.
struct DressForm {
  struct Girth {
    std::string name;
    double wanted, found;  // m
    double height;         // where the tape lies, m
  };
  FigureMesh mesh;
  double stature = 0;  // m
  std::vector<Girth> girths;
};
DressForm make_dress_form(const Measures& measures);

}  // namespace weft::client
