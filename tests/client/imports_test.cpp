#include <gmock/gmock.h>

#include <cstring>
#include <numbers>

#include "client/imports/import.h"
#include "client/imports/mesh_data.h"
#include "client/imports/mesh_facts.h"
#include "client/imports/pins.h"
#include "client/imports/polygon.h"
#include "tests/client/mesh_files.h"

namespace weft::client {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::Ge;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using weft::testing::lattice_obj;
using weft::testing::LatticeFile;

template <class T>
std::vector<T> values(const std::string& bytes) {
  std::vector<T> result(bytes.size() / sizeof(T));
  std::memcpy(result.data(), bytes.data(), bytes.size());
  return result;
}

Import import_obj(const std::string& text, const ImportOptions& options = {}) {
  return import_mesh("mesh.obj", text, options);
}

// A square of 2 m that stands, its UV half as large.
const std::string kSquare =
    "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n"
    "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";

double flat_area(const ImportedMesh& mesh) {
  double area = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    area += signed_area(flat_corners(mesh, t));
  return area;
}

TEST(ObjImport, BecomesTheArraysOfTheInterface) {
  const v1::MeshData data = mesh_data(import_obj(kSquare).mesh, 0.25);
  EXPECT_THAT(values<float>(data.positions_m()), ElementsAre(0, 2, 2, 0, 0, 0, 2, 2, 0, 0, 0, 0));
  EXPECT_THAT(values<std::uint32_t>(data.triangles()), ElementsAre(0, 1, 2, 0, 2, 3));
  EXPECT_THAT(values<float>(data.flat_m()), ElementsAre(0, 2, 2, 0, 0, 0, 2, 2));
  EXPECT_EQ(data.flat_triangles(), "") << "corners are as particles";
  ASSERT_EQ(data.panels_size(), 1);
  EXPECT_EQ(data.panels(0).triangle_count(), 2);
  EXPECT_EQ(data.panels(0).grain_rad(), 0.25);
}

TEST(ObjImport, CountsFromTheEndToo) {
  const Import import =
      import_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf -3/-3 -2/-2 -1/-1\n");
  EXPECT_THAT(import.mesh.triangles, ElementsAre(std::array{0, 1, 2}));
}

TEST(ObjImport, CutsPolygonsIntoTriangles) {
  const auto cut = [](std::vector<Vector3d> corners) { return cut_polygon(corners); };
  // a kite, along its shorter diagonal
  EXPECT_THAT(cut({{0, 0, 0}, {3, -1, 0}, {9, 0, 0}, {3, 1, 0}}),
              ElementsAre(std::array{3, 0, 1}, std::array{1, 2, 3}));
  // a dart, whose shorter diagonal runs outside
  for (const auto& triangle : cut({{0, 0, 0}, {5, 4, 0}, {1, 0, 0}, {5, -4, 0}}))
    EXPECT_THAT(triangle, AllOf(Contains(0), Contains(2)));
  // an L, hollow at its corner
  const Import l =
      import_obj("v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 1 2 3 4 5 6\n");
  EXPECT_THAT(l.mesh.triangles, SizeIs(4));
  EXPECT_NEAR(flat_area(l.mesh), 3, 1e-12);
}

TEST(ObjImport, MakesPanelsOfGroupsElseOfMaterialsElseOfObjects) {
  const std::string points = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
  const std::string one = "f 1/1 2/2 3/3\n", other = "f 1/1 3/3 4/4\n";
  const auto panels = [&](const std::string& first, const std::string& second) {
    const Import import = import_obj(points + first + one + second + other);
    return import.mesh.panels_by + ":" + import.mesh.panels[0] + "," + import.mesh.panels.back();
  };
  EXPECT_EQ(panels("g Front left\nusemtl red\n", "g Back\nusemtl blue\n"), "g:front_left,back");
  EXPECT_EQ(panels("g all\nusemtl red\no a\n", "usemtl blue\no b\n"), "usemtl:red,blue");
  EXPECT_EQ(panels("o a\n", "o b\n"), "o:a,b");
  EXPECT_EQ(panels("g \xC3\xA9\n", "g \xC3\xA8\n"), "g:__,__-2");
}

TEST(ObjImport, PutsTrianglesOfAPanelTogetherAndKeepsParticlesInOrder) {
  const Import import = import_obj(
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 2 0\n"
      "g a\nf 1/1 2/2 3/3\ng b\nf 2/2 5/5 3/3\ng a\nf 1/1 3/3 4/4\n");
  EXPECT_THAT(import.mesh.panel, ElementsAre(0, 0, 1));
  EXPECT_THAT(import.mesh.triangles,
              ElementsAre(std::array{0, 1, 2}, std::array{0, 2, 3}, std::array{1, 4, 2}));
  EXPECT_EQ(place(import.mesh, 2), "line 14 (face 2)");
  EXPECT_EQ(import.mesh.positions[4], Vector3d(2, 0, 0));
}

TEST(ObjImport, KnowsPlacesOfUvThatAreWrittenTwice) {
  const Import import = import_obj(
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
      "vt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\n"
      "vt 0 0\nvt 1 1\nvt 0 1\nf 1/4 3/5 4/6\n");
  EXPECT_THAT(facts_of(import).seams, IsEmpty());
  EXPECT_EQ(import.mesh.corners, import.mesh.triangles);
}

TEST(ObjImport, FindsASeamWhereCornersOfTheFlatShapeDiffer) {
  const Import import = import_obj(
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
      "vt 0 0\nvt 1 0\nvt 1 1\nvt 5 0\nvt 6 1\nvt 5 1\n"
      "f 1/1 2/2 3/3\nf 1/4 3/5 4/6\n");
  const MeshFacts facts = facts_of(import);
  ASSERT_THAT(facts.seams, SizeIs(1));
  EXPECT_NEAR(facts.seams[0].length, std::numbers::sqrt2, 1e-12);
  EXPECT_THAT(import.mesh.panels, ElementsAre("piece-1", "piece-2")) << "as the file names none";
  EXPECT_NE(mesh_data(import.mesh, 0).flat_triangles(), "");
}

TEST(MeshScale, ComparesLengthsInSpaceWithThoseInUv) {
  EXPECT_EQ(import_obj(kSquare).flat_scale, 2);
  EXPECT_EQ(import_obj(kSquare, {.flat_scale = 3.0}).flat_scale, 3);
  EXPECT_EQ(import_obj(kSquare, {.unit_m = 0.01}).flat_scale, 0.02);
  EXPECT_NEAR(flat_area(import_obj(kSquare, {.flat_scale = 3.0}).mesh), 9, 1e-12);
}

TEST(MeshScale, TakesAUnitWhereItIsNear) {
  EXPECT_EQ(rounded_scale(1.004), 1);
  EXPECT_EQ(rounded_scale(0.00996), 0.01);
  EXPECT_EQ(rounded_scale(1.02), 1.02);
}

TEST(MeshScale, TellsOfUvThatAreSqueezed) {
  std::string squeezed = kSquare;
  squeezed.replace(squeezed.find("vt 1 1\nvt 0 1"), 13, "vt 1 9\nvt 0 9");
  const Import import = import_obj(squeezed);
  EXPECT_THAT(facts_text(import, facts_of(import)), HasSubstr("give --flat-scale"));
}

TEST(MeshUnits, TurnAndScalePositions) {
  const Import import = import_obj(lattice_obj({}), {.unit_m = 0.01, .z_up = true});
  // written at (x, y) = (4, 4), z = 0
  EXPECT_LT((import.mesh.positions.back() - Vector3d(0.04, 0, -0.04)).norm(), 1e-12);
  const Import large = import_obj(lattice_obj({.spacing = 20}));
  EXPECT_THAT(large.mesh.notes, Contains(HasSubstr("looks like cm")));
}

TEST(MeshWithoutUv, IsFlatWhereItLiesInAPlane) {
  const Import import = import_obj(lattice_obj({.uv = false}));
  EXPECT_FALSE(import.has_uv);
  EXPECT_NEAR(flat_area(import.mesh), 16, 1e-12);
  // u to the right, v up
  EXPECT_LT((import.mesh.flat.back() - import.mesh.flat[0] - Vector2d(4, 4)).norm(), 1e-12);
}

TEST(MeshUv, ThatAreMirroredAreTurnedOverAboutTheWarp) {
  const Import right = import_obj(lattice_obj({}));
  const Import mirrored = import_obj(lattice_obj({.mirrored = true}));
  EXPECT_THAT(mirrored.mesh.notes, Contains(HasSubstr("1 piece of the UV turned over")));
  EXPECT_GT(flat_area(mirrored.mesh), 15.9);
  EXPECT_LT((mirrored.mesh.flat.back() - right.mesh.flat.back()).norm(), 1e-12);

  // what lies along a warp of 30 degrees stays there
  const double grain = std::numbers::pi / 6;
  const Import turned = import_obj(lattice_obj({.mirrored = true}), {.grain_rad = grain});
  const Vector2d warp(-std::sin(grain), std::cos(grain));
  const Vector2d before(-4, 4), after = turned.mesh.flat.back();
  EXPECT_NEAR(after.dot(warp), before.dot(warp), 1e-12);
}

TEST(MeshPoints, ThatNoTriangleHasAreLeftOut) {
  const Import import = import_obj("v 9 9 9\n" + lattice_obj({.first = 1}));
  EXPECT_THAT(import.mesh.positions, SizeIs(25));
  EXPECT_THAT(import.mesh.notes, Contains("1 point left out that no triangle has"));
}

TEST(MeshPieces, MayLieApartAndTheirUvOverEachOther) {
  const Import import =
      import_obj(lattice_obj({}) + "g second\n" + lattice_obj({.z = 1, .first = 25}));
  const MeshFacts facts = facts_of(import);
  EXPECT_EQ(facts.pieces, 2);
  EXPECT_THAT(facts.panels, SizeIs(2));
  EXPECT_THAT(facts_text(import, facts), HasSubstr("2 pieces"));
}

TEST(MeshFacts, NameTheTrianglesThatKeepTheStepShort) {
  LatticeFile file;
  file.moved = {{12, {2.9, 2}}};  // of the middle, towards its right neighbour
  const Import import = import_obj(lattice_obj(file));
  const MeshFacts facts = facts_of(import);
  EXPECT_NEAR(facts.lowest[0].height, 0.1 / std::numbers::sqrt2, 1e-9);
  EXPECT_NEAR(facts.lowest[0].cost, facts.median_height / facts.lowest[0].height, 1e-12);
  EXPECT_THAT(facts.lowest[0].place, HasSubstr("line "));
}

TEST(MeshBorders, OfOnePieceAreNamedByWhereTheirEdgesLook) {
  const Import import = import_obj(lattice_obj({}));
  const auto pinned = [&](const char* words) { return select_particles(import.mesh, words); };
  EXPECT_THAT(pinned("border:top"), ElementsAre(20, 21, 22, 23, 24));
  EXPECT_THAT(pinned("border:bottom"), ElementsAre(0, 1, 2, 3, 4));
  EXPECT_THAT(pinned("border:left"), ElementsAre(0, 5, 10, 15, 20));
  EXPECT_THAT(pinned("border:right"), ElementsAre(4, 9, 14, 19, 24));
  EXPECT_THAT(pinned("border:1"), SizeIs(16));
  const MeshFacts facts = facts_of(import);
  ASSERT_THAT(facts.borders, SizeIs(1));
  EXPECT_NEAR(facts.borders[0].length, 16, 1e-12);
}

TEST(MeshBorders, OfALevelMeshAreSeenFromAbove) {
  const Import import = import_obj(lattice_obj({}), {.z_up = true});
  EXPECT_THAT(select_particles(import.mesh, "border:top"), ElementsAre(20, 21, 22, 23, 24));
}

TEST(MeshBorders, OfATubeAreItsEnds) {
  const Import import = import_obj(weft::testing::tube_obj());
  const MeshFacts facts = facts_of(import);
  ASSERT_THAT(facts.borders, SizeIs(2));
  for (const char* name : {"top", "bottom"})
    EXPECT_THAT(select_particles(import.mesh, std::string("border:") + name), SizeIs(12)) << name;
  const std::vector<int> top = select_particles(import.mesh, "border:top");
  for (const int i : top) EXPECT_EQ(import.mesh.positions[as_index(i)].y(), 1);
}

TEST(MeshPins, TakeNumbersPanelsAndBoxes) {
  const Import import = import_obj(lattice_obj({.panels = true}));
  const auto pinned = [&](const char* words) { return select_particles(import.mesh, words); };
  EXPECT_THAT(pinned("3,0,6-8"), ElementsAre(0, 3, 6, 7, 8));
  EXPECT_THAT(pinned("box:3.5,3.5,-1:9,9,1"), ElementsAre(24));
  EXPECT_THAT(pinned("panel:left"), SizeIs(15));
  EXPECT_THAT(pinned("panel:left:border:right"), ElementsAre(2, 7, 12, 17, 22));
}

TEST(MeshPins, SayWhatThereIsInstead) {
  const ImportedMesh mesh = import_obj(lattice_obj({.panels = true})).mesh;
  const auto refusal = [&](const char* words) -> std::string {
    try {
      select_particles(mesh, words);
    } catch (const Problem& problem) {
      EXPECT_EQ(problem.exit, Exit::kUsage);
      return problem.what();
    }
    return "";
  };
  EXPECT_THAT(refusal("border:collar"), HasSubstr("top, bottom, left, right"));
  EXPECT_THAT(refusal("border:2"), HasSubstr("1 to 1"));
  EXPECT_THAT(refusal("panel:sleeve"), HasSubstr("left, right"));
  EXPECT_THAT(refusal("box:5,5,5:6,6,6"), HasSubstr("no particle"));
  EXPECT_THAT(refusal("box:1,2:3,4"), HasSubstr("no point x,y,z"));
  EXPECT_THAT(refusal("0,25"), HasSubstr("0 to 24"));
  EXPECT_THAT(refusal("shoulders"), HasSubstr("border:top"));
}

}  // namespace
}  // namespace weft::client
