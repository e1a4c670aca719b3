#pragma once

#include <string>
#include <vector>

#include "client/figures/dress_form.h"
#include "weft/v1/garment.pb.h"

namespace weft::client {

// Of T-shirts, and of patterns that nothing is known about.
inline constexpr const char* kUsualTextile = "jersey_interlock";

struct GarmentInfo {
  std::string name;
  std::string description;
  std::string textile;   // that it is usually made of
  double deflate_m = 0;  // by which bodies want to be smaller while it is put on
};
std::vector<GarmentInfo> garment_templates();

// A pattern for who has the form's measures, placed around it so that nothing starts inside.
// Throws a Problem: no such template.
v1::Pattern make_garment(const std::string& name, const DressForm& form);
// The same with a form made for them.
v1::Pattern make_garment(const std::string& name, const Measures& measures);

}  // namespace weft::client
