#pragma once

#include <array>

#include "core/model/scene.h"

namespace weft {

// Moving air, as it presses on triangles (see add_wind_forces()).
template <class T>
struct WindLaw {
  bool blows = false;
  std::array<T, 3> velocity{};  // of the air, m/s
  T to_velocity = 0;            // 1 / (6 dt): what the sum of three w is multiplied by, 1/s
  T pressure = 0;               // rho / 12, kg/m^3
  T drag = 0;                   // c_t / 6, kg/(m^2 s)
  T lag = 0;  // rho / 2 times give: u along the normal is felt as u / (1 + lag |u|)

  // To so many times what `once` has, in wind that blows. give: see add_wind_forces().
  void set_strength(const WindLaw& once, int times, double give) {
    const T gives = static_cast<T>(6 * give);
    pressure = static_cast<T>(times) * once.pressure;
    drag = static_cast<T>(times) * once.drag / (1 + gives * once.drag);
    lag = gives * once.pressure;
  }
};

template <class T>
WindLaw<T> make_wind_law(const Wind& wind) {
  WindLaw<T> law;
  law.blows = true;
  law.pressure = static_cast<T>(wind.air_density / 12);
  law.drag = static_cast<T>(wind.tangential_drag / 6);
  return law;
}

}  // namespace weft
