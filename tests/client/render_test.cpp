#include <gmock/gmock.h>
#include <png.h>
#include <webp/demux.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>

#include "client/render/stage.h"
#include "tests/client/client_test.h"
#include "tests/support/service/assets.h"

namespace weft::testing {
namespace {

using ::testing::HasSubstr;

struct Rgb {
  int red, green, blue;

  int light() const { return red + green + blue; }
  int colour() const { return std::max({red, green, blue}) - std::min({red, green, blue}); }
  bool is_front() const { return red > green + 60 && red > blue + 60; }
};

// A PNG, as libpng reads it.
class Image {
 public:
  explicit Image(const std::string& path) {
    image_.version = PNG_IMAGE_VERSION;
    EXPECT_NE(png_image_begin_read_from_file(&image_, path.c_str()), 0) << image_.message;
    image_.format = PNG_FORMAT_RGB;
    bytes_.resize(PNG_IMAGE_SIZE(image_));
    EXPECT_NE(png_image_finish_read(&image_, nullptr, bytes_.data(), 0, nullptr), 0)
        << image_.message;
  }

  Image(int width, int height, const std::uint8_t* rgba) {
    image_.width = static_cast<png_uint_32>(width);
    image_.height = static_cast<png_uint_32>(height);
    for (int i = 0; i < 4 * width * height; ++i)
      if (i % 4 != 3) bytes_.push_back(rgba[i]);
  }

  int width() const { return static_cast<int>(image_.width); }
  int height() const { return static_cast<int>(image_.height); }
  Rgb at(int x, int y) const {
    const std::size_t place = 3 * static_cast<std::size_t>(y * width() + x);
    return {bytes_[place], bytes_[place + 1], bytes_[place + 2]};
  }

 private:
  png_image image_{};
  std::vector<unsigned char> bytes_;
};

// The pictures of a WebP file as libwebp shows them, and when each ends, ms.
std::vector<std::pair<Image, int>> animation(const std::string& file) {
  const WebPData data{reinterpret_cast<const std::uint8_t*>(file.data()), file.size()};
  WebPAnimDecoder* decoder = WebPAnimDecoderNew(&data, nullptr);
  EXPECT_NE(decoder, nullptr);
  WebPAnimInfo info;
  WebPAnimDecoderGetInfo(decoder, &info);
  std::vector<std::pair<Image, int>> pictures;
  while (WebPAnimDecoderHasMoreFrames(decoder) != 0) {
    std::uint8_t* rgba = nullptr;
    int end = 0;
    WebPAnimDecoderGetNext(decoder, &rgba, &end);
    pictures.emplace_back(
        Image(static_cast<int>(info.canvas_width), static_cast<int>(info.canvas_height), rgba),
        end);
  }
  WebPAnimDecoderDelete(decoder);
  return pictures;
}

// Where the front of cloth is seen, pixels.
struct Seen {
  int left = 10'000, right = -1, top = 10'000, bottom = -1, pixels = 0;

  int width() const { return right - left + 1; }
  int height() const { return bottom - top + 1; }
};

Seen find_front(const Image& image, int from, int to) {
  Seen seen;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = from; x < to; ++x) {
      if (!image.at(x, y).is_front()) continue;
      seen = {std::min(seen.left, x), std::max(seen.right, x), std::min(seen.top, y),
              std::max(seen.bottom, y), seen.pixels + 1};
    }
  }
  return seen;
}

// A square sheet of 0.4 m that stands upright, held by every particle: its front to +z.
v1::Scene standing_square() {
  v1::Scene scene = small_scene();
  v1::Sheet& sheet = *scene.mutable_sheets(0);
  sheet.mutable_grid()->set_rows(5);
  sheet.mutable_grid()->set_columns(5);
  sheet.mutable_grid()->set_spacing_m(0.1);
  v1::Rotation& rotation = *sheet.mutable_placement()->mutable_rotation();
  rotation.set_w(1);
  rotation.set_x(1);
  sheet.mutable_pins(0)->clear_particles();
  for (int i = 0; i < 25; ++i) sheet.mutable_pins(0)->add_particles(i);
  return scene;
}

