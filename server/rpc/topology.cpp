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

// Its arrays, joined, are the sheet's.
std::vector<v1::Topology> in_parts(v1::Topology whole, std::int64_t most_bytes) {
  constexpr std::size_t kRest = 64;  // sheet, tags and lengths
  const std::size_t panels = whole.ByteSizeLong() - whole.mesh().triangles().size() -
                             whole.mesh().flat_m().size() - whole.mesh().flat_triangles().size();
  const auto most = static_cast<std::size_t>(most_bytes);
  const std::size_t room = std::max(most / 2, most - std::min(most, kRest + panels));
  const v1::MeshData mesh = std::move(*whole.mutable_mesh());
  whole.clear_mesh();
  std::vector<v1::Topology> parts{whole};
  *parts.back().mutable_mesh()->mutable_panels() = mesh.panels();
  std::size_t left = room;
  const auto append = [&](const std::string& array, auto field) {
    for (std::size_t from = 0; from < array.size();) {
      if (left == 0) {
        parts.back().set_continued(true);
        parts.push_back(whole);
        left = room;
      }
      const std::size_t count = std::min(left, array.size() - from);
      (parts.back().mutable_mesh()->*field)()->assign(array, from, count);
      from += count;
      left -= count;
    }
  };
  append(mesh.triangles(), &v1::MeshData::mutable_triangles);
  append(mesh.flat_m(), &v1::MeshData::mutable_flat_m);
  append(mesh.flat_triangles(), &v1::MeshData::mutable_flat_triangles);
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
