#include <gmock/gmock.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <map>
#include <sstream>

#include "client/problem.h"
#include "client/recording/points.h"
#include "client/recording/reader.h"
#include "client/replay/replay_server.h"
#include "tests/client/client_test.h"
#include "tests/support/service/assets.h"

namespace weft::testing {
namespace {

using client::RecordingReader;
using ::testing::AllOf;
using ::testing::HasSubstr;

template <class Value>
std::string bytes_from(const std::vector<Value>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value)};
}

// Two panels of 1 m x 0.5 m, sewn along their long side: 3 x 3 particles, of which those of the
// seam have a corner in each panel. The back lies 2 m beside the front in the flat shape.
v1::MeshData two_panels() {
  std::vector<float> x, y, z, u, v;
  for (int i = 0; i < 9; ++i) {
    x.push_back(0.5F * static_cast<float>(i / 3));
    y.push_back(0);
    z.push_back(0.5F * static_cast<float>(i % 3));
  }
  for (int corner = 0; corner < 12; ++corner) {
    const int particle = corner < 6 ? corner : corner - 3;
    u.push_back(0.5F * static_cast<float>(particle % 3) + (corner < 6 ? 0.0F : 2.0F));
    v.push_back(0.5F * static_cast<float>(particle / 3));
  }
  std::vector<std::uint32_t> triangles, flat;
  for (const std::uint32_t row : {0U, 1U}) {
    for (const std::uint32_t column : {0U, 1U}) {
      const std::uint32_t at = 3 * row + column;
      for (const std::uint32_t particle : {at, at + 1, at + 3, at + 1, at + 4, at + 3}) {
        triangles.push_back(particle);
        flat.push_back(particle + 3 * row);
      }
    }
  }
  v1::MeshData mesh;
  mesh.set_positions_m(bytes_from(x) + bytes_from(y) + bytes_from(z));
  mesh.set_triangles(bytes_from(triangles));
  mesh.set_flat_m(bytes_from(u) + bytes_from(v));
  mesh.set_flat_triangles(bytes_from(flat));
  for (const char* name : {"front", "back"}) {
    v1::Panel* panel = mesh.add_panels();
    panel->set_name(name);
    panel->set_triangle_count(4);
  }
  return mesh;
}

// A grid of 4 x 5 particles, then the panels, which have the particles from 20 on.
v1::Scene grid_and_panels() {
  v1::Scene scene = small_scene();
  *scene.add_sheets() = scene_of(two_panels()).sheets(0);
  scene.mutable_sheets(0)->set_name("flag");
  scene.mutable_sheets(1)->set_name("shirt");
  return scene;
}

constexpr std::int64_t kLast = 4;
constexpr std::size_t kParticles = 20 + 9;

class SheetsOfTriangles : public ClientTest {
 protected:
  SheetsOfTriangles() {
    service_.create(grid_and_panels(), "cloth");
    ask({"record", "cloth", "--run", "--to", std::to_string(kLast), "--encoding", "float64", "-o",
         file_});
  }

  std::string exported(const std::string& format, const std::string& name) {
    ask({"export", file_, "--format", format, "-o", path(name)});
    return path(name);
  }

  // Where a particle is, from the recording.
  std::array<double, 3> place(std::int64_t frame, std::size_t particle) const {
    RecordingReader reader(file_);
    const auto points = client::read_points(reader.read(frame).positions_m(), reader.header());
    return {points.x[particle], points.y[particle], points.z[particle]};
  }

  void change(const char* sql) {
    client::Database(file_, client::Database::Access::kCreate).execute(sql);
  }

  const std::string file_ = path("cloth.weft");
};

TEST_F(SheetsOfTriangles, AreRecordedWithTheirFlatShapeAndPanels) {
  RecordingReader reader(file_);
  const auto meshes = client::meshes_of(reader.header(), reader.topology());
  ASSERT_EQ(meshes.size(), 2);
  EXPECT_TRUE(client::is_grid(meshes[0].layout));
  const client::SheetMesh& shirt = meshes[1];
  EXPECT_EQ(shirt.triangles.size(), 8);
  EXPECT_EQ(shirt.triangles[4], (client::Triangle{3, 4, 6}));
  EXPECT_EQ(shirt.flat_triangles[4], (client::Triangle{6, 7, 9}));
  EXPECT_EQ(shirt.flat[6], (std::array{2.0F, 0.5F}));
  EXPECT_EQ(shirt.panels[1].name, "back");
  EXPECT_EQ(shirt.panels[1].first, 4);
  EXPECT_THAT(weft({"info", file_}).out,
              HasSubstr("flag (4 x 5 particles), shirt (9 particles, 8 triangles, 2"));
  ask({"verify", file_});
  ask({"plot", file_, "-o", path("plot.svg")});
}

