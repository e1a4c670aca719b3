#include "client/figures/dress_form.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "client/problem.h"

namespace weft::client {
namespace {

// A level section of the torso: a superellipse |x / a|^n + |z / b|^n = 1.
struct Section {
  const char* name;
  double height, girth;   // m
  double ratio;           // of width to depth
  double exponent;        // n
  double shift;           // of its middle forward, m
  double share_in_front;  // of its depth
};
// Along a limb, or an arm from the shoulder on.
struct Round {
  double along, side, forward, radius;  // m
};
struct Blob {
  Vector3d middle, radii;  // m
};

struct FigurePlan {
  double stature;
  std::vector<Section> torso;  // upwards
  std::optional<Blob> breast;  // the left one
  std::vector<Round> leg;      // upwards, by height
  double foot_length, foot_radius, foot_height;
  Vector3d shoulder;
  double shoulder_radius;
  std::vector<Round> arm;  // outwards
  Blob head;
};

FigurePlan female() {
  return {1.685,
          {{"gusset", .735, .420, 1.10, 2.00, -.006, .50},
           {"crotch", .770, .800, 1.45, 2.20, -.006, .48},
           {"hip", .815, 1.010, 1.48, 2.35, -.010, .45},
           {"top hip", .930, .900, 1.45, 2.30, 0, .50},
           {"waist", 1.050, .750, 1.38, 2.20, .005, .50},
           {"underbust", 1.135, .790, 1.42, 2.25, .010, .50},
           {"bust", 1.195, .825, 1.45, 2.30, .004, .50},
           {"armpit", 1.255, .850, 1.60, 2.40, -.004, .50},
           {"chest", 1.320, .800, 1.90, 2.40, -.012, .50},
           {"shoulder", 1.395, .640, 2.20, 2.20, -.020, .50},
           {"neck base", 1.440, .400, 1.25, 2.00, -.022, .52},
           {"neck", 1.480, .335, 1.05, 2.00, -.012, .50},
           {"neck top", 1.545, .330, 1.00, 2.00, .004, .50}},
          Blob{{.080, 1.190, .058}, {.066, .070, .062}},
          {{.085, .076, -.018, .0355},
           {.180, .078, -.018, .0415},
           {.320, .081, -.012, .0545},
           {.395, .083, 0, .0535},
           {.455, .085, .006, .0585},
           {.560, .088, .004, .068},
           {.700, .090, 0, .0840},
           {.770, .089, -.004, .0905},
           {.820, .086, -.006, .0895},
           {.900, .078, -.004, .0780}},
          .175,
          .032,
          .045,
          {.168, 1.372, -.020},
          .054,
          {{0, 0, 0, .0520},
           {.07, 0, 0, .0475},
           {.15, 0, 0, .0435},
           {.31, 0, 0, .0370},
           {.345, 0, 0, .0372},
           {.40, 0, 0, .0388},
           {.55, 0, 0, .0268},
           {.575, 0, 0, .0262}},
          {{0, 1.60, .018}, {.074, .102, .090}}};
}

FigurePlan male() {
  return {1.80,
          {{"gusset", .765, .430, 1.10, 2.00, -.006, .50},
           {"crotch", .800, .830, 1.40, 2.20, -.006, .48},
           {"hip", .860, 1.000, 1.42, 2.40, -.012, .44},
           {"top hip", .975, .900, 1.42, 2.40, 0, .50},
           {"waist", 1.085, .830, 1.38, 2.30, .006, .50},
           {"underbust", 1.205, .930, 1.42, 2.35, .006, .50},
           {"bust", 1.280, 1.000, 1.45, 2.45, .004, .52},
           {"armpit", 1.340, 1.005, 1.62, 2.50, -.004, .52},
           {"chest", 1.410, .930, 1.90, 2.45, -.014, .50},
           {"shoulder", 1.490, .740, 2.15, 2.25, -.022, .50},
           {"neck base", 1.530, .455, 1.25, 2.00, -.022, .52},
           {"neck", 1.570, .385, 1.05, 2.00, -.012, .50},
           {"neck top", 1.635, .380, 1.00, 2.00, .004, .50}},
          std::nullopt,
          {{.090, .081, -.018, .0375},
           {.190, .083, -.018, .0435},
           {.340, .087, -.012, .0585},
           {.420, .089, .002, .0575},
           {.485, .091, .008, .063},
           {.590, .094, .006, .074},
           {.740, .096, 0, .0915},
           {.800, .094, -.004, .0980},
           {.850, .090, -.006, .0965},
           {.930, .080, -.004, .0830}},
          .195,
          .036,
          .050,
          {.194, 1.462, -.022},
          .062,
          {{0, 0, 0, .0610},
           {.07, 0, 0, .0575},
           {.16, 0, 0, .0550},
           {.33, 0, 0, .0430},
           {.365, 0, 0, .0432},
           {.42, 0, 0, .0455},
           {.59, 0, 0, .0298},
           {.62, 0, 0, .0290}},
          {{0, 1.70, .018}, {.078, .108, .096}}};
}

// A curve through points that overshoots none of them (Fritsch and Carlson 1980), rounded by a
// Gaussian of `width`, m.
class Curve {
 public:
  Curve(const std::vector<double>& x, const std::vector<double>& y, double width) : first_(x[0]) {
    const std::size_t n = x.size();
    std::vector<double> slope(n, 0), rise(n - 1);
    for (std::size_t k = 0; k + 1 < n; ++k) rise[k] = (y[k + 1] - y[k]) / (x[k + 1] - x[k]);
    for (std::size_t k = 1; k + 1 < n; ++k)
      if (rise[k - 1] * rise[k] > 0) {
        const double before = x[k] - x[k - 1], after = x[k + 1] - x[k];
        slope[k] = 3 * (before + after) /
                   ((2 * after + before) / rise[k - 1] + (after + 2 * before) / rise[k]);
      }
    slope[0] = rise[0];
    slope[n - 1] = rise[n - 2];
    std::vector<double> exact;
    std::size_t k = 0;
    for (double at = x[0]; at < x[n - 1] + kStep; at += kStep) {
      while (k + 2 < n && at > x[k + 1]) ++k;
      const double h = x[k + 1] - x[k], t = std::clamp((at - x[k]) / h, 0.0, 1.0);
      exact.push_back((1 + 2 * t) * (1 - t) * (1 - t) * y[k] +
                      t * (1 - t) * (1 - t) * h * slope[k] + t * t * (3 - 2 * t) * y[k + 1] -
                      t * t * (1 - t) * h * slope[k + 1]);
    }
    const int reach = static_cast<int>(std::ceil(4 * width / kStep));
    const int last = static_cast<int>(exact.size()) - 1;
    for (int i = 0; i <= last; ++i) {
      double sum = 0, weights = 0;
      for (int j = -reach; j <= reach; ++j) {
        const double far = width > 0 ? j * kStep / width : 0, weight = std::exp(-far * far / 2);
        sum += weight * exact[as_index(std::clamp(i + j, 0, last))];
        weights += weight;
      }
      values_.push_back(sum / weights);
    }
  }

