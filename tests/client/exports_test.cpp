#include <gmock/gmock.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <pugixml.hpp>
#include <sstream>

#include "client/recording/points.h"
#include "client/recording/reader.h"
#include "client/recording/writer.h"
#include "tests/client/client_test.h"

namespace weft::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// Two sheets, 4 x 5 and 3 x 6 particles.
v1::Scene two_sheets() {
  v1::Scene scene = small_scene();
  scene.mutable_sheets(0)->set_name("left");
  *scene.add_sheets() = scene.sheets(0);
  v1::Sheet* right = scene.mutable_sheets(1);
  right->set_name("right");
  right->mutable_grid()->set_rows(3);
  right->mutable_grid()->set_columns(6);
  right->mutable_placement()->mutable_origin_m()->set_x(1);
  return scene;
}

constexpr std::size_t kParticles = 20 + 18;
constexpr std::int64_t kLast = 12;

class ExportsTest : public ClientTest {
 protected:
  ExportsTest() {
    service_.create(two_sheets(), "cloth");
    ask({"record", "cloth", "--run", "--to", std::to_string(kLast), "--encoding", "float64", "-o",
         file_});
  }

  // Coordinate `axis` of a particle, from the recording.
  double recorded(std::int64_t frame, std::size_t axis, std::size_t particle) const {
    double value = 0;
    const std::string planes = client::RecordingReader(file_).read(frame).positions_m();
    std::memcpy(&value, planes.data() + sizeof(value) * (axis * kParticles + particle),
                sizeof(value));
    return value;
  }

  const std::string file_ = path("cloth.weft");
};

std::vector<std::vector<double>> read_csv(const std::string& text, std::string& heading) {
  std::istringstream lines(text);
  std::getline(lines, heading);
  std::vector<std::vector<double>> rows;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(std::stod(cell));
  }
  return rows;
}

TEST_F(ExportsTest, CsvHasARowForEveryFrame) {
  ask({"export", file_, "--format", "csv", "-o", path("cloth.csv")});
  std::string heading;
  const auto rows = read_csv(read_file(path("cloth.csv")), heading);
  EXPECT_THAT(heading,
              AllOf(::testing::StartsWith("t,x0,y0,z0,x1,"), ::testing::EndsWith(",x37,y37,z37")));
  ASSERT_EQ(rows.size(), kLast + 1);
  for (std::size_t frame = 0; frame < rows.size(); ++frame) {
    ASSERT_EQ(rows[frame].size(), 1 + 3 * kParticles);
    EXPECT_NEAR(rows[frame][0], static_cast<double>(frame) / 60, 1e-11);
    for (std::size_t i = 0; i < 3 * kParticles; ++i) {
      const double wanted = recorded(static_cast<std::int64_t>(frame), i % 3, i / 3);
      ASSERT_NEAR(rows[frame][1 + i], wanted, 0.51e-12);
    }
  }
}

TEST_F(ExportsTest, CsvOfOneSheetAndSomeFrames) {
  ask({"export", file_, "-f", "csv", "--sheet", "right", "--frames", "3:5", "-o", path("a.csv")});
  std::string heading;
  const auto rows = read_csv(read_file(path("a.csv")), heading);
  ASSERT_EQ(rows.size(), 3);
  ASSERT_EQ(rows[0].size(), 1 + 3 * 18);
  EXPECT_NEAR(rows[2][1], recorded(5, 0, 20), 0.51e-12);
}

TEST_F(ExportsTest, FramesAreFoundByTheirTime) {
  ask({"export", "-f", "csv", "-o", path("a.csv"), "--times", "0.1,0.05", file_});
  std::string heading;
  const auto rows = read_csv(read_file(path("a.csv")), heading);
  ASSERT_EQ(rows.size(), 2);
  EXPECT_EQ(rows[0][0], 0.1);
  EXPECT_NEAR(rows[0][2], recorded(6, 1, 0), 0.51e-12);
  EXPECT_EQ(rows[1][0], 0.05);
}

TEST_F(ExportsTest, ATimeBetweenFramesIsRefusedWithItsNeighbours) {
  const Outcome between = weft({"export", file_, "-f", "csv", "--times", "0.06", "-o", path("a")});
  EXPECT_EQ(between.exit, 1);
  EXPECT_THAT(between.err, AllOf(HasSubstr("frame 3 at 0.05 s"), HasSubstr("frame 4 at 0.0666")));
  EXPECT_THAT(weft({"export", file_, "-f", "csv", "--times", "9", "-o", path("a")}).err,
              HasSubstr("frame 12 at 0.2 s"));
}