// A sheet of a measured textile that only bends, its particles where `place` has those of a row and
// a column.
v1::Scene bent(const std::function<Eigen::Vector3d(int row, int column)>& place) {
  v1::Scene scene = small_scene();
  scene.mutable_environment()->mutable_gravity_m_per_s2();  // none
  v1::Sheet& sheet = *scene.mutable_sheets(0);
  sheet.clear_pins();
  sheet.mutable_bending()->mutable_isometric()->set_resist_compression(false);
  v1::MeasuredTextile& textile = *sheet.mutable_textile()->mutable_measured();
  textile.set_areal_density_kg_per_m2(0.2);
  textile.set_bend_rigidity_warp_n_m(3e-5);
  textile.set_bend_rigidity_weft_n_m(5e-6);
  for (int row = 0; row < sheet.grid().rows(); ++row) {
    for (int column = 0; column < sheet.grid().columns(); ++column)
      for (const double coordinate : place(row, column)) sheet.add_start_positions_m(coordinate);
  }
  return scene;
}

class RenderTest : public ClientTest {
 protected:
  std::string record(const v1::Scene& scene, const std::string& name) {
    service_.create(scene, name);
    ask({"record", name, "--run", "--to", "3", "-o", path(name + ".weft")});
    return path(name + ".weft");
  }
  Image render(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "render");
    arguments.insert(arguments.end(), {"-o", png_});
    ask(arguments);
    return Image(png_);
  }

  const std::string png_ = path("picture.png");
};

TEST_F(RenderTest, ShowsASheetInItsShapeWithinThePicture) {
  const std::string square = record(standing_square(), "square");
  const Image front = render({square, "--azimuth", "0", "--elevation", "0", "--size", "100x80"});
  const Seen seen = find_front(front, 0, 100);
  EXPECT_NEAR(seen.width(), seen.height(), 1);
  EXPECT_GE(seen.pixels, (seen.width() - 2) * (seen.height() - 2));
  EXPECT_NEAR((seen.left + seen.right) / 2.0, 49.5, 1);
  EXPECT_GT(seen.height(), 50);
  EXPECT_GT(seen.top, 0);

  // from 60 degrees to the right half as wide; from behind, the other side
  const Image turned = render({square, "--azimuth", "60", "--elevation", "0", "--size", "100x80"});
  const Seen narrow = find_front(turned, 0, 100);
  EXPECT_NEAR(narrow.width() / static_cast<double>(narrow.height()), 0.5, 0.12);
  const Image back = render({square, "--azimuth", "180", "--size", "100x80"});
  EXPECT_EQ(find_front(back, 0, 100).pixels, 0);
  EXPECT_GT(back.at(50, 35).colour(), 30);
}

TEST_F(RenderTest, ATurntableGoesOnceAroundAtOneSize) {
  const std::string square = record(standing_square(), "square");
  const std::string file = path("square.webp");
  const auto answer = ask({"render", square, "--turntable", "8", "--azimuth", "0", "--elevation",
                           "0", "--size", "128x96", "-o", file});
  EXPECT_EQ(answer["views"], 8);
  const auto pictures = animation(read_file(file));
  ASSERT_EQ(pictures.size(), 8);
  EXPECT_EQ(pictures.back().second, 4000);
  std::vector<int> widths;
  for (const auto& [image, end] : pictures) widths.push_back(find_front(image, 0, 128).width());
  // ahead, from its right, and so on; the back half shows no front
  EXPECT_NEAR(widths[1] / static_cast<double>(widths[0]), std::sqrt(0.5), 0.12);
  EXPECT_NEAR(widths[7], widths[1], 3);
  for (const std::size_t behind : {3U, 4U, 5U})
    EXPECT_EQ(find_front(pictures[behind].first, 0, 128).pixels, 0);
  EXPECT_GT(pictures[4].first.at(64, 40).colour(), 30);
}

