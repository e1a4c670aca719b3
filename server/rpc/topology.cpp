#include "server/rpc/topology.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>

#include "server/convert/mesh.h"
#include "server/rpc/bytes.h"
#include "weft/v1/frame.pb.h"

namespace weft {
namespace {

// So long that each fits into any message; a piece begins where the one before it ends.
std::vector<v1::Fold> pieces_of(const v1::Fold& fold) {
  constexpr int kMost = 200;  // edges
  std::vector<v1::Fold> pieces;
  for (int begin = 0; begin + 1 < fold.particles_size(); begin += kMost) {
    v1::Fold& piece = pieces.emplace_back();
    piece.set_angle_rad(fold.angle_rad());
    const auto first = fold.particles().begin() + begin;
    const int count = std::min(kMost + 1, fold.particles_size() - begin);
    piece.mutable_particles()->Assign(first, first + count);
  }
  return pieces;
}

// Its arrays and folds, joined, are the sheet's.
std::vector<v1::Topology> in_parts(v1::Topology whole, std::int64_t most_bytes) {
  constexpr std::size_t kRest = 64;  // sheet, tags and lengths
  constexpr std::size_t kTags = 8;   // of a panel or a fold
  const v1::MeshData mesh = std::move(*whole.mutable_mesh());
  std::size_t panels = 0;
  for (const v1::Panel& panel : mesh.panels()) panels += kTags + panel.ByteSizeLong();
  const auto most = static_cast<std::size_t>(most_bytes);
  const std::size_t room = std::max(most / 2, most - std::min(most, kRest + panels));
  whole.clear_mesh();
  std::vector<v1::Topology> parts{whole};
  *parts.back().mutable_mesh()->mutable_panels() = mesh.panels();
  std::size_t left = room;
  const auto begin_next = [&] {
    parts.back().set_continued(true);
    parts.push_back(whole);
    left = room;
  };
  const auto append = [&](const std::string& array, auto field) {
    for (std::size_t from = 0; from < array.size();) {
      if (left == 0) begin_next();
      const std::size_t count = std::min(left, array.size() - from);
      (parts.back().mutable_mesh()->*field)()->assign(array, from, count);
      from += count;
      left -= count;
    }
  };
  append(mesh.triangles(), &v1::MeshData::mutable_triangles);
  append(mesh.flat_m(), &v1::MeshData::mutable_flat_m);
  append(mesh.flat_triangles(), &v1::MeshData::mutable_flat_triangles);
  for (const v1::Fold& fold : mesh.folds())
    for (v1::Fold& piece : pieces_of(fold)) {
      const std::size_t bytes = kTags + piece.ByteSizeLong();
      if (left < bytes) begin_next();
      left -= std::min(left, bytes);
      *parts.back().mutable_mesh()->add_folds() = std::move(piece);
    }
  return parts;
}

}  // namespace

std::vector<grpc::ByteBuffer> encoded_topology(const std::vector<SheetShape>& sheets,
                                               std::int64_t most_bytes) {
  std::vector<grpc::ByteBuffer> messages;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    v1::Topology whole;
    whole.set_sheet(static_cast<int>(s));
    *whole.mutable_mesh() = topology_of(sheets[s]);
    for (v1::Topology& part : in_parts(std::move(whole), most_bytes)) {
      v1::StreamFramesResponse message;
      *message.mutable_topology() = std::move(part);
      messages.push_back(encoded(message));
    }
  }
  return messages;
}

}  // namespace weft
