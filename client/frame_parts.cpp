#include "client/frame_parts.h"

#include <fmt/format.h>

#include "client/problem.h"
#include "client/recording/points.h"

namespace weft::client {

void FrameParts::begin(const v1::StreamHeader& header) {
  // three arrays of three numbers of each particle, and two of one; three of each triangle
  constexpr std::size_t kOfParticles = 3 * 3 + 2, kOfTriangles = 3;
  most_bytes_ =
      1024 + 2 * sizeof(double) *
                 (kOfParticles * particle_count(header) + kOfTriangles * triangle_count(header));
  frame_.Clear();
}

bool FrameParts::join(v1::Frame& part) {
  if (frame_.continued()) {
    const std::size_t bytes = frame_.ByteSizeLong() + part.ByteSizeLong();
    if (part.number() != frame_.number() || bytes > most_bytes_) {
      throw Problem(
          Exit::kRefused, "INTERNAL", "FRAME_INCOMPLETE",
          fmt::format("the server sent parts of frame {} that make no frame", frame_.number()));
    }
    frame_.mutable_positions_m()->append(part.positions_m());
    frame_.mutable_velocities_m_per_s()->append(part.velocities_m_per_s());
    frame_.mutable_normals()->append(part.normals());
    frame_.mutable_strain()->append(part.strain());
    frame_.mutable_pressure_pa()->append(part.pressure_pa());
    frame_.mutable_clearance_m()->append(part.clearance_m());
    frame_.set_continued(part.continued());
    part.Swap(&frame_);
  }
  if (!part.continued()) return true;
  frame_.Swap(&part);
  return false;
}

void TopologyParts::begin(const v1::StreamHeader& header) {
  header_ = header;
  topology_.clear();
  continued_ = false;
}

bool TopologyParts::join(v1::Topology& part) {
  const auto check = [&](bool sound) {
    if (sound) return;
    throw Problem(
        Exit::kRefused, "INTERNAL", "TOPOLOGY_UNREADABLE",
        fmt::format("the server sent triangles of sheet {} that make no sheet", part.sheet()));
  };
  check(part.sheet() == static_cast<int>(topology_.size()) - (continued_ ? 1 : 0) &&
        part.sheet() < header_.sheets_size());
  if (!continued_) topology_.emplace_back();
  continued_ = part.continued();
  v1::MeshData& mesh = topology_.back();
  mesh.mutable_triangles()->append(part.mesh().triangles());
  mesh.mutable_flat_m()->append(part.mesh().flat_m());
  mesh.mutable_flat_triangles()->append(part.mesh().flat_triangles());
  mesh.mutable_panels()->MergeFrom(part.mesh().panels());
  mesh.mutable_folds()->MergeFrom(part.mesh().folds());

  const v1::SheetLayout& sheet = header_.sheets(part.sheet());
  const std::size_t most = (particle_count(sheet) + 3 * triangle_count(sheet)) * 2 * sizeof(float);
  check(mesh.triangles().size() <= most && mesh.flat_m().size() <= most &&
        mesh.flat_triangles().size() <= most &&
        static_cast<std::size_t>(mesh.panels_size()) <= triangle_count(sheet) &&
        static_cast<std::size_t>(mesh.folds_size()) <= 3 * triangle_count(sheet));
  if (continued_) return false;
  check(is_sound(mesh, sheet));
  *part.mutable_mesh() = mesh;
  return true;
}

bool TopologyParts::is_complete() const {
  return !continued_ && topology_.size() == static_cast<std::size_t>(header_.sheets_size());
}

}  // namespace weft::client
