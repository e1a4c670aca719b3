#pragma once

#include <Eigen/Geometry>
#include <cstring>
#include <string_view>
#include <vector>

#include "weft/v1/scene.pb.h"

// What messages hold, to compute with.
namespace weft::client {

inline Eigen::Vector3d vector_of(const v1::Vector3& value) {
  return {value.x(), value.y(), value.z()};
}

// Of unit length; none where the field is absent.
template <class Placed>
Eigen::Quaterniond rotation_of(const Placed& placed) {
  if (!placed.has_rotation()) return Eigen::Quaterniond::Identity();
  const v1::Rotation& given = placed.rotation();
  return Eigen::Quaterniond(given.w(), given.x(), given.y(), given.z()).normalized();
}

// Values of a bytes field; what is left over at its end is left out.
template <class Value>
std::vector<Value> values_of(std::string_view bytes) {
  std::vector<Value> values(bytes.size() / sizeof(Value));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(Value));
  return values;
}

}  // namespace weft::client
