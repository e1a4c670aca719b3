#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/util/message_differencer.h>

#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <utility>

#include "tests/server/good_requests.h"
#include "tests/server/mutations.h"
#include "tests/support/service/assets.h"
#include "tests/support/service/service.h"
#include "weft/v1/lab.pb.h"
#include "weft/v1/textile.pb.h"

// Bad requests made from the descriptors of the interface: a new method or field is covered at
// once.
namespace weft::testing {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::MethodDescriptor;

// Fields outside of scenes to which any number or text may be right.
bool may_take(const FieldDescriptor& field) {
  static const std::set<std::string> any = {"expected_frame", "until_frame", "start_frame",
                                            "end_frame",      "request_id",  "sequence"};
  // fewer bytes than an asset has are what is there of it so far
  return any.contains(field.name()) || field.full_name() == "weft.v1.UploadAssetRequest.data";
}

// Whether a violation at `at` speaks of the field at `path`: of it, of a part of it, of the value
// it is part of, or of the oneof it changes.
bool names(const std::string& at, const std::string& path, const FieldDescriptor& field) {
  const std::string parent = path.substr(0, path.rfind('.'));
  if (at == path || at.starts_with(path + ".") || at.starts_with(path + "[") || at == parent)
    return true;
  if (path.starts_with(at + "[")) return true;
  if (path == "start_frame") return at == "end_frame";  // it lies before
  if (field.full_name() == "weft.v1.Sheet.name" && at.ends_with(".holds[0].sheet")) return true;
  // it sews what is not there any more
  if (path.starts_with("pattern.panels") && at.starts_with("pattern.seams")) return true;
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
  upload(*service.assets, known_asset());
  upload(*service.assets, known_body());
  const v1::Scene shown = service.create(given).scene();
  for (v1::Sheet& sheet : *given.mutable_sheets()) {
    if (!sheet.triangles().has_data()) continue;  // a mesh is shown by its name
    const std::string bytes = sheet.triangles().data().SerializeAsString();
    sheet.mutable_triangles()->set_asset(name_of_asset(bytes));
  }
  for (v1::Collider& collider : *given.mutable_colliders()) {
    if (!collider.mesh().has_data()) continue;
    const std::string bytes = collider.mesh().data().SerializeAsString();
    collider.mutable_mesh()->set_asset(name_of_asset(bytes));
  }
  google::protobuf::util::MessageDifferencer differencer;
  differencer.set_scope(google::protobuf::util::MessageDifferencer::PARTIAL);
  std::string differences;
  differencer.ReportDifferencesToString(&differences);
  EXPECT_TRUE(differencer.Compare(given, shown)) << differences;
  EXPECT_EQ(service.create(shown).scene().SerializeAsString(), shown.SerializeAsString());
}
// Tests of refused and left calls run on for a while.
ServerOptions with_room_for_tests() {
  ServerOptions options = Service::in_process();
  options.limits.max_tests = 1000;
  return options;
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
    return name.starts_with("Get") || name.starts_with("List") || name.starts_with("Download") ||
           name == "StreamFrames" || name == "ViewFrames" || name == "RunTest" ||
           name == "BuildGarment";
  }

  // As it was at first, whatever was changed.
  void restore() {
    v1::ListSessionsResponse list;
    EXPECT_TRUE(
        service_.call(&Service::Sessions::ListSessions, v1::ListSessionsRequest(), &list).ok());
    for (const auto& session : list.sessions()) service_.erase(session);
    const auto page = list_assets(*service_.assets);
    for (const auto& asset : page.assets())
      EXPECT_EQ(delete_asset(*service_.assets, asset.name()).code, grpc::StatusCode::OK);
    for (const std::string& bytes : {known_asset(), known_body()})
      EXPECT_EQ(upload(*service_.assets, bytes).second.code, grpc::StatusCode::OK);
    session_ = service_.create(small_scene(), "it");
    v1::CreateSnapshotRequest snapshot;
    snapshot.set_parent(session_.name());
    snapshot.set_snapshot_id("it");
    EXPECT_EQ(service_.error(&Service::Sessions::CreateSnapshot, snapshot).code,
              grpc::StatusCode::OK);
    before_ = service_.get(session_).SerializeAsString();
  }

  Service service_{with_room_for_tests()};
  v1::Session session_;
  std::string before_;
};

// An error that says what api users are promised.
void expect_explained(const Error& error, bool decoded) {
  using enum grpc::StatusCode;
  // gRPC's own answer to bytes that are no message
  if (!decoded && error.code == UNIMPLEMENTED) return;
  EXPECT_TRUE(std::set({INVALID_ARGUMENT, NOT_FOUND, ALREADY_EXISTS, ABORTED, FAILED_PRECONDITION,
                        OUT_OF_RANGE, RESOURCE_EXHAUSTED, DATA_LOSS})
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
      const auto asked = subject.ask(*method, request->SerializeAsString());
      const bool good = asked.accepted;
      EXPECT_TRUE(good || !known) << asked.error.message;
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
#ifdef WEFT_SANITIZED
  constexpr int kRounds = 100;
#else
  constexpr int kRounds = 3000;  // for each method: 50 000 and more in all
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
