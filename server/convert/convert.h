#pragma once

#include <google/protobuf/field_mask.pb.h>
#include <google/protobuf/repeated_ptr_field.h>
#include <google/protobuf/timestamp.pb.h>

#include <chrono>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "core/lab/lab.h"
#include "core/simulation.h"
#include "server/session/session.h"
#include "weft/v1/lab.pb.h"
#include "weft/v1/mesh.pb.h"
#include "weft/v1/session.pb.h"

// Between the words of the interface (weft::v1) and those of the solver.
namespace weft {

// A value, or everything that is wrong with what it was to be made of.
template <class T>
using Converted = std::variant<T, std::vector<Problem>>;

// The mesh of an asset, by its name; nullptr where there is none.
using FindMesh = std::function<std::shared_ptr<const v1::MeshData>(const std::string& name)>;

// A scene that can be simulated. Paths in problems begin with `field`. Idle threads of the
// scheduler, where one is given, help to make what takes long.
Converted<Scene> to_scene(const v1::Scene& scene, const std::string& field,
                          const FindMesh& find_mesh = {}, Scheduler* scheduler = nullptr);

// The hashes of the assets that a scene names.
std::set<std::string> assets_of(const Scene& scene);

// A textile that can be simulated.
Converted<Textile> to_textile(const v1::Textile& textile, const std::string& field);

// `current` with the fields of `change` that the mask names; all of them without a mask.
Converted<Textile> merge_textile(const Textile& current, const v1::Textile& change,
                                 const google::protobuf::FieldMask& mask);

// An action of a call's hand. What is wrong with its numbers depends on the session.
Converted<Action> to_action(const v1::Action& action, const std::string& field);

// A test that can be run.
Converted<LabOrder> to_lab_order(const v1::RunTestRequest& request);

enum class StartValues { kIncluded, kLeftOut };

// With every default filled in.
v1::Session to_proto(const Session& session, StartValues start_values = StartValues::kIncluded);
// One that another server has, with the scene as it was given: what never changes of it.
v1::Session to_proto(const SessionIdentity& identity, v1::Scene given);
v1::Snapshot to_proto(const Session& session, const NamedSnapshot& snapshot);
v1::Verdict to_proto(const Judgement& judgement, std::int64_t frame);
v1::Textile to_proto(const Textile& textile);

// As it was given: a clamp that follows from the stretch stays absent.
v1::Textile as_given(const Textile& textile);
v1::Scene as_given(const Scene& scene);

google::protobuf::Timestamp timestamp_of(std::chrono::system_clock::time_point time);

Pin to_pin(const v1::Pin& pin);
v1::Pin to_proto(const Pin& pin);
Path to_path(const google::protobuf::RepeatedPtrField<v1::Keyframe>& keyframes);
google::protobuf::RepeatedPtrField<v1::Keyframe> to_proto(const Path& path);

v1::Plan to_proto(const Plan& plan);
v1::Repair to_proto(const Repair& repair);
// Precondition: it is not kLetGo.
v1::Action to_proto(const Action& action);
v1::LabReport to_proto(const LabOrder& order, const LabReport& report);
v1::SessionState to_proto(SessionState state);

}  // namespace weft