TEST_F(SheetsOfTriangles, CanBeRunAgainFromTheirRecording) {
  RecordingReader reader(file_);
  const std::string asset = reader.scene().sheets(1).triangles().asset();
  EXPECT_EQ(reader.assets().at(asset), two_panels().SerializeAsString());
  const v1::Scene scene = client::with_meshes(reader.scene(), reader.assets());
  Service other(ServerOptions{});
  other.create(scene, "cloth");
  const Outcome again =
      run_weft({"record", "cloth", "--run", "--to", std::to_string(kLast), "--encoding", "float64",
                "-o", path("again.weft"), "--server", other.server.address()});
  EXPECT_EQ(again.exit, 0) << again.err;
  EXPECT_EQ(ask({"diff", file_, path("again.weft")})["bit_equal"], true);
}

TEST_F(SheetsOfTriangles, ComeWithTheirFoldsALongOneInPieces) {
  constexpr int kCells = 16, kPoints = kCells + 1;
  v1::MeshData mesh = square_mesh(kCells);
  std::vector<int> line;  // to and fro over the rows
  for (int row = 1; row < kCells; ++row)
    for (int k = 1; k < kCells; ++k) line.push_back(row * kPoints + (row % 2 ? k : kCells - k));
  v1::Fold* fold = mesh.add_folds();
  fold->mutable_particles()->Assign(line.begin(), line.end());
  fold->set_angle_rad(0.5);
  ServerOptions options;
  options.limits.max_frame_bytes = 1024;
  Service narrow(options);
  narrow.create(scene_of(mesh), "pressed");
  const Outcome recorded = run_weft({"record", "pressed", "--run", "--to", "2", "-o",
                                     path("pressed.weft"), "--server", narrow.server.address()});
  ASSERT_EQ(recorded.exit, 0) << recorded.err;
  const auto folds = RecordingReader(path("pressed.weft")).topology()[0].folds();
  EXPECT_EQ(folds.size(), 2);
  std::vector<int> joined{line.front()};
  for (const v1::Fold& piece : folds) {
    EXPECT_EQ(piece.angle_rad(), 0.5);
    EXPECT_EQ(piece.particles(0), joined.back());
    joined.insert(joined.end(), piece.particles().begin() + 1, piece.particles().end());
  }
  EXPECT_EQ(joined, line);
}

TEST_F(SheetsOfTriangles, ComeInSeveralMessagesWhereTheyAreLarge) {
  ServerOptions options;
  options.limits.max_frame_bytes = 1024;
  Service narrow(options);
  v1::Scene scene = scene_of(square_mesh(12));
  narrow.create(scene, "wide");
  const Outcome recorded = run_weft({"record", "wide", "--run", "--to", "2", "-o",
                                     path("wide.weft"), "--server", narrow.server.address()});
  EXPECT_EQ(recorded.exit, 0) << recorded.err;
  EXPECT_EQ(RecordingReader(path("wide.weft")).topology()[0].triangles(),
            square_mesh(12).triangles());
}

TEST_F(SheetsOfTriangles, ThatAreDamagedAreTold) {
  RecordingReader(file_).topology();
  change("UPDATE topology SET mesh = substr(mesh, 1, 20) WHERE sheet = 1");
  const Outcome cut = weft({"info", file_});
  EXPECT_EQ(cut.exit, 4);
  EXPECT_THAT(cut.err, HasSubstr("the checksum of the triangles of sheet shirt is wrong"));
  change("DELETE FROM topology");
  EXPECT_EQ(weft({"info", file_}).exit, 4);
}

TEST_F(SheetsOfTriangles, AMeshThatIsNotWhatItsNameSaysIsTold) {
  change("UPDATE assets SET data = substr(data, 2)");
  const Outcome verified = weft({"verify", file_});
  EXPECT_EQ(verified.exit, 4);
  EXPECT_THAT(verified.err, HasSubstr("is not what its name says"));
}

