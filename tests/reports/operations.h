#pragma once

#include <string>
#include <vector>

namespace weft::reports {

// Operations that a formula takes, counted by a number that counts what is done with it.
struct Operations {
  int add = 0, subtract = 0, multiply = 0, divide = 0, root = 0, cosine = 0, compare = 0;
};

struct CountedFormula {
  std::string name;
  Operations operations;
  double forces = 0;  // evaluations, of a formula that steps
};

// The bending function g at one length, in the ways of the paper's Table I. Throws std::logic_error
// where a formula is not the one that core computes.
std::vector<CountedFormula> count_bending();

// One step of one particle in three dimensions, given its forces, as Table II. Throws likewise.
std::vector<CountedFormula> count_steps();

}  // namespace weft::reports
