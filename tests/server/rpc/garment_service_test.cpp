#include <gmock/gmock.h>

#include <set>

#include "tests/support/service/service.h"
#include "weft/v1/garment.grpc.pb.h"

namespace weft::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

v1::PatternPanel* add_rectangle(v1::Pattern& pattern, const std::string& name, double width,
                                double height) {
  v1::PatternPanel* panel = pattern.add_panels();
  panel->set_name(name);
  for (const auto& [u, v] : {std::pair(width, 0.0), {width, height}, {0.0, height}, {0.0, 0.0}}) {
    v1::PatternEdge* edge = panel->add_edges();
    edge->add_points_m(u);
    edge->add_points_m(v);
  }
  return panel;
}

void sew(v1::Pattern& pattern, const std::string& first, int first_edge, const std::string& second,
         int second_edge) {
  v1::PatternSeam* seam = pattern.add_seams();
  seam->add_first_side()->set_panel(first);
  seam->mutable_first_side(0)->set_edge(first_edge);
  seam->add_second_side()->set_panel(second);
  seam->mutable_second_side(0)->set_edge(second_edge);
}

// A tube of denim with a band of wool above.
v1::BuildGarmentRequest skirt() {
  v1::BuildGarmentRequest request;
  v1::Pattern& pattern = *request.mutable_pattern();
  add_rectangle(pattern, "skirt", 0.6, 0.3)->mutable_textile()->set_preset("denim_11oz");
  v1::PatternPanel* band = add_rectangle(pattern, "band", 0.5, 0.04);
  band->set_grain_rad(1.5);
  band->mutable_edges(2)->set_label("waist");
  band->mutable_placement()->mutable_origin_m()->set_y(0.32);
  sew(pattern, "skirt", 1, "skirt", 3);
  sew(pattern, "band", 1, "band", 3);
  sew(pattern, "band", 0, "skirt", 2);
  request.set_edge_m(0.03);
  return request;
}

// Two panels sewn at the sides, with straps a tenth of a metre wide that are sewn on the shoulders.
v1::BuildGarmentRequest vest() {
  v1::BuildGarmentRequest request;
  v1::Pattern& pattern = *request.mutable_pattern();
  for (const auto& [name, z] : {std::pair("front", 0.2), {"back", -0.2}}) {
    v1::PatternPanel* panel = pattern.add_panels();
    panel->set_name(name);
    for (const auto& [u, v] : {std::pair(0.5, 0.0),
                               {0.5, 0.3},
                               {0.4, 0.5},
                               {0.3, 0.5},
                               {0.3, 0.3},
                               {0.2, 0.3},
                               {0.2, 0.5},
                               {0.1, 0.5},
                               {0.0, 0.3},
                               {0.0, 0.0}}) {
      v1::PatternEdge* edge = panel->add_edges();
      edge->add_points_m(u);
      edge->add_points_m(v);
    }
    panel->mutable_edges(0)->set_label("waist");
    panel->mutable_placement()->mutable_origin_m()->set_z(z);
    if (z < 0) {  // its outside looks back
      panel->mutable_placement()->mutable_rotation()->set_y(1);
      panel->mutable_placement()->mutable_origin_m()->set_x(0.5);
    }
  }
  sew(pattern, "front", 1, "back", 9);
  sew(pattern, "front", 9, "back", 1);
  sew(pattern, "front", 3, "back", 7);
  sew(pattern, "front", 7, "back", 3);
  request.set_edge_m(0.03);
  return request;
}

std::pair<v1::BuildGarmentResponse, Error> build(Service& service,
                                                 const v1::BuildGarmentRequest& request) {
  grpc::ClientContext context;
  v1::BuildGarmentResponse response;
  const auto stub = v1::GarmentService::NewStub(service.channel);
  const grpc::Status status = stub->BuildGarment(&context, request, &response);
  return {response, Error(status)};
}

TEST(GarmentService, ShouldersCarryAGarmentThatHasThemNotItsWaist) {
  Service service;
  const auto [garment, error] = build(service, vest());
  ASSERT_EQ(error.code, grpc::StatusCode::OK) << error.message;
  EXPECT_EQ(garment.edges(0).label(), "waist");
  EXPECT_EQ(garment.dressing().holds_size(), 0);
}

