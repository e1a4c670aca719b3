#include <google/protobuf/descriptor.h>
#include <google/protobuf/dynamic_message.h>
#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/text_format.h>
#include <google/protobuf/util/message_differencer.h>

#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <utility>

#include "tests/support/service/service.h"
#include "weft/v1/lab.pb.h"
#include "weft/v1/textile.pb.h"

// Bad requests made from the descriptors of the interface: a new method or field is covered at
// once.
namespace weft::testing {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;

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
  measured->mutable_bending()->mutable_isometric()->set_resist_compression(false);
  measured->mutable_textile()->set_damping_ratio(1e-3);
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
  bool acceptable;  // some field may take it
  std::function<void(Message&, const FieldDescriptor&)> apply;
};

template <class Number>
void set_number(Message& message, const FieldDescriptor& field, Number value) {
  const auto* r = message.GetReflection();
  const bool repeated = field.is_repeated();
  const bool none = repeated && r->FieldSize(message, &field) == 0;
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE: {
      const auto number = static_cast<double>(value);
      if (none) return r->AddDouble(&message, &field, number);
      return repeated ? r->SetRepeatedDouble(&message, &field, 0, number)
                      : r->SetDouble(&message, &field, number);
    }
    case FieldDescriptor::CPPTYPE_INT32: {
      const auto number = static_cast<std::int32_t>(value);
      if (none) return r->AddInt32(&message, &field, number);
      return repeated ? r->SetRepeatedInt32(&message, &field, 0, number)
                      : r->SetInt32(&message, &field, number);
    }
    case FieldDescriptor::CPPTYPE_INT64: {
      const auto number = static_cast<std::int64_t>(value);
      if (none) return r->AddInt64(&message, &field, number);
      return repeated ? r->SetRepeatedInt64(&message, &field, 0, number)
                      : r->SetInt64(&message, &field, number);
    }
    default:
      ADD_FAILURE() << "teach this test the type of " << field.full_name();
  }
}

bool is_number(const FieldDescriptor& field) {
  return field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE ||
         field.cpp_type() == FieldDescriptor::CPPTYPE_INT32 ||
         field.cpp_type() == FieldDescriptor::CPPTYPE_INT64;
}

template <class Number>
Mutation number(std::string what, bool acceptable, Number value) {
  return {std::move(what), acceptable, [value](Message& message, const FieldDescriptor& field) {
            set_number(message, field, value);
          }};
}

template <class Integer>
std::vector<Mutation> integers() {
  using Limits = std::numeric_limits<Integer>;
  return {number<Integer>("0", true, 0), number<Integer>("-1", false, -1),
          number("the largest", false, Limits::max()),
          number("the smallest", false, Limits::min())};
}

std::vector<Mutation> doubles() {
  using Limits = std::numeric_limits<double>;
  return {number("0", true, 0.0),
          number("-1", true, -1.0),
          number("denormal", true, Limits::denorm_min()),
          number("1e300", false, 1e300),
          number("NaN", false, Limits::quiet_NaN()),
          number("infinity", false, Limits::infinity()),
          number("-infinity", false, -Limits::infinity())};
}

Mutation text(std::string what, bool acceptable, std::string value) {
  return {std::move(what), acceptable, [value](Message& message, const FieldDescriptor& field) {
            const auto* r = message.GetReflection();
            if (!field.is_repeated()) return r->SetString(&message, &field, value);
            r->AddString(&message, &field, value);
          }};
}

constexpr const char* kBadUtf8 = "bad UTF-8";

std::vector<Mutation> values(const FieldDescriptor& field) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return doubles();
    case FieldDescriptor::CPPTYPE_INT32:
      return integers<std::int32_t>();
    case FieldDescriptor::CPPTYPE_INT64:
      return integers<std::int64_t>();
    case FieldDescriptor::CPPTYPE_ENUM: {
      std::vector<Mutation> result;
      for (const int value : {-1, 9999}) {
        result.push_back(
            {"unknown value", false, [value](Message& message, const FieldDescriptor& f) {
               message.GetReflection()->SetEnumValue(&message, &f, value);
             }});
      }
      return result;
    }
    case FieldDescriptor::CPPTYPE_BOOL:
      return {{"other value", true, [](Message& message, const FieldDescriptor& f) {
                 const auto* r = message.GetReflection();
                 r->SetBool(&message, &f, !r->GetBool(message, &f));
               }}};
    case FieldDescriptor::CPPTYPE_STRING:
      return {
          text("bad text", false, "Bad Name!"), text("a long text", false, std::string(129, 'x')),
          text("a zero byte", false, std::string("a\0b", 3)), text(kBadUtf8, false, "\xff\xfe")};
    case FieldDescriptor::CPPTYPE_MESSAGE:
      if (field.is_repeated()) return {};
      return {{"empty", true, [](Message& message, const FieldDescriptor& f) {
                 message.GetReflection()->MutableMessage(&message, &f)->Clear();
               }}};
    default:
      ADD_FAILURE() << "teach this test the type of " << field.full_name();
      return {};
  }
}