TEST_F(ExportsTest, WhatIsNotThereIsAUsageError) {
  EXPECT_EQ(weft({"export", file_, "-f", "csv", "--sheet", "up", "-o", path("a")}).exit, 2);
  EXPECT_EQ(weft({"export", file_, "-f", "csv", "--frames", "90:", "-o", path("a")}).exit, 2);
  EXPECT_EQ(weft({"export", file_, "-f", "csv", "--frames", "x", "-o", path("a")}).exit, 2);
  EXPECT_EQ(weft({"export", file_, "-f", "gif", "-o", path("a")}).exit, 2);
}

template <class Number>
Number number_at(const std::string& bytes, std::size_t place) {
  Number number{};
  std::memcpy(&number, bytes.data() + place, sizeof(number));
  return number;
}

// Whoever writes one may claim what he likes: neither takes memory for what is not there.
TEST_F(ExportsTest, RecordingsThatClaimMoreThanTheyHoldAreDamaged) {
  const client::RecordingReader recording(file_);
  v1::Frame frame = client::RecordingReader(file_).read(0);
  v1::StreamHeader huge = recording.header();
  huge.mutable_sheets()->DeleteSubrange(1, 1);
  huge.mutable_sheets(0)->set_rows(40'000);
  huge.mutable_sheets(0)->set_columns(40'000);
  client::RecordingWriter(path("huge.weft"), true, recording.scene(), huge).add(frame);
  frame.set_number(std::int64_t{1} << 60);
  client::RecordingWriter(path("long.weft"), true, recording.scene(), recording.header())
      .add(frame);
  for (const auto& [name, why] : {std::pair("huge.weft", "frame 0 is not as long as its header"),
                                  std::pair("long.weft", "it holds fewer frames than it says")}) {
    const Outcome outcome =
        weft({"export", path(name), "--format", "gltf", "-o", path("cloth.glb")});
    EXPECT_EQ(outcome.exit, 4);
    EXPECT_THAT(outcome.err, HasSubstr(why));
  }
}

TEST_F(ExportsTest, Pc2IsAPointCacheOfAllFrames) {
  ask({"export", file_, "--format", "pc2", "-o", path("cloth.pc2")});
  const std::string bytes = read_file(path("cloth.pc2"));
  ASSERT_EQ(bytes.size(), 32 + (kLast + 1) * kParticles * 12);
  EXPECT_EQ(bytes.substr(0, 12), std::string("POINTCACHE2\0", 12));
  EXPECT_EQ(number_at<std::int32_t>(bytes, 12), 1);
  EXPECT_EQ(number_at<std::int32_t>(bytes, 16), kParticles);
  EXPECT_EQ(number_at<float>(bytes, 20), 0);
  EXPECT_EQ(number_at<float>(bytes, 24), 1);
  EXPECT_EQ(number_at<std::int32_t>(bytes, 28), kLast + 1);
  for (std::size_t i = 0; i < 3 * kParticles; ++i) {
    const std::size_t place = 32 + (kLast * 3 * kParticles + i) * sizeof(float);
    ASSERT_EQ(number_at<float>(bytes, place), static_cast<float>(recorded(kLast, i % 3, i / 3)));
  }
}

TEST_F(ExportsTest, ObjIsAMeshOfQuadsForEveryFrame) {
  ask({"export", file_, "--format", "obj", "--frames", "4:", "-o", path("meshes")});
  EXPECT_FALSE(std::filesystem::exists(path("meshes/cloth_000003.obj")));
  EXPECT_TRUE(std::filesystem::exists(path("meshes/cloth_000012.obj")));

  std::istringstream lines(read_file(path("meshes/cloth_000004.obj")));
  std::vector<std::string> names;
  std::size_t vertices = 0;
  std::size_t quads = 0;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "o") names.emplace_back() = line.substr(2);
    if (kind == "v") {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        double value = 0;
        words >> value;
        ASSERT_NEAR(value, recorded(4, axis, vertices), 1e-8);
      }
      ++vertices;
    }
    if (kind == "f") {
      std::vector<std::size_t> corners(4);
      for (auto& corner : corners) words >> corner;
      const std::size_t columns = names.size() == 1 ? 5 : 6;
      EXPECT_EQ(corners, (std::vector{corners[0], corners[0] + columns, corners[0] + columns + 1,
                                      corners[0] + 1}));
      EXPECT_LE(corners[2], vertices);
      ++quads;
    }
  }
  EXPECT_THAT(names, ::testing::ElementsAre("left", "right"));
  EXPECT_EQ(vertices, kParticles);
  EXPECT_EQ(quads, 3 * 4 + 2 * 5);
}

