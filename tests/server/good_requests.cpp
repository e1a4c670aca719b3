#include "tests/server/good_requests.h"

#include <google/protobuf/dynamic_message.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <map>

#include "tests/server/mutations.h"
#include "tests/support/service/assets.h"
#include "tests/support/service/service.h"
#include "weft/v1/frame.pb.h"
#include "weft/v1/garment.pb.h"
#include "weft/v1/lab.pb.h"
#include "weft/v1/session.pb.h"

namespace weft::testing {

using google::protobuf::Descriptor;

namespace {

void set(v1::Vector3* vector, double x, double y, double z) {
  vector->set_x(x);
  vector->set_y(y);
  vector->set_z(z);
}

void set(v1::Rotation* rotation) {
  rotation->set_w(1);
  rotation->set_x(0.1);
  rotation->set_y(0.2);
  rotation->set_z(0.3);
}

template <class Message>
void add_path(Message* message) {
  for (int i = 0; i < 2; ++i) {
    v1::Keyframe* key = message->add_path();
    key->set_time_s(1 + i);
    set(key->mutable_offset_m(), 0.1 * i, 0, 0);
  }
}

// A square with all that a mesh can have.
v1::MeshData full_mesh(const v1::Textile& textile) {
  v1::MeshData mesh = square_mesh(2);
  const std::size_t plane = mesh.flat_m().size() / 2;
  const std::string u = mesh.flat_m().substr(0, plane), v = mesh.flat_m().substr(plane);
  mesh.set_positions_m(u + std::string(plane, '\0') + v);
  mesh.set_flat_triangles(mesh.triangles());
  v1::Panel* panel = mesh.add_panels();
  panel->set_name("front");
  panel->set_triangle_count(8);
  panel->set_grain_rad(0.1);
  *panel->mutable_textile() = textile;
  v1::Fold* fold = mesh.add_folds();
  fold->mutable_particles()->Add(1);
  fold->mutable_particles()->Add(4);
  fold->set_angle_rad(-0.5);
  return mesh;
}

}  // namespace

v1::Scene full_scene() {
  v1::Scene scene = small_scene();
  v1::Sheet* sheet = scene.mutable_sheets(0);
  sheet->set_name("all");
  sheet->mutable_textile()->mutable_raw()->set_clamp_n_per_m(100);
  sheet->mutable_textile()->set_damping_kg_per_s(1e-4);
  sheet->mutable_textile()->set_friction_coefficient(0.5);
  v1::ChoiKo* law = sheet->mutable_bending()->mutable_choi_ko();
  law->set_evaluator(v1::EVALUATOR_LINEARIZED);
  law->set_segments(16);
  law->set_degree(6);
  law->set_fold_clamp(true);
  law->set_diagonal_bend(true);
  set(sheet->mutable_placement()->mutable_origin_m(), 0, 1, 0);
  set(sheet->mutable_placement()->mutable_rotation());
  for (int i = 0; i < 20; ++i) {
    for (const double value : {0.05 * (i % 5), 1.0, 0.05 * (i / 5)}) {
      sheet->add_start_positions_m(value);
      sheet->add_start_velocities_m_per_s(0.1);
    }
  }
  add_path(sheet->mutable_pins(0));
  sheet->set_skin_m(0.001);
  sheet->set_thickness_m(0.002);
  sheet->set_tether_stretch(0.01);

  v1::Sheet* measured = scene.add_sheets();
  *measured->mutable_grid() = sheet->grid();
  v1::MeasuredTextile* textile = measured->mutable_textile()->mutable_measured();
  textile->set_areal_density_kg_per_m2(0.2);
  textile->set_tensile_warp_n_per_m(100);
  textile->set_tensile_weft_n_per_m(110);
  textile->set_shear_n_per_m(10);
  textile->set_bend_rigidity_warp_n_m(1e-5);
  textile->set_bend_rigidity_weft_n_m(2e-5);
  textile->set_air_drag_kg_per_m2_s(0.1);
  measured->mutable_bending()->mutable_isometric()->set_resist_compression(false);
  measured->mutable_textile()->set_damping_ratio(1e-3);
  v1::Sheet* mesh = scene.add_sheets();
  *mesh->mutable_textile() = measured->textile();
  *mesh->mutable_triangles()->mutable_data() = full_mesh(measured->textile());
  v1::Sheet* uploaded = scene.add_sheets();
  *uploaded->mutable_textile() = measured->textile();
  uploaded->mutable_triangles()->set_asset(name_of_asset(known_asset()));
  v1::Sheet* preset = scene.add_sheets();
  *preset->mutable_grid() = sheet->grid();
  preset->mutable_grid()->set_simulated_every(1);
  preset->mutable_textile()->set_preset("denim_11oz");

  v1::Plane* plane = scene.add_colliders()->mutable_plane();
  set(plane->mutable_point_m(), 0, -1, 0);
  set(plane->mutable_normal(), 0, 1, 0);
  v1::Sphere* sphere = scene.add_colliders()->mutable_sphere();
  set(sphere->mutable_center_m(), 0, -2, 0);
  sphere->set_radius_m(0.3);
  v1::Box* box = scene.add_colliders()->mutable_box();
  set(box->mutable_center_m(), 1, -2, 0);
  set(box->mutable_half_size_m(), 0.1, 0.2, 0.3);
  set(box->mutable_rotation());
  v1::Capsule* capsule = scene.add_colliders()->mutable_capsule();
  set(capsule->mutable_start_m(), 2, -2, 0);
  set(capsule->mutable_end_m(), 2, -2, 1);
  capsule->set_radius_m(0.1);
  v1::BodyMesh* body = scene.add_colliders()->mutable_mesh();
  *body->mutable_data() = cube_mesh(0.1F, 4, -2, 0);
  body->set_cell_m(0.04);
  v1::Poses* poses = body->mutable_data()->mutable_poses();
  poses->add_times_s(150);  // after any dressing
  poses->add_times_s(151);
  poses->set_positions_m(body->data().positions_m() + cube_mesh(0.1F, 4, -1.9F, 0).positions_m());
  v1::BodyMesh* uploaded_body = scene.add_colliders()->mutable_mesh();
  uploaded_body->set_asset(name_of_asset(known_body()));
  uploaded_body->set_cell_m(0.04);
  for (v1::Collider& collider : *scene.mutable_colliders()) {
    collider.set_friction_coefficient(0.2);
    add_path(&collider);
  }

  scene.set_cloth_contact(true);
  scene.set_untangle_s(0.5);
  v1::Dressing* dressing = scene.mutable_dressing();
  dressing->set_close_s(0.1);
  dressing->set_settle_s(0.05);
  dressing->set_drag_per_s(10);
  dressing->set_deflate_m(0.001);
  v1::Hold* hold = dressing->add_holds();
  hold->set_sheet("all");
  for (const int particle : {3, 4}) hold->add_particles(particle);
  hold->set_until_s(0.2);

  set(scene.mutable_environment()->mutable_gravity_m_per_s2(), 0, -9.8, 0);
  v1::Wind* wind = scene.mutable_environment()->mutable_wind();
  set(wind->mutable_velocity_m_per_s(), 1, 0, 0);
  wind->set_gust(0.5);
  wind->set_gust_period_s(2);
  wind->set_air_density_kg_per_m3(1.2);
  wind->set_tangential_drag_kg_per_m2_s(0.01);

  scene.mutable_solver()->set_integrator(v1::INTEGRATOR_VERLET);
  scene.mutable_solver()->set_frame_step_s(0.01);
  scene.mutable_solver()->set_substep_s(1e-5);
  scene.mutable_solver()->set_safety(0.8);
  scene.mutable_solver()->set_step_bound(v1::STEP_BOUND_UNSHEARED);
  scene.mutable_solver()->set_max_repairs(5);
  scene.mutable_solver()->set_max_self_weight_strain(0.5);
  scene.mutable_solver()->set_slow_forces_every(2);
  return scene;
}

std::string known_body() { return cube_mesh(0.1F, 3, -2, 0).SerializeAsString(); }
std::string known_asset() { return square_mesh(1).SerializeAsString(); }

std::vector<std::string> known_requests(const std::string& type) {
  static const std::multimap<std::string, std::string> known = {
      {"CreateSessionRequest", "refused_warnings: 'MESH_DEPENDENT'"},  // its scene is full_scene()
      {"GetSessionRequest", "name: 'sessions/it'"},
      {"ListSessionsRequest", "page_size: 5 page_token: 'it'"},
      {"DeleteSessionRequest", "name: 'sessions/it' allow_missing: true"},
      {"UpdateTextileRequest",
       "name: 'sessions/it' sheet: 'sheet' textile { raw { particle_mass_kg: 0.001 clamp_n_per_m: "
       "9 } "
       "damping_kg_per_s: 1e-4 friction_coefficient: 0.4 }"},
      {"UpdateTextileRequest",
       "name: 'sessions/it' textile { raw { particle_mass_kg: 0.001 bend_n_m2: 1e-6 } } "
       "update_mask { paths: "
       "'raw.bend_n_m2' } duration_s: 0.5"},
      {"UpdateTextileRequest",
       "name: 'sessions/it' textile { measured { areal_density_kg_per_m2: 0.2 "
       "tensile_warp_n_per_m: 100 tensile_weft_n_per_m: 110 shear_n_per_m: 10 "
       "bend_rigidity_warp_n_m: 1e-5 bend_rigidity_weft_n_m: 2e-5 air_drag_kg_per_m2_s: 0.1 } }"},
      {"UpdateTextileRequest", "name: 'sessions/it' textile { preset: 'denim_11oz' }"},
      {"StepSessionRequest", "name: 'sessions/it' frames: 2 expected_frame: 0"},
      {"RunSessionRequest", "name: 'sessions/it' time_scale: 2 until_frame: 3 until_rest: true"},
      {"PauseSessionRequest", "name: 'sessions/it'"},
      {"GetVerdictRequest", "name: 'sessions/it'"},
      {"CreateSnapshotRequest", "parent: 'sessions/it' snapshot_id: 'another'"},
      {"ListSnapshotsRequest", "parent: 'sessions/it'"},
      {"RestoreSessionRequest", "name: 'sessions/it/snapshots/it' session_id: 'new'"},
      {"InteractRequest", "session: 'sessions/it' sequence: 1 action { grab { particle: 3 } }"},
      {"StreamFramesRequest",
       "session: 'sessions/it' start_frame: 0 end_frame: 0 format { encoding: "
       "FRAME_ENCODING_FLOAT64 "
       "velocities: true stats: true grid_step_m: 0.001 first_particle: 2 particle_count: 9 "
       "stride: 2 pressure: true } slow_reader: SLOW_READER_HOLD_SESSION"},
      {"ViewFramesRequest",
       "session: 'sessions/it' format { encoding: FRAME_ENCODING_QUANTIZED_ZSTD velocities: true "
       "stats: true grid_step_m: 0.001 } credits: 2"},
      {"UploadAssetRequest", ""},  // of another asset
      {"GetAssetRequest", ""},     // of known_asset()
      {"DownloadAssetRequest", "offset: 7"},
      {"DeleteAssetRequest", "allow_missing: true"},
      {"ListAssetsRequest", "page_size: 5"},
      {"GetTextileRequest", "name: 'textiles/denim_11oz'"},
      {"RunTestRequest",
       "test: LAB_TEST_BENDING textile { measured { areal_density_kg_per_m2: 0.2 "
       "tensile_warp_n_per_m: 100 tensile_weft_n_per_m: 110 shear_n_per_m: 10 "
       "bend_rigidity_warp_n_m: 1e-5 bend_rigidity_weft_n_m: 2e-5 } } "
       "bending { choi_ko { segments: 8 } } direction: LAB_DIRECTION_WEFT spacings_m: 0.01"},
      {"RunTestRequest",
       "test: LAB_TEST_TENSILE textile { preset: 'wool_tropical' } bending { isometric {} } "
       "direction: LAB_DIRECTION_WARP spacings_m: 0.01 mesh: LAB_MESH_IRREGULAR"},
      {"BuildGarmentRequest",
       "pattern { panels { name: 'front' edges { points_m: [0.2, 0.02] label: 'hem' } "
       "edges { points_m: [0.25, 0.15, 0.2, 0.3] arc: true } edges { points_m: [0, 0.3] } "
       "edges { points_m: [0, 0] } grain_rad: 0.1 placement { origin_m { x: 0.1 y: 1 z: 0.2 } "
       "rotation { w: 1 x: 0.1 y: 0.2 z: 0.3 } } textile { measured { areal_density_kg_per_m2: 0.2 "
       "tensile_warp_n_per_m: 100 tensile_weft_n_per_m: 110 shear_n_per_m: 10 "
       "bend_rigidity_warp_n_m: 1e-5 bend_rigidity_weft_n_m: 2e-5 air_drag_kg_per_m2_s: 0.1 } "
       "friction_coefficient: 0.4 damping_kg_per_s: 1e-4 } "
       "creases { points_m: [0.1, 0.08, 0.1, 0.25] fold_rad: 2 } } "
       "panels { name: 'back' edges { points_m: [0.2, 0] } edges { points_m: [0.2, 0.3] } "
       "edges { points_m: [0, 0.3] } edges { points_m: [0, 0] } textile { preset: 'denim_11oz' } "
       "creases { points_m: [0.1, 0.3, 0.2, 0.15] fold_rad: 2 start_rad: 1.5 } } "
       "seams { first_side { panel: 'front' edge: 3 begin: 0.1 end: 0.9 } "
       "second_side { panel: 'back' edge: 1 begin: 0.2 end: 0.9 } fold_rad: -0.5 } } "
       "edge_m: 0.05"},
  };
  std::vector<std::string> texts;
  const auto [first, last] = known.equal_range(type);
  for (auto each = first; each != last; ++each) texts.push_back(each->second);
  return texts;
}

namespace {

// Something in every field; of a oneof in its `variant`th.
void fill(Message& message, int variant, int depth = 0) {
  const auto* r = message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& field = *message.GetDescriptor()->field(i);
    if (const auto* oneof = field.real_containing_oneof();
        oneof != nullptr && oneof->field(variant % oneof->field_count()) != &field) {
      continue;
    }
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      if (depth == 8) continue;
      fill(field.is_repeated() ? *r->AddMessage(&message, &field)
                               : *r->MutableMessage(&message, &field),
           variant, depth + 1);
    } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_STRING) {
      const bool session = field.name() == "name" || field.name() == "session";
      if (session && depth == 0) r->SetString(&message, &field, "sessions/it");
    } else if (is_number(field)) {
      set_number(message, field, 1);
    }
  }
}

}  // namespace

