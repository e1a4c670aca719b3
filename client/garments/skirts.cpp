#include "client/garments/skirts.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "client/garments/draft.h"
#include "client/garments/surroundings.h"

namespace weft::client {
namespace {

constexpr double kBand = 0.035;  // height of a waistband, m

// Of what hangs from the band, m.
double waist_of(const DressForm& form) { return form.girth("waist").height - kBand / 2; }
double hem_of(const DressForm& form) { return 0.28 * form.stature; }
double waist_half_of(const DressForm& form, double ease) {
  return (form.girth("waist").wanted + ease) / 4;
}

Outline band_of(const DressForm& form, double half, bool front) {
  return band_outline(half, waist_of(form) + 0.01, kBand, front);
}

PanelPlace place_of(const Outline& outline, const Surroundings& body, bool front) {
  return front ? front_of(outline, body) : back_of(outline, body);
}

void add_band(Draft& draft, const Outline& band, const PanelPlace& place, bool front) {
  draft.add(front ? "band-front" : "band-back", band, place, std::numbers::pi / 2);
}

// A piece of a skirt from the waist, with two darts of that width and depth.
struct SkirtPiece {
  double waist, waist_half, hip, hip_half, hem, hem_half;
  double dart_width, dart_depth;
};

Outline skirt_outline(const SkirtPiece& s, bool front) {
  const std::string here = front ? "left" : "right", there = front ? "right" : "left";
  const auto side = of_side("side", here), other = of_side("side", there);
  const double half = s.waist_half + s.dart_width, dart = s.waist_half / 2 + s.dart_width / 2;
  const double fall = s.waist - s.hip;
  const Vector2d hip_high(s.hip_half, s.hip + 0.45 * fall),
      waist_low(half + 0.006, s.waist - 0.3 * fall);
  Outline outline({-s.hem_half, s.hem});
  outline.line("hem", {s.hem_half, s.hem});
  outline.line(("low-" + side).c_str(), {s.hip_half, s.hip});
  outline.curve(side.c_str(), {hip_high, waist_low, Vector2d(half, s.waist)});
  outline.line("waist-1", {dart + s.dart_width / 2, s.waist});
  outline.line("dart-1", {dart, s.waist - s.dart_depth});
  outline.line("dart-2", {dart - s.dart_width / 2, s.waist});
  outline.line("waist-2", {-dart + s.dart_width / 2, s.waist});
  outline.line("dart-3", {-dart, s.waist - s.dart_depth});
  outline.line("dart-4", {-dart - s.dart_width / 2, s.waist});
  outline.line("waist-3", {-half, s.waist});
  outline.curve(other.c_str(),
                {Vector2d(-waist_low.x(), waist_low.y()), Vector2d(-hip_high.x(), hip_high.y()),
                 Vector2d(-s.hip_half, s.hip)});
  outline.line(("low-" + other).c_str(), {-s.hem_half, s.hem});
  return outline;
}

}  // namespace

v1::Pattern make_skirt(const DressForm& form) {
  const Surroundings body(form);
  Draft draft;
  SkirtPiece piece{};
  piece.waist = waist_of(form);
  piece.waist_half = waist_half_of(form, 0.015);
  piece.hip = form.girth("hip").height;
  piece.hip_half = (form.girth("hip").wanted + 0.04) / 4;
  piece.hem = hem_of(form);
  piece.hem_half = piece.hip_half + 0.07;
  for (const bool front : {true, false}) {
    const std::string name = front ? "front" : "back";
    piece.dart_width = front ? 0.012 : 0.022;
    piece.dart_depth = front ? 0.09 : 0.13;
    const Outline outline = skirt_outline(piece, front);
    draft.add(name, outline, place_of(outline, body, front));
    const Outline band = band_of(form, piece.waist_half, front);
    add_band(draft, band, place_of(band, body, front), front);
    draft.sew({name, {"dart-1"}}, {name, {"dart-2"}});
    draft.sew({name, {"dart-3"}}, {name, {"dart-4"}});
    draft.sew({name, {"waist-1", "waist-2", "waist-3"}}, {"band-" + name, {"lower"}});
  }
  for (const char* side : kSides) {
    const std::string label = of_side("side", side);
    draft.sew({"front", {label}}, {"back", {label}});
    draft.sew({"front", {"low-" + label}}, {"back", {"low-" + label}});
    draft.sew({"band-front", {label}}, {"band-back", {label}});
  }
  return draft.take();
}

// Between two parts that are seen cloth goes under the one, back under both, and from under the
// other one to its front; side seams are in the middle of such a pleat.
v1::Pattern make_pleated_skirt(const DressForm& form) {
  constexpr int kParts = 5, kMiddle = kParts / 2;  // that are seen, of front and back each
  constexpr double kPressed = 3, kStart = 2.5;     // rad
  const double waist = waist_of(form), waist_half = waist_half_of(form, -0.01),  // for it is heavy
      hip = form.girth("hip").height, hem = hem_of(form);
  // widths of a part, at the hip and below as at the hip, and of cloth under each side of it, m
  const double at_waist = 2 * waist_half / kParts,
               at_hip = std::max(at_waist, (form.girth("hip").wanted + 0.06) / 2 / kParts);
  const double under = std::max(0.42 * at_waist - (at_hip - at_waist) / 4, 0.01);
  const double each = at_hip + 4 * under;
  const double half = kMiddle * each + each / 2;  // of front or back
  // mirrored to the last bit, and so rounded alike
  const auto middle_of = [&](int k) { return (kMiddle - k) * each; };
  const auto edge_at = [&](double width) { return width / 2; };
  const auto fold_at = [&](double width) { return (each + width) / 4; };

  const Surroundings body(form);
  Draft draft;
  for (const bool front : {true, false}) {
    const std::string name = front ? "front" : "back", here = front ? "left" : "right",
                      there = front ? "right" : "left";
    Outline outline({0, hem});  // the middle part stays in the plane
    outline.line("hem", {half, hem});
    outline.line(of_side("side", here).c_str(), {half, waist});
    std::vector<std::string> seen;
    for (int k = 0; k < kParts; ++k) {
      const std::string number = std::to_string(k + 1);
      const double middle = middle_of(k);
      outline.line(("back-" + number).c_str(), {middle + fold_at(at_waist), waist});
      outline.line(("under-" + number).c_str(), {middle + edge_at(at_waist), waist});
      for (const double to : {middle, middle - edge_at(at_waist)}) {
        seen.push_back("waist-" + std::to_string(seen.size() + 1));
        outline.line(seen.back().c_str(), {to, waist});
      }
      outline.line(("other-under-" + number).c_str(), {middle - fold_at(at_waist), waist});
      outline.line(("other-back-" + number).c_str(), {middle - each / 2, waist});
    }
    outline.line(of_side("side", there).c_str(), {-half, hem});
    outline.line("hem", {0, hem});

    // pleats and room beside them: pressed onto the body while seams close they fold elsewhere
    const double room = std::sin(kStart) * fold_at(at_waist);
    PanelPlace place = place_of(outline, body, front);
    place.origin.z() += front ? room : -room;
    draft.add(name, outline, place);
    for (int k = 0; k < kParts; ++k) {
      const double middle = middle_of(k);
      for (const double side : {1.0, -1.0}) {
        const auto crease = [&](double low, double high, double turn) {
          draft.crease(name,
                       {{middle + side * low, hem},
                        {middle + side * low, hip},
                        {middle + side * high, waist}},
                       turn * kPressed, turn * kStart);
        };
        crease(edge_at(at_hip), edge_at(at_waist), -1);
        crease(fold_at(at_hip), fold_at(at_waist), 1);
      }
      const std::string number = std::to_string(k + 1);
      draft.sew({name, {"back-" + number}}, {name, {"under-" + number}});
      draft.sew({name, {"other-under-" + number}}, {name, {"other-back-" + number}});
    }
    // in front of what is under the parts seen
    add_band(draft, band_of(form, waist_half, front), place, front);
    draft.sew({name, seen}, {"band-" + name, {"lower"}});
  }
  for (const char* side : kSides)
    for (const std::string part : {"", "band-"})
      draft.sew({part + "front", {of_side("side", side)}},
                {part + "back", {of_side("side", side)}});
  return draft.take();
}

}  // namespace weft::client
