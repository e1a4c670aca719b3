#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/model/body.h"
#include "core/model/dressing.h"
#include "core/model/shape.h"
#include "core/model/textile.h"

namespace weft {

using Eigen::Quaterniond;

// Of a keyframe along each axis, m.
inline constexpr double kMostOffset = 1e4;
// At which contact follows colliders, m/s.
inline constexpr double kMostColliderSpeed = 100;

struct Keyframe {
  double time = 0;                     // s
  Vector3d offset = Vector3d::Zero();  // from the start, m
};

// Offsets over time, linear between keyframes, constant outside; empty: no motion.
using Path = std::vector<Keyframe>;
Vector3d offset_at(const Path& path, double time);

enum class Evaluator { kSeries, kExact, kLinearized, kPolynomial };

struct ChoiKo {
  Evaluator evaluator = Evaluator::kLinearized;
  int segments = 32;                 // of kLinearized
  int degree = 8;                    // of kPolynomial
  bool fold_clamp = false;           // kLinearized samples eq. 5
  bool optimal_breakpoints = false;  // of kLinearized: closer where f_b bends more
  bool diagonal_bend = true;
};

struct Isometric {
  // Stretch connections push as they pull. Cloth in its plane does; by eq. 2 it is shortened at no
  // cost.
  bool resist_compression = true;
};

using BendingLaw = std::variant<ChoiKo, Isometric>;

// What a panel is made of, where that is not the sheet's textile.
struct PanelTextile {
  int panel = 0;
  Textile textile;
};

struct Pin {
  std::vector<int> particles;
  Path path;
};

struct SheetDefinition {
  std::string name;
  SheetShape shape;
  std::string asset;  // name of what holds the shape; empty: it has none
  Textile textile;
  std::vector<PanelTextile> panel_textiles;
  BendingLaw bending;
  Vector3d origin = Vector3d::Zero();              // of the shape's coordinates, m
  Quaterniond rotation = Quaterniond::Identity();  // about it
  std::vector<double> start_positions;             // (3 x particles) x, y, z of each, m; or empty
  std::vector<double> start_velocities;            // (3 x particles), m/s; or empty
  std::vector<Pin> pins;
  std::optional<double> skin;  // m; absent: a tenth of the spacing that frames show
  // At which it keeps cloth away, its own and other sheets', m; absent: 2 mm, or as much as the
  // mesh allows.
  std::optional<double> thickness;
  // Keeps free particles within the reach of held ones: as far as the cloth between them is long,
  // and this share of it more. Absent: nothing does but the textile.
  std::optional<double> tether_stretch;