std::vector<std::unique_ptr<Message>> good_requests(const Descriptor& type) {
  const Message* prototype =
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type);
  std::vector<std::unique_ptr<Message>> requests;
  for (const std::string& text : known_requests(type.name())) {
    Message& request = *requests.emplace_back(prototype->New());
    EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(text, &request)) << text;
    if (auto* create = dynamic_cast<v1::CreateSessionRequest*>(&request)) {
      *create->mutable_session()->mutable_scene() = full_scene();
      create->set_session_id("new");
      create->set_validate_only(true);
    }
    if (const auto* field = type.FindFieldByName("name"); type.name().ends_with("AssetRequest"))
      request.GetReflection()->SetString(&request, field, name_of_asset(known_asset()));
    if (auto* upload = dynamic_cast<v1::UploadAssetRequest*>(&request)) {
      const std::string bytes = square_mesh(2).SerializeAsString();
      upload->set_name(name_of_asset(bytes));
      upload->set_size_bytes(static_cast<std::int64_t>(bytes.size()));
      upload->set_data(bytes);
    }
  }
  const int variants = requests.empty() ? 4 : 0;
  for (int variant = 0; variant < variants; ++variant)
    fill(*requests.emplace_back(prototype->New()), variant);
  return requests;
}

}  // namespace weft::testing
