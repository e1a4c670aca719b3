#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <pugixml.hpp>

#include "client/recording/points.h"
#include "client/recording/reader.h"
#include "tests/client/client_test.h"
#include "tests/client/page_content.h"
#include "tests/support/service/assets.h"

namespace weft::testing {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::int64_t kEnd = 20;

// Recordings of a hung sheet and of one that falls beside a ball.
class PageTest : public ClientTest {
 protected:
  PageTest() {
    service_.create(small_scene(), "hung");
    v1::Scene scene = small_scene();
    scene.mutable_sheets(0)->clear_pins();
    scene.mutable_sheets(0)->mutable_placement()->mutable_origin_m()->set_y(3);
    scene.add_colliders()->mutable_sphere()->set_radius_m(0.2);
    service_.create(scene, "fallen");
    for (const std::string name : {"hung", "fallen"}) {
      ask({"record", name, "--run", "--to", std::to_string(kEnd), "--encoding", "float64", "-o",
           path(name + ".weft")});
    }
  }

  const std::string hung_ = path("hung.weft");
  const std::string fallen_ = path("fallen.weft");
  const std::string page_ = path("page.html");
};

// Takes as many numbers from the front as there are in four planes.
std::vector<std::int64_t> take(std::string& planes, std::size_t count) {
  std::vector<std::int64_t> numbers(count);
  for (std::size_t i = 0; i < count; ++i) {
    std::int64_t zigzag = 0;
    for (std::size_t plane = 4; plane-- > 0;)
      zigzag = zigzag * 256 + static_cast<unsigned char>(planes.at(plane * count + i));
    numbers[i] = zigzag % 2 == 0 ? zigzag / 2 : -(zigzag + 1) / 2;
  }
  planes.erase(0, 4 * count);
  return numbers;
}

// Coordinates of every frame, m, in the order x, y, z of particle 0, of particle 1 ...
std::vector<std::vector<double>> decode(const std::string& page, std::size_t index) {
  const nlohmann::json facts = description(page)["recordings"][index];
  const std::size_t frames = facts["time_s"].size();
  const std::size_t particles = facts["particles"];
  std::string planes = inflated(page, "frames-" + std::to_string(index));

  const auto guesses = take(planes, 4 * particles);
  std::vector<std::int64_t> numbers(3 * particles);
  std::vector<std::vector<double>> decoded(frames, std::vector<double>(3 * particles));
  for (auto& frame : decoded) {
    const auto beyond = take(planes, 3 * particles);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::map<std::int64_t, std::int64_t> moves{{particles, 0}};
      std::int64_t particle = 0;
      for (std::size_t k = 0; k < particles; ++k) {
        particle += guesses[k];
        const auto move = [&](std::size_t which) {
          return moves.at(particle - guesses[which * particles + k]);
        };
        moves[particle] = beyond[axis * particles + k] + move(1) + move(2) - move(3);
        const std::size_t i = 3 * static_cast<std::size_t>(particle) + axis;
        numbers[i] += moves[particle];
        frame[i] = facts["origin_m"][axis].get<double>() +
                   static_cast<double>(numbers[i]) * facts["quantum_m"].get<double>();
      }
      EXPECT_EQ(moves.size(), particles + 1);
    }
  }
  EXPECT_EQ(planes, "");
  return decoded;
}