TEST(GarmentService, ShouldersCarryADressHoweverWideItsSkirt) {
  Service service;
  v1::BuildGarmentRequest request = vest();
  v1::Pattern& pattern = *request.mutable_pattern();
  for (const int side : {0, 1}) {
    const v1::PatternPanel above = pattern.panels(side);
    v1::PatternPanel* panel = pattern.add_panels();
    panel->set_name(above.name() + "_skirt");
    *panel->mutable_placement() = above.placement();
    for (const auto& [u, v] : {std::pair(1.75, -1.0), {0.5, 0.0}, {0.0, 0.0}, {-1.25, -1.0}}) {
      v1::PatternEdge* edge = panel->add_edges();
      edge->add_points_m(u);
      edge->add_points_m(v);
    }
    sew(pattern, panel->name(), 2, above.name(), 0);
  }
  sew(pattern, "front_skirt", 1, "back_skirt", 3);
  sew(pattern, "front_skirt", 3, "back_skirt", 1);
  const auto [dress, error] = build(service, request);
  ASSERT_EQ(error.code, grpc::StatusCode::OK) << error.message;
  EXPECT_EQ(dress.dressing().holds_size(), 0);
}

TEST(GarmentService, BuildsASheetThatCanBeSimulatedAndSaysWhichParticlesEdgesHave) {
  Service service;
  const auto [garment, error] = build(service, skirt());
  ASSERT_EQ(error.code, grpc::StatusCode::OK) << error.message;
  EXPECT_GT(garment.least_height(), 0.35);
  ASSERT_EQ(garment.notes_size(), 1);
  EXPECT_EQ(garment.notes(0).code(), "SEAM_UNEQUAL");
  EXPECT_EQ(garment.notes(0).field(), "pattern.seams[2]");

  const v1::MeshData& mesh = garment.sheet().triangles().data();
  ASSERT_EQ(mesh.panels_size(), 2);
  EXPECT_EQ(mesh.panels(0).textile().preset(), "denim_11oz");
  EXPECT_FALSE(mesh.panels(1).has_textile());
  EXPECT_EQ(mesh.panels(1).grain_rad(), 1.5);
  ASSERT_EQ(garment.edges_size(), 8);
  EXPECT_EQ(garment.edges(6).label(), "waist");
  EXPECT_DOUBLE_EQ(garment.edges(6).length_m(), 0.5);
  ASSERT_EQ(garment.dressing().holds_size(), 1);
  EXPECT_THAT(std::set(garment.edges(6).particles().begin(), garment.edges(6).particles().end()),
              ::testing::ElementsAreArray(garment.dressing().holds(0).particles()));
  // the waist is closed, and the band's lower edge is the skirt's upper one
  EXPECT_EQ(*garment.edges(6).particles().begin(), *garment.edges(6).particles().rbegin());
  EXPECT_THAT(
      std::vector(garment.edges(4).particles().rbegin(), garment.edges(4).particles().rend()),
      ::testing::ElementsAreArray(garment.edges(2).particles()));

  v1::Scene scene;
  *scene.add_sheets() = garment.sheet();
  scene.mutable_sheets(0)->mutable_textile()->set_preset("wool_tropical");
  service.step(service.create(scene), 2);
  const auto again = build(service, skirt()).first;
  EXPECT_EQ(garment.SerializeAsString(), again.SerializeAsString());
}

TEST(GarmentService, RefusesAPatternWithEveryFault) {
  Service service;
  v1::BuildGarmentRequest request = skirt();
  request.mutable_pattern()->mutable_panels(0)->mutable_edges(1)->add_points_m(0);
  request.mutable_pattern()->mutable_panels(1)->mutable_textile()->set_preset("none");
  request.mutable_pattern()->mutable_seams(2)->mutable_second_side(0)->set_panel("shirt");
  request.set_edge_m(1);
  const Error error = build(service, request).second;
  EXPECT_EQ(error.reason(), "FIELD_INVALID");
  EXPECT_THAT(error.fields(),
              ElementsAre("pattern.panels[0].edges[1].points_m", "pattern.panels[1].textile.preset",
                          "edge_m", "pattern.seams[2].second_side[0].panel"));
  EXPECT_THAT(error.message, HasSubstr("3 numbers"));
}

}  // namespace
}  // namespace weft::testing
