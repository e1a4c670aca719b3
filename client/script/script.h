#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "client/garments/drape.h"
#include "client/problem.h"
#include "client/scene_action.h"
#include "client/textile_change.h"
#include "weft/v1/frame.pb.h"
#include "weft/v1/scene.pb.h"

namespace weft::client {

// A script is cases, and a case is steps that are done in order. Sessions and snapshots go by the
// names the script gives them.

struct CreateStep {
  std::string session;
  v1::Scene scene;
  std::optional<Drape> drape{};  // what a server makes the scene of, instead
};

struct SetStep {
  std::string session;
  TextileChange change;
};

struct RunStep {
  std::vector<std::string> sessions;  // side by side
  std::optional<std::int64_t> until_frame;
  std::optional<double> until_time_s;  // the first frame not before it
  bool until_rest = false;
  std::optional<double> time_scale;
  bool wait = true;
};

struct WaitStep {
  std::string session;
  std::int64_t frame = 0;
};

struct ActStep {
  std::string session;
  SceneAction action;
};

struct PauseStep {
  std::string session;
};

// Records from the newest frame to the end of the case.
struct RecordStep {
  std::string session;
  std::string path;
  bool velocities = false;
  v1::FrameEncoding encoding = v1::FRAME_ENCODING_FLOAT32;
};

struct SnapshotStep {
  std::string session;
  std::string snapshot;
};

// Makes a session.
struct RestoreStep {
  std::string session;
  std::string snapshot;
};

enum class Quantity {
  kFrame,
  kTime,
  kAtRest,
  kRestTime,
  kLargestStrain,
  kStrain,
  kCuts,
  kKineticEnergy,
  kPotentialEnergy,
  kEnergy,
  kPosition,
  kStrainWarp,  // of a verdict, from here on
  kStrainWeft,
  kPressure,
  kSlid,
};

// What a quantity shall be: within [low, high].
struct Expectation {
  Quantity quantity = Quantity::kFrame;
  std::string name{};  // as the script has it, "particle.y_m"
  double low = 0;
  double high = 0;
  ParticlePlace particle{};  // of kPosition; without a sheet: of the first
  int axis = 0;              // 0 to 2
};

struct ExpectStep {
  std::string session;
  std::vector<Expectation> expectations;
  std::optional<std::set<std::string>> faults{};  // all of the verdict; none: it is good
};

struct Step {
  int line = 0;
  std::string kind;  // "create"
  std::variant<CreateStep, SetStep, ActStep, RunStep, WaitStep, PauseStep, RecordStep, SnapshotStep,
               RestoreStep, ExpectStep>
      what;
};

struct Case {
  std::string name;  // "k_b 0.1, segments 5"
  std::vector<std::pair<std::string, std::string>> values;
  std::vector<Step> steps;
};

struct Script {
  std::string path;
  std::string name;
  int parallel = 1;  // cases at a time
  std::vector<Case> cases;
};

// "drape.yaml, line 7: create.bend"
std::string place_in_script(const std::string& path, int line, const std::string& field);

// What is wrong with a script, each thing once, though every case may say it.
class Faults {
 public:
  void add(const std::string& place, const std::string& description);
  bool any() const { return !violations_.empty(); }
  // Throws them, if there are any.
  void check(const std::string& path) const;

 private:
  std::vector<Violation> violations_;
};

}  // namespace weft::client
