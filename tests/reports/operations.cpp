#include "tests/reports/operations.h"

#include <array>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "core/forces/bending_law.h"
#include "core/motion/integrator.h"

namespace weft::reports {
namespace {

Operations counted;

struct Number {
  double value = 0;
  friend Number operator+(Number a, Number b) { return ++counted.add, Number{a.value + b.value}; }
  friend Number operator-(Number a, Number b) {
    return ++counted.subtract, Number{a.value - b.value};
  }
  friend Number operator*(Number a, Number b) {
    return ++counted.multiply, Number{a.value * b.value};
  }
  friend Number operator/(Number a, Number b) {
    return ++counted.divide, Number{a.value / b.value};
  }
  friend bool operator<(Number a, Number b) { return ++counted.compare, a.value < b.value; }
  friend Number sqrt(Number a) { return ++counted.root, Number{std::sqrt(a.value)}; }
  friend Number cos(Number a) { return ++counted.cosine, Number{std::cos(a.value)}; }
};

Operations count(const std::function<Number()>& formula, double expected, const char* name) {
  counted = {};
  const double value = formula().value;
  if (!(std::abs(value - expected) <= 1e-12 * std::abs(expected)))
    throw std::logic_error(std::string(name) + " is not what core computes");
  return counted;
}

// Eq. 6 term by term, every power from the start, with sinc(u) as eq. 4 has it, in place of r.
Number series_by_powers(Number r) {
  constexpr std::array<std::array<double, 2>, 9> kFractions = {
      {{3.0, 10.0},
       {321.0, 2800.0},
       {3197.0, 56000.0},
       {445617.0, 13798400.0},
       {1766784699.0, 89689600000.0},
       {317184685563.0, 25113088000000.0},
       {14328608561991.0, 1707689984000000.0},
       {6670995251837391.0, 1165411287040000000.0},
       {910588298588385889.0, 228420612259840000000.0}}};
  const Number x = sqrt(Number{1} - r);
  Number f = Number{2} * x;
  for (std::size_t term = 0; term < kFractions.size(); ++term) {
    Number power = x;
    for (std::size_t k = 0; k < 2 * term + 2; ++k) power = power * x;
    f = f + Number{kFractions[term][0]} * power / Number{kFractions[term][1]};
  }
  const Number u = Number{std::sqrt(1.5)} * f;
  return Number{4} * u * u / (cos(u) - r);
}

Number series_by_horner(Number r) {
  const Number x2 = Number{1} - r;
  Number f{SeriesBending::kCoefficients[0]};
  for (std::size_t i = 1; i < SeriesBending::kCoefficients.size(); ++i)
    f = f * x2 + Number{SeriesBending::kCoefficients[i]};
  const Number u = sqrt(Number{1.5} * x2) * f;
  return Number{4} * u * u / (cos(u) - r);
}

// The paper's figure 3: the interval is looked for, from the first on.
Number segment_by_search(const LinearizedBending& table, Number r) {
  const auto& segments = table.segments();
  std::size_t i = 0;
  while (i + 1 < segments.size() &&
         !(r < Number{static_cast<double>(i + 1) / static_cast<double>(segments.size())}))
    ++i;
  return Number{segments[i].slope} * r + Number{segments[i].intercept};
}

Number segment_by_index(const LinearizedBending& table, Number r) {
  const auto& segments = table.segments();
  const Number last{static_cast<double>(segments.size() - 1)};
  Number place = r * Number{static_cast<double>(segments.size())};
  if (last < place) place = last;
  const auto& segment = segments[static_cast<std::size_t>(place.value)];
  return Number{segment.slope} * r + Number{segment.intercept};
}

using Vector = std::array<Number, 3>;

Vector operator+(const Vector& a, const Vector& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
Vector operator-(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Vector operator*(Number a, const Vector& b) { return {a * b[0], a * b[1], a * b[2]}; }

// A particle of 1 / kInverseMass kg on a spring to the origin.
constexpr double kSpring = 3, kInverseMass = 2, kStep = 0.01;

// What a step costs beside its forces: those count, and what they take does not.
class Forces {
 public:
  Vector operator()(const Vector& x) {
    ++evaluations_;
    Vector force;
    for (std::size_t axis = 0; axis < 3; ++axis) force[axis].value = -kSpring * x[axis].value;
    return force;
  }
  int evaluations() const { return evaluations_; }

 private:
  int evaluations_ = 0;
};

struct State {
  Vector x;  // m
  Vector v;  // m/s; of Verlet, the position or the displacement of the step before, m
};

// Eq. 8 as it stands; dt^2 is known before.
void step_verlet_as_printed(State& state, Forces& forces) {
  const Number dt2{kStep * kStep};
  const Vector a = Number{kInverseMass} * forces(state.x);
  const Vector next = Number{2} * state.x - state.v + dt2 * a;
  state = {next, state.x};
}

// The same recurrence by its last displacement; dt^2 / m is known before.
void step_verlet_summed(State& state, Forces& forces) {
  const Number dt2_by_m{kStep * kStep * kInverseMass};
  state.v = state.v + dt2_by_m * forces(state.x);
  state.x = state.x + state.v;
}

void step_euler(State& state, Forces& forces) {
  const Number dt{kStep};
  const Vector a = Number{kInverseMass} * forces(state.x);
  state = {state.x + dt * state.v, state.v + dt * a};
}

void step_midpoint(State& state, Forces& forces) {
  const Number dt{kStep}, half{kStep / 2}, inverse_mass{kInverseMass};
  const Vector a = inverse_mass * forces(state.x);
  const Vector middle = state.x + half * state.v, v_middle = state.v + half * a;
  const Vector a_middle = inverse_mass * forces(middle);
  state = {state.x + dt * v_middle, state.v + dt * a_middle};
}

void step_rk4(State& state, Forces& forces) {
  const Number inverse_mass{kInverseMass}, two{2}, sixth{kStep / 6};
  Vector v = state.v, a = inverse_mass * forces(state.x);
  Vector v_sum = v, a_sum = a;
  const auto stage = [&](Number ahead) {
    const Vector x = state.x + ahead * v;
    v = state.v + ahead * a;
    a = inverse_mass * forces(x);
  };
  for (int middle = 0; middle < 2; ++middle) {
    stage(Number{kStep / 2});
    v_sum = v_sum + two * v;
    a_sum = a_sum + two * a;
  }
  stage(Number{kStep});
  state = {state.x + sixth * (v_sum + v), state.v + sixth * (a_sum + a)};
}

const Vector3d kStart{0.3, -0.2, 0.5}, kVelocity{1, 2, -0.5};

// Where core's integrator has such a particle after two steps, m.
Vector3d two_steps(IntegratorKind kind) {
  Dynamics dynamics;
  dynamics.force = [](double, const Matrix3Xd& x, const Matrix3Xd&, Matrix3Xd& force) {
    force = -kSpring * x;
  };
  dynamics.inverse_mass = VectorXd::Constant(1, kInverseMass);
  dynamics.gravity.setZero();
  const auto integrator = make_integrator(kind);
  Motion motion;
  motion.x = kStart;
  integrator->start(dynamics, 0, kStep, kVelocity, motion);
  for (int step = 0; step < 2; ++step)
    integrator->advance(dynamics, step * kStep, kStep, 1, motion);
  return motion.x;
}

Vector numbers(const Vector3d& from) { return {{{from.x()}, {from.y()}, {from.z()}}}; }

CountedFormula count_step(const std::string& name, IntegratorKind kind, const Vector3d& v,
                          void (*step)(State&, Forces&)) {
  State state{numbers(kStart), numbers(v)};
  Forces forces;
  counted = {};
  step(state, forces);
  CountedFormula made{name, counted, static_cast<double>(forces.evaluations())};
  step(state, forces);
  const Vector3d expected = two_steps(kind);
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (!(std::abs(state.x[axis].value - expected[static_cast<Eigen::Index>(axis)]) <= 1e-12))
      throw std::logic_error(name + " is not what core computes");
  return made;
}

}  // namespace

std::vector<CountedFormula> count_bending() {
  constexpr double kLength = 0.55;  // r, about the middle
  const double series = SeriesBending().value(kLength);
  const Number r{kLength};
  std::vector<CountedFormula> made = {
      {"series, as printed",
       count([&] { return series_by_powers(r); }, series, "the series by powers")},
      {"series, Horner",
       count([&] { return series_by_horner(r); }, series, "the series by Horner")}};
  for (const int segments : {5, 32, 60}) {
    const LinearizedBending table(segments);
    const double expected = table.value(kLength);
    made.push_back({std::to_string(segments) + " segments, searched",
                    count([&] { return segment_by_search(table, r); }, expected, "a search")});
    made.push_back({std::to_string(segments) + " segments, indexed",
                    count([&] { return segment_by_index(table, r); }, expected, "an index")});
  }
  return made;
}

std::vector<CountedFormula> count_steps() {
  // half a kick, as core starts
  const Vector3d a = -kSpring * kInverseMass * kStart;
  const Vector3d displacement = kVelocity * kStep - a * (kStep * kStep / 2);
  return {count_step("Verlet, eq. 8", IntegratorKind::kVerlet, kStart - displacement,
                     step_verlet_as_printed),
          count_step("Verlet, summed", IntegratorKind::kVerlet, displacement, step_verlet_summed),
          count_step("Euler", IntegratorKind::kEuler, kVelocity, step_euler),
          count_step("midpoint", IntegratorKind::kMidpoint, kVelocity, step_midpoint),
          count_step("Runge-Kutta 4", IntegratorKind::kRk4, kVelocity, step_rk4)};
}

}  // namespace weft::reports
