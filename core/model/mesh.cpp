#include "core/model/mesh.h"

namespace weft {

void Connections::add(int i, int j) {
  ++size_;
  if (!runs_.empty() && runs_.back().apart == j - i) {
    Run& last = runs_.back();
    if (last.count == 1) last.step = i - last.first;
    if (i == last.first + last.count * last.step) {
      ++last.count;
      return;
    }
  }
  runs_.push_back({i, 0, j - i, 1});
}

bool resists_compression(const BendingLaw& bending) {
  const auto* isometric = std::get_if<Isometric>(&bending);
  return isometric != nullptr && isometric->resist_compression;
}

StartPositions::StartPositions(const SheetDefinition& sheet)
    : sheet_(sheet), rotation_(sheet.rotation.normalized().toRotationMatrix()) {}

Vector3d StartPositions::operator()(int particle) const {
  if (!sheet_.start_positions.empty())
    return Eigen::Map<const Vector3d>(sheet_.start_positions.data() + 3 * std::ptrdiff_t{particle});
  return sheet_.origin + rotation_ * local_position(sheet_.shape, particle);
}

Matrix3Xd start_positions(const SheetDefinition& sheet) {
  const StartPositions start(sheet);
  Matrix3Xd x(3, sheet.particle_count());
  for (int i = 0; i < sheet.particle_count(); ++i) x.col(i) = start(i);
  return x;
}

Matrix3Xd start_velocities(const SheetDefinition& sheet) {
  if (sheet.start_velocities.empty()) return Matrix3Xd::Zero(3, sheet.particle_count());
  return Eigen::Map<const Matrix3Xd>(sheet.start_velocities.data(), 3, sheet.particle_count());
}

}  // namespace weft
