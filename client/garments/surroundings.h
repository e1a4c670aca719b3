#pragma once

#include <string>

#include "client/figures/dress_form.h"
#include "client/garments/draft.h"

namespace weft::client {

inline constexpr double kClear = 0.02;  // between the body and a panel beside it, m
inline constexpr const char* kSides[] = {"left", "right"};

// A label that ends in the wearer's side.
inline std::string of_side(const char* label, const std::string& side) {
  return label + ("-" + side);
}

// Where the body is, as far as panels have to know.
class Surroundings {
 public:
  explicit Surroundings(const DressForm& form) : form_(form) {}

  // Foremost, or with -1 hindmost point of what lies within `wide` of the middle between two
  // heights, m.
  double depth(double direction, double low, double high, double wide) const;
  // Highest point of the body near x, below the chin, m.
  double top(double x) const;
  // Where the legs part, m.
  double crotch() const;

 private:
  const DressForm& form_;
};

PanelPlace front_of(const Outline& outline, const Surroundings& body);
PanelPlace back_of(const Outline& outline, const Surroundings& body);

// A trapezoid on the body's middle.
Outline trapezoid(const char* lower, double low, double low_half, const char* upper, double high,
                  double high_half, bool front);
Outline band_outline(double half, double low, double height, bool front);

}  // namespace weft::client