TEST_F(PageTest, NeedsNoNetwork) {
  ask({"view", hung_, "-o", page_});
  const std::string page = read_file(page_);
  EXPECT_THAT(page, HasSubstr("content=\"default-src 'none'; script-src 'unsafe-inline'; "
                              "style-src 'unsafe-inline'\""));
  EXPECT_THAT(page, AllOf(Not(HasSubstr("<link")), Not(HasSubstr("<img")), Not(HasSubstr("url(")),
                          Not(HasSubstr("@import")), Not(HasSubstr("<script src"))));
  EXPECT_LT(page.size(), 500'000);
}

// Of a page and the recordings it is of.
void expect_within(double bound, const std::string& page,
                   const std::vector<std::string>& recordings) {
  for (std::size_t index = 0; index < recordings.size(); ++index) {
    const auto decoded = decode(page, index);
    client::RecordingReader recording(recordings[index]);
    ASSERT_EQ(decoded.size(), recording.last_frame() + 1);
    for (std::size_t frame = 0; frame < decoded.size(); ++frame) {
      const auto recorded = client::read_points(
          recording.read(static_cast<std::int64_t>(frame)).positions_m(), recording.header());
      for (std::size_t i = 0; i < recorded.x.size(); ++i) {
        ASSERT_NEAR(decoded[frame][3 * i], recorded.x[i], bound + 1e-12);
        ASSERT_NEAR(decoded[frame][3 * i + 1], recorded.y[i], bound + 1e-12);
        ASSERT_NEAR(decoded[frame][3 * i + 2], recorded.z[i], bound + 1e-12);
      }
    }
  }
}

TEST_F(PageTest, HoldsEveryPositionWithinTheErrorItStates) {
  const double bound = ask({"view", hung_, fallen_, "-o", page_})["largest_error_m"];
  EXPECT_LE(bound, 0.05 / 8192);  // of the spacing
  expect_within(bound, read_file(page_), {hung_, fallen_});
}

TEST_F(PageTest, IsKeptSmallByLessPrecisePositions) {
  const auto whole = ask({"view", hung_, "-o", page_});
  const auto small =
      ask({"view", hung_, "-o", page_, "--most-mb", "0.1"});  // more than that there is besides
  EXPECT_LT(small["bytes"], whole["bytes"]);
  EXPECT_NEAR(small["largest_error_m"], 0.05 / 256, 1e-12);  // and no less precise
  expect_within(small["largest_error_m"], read_file(page_), {hung_});
  EXPECT_EQ(weft({"view", hung_, "-o", page_, "--most-mb", "0"}).exit, 2);
}

TEST_F(PageTest, SaysWhatItShows) {
  ask({"view", hung_, fallen_, "--frames", "5:8", "-o", page_});
  const nlohmann::json page = description(read_file(page_));
  EXPECT_EQ(page["title"], "hung, fallen");
  EXPECT_EQ(page["figures"][0]["recordings"], (nlohmann::json{0, 1}));
  const nlohmann::json& hung = page["recordings"][0];
  EXPECT_EQ(hung["first_frame"], 5);
  EXPECT_EQ(hung["time_s"].size(), 4);
  EXPECT_EQ(hung["stats"]["largest_strain"].size(), 4);
  EXPECT_EQ(hung["sheets"][0]["pinned"], (nlohmann::json{0, 4}));
  EXPECT_EQ(page["recordings"][1]["colliders"][0]["sphere"]["radius_m"], 0.2);
  EXPECT_THAT(page.dump(), AllOf(HasSubstr("[\"k_s, stretch\",\"200 N/m\"]"),
                                 HasSubstr("[\"spacing\",\"50 mm\"]")));
}

TEST_F(PageTest, ASheetOfTrianglesBringsThemAndItsPanels) {
  v1::MeshData mesh = square_mesh(4);
  for (const char* name : {"front", "back"}) {
    v1::Panel& panel = *mesh.add_panels();
    panel.set_name(name);
    panel.set_triangle_count(16);
    panel.set_grain_rad(name == std::string("back") ? std::acos(-1) / 6 : 0);
  }
  service_.create(scene_of(mesh), "sewn");
  const std::string sewn = path("sewn.weft");
  ask({"record", "sewn", "--run", "--to", "2", "-o", sewn});
  const double bound = ask({"view", sewn, hung_, "-o", page_})["largest_error_m"];
  EXPECT_LE(bound, 0.25 / 8192);  // of an edge
  const nlohmann::json page = description(read_file(page_));
  const nlohmann::json& sheet = page["recordings"][0]["sheets"][0];
  EXPECT_EQ(sheet["particle_count"], 25);
  EXPECT_EQ(from_base64(sheet["mesh"]["triangles"]), mesh.triangles());
  EXPECT_EQ(from_base64(sheet["mesh"]["flat_m"]), mesh.flat_m());
  EXPECT_EQ(sheet["mesh"]["panels"][1]["name"], "back");
  EXPECT_THAT(page["recordings"][0]["facts"].dump(),
              AllOf(HasSubstr("[\"particles\",\"25\"],[\"triangles\",\"32\"]"),
                    HasSubstr("[\"median edge\",\"250 mm\"],[\"area\",\"1 m²\"]"),
                    HasSubstr("[\"panel front\",\"0.5 m²\"]"),
                    HasSubstr("[\"panel back\",\"0.5 m², grain 30°\"]")));
  EXPECT_FALSE(page["recordings"][1]["sheets"][0].contains("mesh"));
}

TEST_F(PageTest, ATitleCannotEndItsScript) {
  const std::string title = "</script><script>alert(1)</script>";
  ask({"view", hung_, "--title", title, "-o", page_});
  EXPECT_EQ(description(read_file(page_))["title"], title);
}

TEST_F(PageTest, WhatCannotBeShownIsRefused) {
  EXPECT_EQ(weft({"view", hung_, "--frames", "90:", "-o", page_}).exit, 2);
  EXPECT_EQ(weft({"view", path("none.weft"), "-o", page_}).exit, 4);
  EXPECT_THAT(weft({"view", hung_, "-o", hung_}).err, HasSubstr("it is the recording itself"));
  EXPECT_EQ(client::RecordingReader(hung_).last_frame(), kEnd);
}

TEST_F(PageTest, APlotHasCurvesOfEnergyStrainSpeedAndSubsteps) {
  ask({"plot", hung_, fallen_, "-o", path("plot.svg")});
  pugi::xml_document svg;
  ASSERT_TRUE(svg.load_file(path("plot.svg").c_str()));
  std::vector<std::size_t> curves;
  std::vector<std::size_t> points;
  for (const auto& plot : svg.first_child().children("svg")) {
    curves.push_back(0);
    for (const auto& curve : plot.child("svg").children("polyline")) {
      const std::string text = curve.attribute("points").value();
      points.push_back(static_cast<std::size_t>(std::count(text.begin(), text.end(), ',')));
      ++curves.back();
    }
  }
  EXPECT_EQ(curves, (std::vector<std::size_t>{4, 2, 2, 2}));
  EXPECT_THAT(points, Each(::testing::AnyOf(kEnd, kEnd + 1)));
}

TEST_F(PageTest, HoldsWhatWasRecordedBesidePositionsInLevels) {
  ask({"record", "fallen", "--from", "0", "--to", std::to_string(kEnd), "--pressure", "--clearance",
       "-o", fallen_, "--force"});
  ask({"view", fallen_, "-o", page_});
  const std::string page = read_file(page_);
  const nlohmann::json kinds = description(page)["recordings"][0]["values"];
  std::string bytes = inflated(page, "values-0");
  ASSERT_EQ(bytes.size(), 2 * 20 * (kEnd + 1));
  const nlohmann::json& kind = kinds["clearance"];  // after pressure
  const auto low = kind["low"].get<double>(), high = kind["high"].get<double>();
  client::RecordingReader recording(fallen_);
  std::array<unsigned char, 20> level{};
  for (std::int64_t frame = 0; frame <= kEnd; ++frame) {
    const auto wanted = client::read_clearances(recording.read(frame), recording.header());
    for (std::size_t i = 0; i < 20; ++i) {
      level[i] = static_cast<unsigned char>(
          level[i] + static_cast<unsigned char>(
                         bytes[20 * (kEnd + 1) + static_cast<std::size_t>(frame) * 20 + i]));
      const double share = level[i] / kind["most"].get<double>();
      EXPECT_NEAR(low + (high - low) * share * share, std::min(wanted[i], high),
                  (high - low) / 255);
    }
  }
  EXPECT_GT(high, 2);  // m, where it starts
  EXPECT_EQ(kinds["pressure"]["high"], 0);
}

}  // namespace
}  // namespace weft::testing
