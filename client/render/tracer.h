#pragma once

#include <memory>
#include <stop_token>
#include <vector>

#include "client/render/camera.h"
#include "client/render/picture.h"
#include "client/render/stage.h"

namespace weft::client {

// What the frames in a picture have in common.
struct Studio {
  Directions directions;
  Eigen::Vector3d centre;  // of what is shown, m
  double radius = 1;       // of it, m
  double grid = 0.1;       // cells on the ground, m
  HalfSpace ground;        // where the scene has no plane of its own

  Colouring colouring = Colouring::kCloth;
  double most = 0;        // value of the colour at the end of the ramp
  bool balanced = false;  // whether the ramp begins at -most, else at 0
};

// A part of a picture, pixels.
struct Area {
  int x = 0, y = 0, width = 0, height = 0;
};

// Traces the rays of pictures of a stage, by Embree: a sun of some width, and light from the sky
// where nothing hides it. Every sample is fixed, so equal stages make equal pictures.
class Tracer {
 public:
  Tracer(const Stage& stage, const Studio& studio);
  ~Tracer();

  // Throws a Problem when stopped.
  void draw(const Camera& camera, Picture& picture, const Area& area,
            const std::stop_token& stop) const;

 private:
  class Rays;
  std::unique_ptr<Rays> rays_;
};

// The colour of a share of a ramp, 0 to 1: of the one from 0 on, or of that around 0.
Colour ramp_colour(float share, bool balanced);

}  // namespace weft::client
