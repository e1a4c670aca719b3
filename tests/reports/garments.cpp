// Garments: what it takes to dress a form, whether that is good, and what the mesh changes of it.
#include "client/load/garments.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <ctime>
#include <iostream>
#include <stdexcept>

#include "client/garments/drape.h"
#include "client/textile_file.h"
#include "core/simulation.h"
#include "server/convert/convert.h"
#include "server/session/idle_threads.h"
#include "tests/reports/report.h"
#include "tests/support/core/scenes.h"

namespace weft::reports {
namespace {

using Row = std::vector<std::string>;

constexpr double kLongest = 20;  // until a garment is at rest, s

// A garment of size 40 on the form of its measures.
struct Order {
  std::string garment;
  double edge = 0;                // of triangles, m
  bool capped = false;            // in its stretch under its own weight, at 1 %
  const char* textile = nullptr;  // else the garment's usual one
};

client::GarmentScene make(client::Connection& connection, const Order& order) {
  client::Drape drape;
  drape.garment = order.garment;
  drape.measures = client::measures_of({.size = 40});
  if (order.textile != nullptr) drape.textile = client::textile_named(order.textile);
  drape.edge_m = order.edge;
  if (order.capped) drape.values = {{"solver.max_self_weight_strain", "0.01"}};
  return client::make_drape(connection, drape);
}

Simulation simulate(const v1::Scene& scene) {
  auto converted = to_scene(scene, "scene");
  if (const auto* problems = std::get_if<std::vector<Problem>>(&converted))
    throw std::runtime_error(problems->front().field + ": " + problems->front().message);
  return Simulation(std::get<Scene>(std::move(converted)));
}

struct Seconds {
  double core = 0, wall = 0;
};

Seconds seconds_now() {
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now().time_since_epoch();
  return {static_cast<double>(std::clock()) / CLOCKS_PER_SEC, wall.count()};
}

// Frames from one time to another, or until rest.
struct Passage {
  Seconds took;
  int frames = 0, with_cuts = 0;
  std::int64_t most_cuts = 0;
};

Passage follow_until(Simulation& simulation, double time, bool until_rest,
                     ThreadPool& pool = calling_thread()) {
  Passage passage;
  const Seconds begin = seconds_now();
  while (simulation.time() < time - 1e-9 && !(until_rest && simulation.at_rest())) {
    if (!simulation.advance_frame(pool)) throw std::runtime_error(simulation.failure());
    const std::int64_t cuts = simulation.cloth_cuts().value_or(0);
    passage.most_cuts = std::max(passage.most_cuts, cuts);
    passage.with_cuts += cuts > 0 ? 1 : 0;
    ++passage.frames;
  }
  const Seconds end = seconds_now();
  passage.took = {end.core - begin.core, end.wall - begin.wall};
  return passage;
}

std::string verdict_text(const Verdict& verdict) {
  std::string text;
  for (const Fault& fault : verdict.faults) text += (text.empty() ? "" : ", ") + fault.code;
  return text.empty() ? "good" : text;
}

void say(const Row& row) { std::cerr << fmt::format("{}\n", fmt::join(row, ", ")); }

// Where a body stands, s, before it moves through its poses within kMoves.
constexpr double kStands = 4.5, kMoves = 4;
constexpr int kPoses = 240;

// The form twists to both sides and sways. Level slices of it turn and shift as they are, so it
// never meets itself.
void set_in_motion(v1::MeshData& mesh) {
  const std::string& bytes = mesh.positions_m();
  const std::size_t count = bytes.size() / 12;
  std::vector<float> start(3 * count), all;
  std::memcpy(start.data(), bytes.data(), bytes.size());
  all.reserve(start.size() * kPoses);
  for (int pose = 0; pose < kPoses; ++pose) {
    const double time = kMoves * pose / kPoses;
    const double phase = 2 * M_PI * time / kMoves, ramp = std::sin(phase / 2) * std::sin(phase / 2);
    const double twist = 0.35 * ramp * std::sin(3 * phase),
                 sway = 0.06 * ramp * std::sin(2 * phase);
    std::vector<float> at(3 * count);
    for (std::size_t i = 0; i < count; ++i) {
      const double x = start[i], y = start[count + i], z = start[2 * count + i];
      const double up = std::clamp((y - 0.1) / 1.2, 0.0, 1.0), share = up * up * (3 - 2 * up);
      const double cosine = std::cos(twist * share), sine = std::sin(twist * share);
      at[i] = static_cast<float>(cosine * x + sine * z + sway * share);
      at[count + i] = static_cast<float>(y);
      at[2 * count + i] = static_cast<float>(cosine * z - sine * x);
    }
    all.insert(all.end(), at.begin(), at.end());
    mesh.mutable_poses()->add_times_s(kStands + time);
  }
  mesh.mutable_poses()->set_positions_m(reinterpret_cast<const char*>(all.data()),
                                        all.size() * sizeof(float));
}

class Garments {
 public:
  Garments(Page& page, bool large) : page_(page), large_(large) {}

