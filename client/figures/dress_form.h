#pragma once

#include <optional>
#include <span>
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

  bool operator==(const Measures&) const = default;
};

// Sizes of shops, by which bust, waist and hip girths follow from a number.
inline constexpr int kLeastFemaleSize = 32, kMostFemaleSize = 54;
inline constexpr int kLeastMaleSize = 42, kMostMaleSize = 62;
// A person of that size, even and within those of the figure: 40 of a woman has 0.92, 0.76 and
// 1.00 m, 50 of a man 1.00, 0.88 and 1.04 m, as German shops count.
Measures measures_of_size(FigureKind figure, int size);

// Whom a body or a garment is for.
struct Person {
  Measures measures{};
  std::optional<int> size{};  // gives the girths that are not given
};
// Throws Violation: no such size.
Measures measures_of(const Person& person);

// A length that a person may have.
struct LengthInfo {
  const char* name;  // "top_hip"
  std::optional<double> Measures::*value;
  const char* description;
  double least, most;  // m
};
std::span<const LengthInfo> person_lengths();
inline constexpr double kMostArmAngle = 70;  // degrees

// A standing figure with its feet at y = 0 that looks along z, without face, fingers or toes.
struct DressForm {
  struct Girth {
    std::string name;
    double wanted, found;  // m
    double height;         // where the tape lies, m
  };
  struct Arm {
    Vector3d top = Vector3d::Zero();        // its joint, of the left one, m
    Vector3d direction = Vector3d::Zero();  // to the hand, of length 1
    double length = 0;
    double radius = 0;  // of the upper arm, m
  };
  FigureMesh mesh;
  double stature = 0;  // m
  std::vector<Girth> girths;
  Arm arm;
  double neck_height = 0, neck_girth = 0;  // at its base, m

  const Girth& girth(const std::string& name) const;  // one of `girths`
};
DressForm make_dress_form(const Measures& measures);

}  // namespace weft::client
