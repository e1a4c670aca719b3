#include "core/frame_values.h"
#include "core/simulation_state.h"

namespace weft {
namespace {

// Of all sheets, into planes x, y, z.
void copy_planes(const std::vector<MovingSheet>& sheets, Matrix3Xd SheetState::*values,
                 std::span<double> out) {
  const auto plane = static_cast<Eigen::Index>(out.size() / 3);
  Eigen::Index first = 0;
  for (const MovingSheet& sheet : sheets) {
    const Matrix3Xd& from = sheet.good().*values;
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      Eigen::Map<Eigen::RowVectorXd>(out.data() + axis * plane + first, from.cols()) =
          from.row(axis);
    first += from.cols();
  }
}

}  // namespace

void Simulation::copy_positions(std::span<double> out) const {
  state_->restore_memory();
  copy_planes(state_->sheets, &SheetState::x, out);
}

void Simulation::copy_velocities(std::span<double> out) const {
  state_->restore_memory();
  copy_planes(state_->sheets, &SheetState::v, out);
}

std::shared_ptr<const Scene> Simulation::scene_of_frame() const {
  auto& shared = state_->scene_of_frame;
  if (shared) return shared;
  Scene scene = state_->scene;
  for (SheetDefinition& sheet : scene.sheets) {
    sheet.start_velocities = {};
    if (!scene.dressing) sheet.start_positions = {};  // else seams close from there
  }
  return shared = std::make_shared<const Scene>(std::move(scene));
}

VectorXd Simulation::pressures(std::size_t sheet) const {
  state_->restore_memory();
  state_->bodies.place(state_->scene.colliders, time(), 0);
  const MovingSheet& moving = state_->sheets[sheet];
  return weft::pressures(state_->scene, state_->bodies, state_->scene.sheets[sheet], moving,
                         moving.good().x, time());
}

Verdict Simulation::verdict() const {
  state_->restore_memory();
  state_->bodies.place(state_->scene.colliders, time(), 0);
  return judge(state_->scene, state_->bodies, state_->sheets, time(), at_rest());
}

double Simulation::kinetic_energy() const {
  double sum = 0;
  for (const MovingSheet& sheet : state_->sheets) sum += sheet.good().kinetic_energy;
  return sum;
}

std::optional<std::int64_t> Simulation::cloth_cuts() const {
  if (!state_->scene.cloth_contact) return std::nullopt;
  state_->restore_memory();
  return state_->cloth_contact->count_cuts(state_->sheets);
}

Deformation Simulation::deformation() const {
  state_->restore_memory();
  Deformation all;
  for (const MovingSheet& sheet : state_->sheets) add(sheet, sheet.good().x, all);
  return all;
}

FrameStats Simulation::stats() const { return {deformation(), kinetic_energy(), cloth_cuts()}; }

}  // namespace weft