  double operator()(double x) const {
    const double at =
        std::clamp((x - first_) / kStep, 0.0, static_cast<double>(values_.size() - 1));
    const auto k = std::min(static_cast<std::size_t>(at), values_.size() - 2);
    return values_[k] + (at - static_cast<double>(k)) * (values_[k + 1] - values_[k]);
  }

 private:
  static constexpr double kStep = 0.004;  // m
  double first_;
  std::vector<double> values_;
};

template <class Row, class Of>
Curve curve(const std::vector<Row>& rows, double Row::*along, const Of& of, double width) {
  std::vector<double> x, y;
  for (const Row& row : rows) {
    x.push_back(row.*along);
    y.push_back(of(row));
  }
  return {x, y, width};
}

double perimeter(double a, double b, double n) {
  constexpr int kPoints = 128;
  const auto point = [&](int i) {
    const double angle = 2 * std::numbers::pi * i / kPoints, c = std::cos(angle),
                 s = std::sin(angle);
    return Vector2d(a * std::copysign(std::pow(std::abs(c), 2 / n), c),
                    b * std::copysign(std::pow(std::abs(s), 2 / n), s));
  };
  double sum = 0;
  for (int i = 0; i < kPoints; ++i) sum += (point(i + 1) - point(i)).norm();
  return sum;
}
// Half the depth of a section.
double half_depth(const Section& section) {
  return section.girth / perimeter(section.ratio, 1, section.exponent);
}

// The lesser of two distances, blended where they are closer than `width`.
double blend(double a, double b, double width) {
  const double share = std::clamp(0.5 + 0.5 * (b - a) / width, 0.0, 1.0);
  return b * (1 - share) + a * share - width * share * (1 - share);
}

double from_cone(const Vector3d& p, const Vector3d& a, const Vector3d& b, double radius_a,
                 double radius_b) {
  const Vector3d axis = b - a;
  const double t = std::clamp((p - a).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
  return (p - a - t * axis).norm() - radius_a - t * (radius_b - radius_a);
}

double from_blob(const Vector3d& p, const Blob& blob) {
  const Vector3d q = (p - blob.middle).cwiseQuotient(blob.radii);
  const double k = q.norm();
  return k * (k - 1) / std::max(q.cwiseQuotient(blob.radii).norm(), 1e-9);
}

// Of the left arm so many degrees below the level.
Vector3d arm_direction(double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  return Vector3d(std::cos(angle), -std::sin(angle), 0.06).normalized();
}

// Roughly the distance from a figure, negative inside. It is as its mirror image in x = 0.
class FigureShape {
 public:
  FigureShape(const FigurePlan& plan, double arm_angle)
      : plan_(plan),
        depth_(section(half_depth)),
        width_(section([](const Section& s) { return s.ratio * half_depth(s); })),
        exponent_(section([](const Section& s) { return s.exponent; })),
        shift_(section([](const Section& s) { return s.shift; })),
        front_(section([](const Section& s) { return s.share_in_front; })),
        leg_side_(curve(
            plan.leg, &Round::along, [](const Round& r) { return r.side; }, 0)),
        leg_forward_(curve(
            plan.leg, &Round::along, [](const Round& r) { return r.forward; }, 0)),
        leg_radius_(curve(
            plan.leg, &Round::along, [](const Round& r) { return r.radius; }, 0)),
        arm_radius_(curve(
            plan.arm, &Round::along, [](const Round& r) { return r.radius; }, 0)) {
    arm_ = arm_direction(arm_angle);
  }

  double operator()(const Vector3d& point) const {
    const Vector3d p(std::abs(point.x()), point.y(), point.z());
    double d = from_torso(p);
    if (plan_.breast) d = blend(d, from_blob(p, *plan_.breast), 0.045);
    d = blend(d, from_leg(p), 0.045);
    if (p.x() < 0.08) d = blend(d, from_leg({-p.x(), p.y(), p.z()}), 0.012);
    d = blend(d, from_shoulder(p), 0.05);
    d = blend(d, from_arm(p), 0.04);
    return blend(d, from_blob(p, plan_.head), 0.03);
  }

  // Half the width of the torso there, m.
  double half_width(double height) const { return width_(height); }

 private:
  template <class Of>
  Curve section(const Of& of) const {
    constexpr double kRounding = 0.022;  // m, so that no section shows as an edge
    return curve(plan_.torso, &Section::height, of, kRounding);
  }

  double from_torso(const Vector3d& p) const {
    constexpr double kFar = 0.1;  // m, beyond which nothing is blended
    const double low = plan_.torso.front().height, high = plan_.torso.back().height;
    const double y = std::clamp(p.y(), low, high);
    const double forward = p.z() - shift_(y), front = front_(y), n = exponent_(y);
    const double a = width_(y), b = 2 * (forward > 0 ? front : 1 - front) * depth_(y);
    const double over = std::max(p.y() - high, low - p.y());
    const double beyond = std::max({std::abs(p.x()) - a, std::abs(forward) - b, over});
    if (beyond > kFar) return beyond;
    const double u = std::abs(p.x()) / a, v = std::abs(forward) / b;
    const double f = std::pow(std::pow(u, n) + std::pow(v, n) + 1e-12, 1 / n);
    const double slope = std::hypot(std::pow(u / f, n - 1) / a, std::pow(v / f, n - 1) / b);
    const double d = (f - 1) / std::max(slope, 1e-6);
    if (over <= 0) return d;
    return d > 0 ? std::hypot(d, over) : std::max(d, over);
  }

  double from_leg(const Vector3d& p) const {
    const double low = plan_.leg.front().along, high = plan_.leg.back().along;
    const double y = std::clamp(p.y(), low, high);
    const double over = std::max({p.y() - high, low - p.y(), 0.0});
    const double across = std::hypot(p.x() - leg_side_(y), p.z() - leg_forward_(y));
    const Round& ankle = plan_.leg.front();
    const double foot = from_cone(
        p, {ankle.side, plan_.foot_height, ankle.forward - 0.022},
        {ankle.side + 0.022, plan_.foot_height - 0.012, ankle.forward + plan_.foot_length},
        plan_.foot_radius, 0.75 * plan_.foot_radius);
    return blend(std::hypot(across, over) - leg_radius_(y), foot, 0.035);
  }

  double from_arm(const Vector3d& p) const {
    const double length = plan_.arm.back().along;
    const double along = std::clamp((p - plan_.shoulder).dot(arm_), 0.0, length);
    const double arm = (p - plan_.shoulder - along * arm_).norm() - arm_radius_(along);
    const Vector3d wrist = plan_.shoulder + length * arm_;
    const double scale = plan_.arm.back().radius / 0.0262;
    return blend(
        arm, from_cone(p, wrist + 0.035 * arm_, wrist + 0.1 * arm_, 0.027 * scale, 0.021 * scale),
        0.05);
  }

  double from_shoulder(const Vector3d& p) const {
    const Section& neck = plan_.torso[plan_.torso.size() - 3];
    return from_cone(p, {0.035, neck.height + 0.005, neck.shift},
                     plan_.shoulder + Vector3d(-0.010, 0.006, 0), 0.046,
                     plan_.shoulder_radius - 0.012);
  }

  const FigurePlan& plan_;
  Curve depth_, width_, exponent_, shift_, front_, leg_side_, leg_forward_, leg_radius_,
      arm_radius_;
  Vector3d arm_;
};

// Around the points of a level section between x = -most and most, by the tape: their convex hull.
double girth_of(const FigureMesh& mesh, double height, double most) {
  std::vector<Vector2d> points;
  for (const auto& triangle : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d& a = mesh.vertices[as_index(triangle[k])];
      const Vector3d& b = mesh.vertices[as_index(triangle[(k + 1) % 3])];
      if ((a.y() < height) == (b.y() < height)) continue;
      const Vector3d at = a + (height - a.y()) / (b.y() - a.y()) * (b - a);
      if (std::abs(at.x()) < most) points.emplace_back(at.x(), at.z());
    }
  std::sort(points.begin(), points.end(), [](const Vector2d& a, const Vector2d& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  // one side of the hull, then the other (Andrew 1979)
  double length = 0;
  for (int half = 0; half < 2; ++half) {
    std::vector<Vector2d> chain;
    for (const Vector2d& point : points) {
      while (chain.size() > 1) {
        const Vector2d last = chain.back() - chain[chain.size() - 2], next = point - chain.back();
        if (last.x() * next.y() - last.y() * next.x() > 0) break;
        chain.pop_back();
      }
      chain.push_back(point);
    }
    for (std::size_t i = 1; i < chain.size(); ++i) length += (chain[i] - chain[i - 1]).norm();
    std::reverse(points.begin(), points.end());
  }
  return length;
}

struct Taken {
  const char* section;
  std::optional<double> Measures::*given;
};
constexpr Taken kTaken[] = {{"hip", &Measures::hip},
                            {"top hip", &Measures::top_hip},
                            {"waist", &Measures::waist},
                            {"underbust", &Measures::underbust},
                            {"bust", &Measures::bust}};

Section& section_of(FigurePlan& plan, const std::string& name) {
  return *std::find_if(plan.torso.begin(), plan.torso.end(),
                       [&](const Section& section) { return section.name == name; });
}

// Of the plan as it stands.
double bust_of(const FigurePlan& plan) { return plan.breast ? 0.925 : 1.0; }

// Heights by `tall`, all that lies across by `wide`.
void scale(FigurePlan& plan, double tall, double wide) {
  const Vector3d by(wide, tall, wide);
  plan.stature *= tall;
  for (Section& section : plan.torso) {
    section.height *= tall;
    section.girth *= wide;
    section.shift *= wide;
  }
  for (Round& round : plan.leg)
    round = {round.along * tall, round.side * wide, round.forward * wide, round.radius * wide};
  for (Round& round : plan.arm) round = {round.along * tall, 0, 0, round.radius * wide};
  plan.foot_length *= tall;
  plan.foot_radius *= std::sqrt(tall * wide);
  plan.foot_height *= tall;
  plan.shoulder = plan.shoulder.cwiseProduct(by);
  plan.shoulder_radius *= wide;
  for (Blob* blob : {plan.breast ? &*plan.breast : nullptr})
    if (blob != nullptr) *blob = {blob->middle.cwiseProduct(by), wide * blob->radii};
  const double head = std::sqrt(tall);  // heads differ less than people
  plan.head = {{0, plan.head.middle.y() * tall, plan.head.middle.z() * wide},
               plan.head.radii * head};
}

}  // namespace

Measures measures_of_size(FigureKind figure, int size) {
  Measures measures{.figure = figure};
  const bool female = figure == FigureKind::kFemale;
  measures.bust = female ? 0.02 * size + 0.12 : 0.02 * size;
  measures.waist = female ? 0.02 * size - 0.04 : 0.02 * size - 0.12;
  measures.hip = female ? 0.015 * size + 0.4 : 0.02 * size + 0.04;
  return measures;
}

Measures measures_of(const Person& person) {
  Measures measures = person.measures;
  if (!person.size) return measures;
  const bool female = measures.figure == FigureKind::kFemale;
  const int least = female ? kLeastFemaleSize : kLeastMaleSize,
            most = female ? kMostFemaleSize : kMostMaleSize;
  if (*person.size < least || *person.size > most || *person.size % 2 != 0)
    throw Violation{"size", fmt::format("{} is not even and within {} to {}, sizes of a {}",
                                        *person.size, least, most, female ? "woman" : "man")};
  const Measures usual = measures_of_size(measures.figure, *person.size);
  for (const auto girth : {&Measures::bust, &Measures::waist, &Measures::hip})
    if (!(measures.*girth)) measures.*girth = usual.*girth;
  return measures;
}

std::span<const LengthInfo> person_lengths() {
  static constexpr LengthInfo kLengths[] = {
      {"stature", &Measures::stature, "Height of the person, m", 1.2, 2.2},
      {"bust", &Measures::bust, "Bust or chest girth, m", 0.6, 1.8},
      {"underbust", &Measures::underbust, "Underbust girth, m", 0.5, 1.7},
      {"waist", &Measures::waist, "Waist girth, m", 0.45, 1.8},
      {"top_hip", &Measures::top_hip, "Top hip girth, m", 0.55, 1.8},
      {"hip", &Measures::hip, "Hip girth, m", 0.6, 1.9}};
  return kLengths;
}

const DressForm::Girth& DressForm::girth(const std::string& name) const {
  return *std::find_if(girths.begin(), girths.end(),
                       [&](const Girth& each) { return each.name == name; });
}

DressForm make_dress_form(const Measures& measures) {
  constexpr double kCell = 0.012;  // m
  FigurePlan plan = measures.figure == FigureKind::kFemale ? female() : male();
  const double tall = measures.stature.value_or(plan.stature) / plan.stature;

  // what was given says how stout the rest is
  double ratios = 0;
  int given = 0;
  for (const Taken& each : kTaken)
    if (const auto& girth = measures.*each.given) {
      const bool bust = std::string(each.section) == "bust";
      ratios += *girth / (bust ? bust_of(plan) : section_of(plan, each.section).girth);
      ++given;
    }
  const double wide = given > 0 ? ratios / given : tall;
  const double usual_bust = bust_of(plan) * wide;
  scale(plan, tall, wide);

  DressForm form;
  form.stature = plan.stature;
  for (const Taken& each : kTaken) {
    Section& section = section_of(plan, each.section);
    const bool bust = std::string(each.section) == "bust";
    const double wanted = (measures.*each.given).value_or(bust ? usual_bust : section.girth);
    if (bust && plan.breast)
      section.girth *= wanted / usual_bust;
    else
      section.girth = wanted;
    form.girths.push_back({each.section, wanted, 0, section.height});
  }

  // sections follow what the tape finds
  constexpr int kRounds = 8;
  constexpr double kClose = 3e-3;  // m
  for (int round = 0; round < kRounds; ++round) {
    const FigureShape shape(plan, measures.arm_angle);
    const double reach = plan.shoulder.x() + plan.arm.back().along + 0.2, deep = 0.2 + 0.15 * wide;
    form.mesh =
        surface_of(shape, {-reach, -0.03, -deep}, {reach, plan.stature + 0.08, deep}, kCell);
    smooth(form.mesh, 6);
    double worst = 0;
    for (DressForm::Girth& girth : form.girths) {
      girth.found = girth_of(form.mesh, girth.height, 1.12 * shape.half_width(girth.height));
      const double lacking = girth.wanted - girth.found;
      worst = std::max(worst, std::abs(lacking));
      if (girth.name == "bust" && plan.breast)
        plan.breast->middle.z() += 0.35 * lacking;  // they take it up, not the ribs
      else
        section_of(plan, girth.name).girth += lacking;
    }
    if (worst < kClose) break;
  }

  const auto widest = [](const Round& a, const Round& b) { return a.radius < b.radius; };
  form.arm = {plan.shoulder, arm_direction(measures.arm_angle), plan.arm.back().along,
              std::max_element(plan.arm.begin() + 1, plan.arm.end(), widest)->radius};
  form.neck_height = section_of(plan, "neck base").height;
  form.neck_girth = section_of(plan, "neck base").girth;
  return form;
}

}  // namespace weft::client