  int particle_count() const { return weft::particle_count(shape); }
  double spacing() const { return weft::spacing(shape); }  // m
  double skin_or_default() const;                          // m
  double thickness_or_default() const;                     // m
};

struct Plane {
  Vector3d point = Vector3d::Zero();    // m
  Vector3d normal = Vector3d::UnitY();  // out of the body
};
struct Sphere {
  Vector3d center = Vector3d::Zero();  // m
  double radius = 0;                   // m
};
struct Box {
  Vector3d center = Vector3d::Zero();     // m
  Vector3d half_size = Vector3d::Zero();  // m
  Quaterniond rotation = Quaterniond::Identity();
};
struct Capsule {
  Vector3d start = Vector3d::Zero();  // m
  Vector3d end = Vector3d::Zero();    // m
  double radius = 0;                  // m
};

using SharedBody = std::shared_ptr<const Body>;

struct Collider {
  std::string name;
  std::variant<Plane, Sphere, Box, Capsule, SharedBody> shape;
  double friction = 0.3;
  Path path;
  std::shared_ptr<const Poses> poses{};  // of its body; none: it keeps its shape
  std::string asset = {};          // name of what holds the mesh of its body; empty: it has none
  std::optional<double> cell{};    // of its body's grid as asked for, m
  std::optional<PoseLead> lead{};  // absent: its poses have the times of the scene
};

// The time among its poses at a time of the scene, s.
double pose_time(const Collider& collider, double time);
// Of the fastest vertex as poses lead it between two times, m/s.
double pose_speed(const Collider& collider, double begin, double end);

struct Wind {
  Vector3d velocity = Vector3d::Zero();  // m/s
  double gust = 0;                       // velocity (1 + gust sin(2 pi t / period))
  double gust_period = 1;                // s
  double air_density = 1.2;              // kg/m^3
  double tangential_drag = 0;            // c_t, kg/(m^2 s)
};

// Stands in where a scene has no gravity and weight is a yardstick, m/s^2.
inline constexpr double kStandardGravity = 9.80665;

struct Environment {
  Vector3d gravity{0, -kStandardGravity, 0};  // m/s^2
  std::optional<Wind> wind;
};

enum class IntegratorKind {
  kVerlet,
  kEuler,
  kMidpoint,
  kRk4,
  kLaggedVerlet  // forces see velocities of half a step ago
};
inline bool is_verlet(IntegratorKind kind) {
  return kind == IntegratorKind::kVerlet || kind == IntegratorKind::kLaggedVerlet;
}

// Of positions and forces while stepping.
enum class Precision { kSingle, kDouble };

// What shapes a step is planned for.
enum class StepBound {
  kEveryShape,
  kUnsheared  // in which threads cross nearly as in the flat sheet
};

struct SolverSettings {
  IntegratorKind integrator = IntegratorKind::kVerlet;
  Precision precision = Precision::kSingle;
  bool compensated = true;        // kSingle adds up what its sums of positions lose
  bool plain = false;             // one connection after the other, in double: to compare with
  double frame_step = 1.0 / 60;   // s
  std::optional<double> substep;  // asked for, s
  bool allow_unstable = false;
  double safety = 0.9;  // planned substep / linear bound
  StepBound step_bound = StepBound::kEveryShape;
  // Wind, drag and the bending of a lattice's Isometric act in one of so many substeps or fewer, so
  // many times as strongly; Verlet alone.
  int slow_forces_every = 1;
  // Most halvings of the step by the guard; 0: only what is not finite stops a run.
  int max_repairs = 12;
  // Most that a sheet may stretch under its own weight: stiffer textiles are simulated as soft as
  // that, in shear too, with longer steps. Absent: as stiff as given.
  std::optional<double> max_self_weight_strain;
};

// How close to its equations a scene is computed that does not say it value by value; the interface
// has the errors.
enum class Accuracy {
  kDraft,  // sheets stretch by 1 % under their weight where their textile would less; long steps,
           // lagged damping, slow forces as for kStandard
  kStandard,  // errors are far below what the mesh makes; slow forces in every fourth step
  kFine       // double precision and a quarter of the step, every force in each
};
SolverSettings default_settings(Accuracy accuracy);
BendingLaw default_bending(Accuracy accuracy);

// The thickest that a sheet may be: a quarter of its shortest edge, m.
double most_thickness(const SheetDefinition& sheet);

struct Scene {
  std::vector<SheetDefinition> sheets;
  bool cloth_contact = false;  // whether sheets keep themselves and each other from passing through
  std::vector<Collider> colliders;
  Environment environment;
  SolverSettings solver;
  std::optional<Dressing> dressing;
  std::optional<double> untangle;  // until when cloth contact leads tangled cloth apart, s
};

// If not given, that is a while after a garment is put on; without a dressing it does not, s.
double end_of_untangling(const Scene& scene);

struct Problem {
  std::string field;    // path in a scene file, "sheets[0].grid.rows"
  std::string message;  // with the value and its bounds
};

// Everything that keeps a scene from being simulated; empty for a good one.
std::vector<Problem> find_problems(const Scene& scene);

// The same for poses of a mesh with so many vertices, and for a textile alone; `field` is the path.
std::vector<Problem> find_problems(const Poses& poses, std::size_t vertices,
                                   const std::string& field);
std::vector<Problem> find_problems(const Textile& textile, const std::string& field);

}  // namespace weft