std::vector<Mutation> mutations(const FieldDescriptor& field) {
  std::vector<Mutation> result = values(field);
  result.push_back({"absent", true, [](Message& message, const FieldDescriptor& f) {
                      message.GetReflection()->ClearField(&message, &f);
                    }});
  if (!field.is_repeated()) return result;
  result.push_back({"one fewer", true, [](Message& message, const FieldDescriptor& f) {
                      const auto* r = message.GetReflection();
                      if (r->FieldSize(message, &f) > 0) r->RemoveLast(&message, &f);
                    }});
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
    result.push_back({"one more", true, [](Message& message, const FieldDescriptor& f) {
                        message.GetReflection()->AddDouble(&message, &f, 0);
                      }});
  } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
    result.push_back(
        {"300 more", true, [](Message& message, const FieldDescriptor& f) {
           const auto* r = message.GetReflection();
           if (r->FieldSize(message, &f) == 0) r->AddMessage(&message, &f);
           for (int i = 0; i < 300; ++i)
             r->AddMessage(&message, &f)->CopyFrom(r->GetRepeatedMessage(message, &f, 0));
         }});
  }
  return result;
}

// Calls `visit` with every field of every message in the request, and its path.
using Visit = std::function<void(Message&, const FieldDescriptor&, const std::string&)>;

void walk(Message& message, const std::string& path, const Visit& visit) {
  const auto* r = message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& field = *message.GetDescriptor()->field(i);
    const std::string here = (path.empty() ? "" : path + ".") + field.name();
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

// Fields outside of scenes to which any number or text may be right.
bool may_take(const FieldDescriptor& field) {
  static const std::set<std::string> any = {"expected_frame", "until_frame", "start_frame",
                                            "end_frame",      "request_id",  "sequence"};
  return any.contains(field.name());
}

// Whether a violation at `at` speaks of the field at `path`: of it, of a part of it, of the value
// it is part of, or of the oneof it changes.
bool names(const std::string& at, const std::string& path, const FieldDescriptor& field) {
  const std::string parent = path.substr(0, path.rfind('.'));
  if (at == path || at.starts_with(path + ".") || at.starts_with(path + "[") || at == parent)
    return true;
  if (path == "start_frame") return at == "end_frame";  // it lies before
  const auto* oneof = field.real_containing_oneof();
  if (oneof == nullptr) return false;
  bool other = at == parent + "." + oneof->name();
  for (int i = 0; i < oneof->field_count(); ++i)
    other |= at == parent + "." + oneof->field(i)->name();
  return other;
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

// Good requests of a type, as text; of a type that has none here they are made up from its fields.
std::vector<std::string> known_requests(const std::string& type) {
  static const std::multimap<std::string, std::string> known = {
      {"CreateSessionRequest", ""},  // its scene is full_scene()
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
      {"CreateSnapshotRequest", "parent: 'sessions/it' snapshot_id: 'another'"},
      {"ListSnapshotsRequest", "parent: 'sessions/it'"},
      {"RestoreSessionRequest", "name: 'sessions/it/snapshots/it' session_id: 'new'"},
      {"InteractRequest", "session: 'sessions/it' sequence: 1 action { grab { particle: 3 } }"},
      {"StreamFramesRequest",
       "session: 'sessions/it' start_frame: 0 end_frame: 0 format { encoding: "
       "FRAME_ENCODING_FLOAT64 "
       "velocities: true stats: true grid_step_m: 0.001 first_particle: 2 particle_count: 9 "
       "stride: 2 } slow_reader: SLOW_READER_HOLD_SESSION"},
      {"ViewFramesRequest",
       "session: 'sessions/it' format { encoding: FRAME_ENCODING_QUANTIZED_ZSTD velocities: true "
       "stats: true grid_step_m: 0.001 } credits: 2"},
      {"GetTextileRequest", "name: 'textiles/denim_11oz'"},
      {"RunTestRequest",
       "test: LAB_TEST_BENDING textile { measured { areal_density_kg_per_m2: 0.2 "
       "tensile_warp_n_per_m: 100 tensile_weft_n_per_m: 110 shear_n_per_m: 10 "
       "bend_rigidity_warp_n_m: 1e-5 bend_rigidity_weft_n_m: 2e-5 } } "
       "bending { choi_ko { segments: 8 } } direction: LAB_DIRECTION_WEFT spacings_m: 0.01"},
  };
  std::vector<std::string> texts;
  const auto [first, last] = known.equal_range(type);
  for (auto each = first; each != last; ++each) texts.push_back(each->second);
  return texts;
}

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
  }
  const int variants = requests.empty() ? 4 : 0;
  for (int variant = 0; variant < variants; ++variant)
    fill(*requests.emplace_back(prototype->New()), variant);
  return requests;
}

