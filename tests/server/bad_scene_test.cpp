#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <google/protobuf/util/message_differencer.h>

#include <climits>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "tests/support/service/service.h"

// Bad scenes made from the descriptors of the interface: a new field is covered at once.
namespace weft::testing {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

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

// A good scene in which every message, and every variant of every oneof, occurs.
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
  measured->mutable_bending()->mutable_isometric();
  v1::Sheet* preset = scene.add_sheets();
  *preset->mutable_grid() = sheet->grid();
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
  for (v1::Collider& collider : *scene.mutable_colliders()) {
    collider.set_friction_coefficient(0.2);
    add_path(&collider);
  }

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
  scene.mutable_solver()->set_max_repairs(5);
  scene.mutable_solver()->set_max_self_weight_strain(0.5);
  return scene;
}

// A change of one field of one message.
struct Mutation {
  std::string what;
  bool acceptable;  // the documented range may allow it
  std::function<void(Message&, const FieldDescriptor&)> apply;
};

std::vector<Mutation> numbers(const FieldDescriptor& field) {
  const auto number = [](std::string what, bool acceptable, double value) -> Mutation {
    return {std::move(what), acceptable, [value](Message& message, const FieldDescriptor& f) {
              const auto* r = message.GetReflection();
              const bool repeated = f.is_repeated();
              if (f.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
                repeated ? r->SetRepeatedDouble(&message, &f, 0, value)
                         : r->SetDouble(&message, &f, value);
              } else {
                repeated ? r->SetRepeatedInt32(&message, &f, 0, static_cast<int>(value))
                         : r->SetInt32(&message, &f, static_cast<int>(value));
              }
            }};
  };
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
    return {number("0", true, 0),
            number("-1", true, -1),
            number("NaN", false, std::nan("")),
            number("infinity", false, std::numeric_limits<double>::infinity()),
            number("-infinity", false, -std::numeric_limits<double>::infinity()),
            number("1e300", false, 1e300)};
  }
  return {number("0", true, 0), number("-1", false, -1), number("INT_MAX", false, INT_MAX),
          number("INT_MIN", false, INT_MIN)};
}

std::vector<Mutation> mutations(const FieldDescriptor& field) {
  std::vector<Mutation> result = {{"absent", true, [](Message& message, const FieldDescriptor& f) {
                                     message.GetReflection()->ClearField(&message, &f);
                                   }}};
  const auto add = [&](const std::string& what, bool acceptable, auto apply) {
    result.push_back({what, acceptable, apply});
  };
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
    case FieldDescriptor::CPPTYPE_INT32:
      for (auto& mutation : numbers(field)) result.push_back(std::move(mutation));
      break;
    case FieldDescriptor::CPPTYPE_ENUM:
      for (const int value : {-1, 9999}) {
        add("unknown value", false, [value](Message& message, const FieldDescriptor& f) {
          message.GetReflection()->SetEnumValue(&message, &f, value);
        });
      }
      break;
    case FieldDescriptor::CPPTYPE_BOOL:
      add("other value", true, [](Message& message, const FieldDescriptor& f) {
        const auto* r = message.GetReflection();
        r->SetBool(&message, &f, !r->GetBool(message, &f));
      });
      break;
    case FieldDescriptor::CPPTYPE_STRING:
      for (const char* text : {"Bad Name!",
                               "sixty-four-characters-are-one-more-than-any-name-may-"
                               "ever-have-here"}) {
        add("bad text", false, [text](Message& message, const FieldDescriptor& f) {
          message.GetReflection()->SetString(&message, &f, text);
        });
      }
      break;
    case FieldDescriptor::CPPTYPE_MESSAGE:
      break;
    default:
      ADD_FAILURE() << "teach this test the type of " << field.full_name();
  }
  if (!field.is_repeated()) return result;
  add("one fewer", true, [](Message& message, const FieldDescriptor& f) {
    message.GetReflection()->RemoveLast(&message, &f);
  });
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
    add("one more", false, [](Message& message, const FieldDescriptor& f) {
      message.GetReflection()->AddDouble(&message, &f, 0);
    });
  } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
    add("300 more", false, [](Message& message, const FieldDescriptor& f) {
      const auto* r = message.GetReflection();
      for (int i = 0; i < 300; ++i) {
        r->AddMessage(&message, &f)->CopyFrom(r->GetRepeatedMessage(message, &f, 0));
      }
    });
  }
  return result;
}

// Calls `visit` with every field of every message in the scene, and its path.
using Visit = std::function<void(Message&, const FieldDescriptor&, const std::string&)>;