TEST_F(RenderTest, APictureMayBeWebP) {
  const std::string square = record(standing_square(), "square");
  const std::string file = path("square.webp");
  ask({"render", square, "--size", "100x80", "-o", file});
  const Seen png = find_front(render({square, "--size", "100x80"}), 0, 100);
  const auto pictures = animation(read_file(file));
  ASSERT_EQ(pictures.size(), 1);
  const Seen seen = find_front(pictures[0].first, 0, 100);
  EXPECT_NEAR(seen.pixels, png.pixels, png.pixels / 20);
  EXPECT_NEAR(seen.width(), png.width(), 2);
}

TEST_F(RenderTest, BodiesOfTrianglesAreSeenWhereTheyStand) {
  v1::Scene scene = standing_square();
  scene.mutable_sheets(0)->mutable_grid()->set_spacing_m(0.05);
  *scene.add_colliders()->mutable_mesh()->mutable_data() = cube_mesh(0.1F, 0, -0.35F, 0);
  const auto blue_pixels = [&](const std::string& recording) {
    const Image image = render({recording, "--size", "100x100"});
    int count = 0;
    for (int y = 0; y < 100; ++y)
      for (int x = 0; x < 100; ++x) count += image.at(x, y).blue > image.at(x, y).red + 8 ? 1 : 0;
    return count;
  };
  const int with = blue_pixels(record(scene, "with"));
  // the same place, from far away
  v1::MeshData& cube = *scene.mutable_colliders(0)->mutable_mesh()->mutable_data();
  cube.mutable_poses()->add_times_s(0);
  cube.mutable_poses()->add_times_s(0.01);
  cube.mutable_poses()->set_positions_m(cube_mesh(0.1F, 0.9F, -0.35F, 0).positions_m() +
                                        cube.positions_m());
  EXPECT_EQ(blue_pixels(record(scene, "moved")), with);
  scene.clear_colliders();
  EXPECT_GT(with, blue_pixels(record(scene, "without")) + 75);
}

TEST(Bodies, StandInThePoseThatTheyWereLedTo) {
  v1::Scene scene;
  scene.add_colliders()->mutable_sphere()->set_radius_m(0.1);
  v1::MeshData& cube = *scene.add_colliders()->mutable_mesh()->mutable_data();
  cube = cube_mesh(0.1F, 0, 0, 0);
  cube.mutable_poses()->add_times_s(10);
  cube.mutable_poses()->add_times_s(11);
  cube.mutable_poses()->set_positions_m(cube.positions_m() +
                                        cube_mesh(0.1F, 0.8F, 0, 0).positions_m());
  const auto moved_by = [&](const std::vector<double>& pose_times_s) {
    const auto at = [&](double time_s, const std::vector<double>& led) {
      return std::get<client::Solid>(client::bodies_at(scene, time_s, led)[1]).corners.x[0];
    };
    return at(0, pose_times_s) - at(0, {});
  };
  EXPECT_NEAR(moved_by({10.5}), 0.4, 1e-6);
  EXPECT_NEAR(moved_by({11}), 0.8, 1e-6);
}

TEST_F(RenderTest, BodiesCastShadowsOnAPlane) {
  v1::Scene scene = standing_square();
  scene.mutable_sheets(0)->mutable_grid()->set_spacing_m(0.05);
  scene.add_colliders()->mutable_plane()->mutable_point_m()->set_y(-0.5);
  v1::Sphere& ball = *scene.add_colliders()->mutable_sphere();
  ball.mutable_center_m()->set_y(-0.35);
  ball.set_radius_m(0.1);
  const std::string with_ball = record(scene, "with");
  scene.mutable_colliders()->RemoveLast();
  const std::string without = record(scene, "without");
  const Image image = render({with_ball, without, "--elevation", "60", "--size", "200x100"});

  int ball_pixels = 0;
  int shadow_pixels = 0;
  for (int y = 20; y < 85; ++y) {
    for (int x = 5; x < 95; ++x) {
      const Rgb here = image.at(x, y);
      if (here.blue > here.red + 8) {
        ++ball_pixels;
      } else if (here.light() < image.at(x + 100, y).light() - 150) {
        ++shadow_pixels;
      }
    }
  }
  EXPECT_GT(ball_pixels, 75);
  EXPECT_GT(shadow_pixels, 75);
}

