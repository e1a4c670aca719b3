#include "client/commands/commands.h"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "client/output/text.h"
#include "client/sheet_layout.h"
#include "server/config.h"

namespace weft::client {
namespace {

// Processor time of a second of simulated time, where the server has computed something to go by.
std::optional<double> seconds_of(const v1::Plan& plan, const v1::ServerStats& stats) {
  constexpr double kEnough = 0.1;  // s
  if (stats.frame_time_s().sum() < kEnough || stats.particle_substeps() == 0) return std::nullopt;
  return plan.particle_substeps_per_second() * stats.frame_time_s().sum() /
         static_cast<double>(stats.particle_substeps());
}

std::string shape_text(const v1::Sheet& sheet) {
  if (sheet.has_grid()) {
    const v1::Grid& grid = sheet.grid();
    return fmt::format("{} x {} particles, {:.4g} mm apart{}", grid.rows(), grid.columns(),
                       grid.spacing_m() * 1e3, simulated_text(grid.simulated_every()));
  }
  const std::string& asset = sheet.triangles().asset();
  return asset.empty() ? "triangles" : "triangles of " + asset;
}

std::string sheets_text(const v1::Scene& scene) {
  std::string text;
  for (const auto& sheet : scene.sheets())
    text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", sheet.name(), shape_text(sheet));
  return text;
}

std::int64_t read_frame_number(const std::string& text, const std::string& range) {
  if (text.empty() || text.size() > 18 ||
      text.find_first_not_of("0123456789") != std::string::npos) {
    throw usage_problem("--frames " + range + ": write A:B, A: or :B");
  }
  return std::stoll(text);
}

}  // namespace

CLI::App* add_group(CLI::App& app, const char* name, const char* description) {
  CLI::App* group = app.add_subcommand(name, description);
  group->callback([group, name] {
    if (group->get_subcommands().empty()) {
      throw usage_problem(fmt::format("which one? see weft {} --help", name));
    }
  });
  return group;
}

void add_session_argument(CLI::App& command, std::string& session) {
  command.add_option("SESSION", session, "Name of the session")->option_text(" ")->required();
}

void add_refuse_option(CLI::App& command, std::vector<std::string>& codes) {
  command
      .add_option("--refuse", codes,
                  "Warnings that are errors here: codes, such as STARTS_INSIDE,TANGLED_START")
      ->type_name("CODE,...")
      ->delimiter(',')
      ->allow_extra_args(false);
}

void add_session_or_scene_argument(CLI::App& command, std::string& given) {
  command.add_option("SESSION", given, "Name of the session, or a scene file (see --embedded)")
      ->option_text(" ")
      ->required();
}

void add_relax(CLI::App& command, bool& relax) {
  command.add_flag("--relax", relax, "Come to rest on the shortest way, instead of moving in time")
      ->needs("--until-rest");
}

void add_accuracy(CLI::App& command, std::optional<v1::Accuracy>& accuracy) {
  const std::map<std::string, v1::Accuracy> accuracies{{"draft", v1::ACCURACY_DRAFT},
                                                       {"standard", v1::ACCURACY_STANDARD},
                                                       {"fine", v1::ACCURACY_FINE}};
  command.add_option("--accuracy", accuracy, "How close to the equations, and how fast")
      ->transform(one_of(accuracies))
      ->option_text("draft|standard|fine");
}

FrameRange read_frame_range(const std::string& text) {
  FrameRange range;
  if (text.empty()) return range;
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::string first = text.substr(0, colon);
  const std::string last = colon < text.size() ? text.substr(colon + 1) : first;
  if (!first.empty() || last.empty()) range.first = read_frame_number(first, text);
  if (!last.empty()) range.last = read_frame_number(last, text);
  return range;
}

std::pair<std::string, std::string> read_setting(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) throw usage_problem("--set " + text + ": write FIELD=VALUE");
  return {text.substr(0, equals), text.substr(equals + 1)};
}

std::pair<std::string, std::uint16_t> read_address(const char* option, const std::string& text,
                                                   bool insecure) {
  const std::size_t colon = text.rfind(':');
  const std::string port = colon == std::string::npos ? "" : text.substr(colon + 1);
  const bool digits = !port.empty() && port.size() <= 5 &&
                      port.find_first_not_of("0123456789") == std::string::npos;
  if (colon == 0 || !digits || std::stoi(port) > 65535)
    throw usage_problem(fmt::format("{} {}: write HOST:PORT", option, text));
  std::string host = text.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  if (!is_loopback(host) && host != "::1" && !insecure) {
    throw usage_problem(
        fmt::format("{} is {}, which other machines can reach, and nothing is encrypted; add "
                    "--insecure if that is what you want",
                    option, text));
  }
  return {host, static_cast<std::uint16_t>(std::stoi(port))};
}