TEST_F(SheetsOfTriangles, AreAloneWhatNeedsTheNewVersionOfTheFile) {
  const auto version = [](const std::string& file) {
    client::Database database(file, client::Database::Access::kRead);
    client::Statement row = database.prepare("PRAGMA user_version");
    row.step();
    return row.integer(0);
  };
  service_.create(small_scene(), "grid");
  ask({"record", "grid", "--run", "--to", "2", "-o", path("grid.weft")});
  EXPECT_EQ(version(path("grid.weft")), 2);
  EXPECT_EQ(version(file_), 3);
}

TEST_F(SheetsOfTriangles, AreCutJoinedAndCompared) {
  ask({"cut", file_, "--frames", "0:2", "-o", path("a.weft")});
  ask({"cut", file_, "--frames", "2:4", "-o", path("b.weft")});
  ask({"join", path("a.weft"), path("b.weft"), "-o", path("joined.weft")});
  EXPECT_EQ(ask({"diff", file_, path("joined.weft"), "--within", "0"})["bit_equal"], true);
  EXPECT_FALSE(RecordingReader(path("joined.weft")).assets().empty());
  v1::Scene other = grid_and_panels();
  std::string* positions =
      other.mutable_sheets(1)->mutable_triangles()->mutable_data()->mutable_positions_m();
  const float lifted = 0.25F;  // y of particle 7
  std::memcpy(positions->data() + 4 * (9 + 7), &lifted, 4);
  service_.create(other, "other");
  ask({"record", "other", "--to", "0", "--encoding", "float64", "-o", path("other.weft")});
  const auto found = ask({"diff", file_, path("other.weft"), "--frames", "0:0"});
  EXPECT_EQ(found["largest"]["sheet"], "shirt");
  EXPECT_EQ(found["largest"]["particle"], 7);
  EXPECT_NEAR(found["largest"]["distance_m"], 0.25, 1e-9);
}

TEST_F(SheetsOfTriangles, AreReplayedWithTheBitsOfTheOriginal) {
  const client::ReplayServer replay(file_, "127.0.0.1:0", 0);
  const Outcome copied =
      run_weft({"record", "cloth", "--run", "--to", std::to_string(kLast), "--encoding", "float64",
                "-o", path("copy.weft"), "--server", replay.address()});
  EXPECT_EQ(copied.exit, 0) << copied.err;
  EXPECT_EQ(ask({"diff", file_, path("copy.weft"), "--within", "0"})["bit_equal"], true);
  RecordingReader original(file_), copy(path("copy.weft"));
  EXPECT_EQ(copy.topology()[1].SerializeAsString(), original.topology()[1].SerializeAsString());
  EXPECT_EQ(copy.assets(), original.assets());

  // strain and normals are what the session streams
  const auto frame = [](v1::FrameService::Stub& frames) {
    grpc::ClientContext context;
    v1::StreamFramesRequest request;
    request.set_session("sessions/cloth");
    request.set_start_frame(kLast);
    request.set_end_frame(kLast);
    request.mutable_format()->set_encoding(v1::FRAME_ENCODING_FLOAT64);
    request.mutable_format()->set_strain(true);
    request.mutable_format()->set_normals(true);
    const auto reader = frames.StreamFrames(&context, request);
    v1::StreamFramesResponse message;
    while (reader->Read(&message) && !message.has_frame()) {
    }
    return message.frame();
  };
  const auto stub = v1::FrameService::NewStub(
      grpc::CreateChannel(replay.address(), grpc::InsecureChannelCredentials()));
  const v1::Frame replayed = frame(*stub), streamed = frame(*service_.frames);
  EXPECT_EQ(streamed.strain().size(), 3 * (24 + 8) * sizeof(double));
  EXPECT_EQ(replayed.strain(), streamed.strain());
  EXPECT_EQ(replayed.normals(), streamed.normals());
}

