#pragma once

#include <Eigen/Geometry>
#include <limits>

#include "client/render/body.h"

namespace weft::client {

// Where it is seen from, degrees: around the vertical from the front to the right, and above the
// level.
struct Outlook {
  double azimuth = 30;
  double elevation = 20;
};

// Shares of a picture that stay free at its upper and lower edge.
struct Margins {
  double top = 0;
  double bottom = 0;
};

// Unit vectors: up, and two in the level, seen from the camera.
struct Directions {
  Eigen::Vector3d up, near, right;
};

// Up is against gravity; where there is none, y.
Directions directions_of(const Eigen::Vector3d& gravity, const Outlook& outlook);

// A pinhole camera.
struct Camera {
  Eigen::Vector3d place;
  Eigen::Vector3d forward, right, up;   // unit vectors
  double tangent_x = 0, tangent_y = 0;  // of half the angle of view

  // The direction through a point of the picture, -1 to 1 to the right and upwards.
  Eigen::Vector3d ray(double x, double y) const {
    return (forward + x * tangent_x * right + y * tangent_y * up).normalized();
  }

  // Led around an axis, and turned with it.
  Camera turned(const Eigen::AngleAxisd& turn, const Eigen::Vector3d& centre) const {
    return {centre + turn * (place - centre),
            turn * forward,
            turn * right,
            turn * up,
            tangent_x,
            tangent_y};
  }
};

// Finds the nearest place from which a camera that looks in a direction sees everything.
class CameraFit {
 public:
  // aspect: width over height of the picture
  CameraFit(const Directions& directions, const Outlook& outlook, double aspect,
            const Margins& margins);

  void add(const Ball& ball);
  Camera camera() const;

 private:
  // Half the picture to one side: how far its edge is beyond everything, for a camera at the
  // origin.
  struct Side {
    double tangent = 0;
    double most = -std::numeric_limits<double>::infinity();
  };

  Camera camera_;
  Side left_, right_, above_, below_;
};

}  // namespace weft::client
