#include "client/imports/flat_overlap.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

#include "client/imports/flat_shape.h"

namespace weft::client {
namespace {

constexpr std::size_t kMostOverlaps = 100;
constexpr double kTouch = 1e-5;  // how deep rounded neighbours may lie in each other, of an edge

// Whether all of b lies outside an edge of a; both run anticlockwise.
bool is_apart(const FlatCorners& a, const FlatCorners& b) {
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector2d edge = a[(k + 1) % 3] - a[k];
    const double most = kTouch * edge.squaredNorm();
    const bool outside = std::all_of(b.begin(), b.end(), [&](const Vector2d& p) {
      const Vector2d to = p - a[k];
      return edge.x() * to.y() - edge.y() * to.x() <= most;
    });
    if (outside) return true;
  }
  return false;
}

struct Piece {
  Eigen::AlignedBox2d box;
  FlatCorners corners;
  int triangle, island;
};

}  // namespace

std::vector<std::pair<int, int>> find_overlaps(const ImportedMesh& mesh) {
  std::vector<int> island;
  find_islands(mesh, island);
  std::vector<Piece> pieces(mesh.triangles.size());
  for (std::size_t t = 0; t < pieces.size(); ++t) {
    pieces[t].corners = flat_corners(mesh, t);
    for (const Vector2d& corner : pieces[t].corners) pieces[t].box.extend(corner);
    pieces[t].triangle = static_cast<int>(t);
    pieces[t].island = island[t];
  }
  std::stable_sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) {
    return a.island != b.island ? a.island < b.island : a.box.min().x() < b.box.min().x();
  });

  // along u, those that a triangle may still meet
  std::vector<std::pair<int, int>> overlaps;
  std::vector<const Piece*> open;
  for (const Piece& piece : pieces) {
    std::erase_if(open, [&](const Piece* each) {
      return each->island != piece.island || each->box.max().x() <= piece.box.min().x();
    });
    for (const Piece* each : open) {
      if (each->box.max().y() <= piece.box.min().y() || each->box.min().y() >= piece.box.max().y())
        continue;
      if (is_apart(each->corners, piece.corners) || is_apart(piece.corners, each->corners))
        continue;
      overlaps.emplace_back(std::min(each->triangle, piece.triangle),
                            std::max(each->triangle, piece.triangle));
      if (overlaps.size() == kMostOverlaps) return overlaps;
    }
    open.push_back(&piece);
  }
  return overlaps;
}

}  // namespace weft::client