// A number of a big-endian file.
template <class Number>
Number big_endian_at(std::string bytes, std::size_t place) {
  bytes = bytes.substr(place, sizeof(Number));
  std::reverse(bytes.begin(), bytes.end());
  return number_at<Number>(bytes, 0);
}

TEST_F(ExportsTest, MddIsAPointCacheWithTimes) {
  ask({"export", file_, "--format", "mdd", "--every", "5", "-o", path("cloth.mdd")});
  const std::string bytes = read_file(path("cloth.mdd"));
  ASSERT_EQ(big_endian_at<std::int32_t>(bytes, 0), 3);  // frames 0, 5 and 10
  ASSERT_EQ(big_endian_at<std::int32_t>(bytes, 4), kParticles);
  ASSERT_EQ(bytes.size(), 8 + 3 * (4 + 12 * kParticles));
  for (std::size_t k = 0; k < 3; ++k) {
    const auto frame = static_cast<std::int64_t>(5 * k);
    EXPECT_FLOAT_EQ(big_endian_at<float>(bytes, 8 + 4 * k), static_cast<float>(5 * k) / 60);
    for (std::size_t i = 0; i < 3 * kParticles; ++i) {
      ASSERT_EQ(big_endian_at<float>(bytes, 20 + 4 * (k * 3 * kParticles + i)),
                static_cast<float>(recorded(frame, i % 3, i / 3)));
    }
  }
}

// The numbers of an appended array of a .vtp file.
template <class Number>
std::vector<Number> vtk_array(const std::string& file, const std::string& attributes) {
  const std::string after = "offset=\"";
  const std::size_t offset = file.find(after, file.find(attributes)) + after.size();
  const std::size_t place = file.find("raw\">_") + 6 + std::stoul(file.substr(offset));
  std::vector<Number> numbers(number_at<std::uint64_t>(file, place) / sizeof(Number));
  std::memcpy(numbers.data(), file.data() + place + 8, numbers.size() * sizeof(Number));
  return numbers;
}

TEST_F(ExportsTest, VtkIsACollectionOfMeshes) {
  ask({"export", file_, "--format", "vtk", "--frames", "4:", "-o", path("cloth.pvd")});
  pugi::xml_document collection;
  ASSERT_TRUE(collection.load_file(path("cloth.pvd").c_str()));
  std::int64_t frame = 4;
  for (const auto& entry : collection.child("VTKFile").child("Collection")) {
    EXPECT_NEAR(entry.attribute("timestep").as_double(), static_cast<double>(frame) / 60, 1e-11);
    const std::string mesh = read_file(path(entry.attribute("file").value()));
    const auto points = vtk_array<double>(mesh, "NumberOfComponents=\"3\"");
    ASSERT_EQ(points.size(), 3 * kParticles);
    for (std::size_t i = 0; i < points.size(); ++i)
      ASSERT_EQ(points[i], recorded(frame, i % 3, i / 3));
    const auto corners = vtk_array<std::int32_t>(mesh, "Name=\"connectivity\"");
    EXPECT_EQ(corners.size(), 4 * (3 * 4 + 2 * 5));
    EXPECT_EQ(corners[4 * 12], 20);  // the first cell of the second sheet
    EXPECT_EQ(vtk_array<std::int32_t>(mesh, "Name=\"offsets\"").back(), corners.size());
    ++frame;
  }
  EXPECT_EQ(frame, kLast + 1);
  EXPECT_EQ(weft({"export", file_, "-f", "vtk", "-o", path("cloth.vtk")}).exit, 2);
}

