#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/model/scene.h"
#include "core/triangles/cut.h"

namespace weft {

// What a textile is put to. All but the drape have an answer from a textbook.
enum class LabTest {
  kTensile,     // a strip pulled by 1 %: its modulus
  kShear,       // a frame sheared by 1 degree: its modulus
  kBending,     // the bending curve of a connection: f_b, f_b*, the evaluator's, and its error;
                // on triangles the rigidity of a cylinder in four directions
  kCantilever,  // ASTM D1388: a strip over an edge hangs at 41.5 degrees
  kChain,       // threads without bending between two hooks: an elastic catenary
  kDrape,       // ISO 9073-9 (Cusick): a disc hangs over a smaller one, its shadow is measured
};

struct LabOrder {
  LabTest test = LabTest::kCantilever;
  MeasuredTextile textile;
  BendingLaw bending;
  bool weft = false;             // the specimen is cut along the weft
  std::vector<double> spacings;  // h, m; empty: a range that the test chooses
  std::optional<Cut> mesh = {};  // of the specimen's triangles; absent: a lattice
};

// A figure that was asked for and what the model made of it, at one resolution.
struct LabValue {
  std::string quantity;
  std::string unit;
  double spacing = 0;  // m
  int particles = 0;
  std::optional<double> asked;  // absent: theory has no answer
  double found = 0;
};

// Rows of numbers under names with units: "r", "f_b N".
struct LabCurve {
  std::string name;
  std::vector<std::string> columns;
  std::vector<std::vector<double>> rows;
};

struct LabReport {
  std::string method;  // the specimen, and where `asked` comes from
  std::vector<LabValue> values;
  std::vector<LabCurve> curves;
  std::vector<std::string> notes;  // where the model is wrong about cloth
};

// Everything that keeps a test from being run; empty for a good one. Fields as in RunTestRequest.
std::vector<Problem> find_problems(const LabOrder& order);

// Who waits for a test.
struct LabWatch {
  std::stop_token stop;
  std::function<void(int done, int specimens)> progress;  // called before each specimen; or empty
};

// Precondition: find_problems(order) is empty. On a stop it ends soon, with what it has.
LabReport run_lab(const LabOrder& order, const LabWatch& watch = {});

}  // namespace weft