TEST_F(SheetsOfTriangles, AreObjGroupsWithFlatShapeAndNormals) {
  std::istringstream lines(read_file(exported("obj", "mesh") + "/cloth_000004.obj"));
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<double, 2>> corners;
  std::size_t normals = 0;
  std::map<std::string, std::vector<std::array<std::size_t, 3>>> faces;  // corners by group
  std::string group;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "v")
      words >> vertices.emplace_back()[0] >> vertices.back()[1] >> vertices.back()[2];
    if (word == "vt") words >> corners.emplace_back()[0] >> corners.back()[1];
    if (word == "vn") ++normals;
    if (word == "g") words >> group;
    while (word == "f" && words >> word) {
      auto& [v, vt, vn] = faces[group].emplace_back();
      if (!group.empty()) std::sscanf(word.c_str(), "%zu/%zu/%zu", &v, &vt, &vn);
      word = "f";
    }
  }
  ASSERT_EQ(vertices.size(), kParticles);
  for (std::size_t i = 0; i < kParticles; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      ASSERT_NEAR(vertices[i][axis], place(kLast, i)[axis], 1e-8);
  EXPECT_EQ(corners.size(), 12);
  EXPECT_EQ(normals, 9);
  EXPECT_EQ(faces[""].size(), 4 * 3 * 4) << "cells of the grid";
  ASSERT_EQ(faces["front"].size(), 12);
  ASSERT_EQ(faces["back"].size(), 12);
  EXPECT_EQ(faces["back"][0], (std::array<std::size_t, 3>{20 + 3 + 1, 6 + 1, 3 + 1}));
  EXPECT_EQ(corners[6], (std::array{2.0, 0.5}));
}

TEST_F(SheetsOfTriangles, AreGltfPrimitivesWhoseVerticesSayTheirParticle) {
  const std::string file = read_file(exported("gltf", "cloth.glb"));
  std::uint32_t length = 0;
  std::memcpy(&length, file.data() + 12, 4);
  const auto json = nlohmann::json::parse(file.substr(20, length));
  const std::string binary = file.substr(28 + length);
  EXPECT_EQ(json["buffers"][0]["byteLength"], binary.size());
  const auto array = [&]<class Number>(std::size_t accessor, Number) {
    const auto& view = json["bufferViews"][accessor];  // one for each
    std::vector<Number> numbers(view["byteLength"].get<std::size_t>() / sizeof(Number));
    std::memcpy(numbers.data(), binary.data() + view["byteOffset"].get<std::size_t>(),
                view["byteLength"].get<std::size_t>());
    return numbers;
  };
  const auto& primitives = json["meshes"][0]["primitives"];
  ASSERT_EQ(primitives.size(), 3);  // the grid, front and back
  EXPECT_EQ(primitives[2]["extras"]["panel"], "back");
  const auto& attributes = primitives[2]["attributes"];
  const auto particles = array(attributes["_PARTICLE"].get<std::size_t>(), 0.0F);
  const auto flat = array(attributes["TEXCOORD_0"].get<std::size_t>(), 0.0F);
  const auto base = array(attributes["POSITION"].get<std::size_t>(), 0.0F);
  ASSERT_EQ(particles.size(), 20 + 12);
  const auto indices = array(primitives[2]["indices"].get<std::size_t>(), std::uint32_t{});
  ASSERT_EQ(indices.size(), 12);
  EXPECT_EQ(particles[indices[0]], 23);
  EXPECT_EQ(flat[2 * indices[0]], 2);
  EXPECT_EQ(flat[2 * indices[0] + 1], 1 - 0.5F);
  ASSERT_EQ(primitives[2]["targets"].size(), kLast);
  const auto moved =
      array(primitives[2]["targets"][kLast - 1]["POSITION"].get<std::size_t>(), 0.0F);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      ASSERT_NEAR(base[3 * i + axis] + moved[3 * i + axis],
                  place(kLast, static_cast<std::size_t>(particles[i]))[axis], 1e-6);
  }
}

TEST_F(SheetsOfTriangles, AreUsdSubsetsWithTheFlatShapeOfEachCorner) {
  const std::string file = read_file(exported("usda", "cloth.usda"));
  EXPECT_EQ(std::count(file.begin(), file.end(), '{'), std::count(file.begin(), file.end(), '}'));
  EXPECT_EQ(std::count(file.begin(), file.end(), '['), std::count(file.begin(), file.end(), ']'));
  EXPECT_THAT(file, AllOf(HasSubstr("4, 4, 3, 3, 3, 3, 3, 3, 3, 3]"),
                          HasSubstr("texCoord2f[] primvars:st = [(0, 0)"),
                          HasSubstr("interpolation = \"faceVarying\""),
                          HasSubstr("GeomSubset \"shirt_back\""),
                          HasSubstr("familyName = \"panels\"\n        int[] indices = "
                                    "[16, 17, 18, 19]")));
}