TEST_F(RenderTest, ComparesThroughOneCamera) {
  const std::string square = record(standing_square(), "square");
  v1::Scene scene = standing_square();
  scene.mutable_sheets(0)->mutable_grid()->set_spacing_m(0.05);
  const std::string half = record(scene, "half");
  const Image image =
      render({square, half, "--azimuth", "0", "--elevation", "0", "--size", "160x80"});
  const Seen left = find_front(image, 0, 80);
  const Seen right = find_front(image, 80, 160);
  EXPECT_NEAR(left.width() / 2.0, right.width(), 1);
  EXPECT_NEAR(left.left, right.left - 80, 1);
}

TEST_F(RenderTest, ColoursByStrainInOneScale) {
  v1::Scene scene = standing_square();
  const std::string still = record(scene, "still");
  // the lowest row led down by a fifth of the spacing
  v1::Sheet& sheet = *scene.mutable_sheets(0);
  sheet.mutable_pins(0)->mutable_particles()->Truncate(20);
  v1::Pin& led = *sheet.add_pins();
  for (int i = 20; i < 25; ++i) led.add_particles(i);
  led.add_path()->set_time_s(0);
  v1::Keyframe& end = *led.add_path();
  end.set_time_s(0.02);
  end.mutable_offset_m()->set_y(-0.02);
  const std::string stretched = record(scene, "stretched");

  const nlohmann::json answer = ask({"render", still, stretched, "--colour", "strain", "--size",
                                     "160x80", "--azimuth", "0", "--elevation", "0", "-o", png_});
  EXPECT_NEAR(answer["largest_strain"], 0.2, 1e-4);
  const Image image(png_);
  EXPECT_EQ(find_front(image, 0, 80).pixels, 0);  // nothing red where nothing is stretched
  EXPECT_GT(find_front(image, 80, 160).pixels, 75);
  const Rgb pale = image.at(40, 30);
  EXPECT_GT(pale.red, pale.blue + 30);
}

TEST_F(RenderTest, ASheetOnACylinderHasTheBendingEnergyOfItsCurvature) {
  constexpr double kRadius = 0.25;
  constexpr double kSpacing = 0.05;
  const auto arc = [](int i) {
    const double angle = 2 * i * std::asin(kSpacing / 2 / kRadius);
    return Eigen::Vector2d(kRadius * std::cos(angle), kRadius * std::sin(angle));
  };
  const auto largest = [&](const v1::Scene& scene, const std::string& name) {
    const auto answer = ask({"render", record(scene, name), "--frame", "0", "--colour", "bending",
                             "--size", "64x64", "-o", png_});
    return answer["largest_bending_energy_j_per_m2"].get<double>();
  };
  const v1::Scene along_warp = bent([&](int row, int column) {
    return Eigen::Vector3d(arc(column).x(), arc(column).y(), kSpacing * row);
  });
  EXPECT_NEAR(largest(along_warp, "warp"), 3e-5 / 2 / (kRadius * kRadius), 1e-8);
  v1::Scene along_weft = bent([&](int row, int column) {
    return Eigen::Vector3d(arc(row).x(), arc(row).y(), kSpacing * column);
  });
  EXPECT_NEAR(largest(along_weft, "weft"), 5e-6 / 2 / (kRadius * kRadius), 1e-9);

  // a raw textile has a rigidity too, by its spacing
  *along_weft.mutable_sheets(0)->mutable_textile() = small_scene().sheets(0).textile();
  EXPECT_NEAR(largest(along_weft, "raw"), 1.5 * 1e-5 / kSpacing / 2 / (kRadius * kRadius), 1e-7);
}