  void write() {
    dressing();
    moving();
    refinement();
    queue();
    if (!left_out_.empty())
      page_.text("Left out without `--large`: " + fmt::format("{}", fmt::join(left_out_, ", ")) +
                 ".");
  }

 private:
  // Whether a long part is to be measured.
  bool wanted(const std::string& what) {
    if (!large_) left_out_.push_back(what);
    return large_;
  }

  void dressing() {
    page_.text("## From flat panels to rest");
    std::vector<Order> orders{{"tshirt", 0.0105, true}};
    if (wanted("the T-shirt not capped")) orders.push_back({"tshirt", 0.0105, false});
    if (wanted("the dress")) orders.push_back({"dress", 0.00965, true});
    std::vector<Row> rows;
    for (const Order& order : orders) {
      const client::GarmentScene made = make(*connection_, order);
      const Seconds begin = seconds_now();
      Simulation simulation = simulate(made.scene);
      const Passage passage = follow_until(simulation, kLongest, true);
      const double core = seconds_now().core - begin.core;
      const Verdict verdict = simulation.verdict();
      const char* stretch = order.capped ? "capped at 1 %" : "as measured";
      const std::string particles = std::to_string(simulation.particle_count());
      rows.push_back({order.garment, particles, stretch, fmt::format("{:.1f}", core),
                      fmt::format("{:.1f}", simulation.time()), std::to_string(passage.most_cuts),
                      std::to_string(verdict.cloth_cuts),
                      fmt::format("{:.1f}", 100 * verdict.strain_warp),
                      fmt::format("{:.1f}", 100 * verdict.strain_weft), verdict_text(verdict)});
      page_.row({"dressing", order.garment + (order.capped ? " capped" : ""), particles,
                 number(core), number(simulation.time()), std::to_string(passage.most_cuts),
                 std::to_string(verdict.cloth_cuts)});
      say(rows.back());
    }
    page_.table({"garment", "particles", "stretch", "processor s", "simulated s", "most cuts",
                 "cuts at rest", "strain warp %", "weft %", "verdict"},
                rows);
    page_.text(
        "On one thread, with the making of the body's grid. Cuts are edges of cloth through cloth, "
        "of the worst frame and at rest. Sewn particles are the same ones, so no gap is left at a "
        "seam.");
  }

