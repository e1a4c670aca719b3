#include <gmock/gmock.h>

#include <cmath>

#include "client/imports/import.h"
#include "client/imports/mesh_facts.h"
#include "tests/client/mesh_files.h"

namespace weft::client {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;
using weft::testing::lattice_obj;
using weft::testing::LatticeFile;

// What is said of a file that cannot be used, a line for each reason.
std::string refusal(const std::string& text, const ImportOptions& options = {},
                    const std::string& path = "mesh.obj") {
  try {
    import_mesh(path, text, options);
  } catch (const Problem& problem) {
    EXPECT_EQ(problem.exit, Exit::kFile);
    EXPECT_EQ(problem.reason, "FILE_MALFORMED");
    std::string said = problem.what();
    for (const auto& [place, what] : problem.violations) said += "\n" + place + ": " + what;
    return said;
  }
  return "";
}

const std::string kPoints =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\n"
    "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";  // 9 lines

TEST(MeshFaults, OfNumbersAreNamedByTheirLine) {
  EXPECT_THAT(refusal("v 0 0 0\nv nan 0 0\n"),
              HasSubstr("line 2: x, y and z are not 3 finite numbers"));
  EXPECT_THAT(refusal("v 0 0 inf\n"), HasSubstr("line 1"));
  EXPECT_THAT(refusal("v 0 0\n"), HasSubstr("line 1"));
  EXPECT_THAT(refusal("v 1e999 0 0\n"), HasSubstr("line 1"));
  EXPECT_THAT(refusal("v 0,5 0 0\n"), HasSubstr("line 1"));
  EXPECT_THAT(refusal("# points\r\nvt 0 oops\r\n"), HasSubstr("line 2: u and v are not 2 finite"));
  EXPECT_EQ(refusal("v +0.5 1e-3 .5 1.0 # four\nv 1 0 0\nv 0 1 .5\nvt 0 0 0\nvt 1 0\nvt 0 1\nf 1/1 "
                    "2/2 3/3\n"),
            "");
}

TEST(MeshFaults, OfIndicesAreNamedByTheirFace) {
  EXPECT_THAT(refusal(kPoints + "f 1/1 2/2 3/3\nf 1 2 9\n"),
              HasSubstr("line 11 (face 2): vertex 9 is not one of the 5 before it"));
  EXPECT_THAT(refusal(kPoints + "f 1 2 0\n"), HasSubstr("vertex 0"));
  EXPECT_THAT(refusal(kPoints + "f 1 2 -6\n"), HasSubstr("vertex -6"));
  EXPECT_THAT(refusal(kPoints + "f 1/1 2/2 3/5\n"), HasSubstr("vt 5 is not one of the 4"));
  EXPECT_THAT(refusal(kPoints + "f 1 2\n"), HasSubstr("has 2 corners"));
}

TEST(MeshFaults, FilesThatAreNoneAreToldApart) {
  EXPECT_THAT(refusal(""), HasSubstr("is empty"));
  EXPECT_THAT(refusal("{\"sheets\": []}"), HasSubstr("is no OBJ file"));
  EXPECT_THAT(refusal(kPoints), HasSubstr("has points, but no faces"));
  EXPECT_THAT(refusal("words", {}, "mesh.gltf"), HasSubstr("is no glTF file"));
  EXPECT_THAT(refusal("words", {}, "mesh.stl"), HasSubstr("neither .obj, .gltf nor .glb"));
}

TEST(MeshFaults, AnEdgeOfThreeTrianglesIsRefused) {
  const std::string said =
      refusal(kPoints + "g front\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\nf 3/3 1/1 5/4\n");
  EXPECT_THAT(said, AllOf(HasSubstr("its edge from (0, 0, 0) to (1, 1, 0) belongs to 3 triangles"),
                          HasSubstr("line 11 (face 1), line 12 (face 2), line 13 (face 3)"),
                          HasSubstr("panel front")));
}

TEST(MeshFaults, TrianglesThatFaceOppositeWaysAreRefusedAndTurnedOnRequest) {
  const std::string text = kPoints + "f 1/1 2/2 3/3\nf 1/1 4/4 3/3\n";
  EXPECT_THAT(refusal(text),
              HasSubstr("line 10 (face 1): faces the other way than line 11 (face 2)"));
  const Import mended = import_mesh("mesh.obj", text, {.mend = true});
  EXPECT_THAT(mended.mesh.notes, Contains(HasSubstr("1 triangle turned")));
}

TEST(MeshFaults, TrianglesWithoutAreaAreRefusedAndDroppedOnRequest) {
  const std::string text = kPoints + "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\nf 1/1 1/1 5/4\n";
  EXPECT_THAT(refusal(text), HasSubstr("line 12 (face 3): is a triangle without area"));
  EXPECT_THAT(import_mesh("mesh.obj", text, {.mend = true}).mesh.triangles, SizeIs(2));
}

TEST(MeshFaults, EqualTrianglesAreRefusedAndDroppedOnRequest) {
  const std::string text = kPoints + "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\nf 2/2 3/3 1/1\n";
  EXPECT_THAT(refusal(text), HasSubstr("line 12 (face 3): has the same corners"));
  EXPECT_THAT(import_mesh("mesh.obj", text, {.mend = true}).mesh.triangles, SizeIs(2));
}

TEST(MeshFaults, OfUvAreNamedByTheirTriangle) {
  EXPECT_THAT(refusal(kPoints + "f 1/1 2/2 3/3\nf 1 3 4\n"),
              HasSubstr("line 11 (face 2): has no UV"));
  EXPECT_THAT(refusal(kPoints + "f 1/1 2/2 3/3\nf 1/1 3/3 4/3\n"),
              HasSubstr("has no area in its UV"));
  // a point whose UV lie beyond its neighbours'
  const std::string said = refusal(lattice_obj({.moved_uv = {{12, {3.6, 2.3}}}}));
  EXPECT_THAT(said, HasSubstr("is turned over in its UV"));
}

TEST(MeshFaults, AMeshWithoutUvThatIsNotFlatIsRefusedWithWhatToDo) {
  EXPECT_THAT(refusal("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 1\nf 1 2 3\nf 1 3 4\n"),
              AllOf(HasSubstr("has no UV"), HasSubstr("UV > Unwrap")));
}

TEST(MeshFaults, UvThatFoldOverThemselvesAreRefused) {
  // seven triangles around a point, by 60 degrees each in UV and by 40 in space
  std::string text = "v 0 0 0\nvt 0 0\n", faces;
  for (int i = 0; i <= 7; ++i) {
    const double space = i * 40 / 57.29578, flat = i * 60 / 57.29578;
    text += "v " + std::to_string(std::cos(space)) + " " + std::to_string(std::sin(space)) +
            " 0\n" + "vt " + std::to_string(std::cos(flat)) + " " + std::to_string(std::sin(flat)) +
            "\n";
    const auto corner = [&](int n) { return " " + std::to_string(n) + "/" + std::to_string(n); };
    if (i > 0) faces += "f 1/1" + corner(i + 1) + corner(i + 2) + "\n";
  }
  EXPECT_THAT(refusal(text + faces),
              AllOf(HasSubstr("(face 1): lies over"), HasSubstr("(face 7)")));
}

TEST(MeshFaults, OfOneKindAreCountedAfterFive) {
  std::string text;
  for (int i = 0; i < 12; ++i) text += "v nan 0 0\n";
  EXPECT_THAT(refusal(text), AllOf(HasSubstr("line 5:"), Not(HasSubstr("line 6:")),
                                   HasSubstr("and 7 more like this one")));
}

TEST(MeshMending, JoinsPointsInOnePlace) {
  const std::string text =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 0 0\nv 1 1 1e-9\nv 0 1 0\n"
      "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 4/1 5/3 6/4\n";
  const Import open = import_mesh("mesh.obj", text, {});
  EXPECT_EQ(facts_of(open).pieces, 2);
  EXPECT_THAT(open.mesh.notes, Contains(HasSubstr("2 points lie where another does")));
  const Import mended = import_mesh("mesh.obj", text, {.mend = true});
  EXPECT_EQ(facts_of(mended).pieces, 1);
  EXPECT_THAT(mended.mesh.positions, SizeIs(4));
  EXPECT_THAT(mended.mesh.notes, Contains("2 points joined with the one that lies there too"));
}

TEST(MeshMending, JoinsTheEndsOfSlivers) {
  LatticeFile file;
  file.moved = {{12, {2.9, 2}}};  // of the middle, towards its right neighbour
  const Import before = import_mesh("mesh.obj", lattice_obj(file), {});
  const Import after = import_mesh("mesh.obj", lattice_obj(file), {.mend = true});
  EXPECT_LT(facts_of(before).lowest[0].height, 0.11);
  EXPECT_GT(facts_of(after).lowest[0].height, 0.3);
  EXPECT_THAT(after.mesh.positions, SizeIs(24));
  EXPECT_THAT(after.mesh.triangles, SizeIs(30));
  EXPECT_THAT(after.mesh.notes, Contains(AllOf(HasSubstr("1 particle joined"), HasSubstr("100 mm"),
                                               HasSubstr("+0 % of it larger"))));
}

TEST(MeshMending, LeavesBordersAndSeamsWhereTheyAre) {
  LatticeFile file;
  file.panels = true;
  file.moved = {{10, {0, 1.1}}, {12, {2, 1.1}}};  // on the border, and where panels meet
  const Import after = import_mesh("mesh.obj", lattice_obj(file), {.mend = true});
  EXPECT_THAT(after.mesh.positions, SizeIs(25));
  EXPECT_THAT(after.mesh.notes, Contains(HasSubstr("are left, at borders and seams")));
}

TEST(MeshMending, ChangesNothingWithoutNeed) {
  const Import import = import_mesh("mesh.obj", lattice_obj({}), {.mend = true});
  EXPECT_THAT(import.mesh.notes, IsEmpty());
  EXPECT_THAT(import.mesh.positions, SizeIs(25));
}

}  // namespace
}  // namespace weft::client