TEST_F(RenderTest, TheBendingEnergyOfAllParticlesIsWhatTheSolverHasOfIt) {
  const v1::Scene scene = bent([](int row, int column) {
    const double x = 0.05 * column;
    const double z = 0.05 * row;
    return Eigen::Vector3d(x, x * x * (z - 0.02) + std::sin(20 * z * x) / 50, z);
  });
  client::RecordingReader recording(record(scene, "saddle"));
  const auto stage = read_stage(recording, 0, client::Colouring::kBending);
  const std::vector<float>& values = stage.surfaces[0].values;
  std::size_t pieces = 1;  // that a cell is drawn in
  while ((3 * pieces + 1) * (4 * pieces + 1) < values.size()) ++pieces;
  double energy = 0;
  for (std::size_t row = 0; row < 4; ++row) {
    for (std::size_t column = 0; column < 5; ++column) {
      const double area = 0.05 * 0.05 * (row % 3 == 0 ? 0.5 : 1) * (column % 4 == 0 ? 0.5 : 1);
      energy += area * values[pieces * (row * (4 * pieces + 1) + column)];
    }
  }
  EXPECT_GT(energy, 1e-7);
  EXPECT_NEAR(energy, recording.read(0).stats().potential_energy_j(), 1e-4 * energy);
}

// A square of 1 m x 1 m in triangles, its particles where `place` has those of its flat shape.
v1::Scene laid(const std::function<Eigen::Vector3d(double u, double v)>& place) {
  constexpr int kCells = 20;
  v1::Scene scene = scene_of(square_mesh(kCells));
  scene.mutable_environment()->mutable_gravity_m_per_s2();  // none
  v1::Sheet& sheet = *scene.mutable_sheets(0);
  for (int i = 0; i < (kCells + 1) * (kCells + 1); ++i) {
    const double u = i % (kCells + 1), v = i / (kCells + 1);
    for (const double coordinate : place(u / kCells, v / kCells))
      sheet.add_start_positions_m(coordinate);
  }
  return scene;
}

TEST_F(RenderTest, StrainOfTrianglesIsToldAlongWarpAndWeftAndAsShear) {
  const std::string file = record(
      laid([](double u, double v) { return Eigen::Vector3d(1.1 * v + 0.2 * u, 0, 0.9 * u); }),
      "strained");
  const auto largest = [&](const std::string& colour, const std::string& field) {
    return ask({"render", file, "--frame", "0", "--colour", colour, "--size", "64x64", "-o",
                png_})[field]
        .get<double>();
  };
  const double weft = std::hypot(0.2, 0.9);
  constexpr double kRounding = 1e-5;  // of positions in single precision, over an edge
  EXPECT_NEAR(largest("strain", "largest_strain"), 0.1, kRounding);
  EXPECT_NEAR(largest("warp", "largest_warp_strain"), 0.1, kRounding);
  EXPECT_NEAR(largest("weft", "largest_weft_strain"), 1 - weft, kRounding);
  EXPECT_NEAR(largest("shear", "largest_shear"), 0.2 / weft, kRounding);
}

TEST_F(RenderTest, TrianglesOnACylinderHaveTheBendingEnergyOfItsCurvature) {
  constexpr double kRadius = 0.4;
  const auto arc = [](double length) {
    return Eigen::Vector2d(kRadius * std::sin(length / kRadius),
                           kRadius * std::cos(length / kRadius));
  };
  const std::vector<std::function<Eigen::Vector3d(double, double)>> ways{
      [&](double u, double v) { return Eigen::Vector3d(arc(v).x(), arc(v).y(), u); },
      [&](double u, double v) { return Eigen::Vector3d(v, arc(u).y(), arc(u).x()); },
      [&](double u, double v) {
        const double along = (u + v) / std::numbers::sqrt2, across = (u - v) / std::numbers::sqrt2;
        return Eigen::Vector3d(arc(along).x(), arc(along).y(), across);
      }};
  for (std::size_t way = 0; way < ways.size(); ++way) {
    const std::string file = record(laid(ways[way]), "rolled-" + std::to_string(way));
    const auto answer =
        ask({"render", file, "--frame", "0", "--colour", "bending", "--size", "64x64", "-o", png_});
    const double expected = 1e-5 / 2 / (kRadius * kRadius);
    EXPECT_NEAR(answer["largest_bending_energy_j_per_m2"], expected, 0.02 * expected) << way;
  }
}