TEST_F(SheetsOfTriangles, AreVtkCellsThatSayTheirPanel) {
  exported("vtk", "cloth.pvd");
  const std::string file = read_file(path("cloth/frame_000004.vtp"));
  const auto array = [&]<class Number>(const std::string& attributes, Number) {
    const std::string after = "offset=\"";
    const std::size_t offset = file.find(after, file.find(attributes)) + after.size();
    const std::size_t place = file.find("raw\">_") + 6 + std::stoul(file.substr(offset));
    std::uint64_t length = 0;
    std::memcpy(&length, file.data() + place, 8);
    std::vector<Number> numbers(length / sizeof(Number));
    std::memcpy(numbers.data(), file.data() + place + 8, length);
    return numbers;
  };
  std::vector<std::int32_t> panels(12, 0);
  panels.insert(panels.end(), {1, 1, 1, 1, 2, 2, 2, 2});
  EXPECT_EQ(array("Name=\"panel\"", std::int32_t{}), panels);
  const auto flat = array("Name=\"uv\"", 0.0F);
  ASSERT_EQ(flat.size(), 8 * 20);
  EXPECT_EQ(flat[8 * 16], 2);
  EXPECT_EQ(flat[8 * 16 + 1], 0.5F);
  EXPECT_EQ(array("Name=\"connectivity\"", std::int32_t{}).size(), 4 * 12 + 3 * 8);
}

// A file of a ZIP file in which all are stored; its checksum is held to what is written there.
std::string stored_file(const std::string& zip, const std::string& name) {
  const auto number = [&](std::size_t place, std::size_t size) {
    std::uint32_t value = 0;
    std::memcpy(&value, zip.data() + place, size);
    return value;
  };
  const std::size_t end = zip.rfind("PK\x05\x06");
  std::size_t entry = number(end + 16, 4);
  for (std::uint32_t left = number(end + 10, 2); left > 0; --left) {
    const std::uint32_t length = number(entry + 28, 2), size = number(entry + 24, 4);
    const std::size_t local = number(entry + 42, 4);
    if (zip.substr(entry + 46, length) == name) {
      EXPECT_EQ(zip.substr(local, 4), "PK\x03\x04");
      EXPECT_EQ(zip.substr(local + 14, 12), zip.substr(entry + 16, 12));
      const std::string bytes = zip.substr(local + 30 + length, size);
      EXPECT_EQ(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()),
                number(entry + 16, 4));
      return bytes;
    }
    entry += 46 + length;
  }
  ADD_FAILURE() << "there is no " << name;
  return std::string(10, '\0');
}

TEST_F(SheetsOfTriangles, AreArraysOfNumPy) {
  const std::string zip = read_file(exported("npz", "cloth.npz"));
  const auto array = [&]<class Number>(const std::string& name, const std::string& shape, Number) {
    const std::string file = stored_file(zip, name + ".npy");
    EXPECT_EQ(file.substr(1, 5), "NUMPY");
    std::uint16_t length = 0;
    std::memcpy(&length, file.data() + 8, 2);
    EXPECT_EQ((10 + length) % 64, 0);
    EXPECT_THAT(file.substr(10, length), HasSubstr("'shape': (" + shape + ")"));
    std::vector<Number> numbers((file.size() - 10 - length) / sizeof(Number));
    std::memcpy(numbers.data(), file.data() + 10 + length, numbers.size() * sizeof(Number));
    return numbers;
  };
  const auto vertices = array("vertices_seq", "5,29,3,", 0.0F);
  ASSERT_EQ(vertices.size(), 5 * 29 * 3);
  for (std::size_t i = 0; i < kParticles; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      ASSERT_EQ(vertices[3 * (kLast * kParticles + i) + axis],
                static_cast<float>(place(kLast, i)[axis]));
  const auto faces = array("faces", "32,3,", std::int32_t{});
  EXPECT_EQ(faces[3 * 28], 20 + 3);
  const auto faces_uv = array("faces_uv", "32,3,", std::int32_t{});
  const auto vertices_uv = array("vertices_uv", "32,2,", 0.0F);
  EXPECT_EQ(vertices_uv[2 * static_cast<std::size_t>(faces_uv[3 * 28])], 2);
  EXPECT_EQ(array("panel", "32,", std::int32_t{})[31], 2);
  EXPECT_NEAR(array("fps", "", 0.0)[0], 60, 1e-9);
  EXPECT_EQ(array("panel_names", "3,", std::uint32_t{})[0], 'f');  // of "flag"
}

}  // namespace
}  // namespace weft::testing
