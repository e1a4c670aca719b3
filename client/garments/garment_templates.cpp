#include "client/garments/garment_templates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "client/garments/draft.h"
#include "client/garments/skirts.h"
#include "client/garments/surroundings.h"

namespace weft::client {
namespace {

// A top's body, half of it drawn, down to a hem: heights, and half widths.
struct Bodice {
  double hem, hem_half;
  double underarm, chest_half;
  double shoulder, shoulder_half;
  double neck, neck_half;
  double front_neck, back_neck;  // depths of the neckline
};

// Labels end in the wearer's side; the back is drawn as seen from behind.
Outline bodice_outline(const Bodice& b, bool front) {
  const std::string here = front ? "left" : "right", there = front ? "right" : "left";
  const double depth = b.shoulder - b.underarm, drop = front ? b.front_neck : b.back_neck;
  Outline outline({-b.hem_half, b.hem});
  outline.line("hem", {b.hem_half, b.hem});
  const auto side = of_side("side", here), armhole = of_side("armhole", here),
             shoulder = of_side("shoulder", here), other_shoulder = of_side("shoulder", there),
             other_armhole = of_side("armhole", there), other_side = of_side("side", there);
  const Vector2d underarm(b.chest_half, b.underarm), tip(b.shoulder_half, b.shoulder),
      neck(b.neck_half, b.neck);
  constexpr double kHollow = 0.02;
  const Vector2d low(b.shoulder_half - kHollow, b.underarm + 0.02 * depth),
      high(b.shoulder_half - kHollow, b.shoulder - 0.55 * depth);
  const auto image = [](const Vector2d& point) { return Vector2d(-point.x(), point.y()); };
  outline.line(side.c_str(), underarm);
  outline.curve(armhole.c_str(), {low, high, tip});
  outline.line(shoulder.c_str(), neck);
  outline.curve("neck", {Vector2d(b.neck_half, b.neck - 0.95 * drop),
                         Vector2d(-b.neck_half, b.neck - 0.95 * drop), image(neck)});
  outline.line(other_shoulder.c_str(), image(tip));
  outline.curve(other_armhole.c_str(), {image(high), image(low), image(underarm)});
  outline.line(other_side.c_str(), {-b.hem_half, b.hem});
  return outline;
}

// Half widths and lengths of a sleeve, m.
struct Sleeve {
  double upper, cuff;
  double length;    // of the underarm seam, v
  double drop = 0;  // of the cuff across the arm
};

// The front half of the left sleeve, v up the arm, u = 0 in its upper middle; the cap is as long as
// the armhole, and eased by 1.5 %.
Outline sleeve_outline(const Sleeve& sleeve, double armhole) {
  constexpr double kEase = 1.015;
  const double u = sleeve.upper / 2, length = sleeve.length;
  const double below = -sleeve.cuff / 2 - sleeve.drop, above = sleeve.cuff / 2 - sleeve.drop;
  const auto with_cap = [&](double height) {
    Outline outline({below, 0});
    outline.line("cuff", {above, 0});
    outline.line("over", {u, length + height});
    outline.curve("cap", {Vector2d(0.1 * u, length + height), Vector2d(-0.3 * u, length),
                          Vector2d(-u, length)});
    outline.line("under", {below, 0});
    return outline;
  };
  double low = 0, high = 2 * armhole;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (with_cap(middle).length("cap") < kEase * armhole ? low : high) = middle;
  }
  return with_cap(low);
}

// Sleeves of two halves around both arms, sewn into the armholes of front and back.
void add_sleeves(Draft& draft, const DressForm& form, const Bodice& bodice, Sleeve sleeve) {
  const double armhole = bodice_outline(bodice, true).length("armhole-left");
  // v runs up the arm, u across it; the cap ends at the shoulder's tip, or the underarm beside the
  // bodice's, and as high where that leaves room for the arm
  const auto& arm = form.arm;
  const double turn = std::numbers::pi / 2 + std::atan2(arm.direction.y(), arm.direction.x());
  const Vector3d across(std::cos(turn), std::sin(turn), 0);
  const double tip = arm.radius / 2 + sleeve_outline(sleeve, armhole).most_v() - sleeve.length;
  const auto along = [&](double below) {  // from the joint to the underarm, as far below the axis
    const double out = bodice.chest_half + kClear - arm.top.x() + below * across.x();
    return std::max(tip, out / arm.direction.x());
  };
  const double half = sleeve.upper / 2, least = std::min(half, arm.radius + kClear);
  const double low = arm.top.y() + along(half) * arm.direction.y() - half * across.y();
  const double below = std::clamp(half - (bodice.underarm - low) / across.y(), least, half);
  sleeve.drop = half - below;  // the cuff stays around the arm
  const Outline outline = sleeve_outline(sleeve, armhole);
  const Vector3d cuff =
      arm.top + (along(below) + sleeve.length) * arm.direction + sleeve.drop * across;
  const double deep = arm.radius + kClear, mid = (arm.top.z() + cuff.z()) / 2,
               lean = std::abs(arm.top.z() - cuff.z()) / 2;
  PanelPlace place{{cuff.x(), cuff.y(), mid + lean + deep},
                   Quaterniond(Eigen::AngleAxisd(turn, Vector3d::UnitZ()))};
  const PanelPlace back = behind(place, mid - lean - deep);
  draft.add("sleeve-front-left", outline, place);
  draft.add("sleeve-back-left", outline.mirrored(), back);
  draft.add("sleeve-front-right", outline.mirrored(), mirrored(place));
  draft.add("sleeve-back-right", outline, mirrored(back));
  for (const std::string side : kSides) {
    const std::string sleeve_front = "sleeve-front-" + side, sleeve_back = "sleeve-back-" + side;
    draft.sew({"front", {of_side("armhole", side)}}, {sleeve_front, {"cap"}});
    draft.sew({"back", {of_side("armhole", side)}}, {sleeve_back, {"cap"}});
    draft.sew({sleeve_front, {"over"}}, {sleeve_back, {"over"}});
    draft.sew({sleeve_front, {"under"}}, {sleeve_back, {"under"}});
  }
}

// Shoulders, necks and armholes of a top, with `ease` around the chest, m.
Bodice bodice_for(const DressForm& form, const Surroundings& body, double ease) {
  Bodice b{};
  b.chest_half = (form.girth("bust").wanted + ease) / 4;
  b.neck_half = form.neck_girth / (2 * std::numbers::pi) + 0.025;
  b.shoulder_half = form.arm.top.x() + 0.015;
  // above the body all along
  b.neck = body.top(b.neck_half) + 0.015;
  b.shoulder = body.top(b.shoulder_half) + 0.015;
  for (double t = 0.1; t < 1; t += 0.1) {
    const double line = b.neck + t * (b.shoulder - b.neck);
    const double lack = body.top(b.neck_half + t * (b.shoulder_half - b.neck_half)) + 0.012 - line;
    if (lack > 0) b.neck += lack, b.shoulder += lack;
  }
  // below the arm
  const double along = (b.chest_half - form.arm.top.x()) / form.arm.direction.x();
  const double arm =
      form.arm.top.y() + along * form.arm.direction.y() - form.arm.radius / form.arm.direction.x();
  b.underarm = std::min(b.shoulder - form.girth("bust").wanted / 10 - 0.11, arm - kClear);
  b.front_neck = 0.09;
  b.back_neck = 0.025;
  return b;
}

void add_bodice(Draft& draft, const Bodice& b, const Surroundings& body) {
  const Outline front = bodice_outline(b, true), back = bodice_outline(b, false);
  draft.add("front", front, front_of(front, body));
  draft.add("back", back, back_of(back, body));
  for (const std::string side : kSides)
    for (const char* label : {"side", "shoulder"})
      draft.sew({"front", {of_side(label, side)}}, {"back", {of_side(label, side)}});
}

double upper_arm_half(const DressForm& form, double ease) {
  return std::numbers::pi * form.arm.radius + ease / 2;
}

v1::Pattern tshirt(const DressForm& form) {
  const Surroundings body(form);
  Draft draft;
  Bodice b = bodice_for(form, body, 0.08);
  b.hem = form.girth("hip").height + 0.02;
  b.hem_half = std::max(b.chest_half, (form.girth("hip").wanted + 0.04) / 4);
  add_bodice(draft, b, body);
  const double half = upper_arm_half(form, 0.09);
  add_sleeves(draft, form, b, {half, 0.92 * half, 0.07});
  return draft.take();
}

v1::Pattern dress(const DressForm& form) {
  constexpr double kGathers = 1.35;
  const Surroundings body(form);
  Draft draft;
  Bodice b = bodice_for(form, body, 0.06);
  b.hem = form.girth("waist").height;
  b.hem_half = (form.girth("waist").wanted + 0.06) / 4;
  b.front_neck = 0.11;
  add_bodice(draft, b, body);
  const double half = upper_arm_half(form, 0.08);
  add_sleeves(draft, form, b, {half, 0.92 * half, 0.05});
  const double waist_half = kGathers * b.hem_half, hem = 0.27 * form.stature;
  const double hem_half =
      std::max(waist_half, (form.girth("hip").wanted + 0.1) / 4) + 0.25 * (b.hem - hem);
  for (const bool front : {true, false}) {
    const std::string name = front ? "front" : "back";
    const Outline outline =
        trapezoid("hem", hem, hem_half, "waist", b.hem - 0.015, waist_half, front);
    draft.add("skirt-" + name, outline, (front ? front_of : back_of)(outline, body));
    draft.sew({name, {"hem"}}, {"skirt-" + name, {"waist"}});
  }
  for (const std::string side : kSides)
    draft.sew({"skirt-front", {of_side("side", side)}}, {"skirt-back", {of_side("side", side)}});
  return draft.take();
}

// A collar whose fall comes down over its stand. It starts outside of front and back, turned down:
// closed, it could not turn over.
void add_collar(Draft& draft, const Bodice& b, const Surroundings& body) {
  constexpr double kStand = 0.03, kFall = 0.045, kWider = 0.022, kTurned = 3;
  constexpr double kAround = 0.003;     // m: it is longer than the stand it lies around by four
  constexpr double kFirstTurned = 2.5;  // rad: it starts above the shoulders that it comes down on
  for (const bool front : {true, false}) {
    const std::string name = front ? "front" : "back";
    const Outline bodice = bodice_outline(b, front);
    const double half = bodice.length("neck") / 2, low = b.neck + 0.01, roll = low + kStand;
    const auto place = front ? front_of : back_of;
    const Outline stand = band_outline(half, low, kStand, front),
                  fall = trapezoid("lower", roll, half + kAround, "upper", roll + kFall,
                                   half + kWider, front);
    draft.add("stand-" + name, stand, place(stand, body), std::numbers::pi / 2);
    PanelPlace turned = place(bodice, body);
    const double out = front ? 1 : -1;
    const Quaterniond turn(Eigen::AngleAxisd(out * kFirstTurned, Vector3d::UnitX()));
    const Vector3d edge(0, roll, 0);
    turned.origin += edge - turn * edge + Vector3d(0, 0, out * kClear);
    turned.rotation = turn * turned.rotation;
    draft.add("fall-" + name, fall, turned, std::numbers::pi / 2);
    draft.sew({name, {"neck"}}, {"stand-" + name, {"lower"}});
    draft.sew({"stand-" + name, {"upper"}}, {"fall-" + name, {"lower"}}, kTurned);
  }
  for (const std::string side : kSides)
    for (const std::string part : {"stand-", "fall-"})
      draft.sew({part + "front", {of_side("side", side)}},
                {part + "back", {of_side("side", side)}});
}

v1::Pattern shirt(const DressForm& form) {
  const Surroundings body(form);
  Draft draft;
  Bodice b = bodice_for(form, body, 0.12);
  b.hem = form.girth("hip").height - 0.03;
  b.hem_half = std::max(b.chest_half, (form.girth("hip").wanted + 0.06) / 4);
  b.front_neck = 0.075;
  add_bodice(draft, b, body);
  const double half = upper_arm_half(form, 0.12);
  add_sleeves(draft, form, b, {half, 0.62 * half, form.arm.length - 0.22});
  add_collar(draft, b, body);
  return draft.take();
}

// A leg's front or back: heights, and widths from the middle of the body outwards.
struct LegPiece {
  double waist, waist_half, hip, hip_half, crotch, fork, hem, hem_width;
  double dart_width, dart_depth;  // 0: none
};

// With the middle of the body at u = 0, the fork beyond it.
Outline leg_outline(const LegPiece& p) {
  const double rise = p.waist - p.crotch, fall = p.waist - p.hip, dart = p.dart_width;
  const double middle = (p.hip_half - p.fork) / 2;  // of the leg
  Outline outline({middle - p.hem_width / 2, p.hem});
  outline.line("hem", {middle + p.hem_width / 2, p.hem});
  outline.line("low-side", {p.hip_half, p.hip});
  outline.curve("side", {Vector2d(p.hip_half, p.hip + 0.45 * fall),
                         Vector2d(p.waist_half + dart + 0.006, p.waist - 0.3 * fall),
                         Vector2d(p.waist_half + dart, p.waist)});
  if (dart > 0) {
    const double at = (p.waist_half + dart) / 2;
    outline.line("waist-1", {at + dart / 2, p.waist});
    outline.line("dart-1", {at, p.waist - p.dart_depth});
    outline.line("dart-2", {at - dart / 2, p.waist});
    outline.line("waist-2", {0, p.waist});
  } else {
    outline.line("waist-1", {0, p.waist});
  }
  outline.curve("rise", {Vector2d(0, p.crotch + 0.25 * rise), Vector2d(-0.1 * p.fork, p.crotch),
                         Vector2d(-p.fork, p.crotch)});
  outline.line("inseam", {middle - p.hem_width / 2, p.hem});
  return outline;
}

// In front of the left leg, or behind the right one; the inseam hangs straight down between them.
PanelPlace leg_place(const LegPiece& p, const Surroundings& body, bool front) {
  constexpr double kApart = 0.006, kWide = 0.25;
  const double side = front ? 1 : -1;
  const double lean = std::atan2((p.hip_half + p.fork - p.hem_width) / 2, p.crotch - p.hem);
  const double z = body.depth(side, p.hem, p.waist, kWide) + side * kClear;
  PanelPlace place{{0, 0, z}, Quaterniond(Eigen::AngleAxisd(-side * lean, Vector3d::UnitZ()))};
  if (!front) place = behind(place, z);
  place.origin +=
      Vector3d(side * kApart, p.crotch, 0) - place.rotation * Vector3d(-p.fork, p.crotch, 0);
  return place;
}

// A band's front or back, whose lower edge is in two halves.
Outline halved_band(double half, double low, double height, bool front) {
  const std::string here = front ? "left" : "right", there = front ? "right" : "left";
  Outline outline({-half, low});
  outline.line(of_side("lower", there).c_str(), {0, low});
  outline.line(of_side("lower", here).c_str(), {half, low});
  outline.line(of_side("side", here).c_str(), {half, low + height});
  outline.line("upper", {-half, low + height});
  outline.line(of_side("side", there).c_str(), {-half, low});
  return outline;
}

v1::Pattern trousers(const DressForm& form) {
  constexpr double kBand = 0.035, kBelow = 0.015;
  const Surroundings body(form);
  Draft draft;
  const double hip = form.girth("hip").wanted;
  LegPiece piece{};
  piece.waist = form.girth("waist").height - kBand / 2;
  piece.waist_half = 0.98 * form.girth("waist").wanted / 4;  // stays up by it
  piece.hip = form.girth("hip").height;
  piece.crotch = body.crotch() - kBelow;
  piece.hem = 0.07 * form.stature;
  for (const bool front : {true, false}) {
    const std::string name = front ? "front" : "back";
    piece.hip_half = (hip + 0.05) / 4 + (front ? -0.005 : 0.005);
    piece.fork = (front ? 0.055 : 0.105) * hip;
    piece.hem_width = (front ? 0.2 : 0.22) * hip;
    piece.dart_width = front ? 0 : 0.025;
    piece.dart_depth = 0.11;
    const Outline leg = leg_outline(piece);
    const PanelPlace place = leg_place(piece, body, front);
    const std::string here = name + (front ? "-left" : "-right"),
                      there = name + (front ? "-right" : "-left");
    draft.add(here, leg, place);
    draft.add(there, leg.mirrored(), mirrored(place));
    const Outline band = halved_band(piece.waist_half, piece.waist + 0.01, kBand, front);
    draft.add("band-" + name, band, (front ? front_of : back_of)(band, body), std::numbers::pi / 2);
    draft.sew({here, {"rise"}}, {there, {"rise"}});
    for (const std::string side : kSides) {
      const std::string panel = name + "-" + side;
      std::vector<std::string> waist{"waist-1"};
      if (!front) {
        draft.sew({panel, {"dart-1"}}, {panel, {"dart-2"}});
        waist.emplace_back("waist-2");
        if (panel == there) std::ranges::reverse(waist);
      }
      draft.sew({panel, waist}, {"band-" + name, {of_side("lower", side)}});
    }
  }
  for (const std::string side : kSides) {
    for (const char* label : {"low-side", "side", "inseam"})
      draft.sew({"front-" + side, {label}}, {"back-" + side, {label}});
    draft.sew({"band-front", {of_side("side", side)}}, {"band-back", {of_side("side", side)}});
  }
  return draft.take();
}

struct Template {
  GarmentInfo info;
  v1::Pattern (*make)(const DressForm&);
};
const std::vector<Template>& all_templates() {
  static const std::vector<Template> all = {
      {{"tshirt", "A T-shirt: front, back, sleeves of two halves", kUsualTextile}, tshirt},
      {{"skirt", "A skirt to the knee: front and back with darts, a waistband", "denim_11oz"},
       make_skirt},
      {{"pleated_skirt", "A skirt to the knee in box pleats, a waistband", "wool_tropical"},
       make_pleated_skirt},
      {{"trousers", "Trousers to the ankle: legs of a front and a back, a waistband", "denim_11oz",
        0.02},
       trousers},
      {{"dress", "A dress to the knee: a fitted top with sleeves, a gathered skirt",
        "wool_tropical"},
       dress},
      {{"shirt", "A loose shirt with long sleeves and a collar that falls, without an opening",
        kUsualTextile},
       shirt},
  };
  return all;
}

const Template& template_of(const std::string& name) {
  std::string names;
  for (const Template& each : all_templates()) {
    if (each.info.name == name) return each;
    names += (names.empty() ? "" : ", ") + each.info.name;
  }
  throw usage_problem(fmt::format("there is no garment \"{}\"; there are {}", name, names));
}

}  // namespace

std::vector<GarmentInfo> garment_templates() {
  std::vector<GarmentInfo> infos;
  for (const Template& each : all_templates()) infos.push_back(each.info);
  return infos;
}

v1::Pattern make_garment(const std::string& name, const Measures& measures) {
  return template_of(name).make(make_dress_form(measures));
}

v1::Pattern make_garment(const std::string& name, const DressForm& form) {
  return template_of(name).make(form);
}

}  // namespace weft::client