  void moving() {
    const std::string what = "the dress on a body that moves";
    page_.text("## On a body that moves");
    const Order order = large_ ? Order{"dress", 0.00965, true} : Order{"dress", 0.02, true};
    if (!large_) left_out_.push_back(what + ", in 15 000 particles");
    client::GarmentScene made = make(*connection_, order);
    set_in_motion(*made.scene.mutable_colliders(0)->mutable_mesh()->mutable_data());
    Simulation simulation = simulate(made.scene);
    Scheduler scheduler(2);  // threads that have nothing to do by the time they are asked to help
    follow_until(simulation, kStands, false);
    IdleThreads pool(scheduler, std::min(2, simulation.most_threads()));
    const Passage passage = follow_until(simulation, kStands + kMoves, false, pool);
    const Verdict verdict = simulation.verdict();
    const Row row{order.garment,
                  std::to_string(simulation.particle_count()),
                  fmt::format("{:.1f}", passage.took.core),
                  fmt::format("{:.1f}", passage.took.wall),
                  fmt::format("{} of {}", passage.with_cuts, passage.frames),
                  std::to_string(passage.most_cuts),
                  std::to_string(verdict.cloth_cuts),
                  std::to_string(verdict.particles_inside)};
    page_.row({"moving", order.garment, row[1], number(passage.took.core), number(kMoves),
               std::to_string(passage.most_cuts), std::to_string(verdict.cloth_cuts)});
    say(row);
    page_.table({"garment", "particles", "processor s", "wall s", "frames with cuts", "most cuts",
                 "cuts at the end", "particles inside"},
                {row});
    page_.text(fmt::format(
        "From {} s on the form twists by 20 degrees to both sides and sways by 6 cm, in {} poses "
        "within {} s; two threads.",
        kStands, kPoses, kMoves));
  }

  void refinement();
  void queue();