// The numbers of a list that follows a text.
std::vector<double> list_after(const std::string& file, const std::string& text) {
  const std::size_t place = file.find(text);
  EXPECT_NE(place, std::string::npos) << text;
  const std::size_t start = file.find('[', place + text.size() - 1) + 1;
  std::string list = file.substr(start, file.find(']', start) - start);
  for (char& c : list)
    if (c == '(' || c == ')' || c == ',') c = ' ';
  std::istringstream words(list);
  return {std::istream_iterator<double>(words), {}};
}

TEST_F(ExportsTest, UsdIsAMeshWithASampleForEveryFrameAndASubsetForEverySheet) {
  ask({"export", file_, "--format", "usda", "--frames", "4:", "-o", path("cloth.usda")});
  const std::string file = read_file(path("cloth.usda"));
  EXPECT_THAT(file, AllOf(::testing::StartsWith("#usda 1.0\n"), HasSubstr("metersPerUnit = 1\n"),
                          HasSubstr("upAxis = \"Y\""), HasSubstr("timeCodesPerSecond = 60\n"),
                          HasSubstr("startTimeCode = 4\n"), HasSubstr("endTimeCode = 12\n")));
  EXPECT_EQ(std::count(file.begin(), file.end(), '{'), std::count(file.begin(), file.end(), '}'));
  const std::size_t cells = 3 * 4 + 2 * 5;
  EXPECT_EQ(list_after(file, "faceVertexCounts = ["), std::vector<double>(cells, 4));
  const auto corners = list_after(file, "faceVertexIndices = [");
  ASSERT_EQ(corners.size(), 4 * cells);
  EXPECT_EQ(corners[4 * 12], 20);  // the first cell of the second sheet
  EXPECT_EQ(list_after(file.substr(file.find("GeomSubset \"right\"")), "indices = [")[0], 12);
  for (std::int64_t frame = 4; frame <= kLast; ++frame) {
    const auto points = list_after(file, "\n        " + std::to_string(frame) + ": [");
    ASSERT_EQ(points.size(), 3 * kParticles);
    for (std::size_t i = 0; i < points.size(); ++i)
      ASSERT_FLOAT_EQ(static_cast<float>(points[i]),
                      static_cast<float>(recorded(frame, i % 3, i / 3)));
  }
  EXPECT_EQ(weft({"export", file_, "-f", "usda", "-o", path("cloth.usd")}).exit, 2);
}

// A binary glTF file.
struct Gltf {
  nlohmann::json json;
  std::string bytes;

  explicit Gltf(const std::string& file) {
    EXPECT_EQ(file.substr(0, 4), "glTF");
    EXPECT_EQ(number_at<std::uint32_t>(file, 4), 2);
    EXPECT_EQ(number_at<std::uint32_t>(file, 8), file.size());
    const auto length = number_at<std::uint32_t>(file, 12);
    EXPECT_EQ(file.substr(16, 4), "JSON");
    json = nlohmann::json::parse(file.substr(20, length));
    EXPECT_EQ(number_at<std::uint32_t>(file, 20 + length), file.size() - 28 - length);
    EXPECT_EQ(file.substr(24 + length, 4), std::string("BIN\0", 4));
    bytes = file.substr(28 + length);
    EXPECT_EQ(json["buffers"][0]["byteLength"], bytes.size());
  }

  template <class Number>
  std::vector<Number> array(const nlohmann::json& accessor) const {
    const nlohmann::json& view =
        json["bufferViews"]
            [json["accessors"][accessor.get<std::size_t>()]["bufferView"].get<std::size_t>()];
    std::vector<Number> numbers(view["byteLength"].get<std::size_t>() / sizeof(Number));
    std::memcpy(numbers.data(), bytes.data() + view["byteOffset"].get<std::size_t>(),
                view["byteLength"]);
    return numbers;
  }
};

