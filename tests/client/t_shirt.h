#pragma once

#include <string>

namespace weft::testing {

// How a T-shirt is written to an OBJ file.
struct TShirt {
  double spacing = 0.0155;  // m; about 3500 points
  double uv_unit = 1;       // m for a unit of UV
};

// A T-shirt of two panels, g front and g back, sewn at the shoulders, under the arms and at the
// sides, with a piece of UV each: 0.52 m wide, 0.7 m high, sleeves of 0.16 m, open at neck, hem and
// cuffs. The back lies beside the front as it is seen from behind.
std::string t_shirt_obj(const TShirt& shirt = {});

}  // namespace weft::testing
