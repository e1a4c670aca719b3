#include "client/script/check.h"

#include <fmt/format.h>
#include <google/protobuf/util/field_mask_util.h>

#include <filesystem>
#include <map>
#include <set>
#include <tuple>

#include "client/assets.h"
#include "client/scene_file.h"

namespace weft::client {
namespace {

// A session as it would be.
struct Known {
  std::optional<v1::Session> session{};             // none where the server refuses it
  std::set<std::pair<std::string, int>> grabbed{};  // sheet, particle
  std::int64_t snapshots = 0;
};

class Checker {
 public:
  Checker(Connection& connection, const Script& script, bool replace)
      : connection_(connection), script_(script), replace_(replace) {}

  void check() {
    for (const Case& each : script_.cases) {
      sessions_.clear();
      snapshots_.clear();
      for (const Step& step : each.steps)
        std::visit([&](const auto& what) { check_step(step, what); }, step.what);
    }
    faults_.check(script_.path);
  }

 private:
  void fault(const Step& step, const std::string& field, const std::string& description) {
    faults_.add(place_in_script(script_.path, step.line, step.kind + field), description);
  }

  // What the server would make of the scene; each is asked about once.
  std::optional<v1::Session> ask(const Step& step, const std::string& session,
                                 const v1::Scene& scene) {
    const std::string key = asset_name(scene.SerializeAsString());
    if (const auto known = asked_.find(key); known != asked_.end()) return known->second;
    v1::CreateSessionRequest request;
    request.set_validate_only(true);
    std::optional<v1::Session>& answer = asked_[key];
    note_refusals(step, session, [&] { answer = create_session(connection_, scene, request); });
    return answer;
  }

  // What a server refuses is a fault of the session's.
  template <class Work>
  void note_refusals(const Step& step, const std::string& session, const Work& work) {
    try {
      work();
    } catch (const Problem& problem) {
      if (problem.exit == Exit::kNoConnection || problem.exit == Exit::kInterrupted) throw;
      if (problem.violations.empty()) fault(step, "", session + ": " + problem.what());
      for (const auto& [field, description] : problem.violations)
        fault(step, fmt::format(": {} of {}", field, session), description);
    }
  }

  void check_step(const Step& step, const CreateStep& what) {
    const auto scene = what.drape ? make(step, what.session, *what.drape) : what.scene;
    sessions_[what.session] = {.session = scene ? ask(step, what.session, *scene) : std::nullopt};
  }

  // What the server makes of the pattern.
  std::optional<v1::Scene> make(const Step& step, const std::string& session, const Drape& drape) {
    std::optional<v1::Scene> scene;
    note_refusals(step, session, [&] { scene = make_drape(connection_, drape).scene; });
    return scene;
  }

  void check_step(const Step& step, const SnapshotStep& what) {
    Known& known = sessions_[what.session];
    if (++known.snapshots == most_snapshots() + 1)
      fault(step, "", fmt::format("a session keeps at most {} snapshots", most_snapshots()));
    snapshots_[what.snapshot] = known;
  }

  void check_step(const Step&, const RestoreStep& what) {
    Known& known = sessions_[what.session] = snapshots_[what.snapshot];
    known.snapshots = 0;
  }

  std::int64_t most_snapshots() {
    if (!most_snapshots_) {
      most_snapshots_ = connection_.call(&v1::ServerService::Stub::GetServerInfo, {})
                            .limits()
                            .max_snapshots_per_session();
    }
    return *most_snapshots_;
  }

  void check_step(const Step& step, const SetStep& what) {
    auto& session = sessions_[what.session].session;
    if (!session) return;  // refused before
    v1::Scene scene = session->scene();
    v1::UpdateTextileRequest request;
    try {
      request = textile_request(*session, what.change);
    } catch (const Problem& problem) {
      return fault(step, ".fields", problem.what());
    }
    for (auto& sheet : *scene.mutable_sheets()) {
      if (!what.change.sheet.empty() && sheet.name() != what.change.sheet) continue;
      if (what.change.sheet.empty() && scene.sheets_size() > 1) break;
      if (request.has_update_mask()) {
        google::protobuf::util::FieldMaskUtil::MergeMessageTo(
            request.textile(), request.update_mask(), {}, sheet.mutable_textile());
      } else if (request.duration_s() > 0 && sheet.textile().has_raw()) {
        return fault(step, ".over_s", "leads from raw to raw; change to a measured one at once");
      } else {
        *sheet.mutable_textile() = request.textile();
      }
      session = ask(step, what.session, scene);
      return;
    }
    fault(step, ".sheet",
          what.change.sheet.empty()
              ? fmt::format("is missing; {} has {} sheets", what.session, scene.sheets_size())
              : fmt::format("{} has no sheet \"{}\"", what.session, what.change.sheet));
  }

  void check_step(const Step& step, const ActStep& what) {
    auto& [session, grabbed, snapshots] = sessions_[what.session];
    if (!session) return;
    v1::Action action;
    try {
      action = to_action(what.action, session->scene());
    } catch (const Problem& problem) {
      return fault(step, "", problem.what());
    }
    const auto particle = [](const auto& of) { return std::pair(of.sheet(), of.particle()); };
    if (action.has_grab() && !grabbed.insert(particle(action.grab())).second)
      fault(step, "", "the particle is grabbed already");
    if (action.has_drag() && !grabbed.contains(particle(action.drag())))
      fault(step, "", "the particle was not grabbed before this");
    if (action.has_release() && grabbed.erase(particle(action.release())) == 0)
      fault(step, "", "the particle was not grabbed before this");
  }

  void check_step(const Step& step, const RecordStep& what) {
    const std::string path =
        std::filesystem::weakly_canonical(std::filesystem::absolute(what.path)).string();
    if (!files_.insert(path).second)
      fault(step, ".file", what.path + " is written more than once; put $case into its name");
    std::error_code error;
    const auto directory = std::filesystem::path(path).parent_path();
    if (!std::filesystem::is_directory(directory, error))
      fault(step, ".file", fmt::format("there is no directory {}", directory.string()));
    if (!replace_ && std::filesystem::exists(path, error))
      fault(step, ".file", what.path + " exists; --force replaces it");
  }

  void check_step(const Step& step, const ExpectStep& what) {
    const auto& session = sessions_[what.session].session;
    if (!session) return;
    for (const Expectation& expectation : what.expectations) {
      if (expectation.quantity != Quantity::kPosition) continue;
      const ParticlePlace& place = expectation.particle;
      const v1::Sheet* sheet = nullptr;
      for (const auto& each : session->scene().sheets()) {
        const bool meant = place.sheet.empty() || each.name() == place.sheet;
        if (meant && sheet == nullptr) sheet = &each;
      }
      if (sheet == nullptr) {
        fault(step, ".particle.sheet",
              fmt::format("{} has no sheet \"{}\"", what.session, place.sheet));
        continue;
      }
      try {
        particle_number(place, *sheet);
      } catch (const Problem& problem) {
        fault(step, ".particle", problem.what());
      }
    }
  }

  template <class What>
  void check_step(const Step&, const What&) {}

  Connection& connection_;
  const Script& script_;
  bool replace_;
  Faults faults_;
  std::map<std::string, std::optional<v1::Session>> asked_;
  std::map<std::string, Known> sessions_, snapshots_;  // of the case
  std::optional<std::int64_t> most_snapshots_;         // of a session
  std::set<std::string> files_;                        // of all cases
};

}  // namespace

void check_script(Connection& connection, const Script& script, bool replace) {
  Checker(connection, script, replace).check();
}

}  // namespace weft::client