  Page& page_;
  bool large_;
  std::vector<std::string> left_out_;
  std::unique_ptr<client::Connection> connection_ = client::Connection::embedded({});
};

// Length of the edges with a label as they lie, and their mean height, m.
struct Line {
  double length = 0, height = 0;
};

Line line_of(const client::Json& edges, const std::string& label, const Matrix3Xd& x) {
  Line line;
  int particles = 0;
  for (const auto& edge : edges) {
    if (!edge.value("label", "").starts_with(label)) continue;
    const auto& on_it = edge.at("particles");
    for (std::size_t k = 0; k < on_it.size(); ++k) {
      const Vector3d at = x.col(on_it[k].get<int>());
      line.height += at.y();
      ++particles;
      if (k > 0) line.length += (at - x.col(on_it[k - 1].get<int>())).norm();
    }
  }
  line.height /= std::max(1, particles);
  return line;
}

// Area of the projection on the ground, by cells of 1 mm, m^2.
double shadow(const std::vector<std::array<int, 3>>& triangles, const Matrix3Xd& x) {
  constexpr double kCell = 1e-3;
  const Vector3d least = x.rowwise().minCoeff(), most = x.rowwise().maxCoeff();
  const auto cells = [&](int axis) {
    return static_cast<Eigen::Index>((most[axis] - least[axis]) / kCell) + 2;
  };
  Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic> dark =
      Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic>::Zero(cells(0), cells(2));
  for (const auto& triangle : triangles) {
    std::array<Vector2d, 3> at;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d corner = (x.col(triangle[k]) - least) / kCell;
      at[k] = {corner.x(), corner.z()};
    }
    const auto cross = [](const Vector2d& a, const Vector2d& b) {
      return a.x() * b.y() - a.y() * b.x();
    };
    const double turn = cross(at[1] - at[0], at[2] - at[0]) < 0 ? -1 : 1;
    const auto low =
        at[0].cwiseMin(at[1]).cwiseMin(at[2]).array().ceil().cast<Eigen::Index>().eval();
    const auto high =
        at[0].cwiseMax(at[1]).cwiseMax(at[2]).array().floor().cast<Eigen::Index>().eval();
    for (Eigen::Index i = low.x(); i <= high.x(); ++i)
      for (Eigen::Index j = low.y(); j <= high.y(); ++j) {
        const Vector2d point(static_cast<double>(i), static_cast<double>(j));
        bool within = true;
        for (std::size_t k = 0; k < 3; ++k)
          within = within && turn * cross(at[(k + 1) % 3] - at[k], point - at[k]) >= 0;
        if (within) dark(i, j) = true;
      }
  }
  return kCell * kCell * static_cast<double>(dark.count());
}

void Garments::refinement() {
  page_.text("## Refined");
  std::vector<double> edges{0.04, 0.02};
  if (wanted("the skirt of 1 cm")) edges.push_back(0.01);
  std::vector<Row> rows;
  for (const double edge : edges) {
    const client::GarmentScene made = make(*connection_, {"skirt", edge, true});
    Simulation simulation = simulate(made.scene);
    const Passage passage = follow_until(simulation, kLongest, true);
    const Matrix3Xd x = testing::positions(simulation);
    const Line waist = line_of(made.json.at("edges"), "waist", x),
               hem = line_of(made.json.at("edges"), "hem", x);
    const double area = shadow(triangles_of(simulation.scene().sheets[0].shape), x);
    rows.push_back(
        {fmt::format("{:g}", 100 * edge), std::to_string(simulation.particle_count()),
         fmt::format("{:.1f}", passage.took.core), fmt::format("{:.1f}", 1e3 * waist.length),
         fmt::format("{:.1f}", 1e3 * waist.height), fmt::format("{:.1f}", 1e3 * hem.height),
         fmt::format("{:.4f}", area), verdict_text(simulation.verdict())});
    page_.row({"refinement", "skirt", rows.back()[1], number(passage.took.core),
               number(waist.length), number(hem.height), number(area)});
    say(rows.back());
  }
  page_.table({"edges cm", "particles", "processor s", "waist mm", "its height mm",
               "hem's height mm", "shadow m²", "verdict"},
              rows);
  page_.text(
      "The skirt at rest, its stretch capped at 1 %: how long its waist is, how high waist and hem "
      "are in the "
      "mean, and the area of its shadow, seen from above.");
}

void Garments::queue() {
  page_.text("## Many");
  client::GarmentsOrder order;
  order.scene = make(*connection_, {"tshirt", 0.02, true}).scene;
  order.garments = large_ ? 20 : 6;
  if (!large_) left_out_.push_back("20 T-shirts instead of 6");
  std::vector<Row> rows;
  double first = 0;
  for (const int at_once : {1, 2, order.garments}) {
    order.at_once = at_once;
    const Seconds begin = seconds_now();
    const auto result = client::put_on(*connection_, order, [](const auto&) {});
    const Seconds end = seconds_now();
    if (first == 0) first = result.wall.count();
    rows.push_back({std::to_string(at_once), fmt::format("{:.1f}", result.wall.count()),
                    fmt::format("{:.1f}", end.core - begin.core),
                    fmt::format("{:.2f}", first / result.wall.count()),
                    fmt::format("{:.0f}", result.per_hour()),
                    fmt::format("{} of {}", result.good, result.done)});
    page_.row({"queue", std::to_string(at_once), std::to_string(order.garments),
               number(end.core - begin.core), number(result.wall.count()), "", ""});
    say(rows.back());
  }
  page_.table({"at a time", "wall s", "processor s", "times as fast", "an hour", "good"}, rows);
  page_.text(
      fmt::format("{} T-shirts, edges of 2 cm, stretch capped at 1 %, on a server of two threads.",
                  order.garments));
}

}  // namespace

void garments(const std::filesystem::path& folder, const std::string& commit, bool large) {
  Page page(folder, {"what", "scene", "particles", "processor_s", "a", "b", "c"});
  page.text("# Garments");
  page.text(fmt::format(
      "Made by `./dev bench garments{}` on {}. Garments of our own for size 40, the T-shirt of "
      "interlock jersey, the dress of tropical wool, the skirt of denim, on the dress form of its "
      "measures (`weft drape`). Processor seconds are of the cores that did the work, wall seconds "
      "depend on what else the machine does.",
      large ? " --large" : "", machine(commit)));
  Garments(page, large).write();
  page.write();
}

}  // namespace weft::reports
