#include "tests/client/t_shirt.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <tuple>

namespace weft::testing {
namespace {

constexpr double kHalfBody = 0.26, kHalfSleeves = 0.42, kHeight = 0.7;  // m
constexpr double kArmpit = 0.48, kHalfNeck = 0.09, kSlope = 0.25;

enum class Panel { kFront, kBack };

// The panel is drawn on a lattice of columns and rows that all of its corners lie on.
class Drawing {
 public:
  explicit Drawing(const TShirt& shirt) : shirt_(shirt), h_(shirt.spacing) {}

  std::string text() {
    std::string faces;
    for (const Panel panel : {Panel::kFront, Panel::kBack}) {
      faces += panel == Panel::kFront ? "g front\n" : "g back\n";
      for (int row = 0; row < count(kHeight); ++row)
        for (int column = -count(kHalfSleeves); column < count(kHalfSleeves); ++column)
          if (has_cell(panel, column, row)) add_cell(panel, column, row, faces);
    }
    return "# a T-shirt\n" + points_ + flats_ + faces;
  }

 private:
  int count(double length) const { return static_cast<int>(std::lround(length / h_)); }

  bool has_cell(Panel panel, int column, int row) const {
    const int x = column < 0 ? -column - 1 : column;  // cells from the middle
    const int depth = count(panel == Panel::kFront ? 0.09 : 0.03);
    if (x < count(kHalfNeck) && row >= count(kHeight) - depth) return false;
    return x < count(kHalfBody) || row >= count(kArmpit);
  }

  bool is_seam(int column, int row) const {
    const int x = std::abs(column);
    return (row == count(kHeight) && x >= count(kHalfNeck)) ||
           (row == count(kArmpit) && x >= count(kHalfBody)) ||
           (x == count(kHalfBody) && row <= count(kArmpit));
  }

  // The body hides in it: deeper away from the seams.
  double depth(double x, double y) const {
    const double side =
        y < kArmpit ? kHalfBody - x : std::hypot(std::max(kHalfBody - x, 0.), y - kArmpit);
    const double shoulder = x > kHalfNeck ? kHeight - y : std::hypot(kHeight - y, kHalfNeck - x);
    const double away = std::max(0., std::min(side, shoulder));
    return 0.03 * (1 - std::exp(-away / 0.1));
  }

  int point(Panel panel, int column, int row) {
    const bool shared = is_seam(column, row);
    const auto [found, added] = numbers_.try_emplace({shared ? Panel::kFront : panel, column, row},
                                                     static_cast<int>(numbers_.size()) + 1);
    if (!added) return found->second;
    const double x = column * h_, y = row * h_;
    const double z = shared ? 0 : depth(std::abs(x), y) * (panel == Panel::kFront ? 1 : -1);
    fmt::format_to(std::back_inserter(points_), "v {:.6f} {:.6f} {:.6f}\n", x, height(x, y) + 0.7,
                   z);
    return found->second;
  }

  // Shoulders slope.
  static double height(double x, double y) { return y - kSlope * std::abs(x) * y / kHeight; }

  int flat(Panel panel, int column, int row) {
    const auto [found, added] =
        flat_numbers_.try_emplace({panel, column, row}, static_cast<int>(flat_numbers_.size()) + 1);
    if (!added) return found->second;
    const double x = column * h_, y = row * h_;
    const double u = panel == Panel::kFront ? x : 1 - x;
    fmt::format_to(std::back_inserter(flats_), "vt {:.7f} {:.7f}\n", u / shirt_.uv_unit,
                   height(x, y) / shirt_.uv_unit);
    return found->second;
  }

  std::string corner(Panel panel, int column, int row) {
    return fmt::format(" {}/{}", point(panel, column, row), flat(panel, column, row));
  }

  // Two triangles; their diagonals alternate. The back is seen from behind.
  void add_cell(Panel panel, int column, int row, std::string& faces) {
    std::array<std::string, 4> around = {corner(panel, column, row), corner(panel, column + 1, row),
                                         corner(panel, column + 1, row + 1),
                                         corner(panel, column, row + 1)};
    if (panel == Panel::kBack) std::swap(around[1], around[3]);
    if ((column + row) % 2 != 0) std::rotate(around.begin(), around.begin() + 1, around.end());
    faces +=
        "f" + around[0] + around[1] + around[2] + "\nf" + around[0] + around[2] + around[3] + "\n";
  }

  using Key = std::tuple<Panel, int, int>;
  TShirt shirt_;
  double h_;
  std::map<Key, int> numbers_, flat_numbers_;
  std::string points_, flats_;
};

}  // namespace

std::string t_shirt_obj(const TShirt& shirt) { return Drawing(shirt).text(); }

}  // namespace weft::testing