TEST_F(RenderTest, PanelsHaveColoursOfTheirOwn) {
  v1::MeshData mesh = square_mesh(10);
  for (const char* name : {"lower", "upper"}) {
    v1::Panel& panel = *mesh.add_panels();
    panel.set_name(name);
    panel.set_triangle_count(100);
  }
  v1::Scene scene = scene_of(mesh);
  v1::Rotation& upright = *scene.mutable_sheets(0)->mutable_placement()->mutable_rotation();
  upright.set_w(1);
  upright.set_z(-1);  // the warp hangs down
  const std::string file = record(scene, "panels");
  const auto fronts = [&](const std::string& colour) {
    const Image image = render({file, "--frame", "0", "--colour", colour, "--size", "100x100",
                                "--azimuth", "90", "--elevation", "0"});
    return find_front(image, 0, 100);
  };
  const Seen cloth = fronts("cloth");
  const Seen panels = fronts("panels");
  EXPECT_NEAR(cloth.width(), cloth.height(), 2);
  EXPECT_NEAR(panels.height(), cloth.height() / 2.0, 2);
}

TEST_F(RenderTest, ShowsSeveralFramesAndTheSameBytesAgain) {
  const std::string square = record(standing_square(), "square");
  const auto answer = ask({"render", square, "--contact", "4", "--size", "128x128", "-o", png_});
  EXPECT_EQ(answer["frames"], (nlohmann::json{{0, 1, 2, 3}}));
  const std::string bytes = read_file(png_);
  ask({"render", square, "--frame", "0,1,2,3", "--size", "128x128", "-o", png_});
  EXPECT_EQ(read_file(png_), bytes);
  const Image image(png_);
  for (const int x : {32, 96})
    for (const int y : {28, 92}) EXPECT_TRUE(image.at(x, y).is_front());
}

TEST_F(RenderTest, SaysWhatIsWrong) {
  const std::string square = record(standing_square(), "square");
  const auto refused = [&](std::vector<std::string> arguments, int exit) {
    arguments.insert(arguments.begin(), {"render", square});
    const Outcome outcome = weft(std::move(arguments));
    EXPECT_EQ(outcome.exit, exit);
    return outcome.err;
  };
  EXPECT_THAT(refused({"--frame", "2,4", "-o", png_}, 1), HasSubstr("no frame 4; it has 0 to 3"));
  for (const std::string size : {"63x64", "64x8193", "64", "64x", "axb", "64x64x64"}) {
    EXPECT_THAT(refused({"--size", size, "-o", png_}, 2),
                HasSubstr("--size " + size + ": write WIDTHxHEIGHT, each 64 to 8192 pixels"));
  }
  EXPECT_THAT(refused({"--contact", "4", "--size", "127x128", "-o", png_}, 2),
              HasSubstr("127 x 128 pixels are too few for 2 x 2 frames, of 64 x 64 each"));
  EXPECT_THAT(refused({"--size", "64x64", "-o", path("no/x.png")}, 4),
              HasSubstr("cannot write " + path("no/x.png") + ": No such file or directory"));
  EXPECT_THAT(refused({"-o", square}, 4), HasSubstr("it is the recording itself"));
  EXPECT_THAT(refused({"--turntable", "-o", png_}, 2), HasSubstr("-o PATH must end in .webp"));
  EXPECT_THAT(refused({"--turntable", "--frame", "1,2", "-o", path("x.webp")}, 2),
              HasSubstr("shows one frame of each recording"));
  EXPECT_THAT(refused({"--turntable", "1", "-o", path("x.webp")}, 2), HasSubstr("2"));
  EXPECT_FALSE(std::filesystem::exists(png_));
}

}  // namespace
}  // namespace weft::testing
