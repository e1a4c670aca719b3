#include "core/motion/guard.h"

#include <algorithm>
#include <cmath>

#include "core/forces/elastic.h"
#include "core/model/text.h"

namespace weft {
namespace {

// False for NaN too.
bool within_reach(const Matrix3Xd& values) {
  if (values.squaredNorm() <= kFarthest * kFarthest) return true;
  bool within = true;
  for (const double value : values.reshaped()) within &= std::abs(value) <= kFarthest;
  return within;
}

double path_speed(const Path& path, double begin, double end) {
  double speed = 0;
  for (std::size_t k = 1; k < path.size(); ++k) {
    if (path[k].time <= begin || path[k - 1].time >= end) continue;
    speed = std::max(
        speed, (path[k].offset - path[k - 1].offset).norm() / (path[k].time - path[k - 1].time));
  }
  return speed;
}

bool close(double one, double other) {
  return std::abs(one - other) <= 0.25 * std::max(std::abs(one), std::abs(other));
}

}  // namespace

double kinetic_energy(const Mesh& mesh, const Matrix3Xd& v) {
  double twice = 0;
  for (Eigen::Index i = 0; i < v.cols(); ++i) twice += mesh.mass[i] * v.col(i).squaredNorm();
  return twice / 2;
}

double motion_speed(const Scene& scene, const SheetDefinition& sheet, double begin, double end) {
  double speed = 0;
  for (const SheetDefinition& each : scene.sheets)
    if (&each == &sheet || scene.cloth_contact)
      for (const Pin& pin : each.pins) speed = std::max(speed, path_speed(pin.path, begin, end));
  for (const Collider& collider : scene.colliders) {
    speed =
        std::max(speed, path_speed(collider.path, begin, end) + pose_speed(collider, begin, end));
  }
  // seams pull panels along
  constexpr double kClosing = 1;  // m/s
  if (scene.dressing && begin < scene.dressing->close + scene.dressing->settle)
    speed = std::max(speed, kClosing);
  return speed;
}

double wind_speed(const Scene& scene) {
  const auto& wind = scene.environment.wind;
  return wind ? wind->velocity.norm() * (1 + wind->gust) : 0;
}

double drive_speed(const Scene& scene, const SheetDefinition& sheet, double begin, double end) {
  return std::max(motion_speed(scene, sheet, begin, end), wind_speed(scene));
}

Inspection inspect_finite(const SheetState& after) {
  Inspection found;
  found.finite = within_reach(after.x) && within_reach(after.v);
  if (!found.finite) found.reason = "a position or velocity stopped being finite";
  return found;
}

Inspection inspect(const Mesh& mesh, const Drive& drive, double most_strain,
                   const SheetState& before, const SheetState& after) {
  Inspection found = inspect_finite(after);
  if (!found.finite) return found;

  found.strain = largest_strain(mesh, after.x);
  if (found.strain > most_strain)
    found.reason = join("a strain of ", 100 * found.strain, " % passed the limit of ",
                        100 * most_strain, " %");

  // energy cannot have grown much unless motion did
  const double mass = mesh.mass.sum();
  const double fall = drive.gravity.norm() * drive.frame_step;
  const double speed = std::max(drive.speed, kStillSpeed);
  const double driven = 10 * mass * (speed * speed + fall * fall) + drive.given;  // J
  const double kinetic = after.kinetic_energy, kinetic_before = before.kinetic_energy;
  if (kinetic <= 2 * kinetic_before + driven && found.reason.empty()) return found;
  const double elastic_before = elastic_energy(mesh, before.x);
  const double weight_work = mesh.mass.dot((after.x - before.x).transpose() * drive.gravity);
  const double grown =
      kinetic - kinetic_before + elastic_energy(mesh, after.x) - elastic_before - weight_work;
  const double limit = kinetic_before + elastic_before + driven;
  found.energy = kinetic_before + elastic_before + grown;
  if (grown > limit && found.reason.empty())
    found.reason = join("energy grew by ", grown, " J in a frame, past the limit of ", limit, " J");
  return found;
}

bool confirms(const Inspection& one, const Inspection& other) {
  return one.finite && other.finite && close(one.strain, other.strain) &&
         close(one.energy, other.energy);
}

}  // namespace weft