TEST_F(ExportsTest, GltfIsAnAnimationFromFrameToFrame) {
  ask({"export", file_, "--format", "gltf", "--every", "4", "-o", path("cloth.glb")});
  const Gltf gltf(read_file(path("cloth.glb")));
  const nlohmann::json& shape = gltf.json["meshes"][0]["primitives"][0];
  const nlohmann::json& sampler = gltf.json["animations"][0]["samplers"][0];
  EXPECT_EQ(gltf.array<std::uint32_t>(shape["indices"]).size(), 6 * (3 * 4 + 2 * 5));
  const auto base = gltf.array<float>(shape["attributes"]["POSITION"]);
  const auto times = gltf.array<float>(sampler["input"]);
  const auto weights = gltf.array<float>(sampler["output"]);
  ASSERT_EQ(times.size(), 4);  // frames 0, 4, 8 and 12
  ASSERT_EQ(shape["targets"].size(), 3);
  for (std::size_t k = 0; k < times.size(); ++k) {
    EXPECT_FLOAT_EQ(times[k], static_cast<float>(4 * k) / 60);
    auto shown = base;
    for (std::size_t target = 0; target < 3; ++target) {
      const auto moved = gltf.array<float>(shape["targets"][target]["POSITION"]);
      for (std::size_t i = 0; i < shown.size(); ++i) shown[i] += weights[3 * k + target] * moved[i];
    }
    for (std::size_t i = 0; i < shown.size(); ++i)
      ASSERT_NEAR(shown[i], recorded(static_cast<std::int64_t>(4 * k), i % 3, i / 3), 1e-6);
  }
}

TEST_F(ExportsTest, PressureAndClearanceGoWithTheFramesOfEachSheet) {
  v1::Scene scene = two_sheets();
  scene.mutable_sheets(1)->clear_pins();
  scene.add_colliders()->mutable_plane()->mutable_point_m()->set_y(-0.2);
  service_.create(scene, "table");
  ask({"record", "table", "--run", "--to", "30", "--pressure", "--clearance", "-o",
       path("table.weft")});
  client::RecordingReader recording(path("table.weft"));
  const v1::Frame last = recording.read(30);
  const auto pressures = client::read_pressures(last, recording.header()),
             clearances = client::read_clearances(last, recording.header());
  ASSERT_EQ(pressures.size(), kParticles);
  EXPECT_GT(*std::max_element(pressures.begin(), pressures.end()), 1);

  ask({"export", path("table.weft"), "-f", "csv", "--sheet", "right", "-o", path("table.csv")});
  std::string heading;
  const auto rows = read_csv(read_file(path("table.csv")), heading);
  EXPECT_THAT(heading, HasSubstr(",z17,pressure0,pressure1,"));
  EXPECT_THAT(heading,
              ::testing::EndsWith(",pressure17,clearance0,clearance1,clearance2,clearance3,"
                                  "clearance4,clearance5,clearance6,clearance7,"
                                  "clearance8,clearance9,clearance10,clearance11,"
                                  "clearance12,clearance13,clearance14,clearance15,"
                                  "clearance16,clearance17"));
  ask({"export", path("table.weft"), "-f", "vtk", "--frames", "30:", "-o", path("table.pvd")});
  const std::string mesh = read_file(path("table/frame_000030.vtp"));
  EXPECT_EQ(vtk_array<double>(mesh, "Name=\"pressure\""), pressures);
  EXPECT_EQ(vtk_array<double>(mesh, "Name=\"clearance\""), clearances);
  ask({"export", path("table.weft"), "-f", "gltf", "--frames", "30:", "-o", path("table.glb")});
  const Gltf gltf(read_file(path("table.glb")));
  const nlohmann::json& attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"];
  const auto attribute = gltf.array<float>(attributes["_PRESSURE"]);
  ask({"export", path("table.weft"), "-f", "npz", "-o", path("table.npz")});
  const std::string zip = read_file(path("table.npz"));
  const std::size_t file = zip.find("clearance.npy"), header = zip.find("\x93NUMPY", file);
  EXPECT_THAT(zip.substr(header, 128), HasSubstr("(31,38,)"));
  const std::size_t numbers = header + 10 + number_at<std::uint16_t>(zip, header + 8);
  for (std::size_t i = 0; i < kParticles; ++i) {
    EXPECT_EQ(attribute[i], static_cast<float>(pressures[i]));
    EXPECT_EQ(number_at<float>(zip, numbers + 4 * (30 * kParticles + i)),
              static_cast<float>(clearances[i]));
    if (i < 20) continue;
    EXPECT_NEAR(rows[30][1 + 3 * 18 + i - 20], pressures[i], 1e-6 * pressures[i]);
    EXPECT_NEAR(rows[30][1 + 4 * 18 + i - 20], clearances[i], 1e-9);
  }
}

}  // namespace
}  // namespace weft::testing
