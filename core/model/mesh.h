#pragma once

#include <Eigen/Core>
#include <array>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "core/forces/bending_law.h"
#include "core/model/scene.h"

namespace weft {

// (3 x particles) x, y, z of each particle in a column.
using Eigen::Matrix3Xd;
using Eigen::VectorXd;

// Particles i and j, each pair once.
using Connection = std::pair<int, int>;

// Connections one after the other, as runs of equal ones: in a lattice those of a row, or more.
class Connections {
  struct Run {
    int first, step, apart, count;  // first + k step is connected with what lies `apart` from it
  };

 public:
  class Iterator {
   public:
    Iterator(const Run* run, const Run* end) : run_(run), end_(end) { begin_run(); }
    Connection operator*() const { return {i_, i_ + run_->apart}; }
    Iterator& operator++() {
      i_ += run_->step;
      if (--left_ == 0) ++run_, begin_run();
      return *this;
    }
    bool operator==(std::default_sentinel_t) const { return run_ == end_; }

   private:
    void begin_run() {
      if (run_ != end_) i_ = run_->first, left_ = run_->count;
    }
    const Run *run_, *end_;
    int i_ = 0, left_ = 0;
  };

  void add(int i, int j);
  Iterator begin() const { return {runs_.data(), runs_.data() + runs_.size()}; }
  static std::default_sentinel_t end() { return std::default_sentinel; }
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }

 private:
  std::vector<Run> runs_;
  std::size_t size_ = 0;
};

enum class FamilyKind {
  kStretch,
  kShear,
  kBend,
  kDiagonalBend,
  kDamp  // edges of triangles, which only damp
};

// Connections that share a law and its constants.
struct Family {
  FamilyKind kind;
  double rest_length;                // L, m
  double stiffness;                  // k of eq. 2, N/m; 0 for bend
  std::optional<BendingForce> bend;  // eq. 3 to 5; absent: no force
  Connections connections;
  bool pushes = false;  // where it is shortened, as it pulls by eq. 2
};

// Energy stiffness / 2 |sum weight_k x_k|^2 over up to four particles: the isometric law.
struct Stencil {
  std::array<int, 4> particle;
  std::array<double, 4> weight;
  double stiffness;  // N/m
};

// A triangle, with the gradients of its corners' hat functions along warp and weft.
struct MembraneElement {
  std::array<int, 3> particle{};
  std::array<double, 3> du{}, dv{};  // 1/m
  double area = 0;                   // of the flat shape, m^2
  int panel = 0;
};

// Second derivatives of positions along warp and weft at a particle, x_uu, x_uv and x_vv: sums of
// the positions around it by these weights, 1/m^2.
struct CurvatureFit {
  std::vector<int> particle;                  // the first is its own
  std::vector<std::array<double, 3>> weight;  // uu, uv, vv
  double area = 0;                            // of it that has this panel's textile, m^2
  int panel = 0;
};

// Stiffness of a panel in its plane, N/m.
struct MembraneStiffness {
  double warp = 0, weft = 0;
  double coupling = 0;  // of strain along the warp with that along the weft
  double shear = 0;     // per radian
};

// Bending rigidity of a panel, N m. Twist: the mean of warp and weft in a textile without cross
// contraction.
struct BendStiffness {
  double warp = 0, weft = 0, twist = 0;
};

// An edge that keeps an angle, as Fold has it. The first two particles are its ends; with the third
// they run anticlockwise, with the fourth clockwise.
struct Hinge {
  std::array<int, 4> particle{};
  std::array<double, 4> slope{};  // of the angle by how far each leaves the flat shape, rad/m
  double stiffness = 0;           // N m, per radian
  double angle = 0;               // at rest, rad
};

// What a sheet of triangles resists strain and curvature by; empty: it does not.
struct Surface {
  std::vector<MembraneElement> membrane = {};
  std::vector<CurvatureFit> fits = {};
  std::vector<Hinge> hinges = {};
  std::vector<MembraneStiffness> stretch = {};  // of each panel
  std::vector<BendStiffness> bend = {};         // of each panel
  bool pushes = true;  // where it is shortened, as it pulls; needs no coupling
};

// Particles and connections: all that forces know of a sheet.
struct Mesh {
  VectorXd mass;       // (particles) kg
  VectorXd drag;       // (particles) in still air, kg/s; or empty: none
  double damping = 0;  // k_d of every connection, kg/s
  std::vector<Family> families;
  std::vector<Stencil> stencils;
  Surface surface;
  std::vector<std::array<int, 3>> triangles;  // that wind presses on
};

// Whether stretch connections push.
bool resists_compression(const BendingLaw& bending);

// Positions at the start: those given, or the flat sheet as it is placed. Holds on to the sheet.
class StartPositions {
 public:
  explicit StartPositions(const SheetDefinition& sheet);
  Vector3d operator()(int particle) const;  // m

 private:
  const SheetDefinition& sheet_;
  Eigen::Matrix3d rotation_;
};
Matrix3Xd start_positions(const SheetDefinition& sheet);
// Velocities at the start, m/s.
Matrix3Xd start_velocities(const SheetDefinition& sheet);

}  // namespace weft