void walk(Message& message, const std::string& path, const Visit& visit) {
  const auto* r = message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& field = *message.GetDescriptor()->field(i);
    if (field.real_containing_oneof() != nullptr && !r->HasField(message, &field)) continue;
    if (field.is_repeated() && r->FieldSize(message, &field) == 0) continue;
    const std::string here = path + "." + field.name();
    visit(message, field, here);
    if (field.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    if (field.is_repeated()) {
      for (int k = 0; k < r->FieldSize(message, &field); ++k) {
        walk(*r->MutableRepeatedMessage(&message, &field, k), here + "[" + std::to_string(k) + "]",
             visit);
      }
    } else if (r->HasField(message, &field)) {
      walk(*r->MutableMessage(&message, &field), here, visit);
    }
  }
}

// Whether a violation at `at` speaks of the field at `path`: of it, of a part of it, of the value
// it is part of, or of the oneof it leaves empty.
bool names(const std::string& at, const std::string& path, const FieldDescriptor& field) {
  const std::string parent = path.substr(0, path.rfind('.'));
  const auto* oneof = field.real_containing_oneof();
  return at == path || at.starts_with(path + ".") || at.starts_with(path + "[") || at == parent ||
         (oneof != nullptr && at == parent + "." + oneof->name());
}

// Fields of whole messages that no scene has any use for yet.
void expect_everything_occurs(const v1::Scene& scene) {
  std::set<const FieldDescriptor*> seen;
  v1::Scene copy = scene;
  walk(copy, "scene", [&](Message& message, const FieldDescriptor& field, const std::string&) {
    const auto* r = message.GetReflection();
    if (field.is_repeated() || !field.has_presence() || r->HasField(message, &field)) {
      seen.insert(&field);
    }
  });
  std::set<const Descriptor*> visited;
  const std::function<void(const Descriptor&)> expect = [&](const Descriptor& type) {
    if (!visited.insert(&type).second) return;
    for (int i = 0; i < type.field_count(); ++i) {
      const FieldDescriptor& field = *type.field(i);
      EXPECT_TRUE(seen.contains(&field)) << "full_scene() lacks " << field.full_name();
      if (field.message_type() != nullptr) expect(*field.message_type());
    }
  };
  expect(*v1::Scene::descriptor());
}

TEST(GoodScenes, AreShownAsTheyWereGiven) {
  Service service;
  v1::Scene given = full_scene();
  given.mutable_sheets()->RemoveLast();  // a preset is shown by its values
  const v1::Scene shown = service.create(given).scene();
  google::protobuf::util::MessageDifferencer differencer;
  differencer.set_scope(google::protobuf::util::MessageDifferencer::PARTIAL);
  std::string differences;
  differencer.ReportDifferencesToString(&differences);
  EXPECT_TRUE(differencer.Compare(given, shown)) << differences;
  EXPECT_EQ(service.create(shown).scene().SerializeAsString(), shown.SerializeAsString());
}

TEST(BadScenes, OfEveryFieldAreRefusedByNameAndHarmNothing) {
  Service service;
  const v1::Session other = service.create();
  v1::Scene base = full_scene();
  expect_everything_occurs(base);
  ASSERT_EQ(service.create_error(base, "base").code, grpc::StatusCode::OK);

  int refused = 0, accepted = 0;
  v1::Scene scene = base;
  walk(scene, "session.scene",
       [&](Message& message, const FieldDescriptor& field, const std::string& path) {
         const std::unique_ptr<Message> good(message.New());
         good->CopyFrom(message);
         for (const auto& mutation : mutations(field)) {
           SCOPED_TRACE(path + ": " + mutation.what);
           mutation.apply(message, field);
           v1::CreateSessionRequest request;
           *request.mutable_session()->mutable_scene() = scene;
           request.set_validate_only(true);
           const Error error = service.error(&Service::Sessions::CreateSession, request);
           message.CopyFrom(*good);
           if (error.code == grpc::StatusCode::OK) {
             EXPECT_TRUE(mutation.acceptable) << "was accepted";
             ++accepted;
             continue;
           }
           ++refused;
           EXPECT_EQ(error.code, grpc::StatusCode::INVALID_ARGUMENT) << error.message;
           if (error.reason() == "STEP_UNSTABLE") {
             EXPECT_TRUE(path.find(".solver") != std::string::npos) << error.message;
             continue;
           }
           EXPECT_EQ(error.reason(), "FIELD_INVALID");
           const auto fields = error.fields();
           EXPECT_TRUE(std::any_of(fields.begin(), fields.end(), [&](const auto& at) {
             return names(at, path, field);
           })) << error.message;
         }
       });
  EXPECT_GT(refused, 400);
  EXPECT_GT(accepted, 100);

  EXPECT_EQ(service.info().sessions(), 2);
  EXPECT_EQ(service.step(other, 3).frame(), 3);
}

}  // namespace
}  // namespace weft::testing