// A server with the session that requests speak of.
class Subject {
 public:
  Subject() { restore(); }

  struct Answer {
    bool accepted;
    Error error;
  };
  Answer ask(const MethodDescriptor& method, const std::string& bytes) {
    const std::string path = "/" + method.service()->full_name() + "/" + method.name();
    auto [message, error] = raw_call(service_, path, bytes, method.server_streaming());
    ++asked;
    if (error.code == grpc::StatusCode::OK) {
      if (!reads_only(method)) restore();
      return {true, std::move(error)};
    }
    ++refused;
    EXPECT_EQ(service_.get(session_).SerializeAsString(), before_) << "a refusal changed something";
    return {false, std::move(error)};
  }

  int asked = 0, refused = 0;

 private:
  static bool reads_only(const MethodDescriptor& method) {
    const std::string& name = method.name();
    return name.starts_with("Get") || name.starts_with("List") || name == "StreamFrames" ||
           name == "ViewFrames" || name == "RunTest";
  }

  // As it was at first, whatever was changed.
  void restore() {
    v1::ListSessionsResponse list;
    EXPECT_TRUE(
        service_.call(&Service::Sessions::ListSessions, v1::ListSessionsRequest(), &list).ok());
    for (const auto& session : list.sessions()) service_.erase(session);
    session_ = service_.create(small_scene(), "it");
    v1::CreateSnapshotRequest snapshot;
    snapshot.set_parent(session_.name());
    snapshot.set_snapshot_id("it");
    EXPECT_EQ(service_.error(&Service::Sessions::CreateSnapshot, snapshot).code,
              grpc::StatusCode::OK);
    before_ = service_.get(session_).SerializeAsString();
  }

  Service service_;
  v1::Session session_;
  std::string before_;
};

// An error that says what api users are promised.
void expect_explained(const Error& error, bool decoded) {
  using enum grpc::StatusCode;
  // gRPC's own answer to bytes that are no message
  if (!decoded && error.code == UNIMPLEMENTED) return;
  EXPECT_TRUE(std::set({INVALID_ARGUMENT, NOT_FOUND, ALREADY_EXISTS, ABORTED, FAILED_PRECONDITION,
                        OUT_OF_RANGE, RESOURCE_EXHAUSTED})
                  .contains(error.code))
      << error.code << ": " << error.message;
  EXPECT_EQ(error.info.domain(), "weft.v1");
  EXPECT_NE(error.reason(), "");
  EXPECT_TRUE(error.code != INVALID_ARGUMENT || !decoded || !error.fields().empty());
}

// Whether as much as is allowed takes a second.
bool is_costly(const FieldDescriptor& field) {
  return field.name() == "frames" || field.name() == "rows" || field.name() == "columns";
}

// The bounds in "... is not within 1 to 2 m".
std::optional<std::pair<double, double>> bounds_in(const std::string& description) {
  const std::string words = " is not within ";
  const std::size_t at = description.find(words);
  if (at == std::string::npos) return std::nullopt;
  std::istringstream rest(description.substr(at + words.size()));
  std::string low, to, high;
  rest >> low >> to >> high;
  if (to != "to") return std::nullopt;
  return std::pair(std::stod(low), std::stod(high));
}