std::string state_text(const v1::Session& session) {
  switch (session.state()) {
    case v1::SESSION_STATE_PAUSED:
      return "paused";
    case v1::SESSION_STATE_RUNNING:
      return "running";
    case v1::SESSION_STATE_RESTORING:
      return "restoring";
    case v1::SESSION_STATE_FAILED:
      return "failed";
    case v1::SESSION_STATE_STORED:
      return "stored";
    default:
      return session.replica().empty() ? "unknown" : "on " + session.replica();
  }
}

bool is_shown(const v1::Session& session) {
  return session.state() != v1::SESSION_STATE_UNSPECIFIED &&
         session.state() != v1::SESSION_STATE_STORED;
}

std::string session_text(const v1::Session& session) {
  Facts facts;
  facts.add("session", session.name())
      .add("uid", session.uid())
      .add("state", state_text(session))
      .add("frame", std::to_string(session.frame()))
      .add("simulated time", seconds_text(session.time_s()))
      .add("at rest", (session.at_rest() ? "yes" : "no") + residual_text(session))
      .add("sheets", sheets_text(session.scene()))
      .add("colliders", std::to_string(session.scene().colliders_size()))
      .add("created", google::protobuf::util::TimeUtil::ToString(session.create_time()));
  for (const auto& repair : session.repairs()) {
    facts.add("repair", fmt::format("frame {}, {} a substep from there on: {}", repair.frame(),
                                    seconds_text(repair.substep_s()), repair.reason()));
  }
  if (!session.owner().empty()) facts.add("owner", session.owner());
  if (!session.replica().empty()) facts.add("replica", session.replica());
  if (!session.failure().empty()) facts.add("failure", session.failure());
  return facts.text();
}

v1::ListSessionsResponse list_sessions(Connection& connection) {
  v1::ListSessionsRequest request;
  v1::ListSessionsResponse all;
  do {
    v1::ListSessionsResponse page = connection.call(&Sessions::ListSessions, request);
    all.mutable_sessions()->MergeFrom(page.sessions());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return all;
}

std::string plan_text(const v1::Plan& plan, const v1::ServerStats* stats) {
  const double frame_step = plan.substep_s() * static_cast<double>(plan.substeps_per_frame());
  Facts facts;
  facts.add("frame step", fmt::format("{} = {} of {}", seconds_text(frame_step),
                                      count_of(plan.substeps_per_frame(), "substep"),
                                      seconds_text(plan.substep_s())));
  if (plan.linear_bound_s() > 0) {
    facts.add("linear bound",
              fmt::format("{}, for every shape; limited by {}", seconds_text(plan.linear_bound_s()),
                          plan.limiting_sheet()));
  } else {
    facts.add("linear bound", "none for this integrator");
  }
  if (plan.unsheared_bound_s() > 0) {
    facts.add("unsheared bound",
              seconds_text(plan.unsheared_bound_s()) +
                  ", for shapes in which threads cross nearly as in the flat sheet");
  }
  facts.add("close estimate", seconds_text(plan.estimated_bound_s()) + ", for the present shape");
  for (const auto& damping : plan.dampings()) {
    facts.add("damping", fmt::format("{}: {} kg/s, {} of critical in its stiffest mode",
                                     damping.sheet(), number_text(damping.damping_kg_per_s()),
                                     number_text(damping.damping_ratio())));
  }
  facts.add("cost", fmt::format("{:.3g} million particle-substeps for a second",
                                plan.particle_substeps_per_second() / 1e6));
  if (const auto time = stats != nullptr ? seconds_of(plan, *stats) : std::nullopt) {
    facts.add("cost", fmt::format("{} of a core, at the pace of this server's sessions",
                                  seconds_text(*time)));
  }
  for (const auto& cost : plan.stretch_costs()) {
    if (!std::isfinite(cost.self_weight_strain())) continue;
    facts.add("stretch", fmt::format("{}: {} under its own weight, hung by an edge", cost.sheet(),
                                     percent_text(cost.self_weight_strain())));
  }
  for (const auto& pass : plan.passes()) facts.add("pass", pass);
  for (const auto& skipped : plan.skipped())
    facts.add("skipped", skipped.pass() + ": " + skipped.reason());
  for (const auto& limit : plan.bending_limits()) {
    facts.add("bending",
              fmt::format("{}: true above a curvature of {} 1/m; finest useful spacing {} mm",
                          limit.sheet(), number_text(limit.least_curvature_per_m()),
                          number_text(limit.finest_spacing_m() * 1e3)));
  }
  for (const auto& warning : plan.warnings()) {
    const std::string place = warning.field().empty() ? "" : " at " + warning.field();
    facts.add("warning", fmt::format("{}{}: {}", warning.code(), place, warning.message()));
  }
  return facts.text();
}

}  // namespace weft::client