// Asks for the bounds that a refusal names, and for the next number beyond each.
void try_bounds(Subject& subject, const MethodDescriptor& method, Message& request,
                Message& message, const FieldDescriptor& field, const std::string& path,
                const Error& refusal) {
  for (const auto& violation : refusal.bad.field_violations()) {
    const std::string& description = violation.description();
    const auto bounds = bounds_in(description);
    if (violation.field() != path || !bounds) continue;
    const bool real = field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE;
    for (const int end : {1, 2}) {
      const double bound = end == 1 ? bounds->first : bounds->second;
      const double away = end == 1 ? -1 : 1;
      const double beyond = real ? std::nextafter(bound, away * HUGE_VAL) : bound + away;
      for (const double value : {bound, beyond}) {
        SCOPED_TRACE(description + ": tried " + std::to_string(value));
        if (end == 2 && value == bound && is_costly(field)) continue;
        real ? set_number(message, field, value)
             : set_number(message, field, static_cast<std::int64_t>(value));
        const auto answer = subject.ask(method, request.SerializeAsString());
        bool out = false;
        for (const auto& found : answer.error.bad.field_violations()) {
          out |= found.field() == path && bounds_in(found.description()).has_value();
        }
        EXPECT_EQ(out, value == beyond) << answer.error.message;
      }
    }
    return;
  }
}

// Whether the method does not look at the field: Session's own but the scene, and what a mask
// leaves out.
bool is_ignored(const Message& request, const std::string& path) {
  if (path.starts_with("session.")) return !path.starts_with("session.scene");
  const auto* update = dynamic_cast<const v1::UpdateTextileRequest*>(&request);
  return update != nullptr && update->has_update_mask() && path.starts_with("textile.") &&
         path != "textile." + update->update_mask().paths(0);
}

TEST(BadRequests, OfEveryFieldAreRefusedByNameAndChangeNothing) {
  const google::protobuf::LogSilencer silence;  // about UTF-8
  v1::Scene scene = full_scene();
  expect_everything_occurs(scene);
  Subject subject;
  for (const MethodDescriptor* method : all_methods()) {
    for (const auto& request : good_requests(*method->input_type())) {
      SCOPED_TRACE(method->full_name());
      const bool known = !known_requests(method->input_type()->name()).empty();
      const bool good = subject.ask(*method, request->SerializeAsString()).accepted;
      EXPECT_TRUE(good || !known);
      std::set<std::string> bounded;
      walk(*request, "",
           [&](Message& message, const FieldDescriptor& field, const std::string& path) {
             const bool ignored = is_ignored(*request, path);
             const std::unique_ptr<Message> whole(message.New());
             whole->CopyFrom(message);
             for (const auto& mutation : mutations(field)) {
               SCOPED_TRACE(path + ": " + mutation.what);
               mutation.apply(message, field);
               const auto [accepted, error] = subject.ask(*method, request->SerializeAsString());
               const bool decoded = mutation.what != kBadUtf8;
               if (accepted) {
                 EXPECT_TRUE(mutation.acceptable || ignored || may_take(field) || !known)
                     << "was accepted";
               } else {
                 expect_explained(error, decoded);
                 const auto fields = error.fields();
                 const bool named = std::any_of(fields.begin(), fields.end(), [&](const auto& at) {
                   return names(at, path, field);
                 });
                 EXPECT_TRUE(!good || fields.empty() || named || error.reason() == "STEP_UNSTABLE")
                     << error.message;
                 if (good && is_number(field) && bounded.insert(path).second)
                   try_bounds(subject, *method, *request, message, field, path, error);
               }
               message.CopyFrom(*whole);
             }
           });
    }
  }
  EXPECT_GT(subject.asked, 2000);
  EXPECT_GT(subject.refused, 1200);
  RecordProperty("asked", subject.asked);
  RecordProperty("refused", subject.refused);
}

TEST(BadRequests, OfDamagedBytesAreRefusedOrReadAsTheyAre) {
#ifdef __SANITIZE_ADDRESS__
  constexpr int kRounds = 100;
#else
  constexpr int kRounds = 6000;  // for each method: 100 000 and more in all
#endif
  const google::protobuf::LogSilencer silence;
  Subject subject;
  std::mt19937 random(7);
  for (const MethodDescriptor* method : all_methods()) {
    if (method->name() == "StepSession") continue;  // some would take long, rightly
    SCOPED_TRACE(method->full_name());
    const auto requests = good_requests(*method->input_type());
    for (int round = 0; round < kRounds; ++round) {
      std::string bytes = requests[random() % requests.size()]->SerializeAsString();
      if (bytes.empty()) bytes = "x";
      const auto [accepted, error] = subject.ask(*method, damaged(std::move(bytes), random));
      if (!accepted) expect_explained(error, false);
    }
  }
  EXPECT_GT(subject.asked, 15 * kRounds);
  EXPECT_GT(subject.refused, 2 * kRounds);
}

}  // namespace
}  // namespace weft::testing
