#include "client/output/svg.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

namespace weft::client {
namespace {

constexpr double kWidth = 720, kHeight = 480;
constexpr double kLeft = 80, kRight = 24, kTop = 44, kBottom = 56;
constexpr std::array kColours = {"#1f77b4", "#d62728", "#2ca02c", "#9467bd",
                                 "#ff7f0e", "#17becf", "#8c564b", "#7f7f7f"};

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else {
      out += c;
    }
  }
  return out;
}

// A range, and places in it at 1, 2 or 5 times a power of ten.
struct Axis {
  double low = 0, high = 1;

  void widen() {
    const double margin = high > low ? 0.05 * (high - low) : 0.05 * std::abs(low) + 1e-12;
    low -= margin;
    high += margin;
  }
  double step() const {
    const double rough = (high - low) / 6, power = std::pow(10, std::floor(std::log10(rough)));
    for (const double factor : {1.0, 2.0, 5.0})
      if (factor * power >= rough) return factor * power;
    return 10 * power;
  }
  std::vector<double> ticks() const {
    std::vector<double> places;
    const double by = step();
    for (double k = std::ceil(low / by); k * by <= high; ++k)
      places.push_back(k * by + 0.0);  // not -0
    return places;
  }
};

std::pair<Axis, Axis> axes_of(const Plot& plot) {
  Axis x, y;
  bool first = true;
  for (const Series& series : plot.series) {
    for (const auto& [px, py] : series.points) {
      x = first ? Axis{px, px} : Axis{std::min(x.low, px), std::max(x.high, px)};
      y = first ? Axis{py, py} : Axis{std::min(y.low, py), std::max(y.high, py)};
      first = false;
    }
  }
  x.widen();
  y.widen();
  if (plot.downwards) {  // a picture of a shape: one measure for both
    const double measure = (x.high - x.low) / (kWidth - kLeft - kRight);
    y.high = std::max(y.high, y.low + measure * (kHeight - kTop - kBottom));
    std::swap(y.low, y.high);
  }
  return {x, y};
}

}  // namespace

std::string svg_text(const Plot& plot) {
  const auto [x_axis, y_axis] = axes_of(plot);
  const auto place_x = [&, x = x_axis](double value) {
    return kLeft + (value - x.low) / (x.high - x.low) * (kWidth - kLeft - kRight);
  };
  const auto place_y = [&, y = y_axis](double value) {
    return kHeight - kBottom - (value - y.low) / (y.high - y.low) * (kHeight - kTop - kBottom);
  };
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"sans-serif\" font-size=\"13\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n"
      "<text x=\"{2}\" y=\"24\" font-size=\"16\">{3}</text>\n",
      kWidth, kHeight, kLeft, escaped(plot.title));
  const auto out = std::back_inserter(svg);
  const double right = kWidth - kRight, bottom = kHeight - kBottom;

  // grid, ticks and labels
  for (const double tick : x_axis.ticks()) {
    const double x = place_x(tick);
    fmt::format_to(out,
                   "<path d=\"M{0:.2f} {1}V{2}\" stroke=\"#ddd\"/>"
                   "<text x=\"{0:.2f}\" y=\"{3}\" text-anchor=\"middle\">{4:.6g}</text>\n",
                   x, kTop, bottom, bottom + 18, tick);
  }
  Axis upright = y_axis;
  if (upright.low > upright.high) std::swap(upright.low, upright.high);
  for (const double tick : upright.ticks()) {
    const double y = place_y(tick);
    fmt::format_to(out,
                   "<path d=\"M{1} {0:.2f}H{2}\" stroke=\"#ddd\"/>"
                   "<text x=\"{3}\" y=\"{4:.2f}\" text-anchor=\"end\">{5:.6g}</text>\n",
                   y, kLeft, right, kLeft - 6, y + 4, tick);
  }
  fmt::format_to(out,
                 "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" "
                 "stroke=\"black\"/>\n",
                 kLeft, kTop, right - kLeft, bottom - kTop);
  fmt::format_to(out, "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n",
                 (kLeft + right) / 2, kHeight - 14, escaped(plot.x_label));
  fmt::format_to(out,
                 "<text transform=\"translate(18 {}) rotate(-90)\" "
                 "text-anchor=\"middle\">{}</text>\n",
                 (kTop + bottom) / 2, escaped(plot.y_label));

  // lines with their names
  for (std::size_t s = 0; s < plot.series.size(); ++s) {
    const Series& series = plot.series[s];
    const char* colour = kColours[s % kColours.size()];
    fmt::format_to(out, "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\" points=\"",
                   colour);
    for (const auto& [x, y] : series.points)
      fmt::format_to(out, "{:.2f},{:.2f} ", place_x(x), place_y(y));
    svg += "\"/>\n";
    if (plot.points)
      for (const auto& [x, y] : series.points)
        fmt::format_to(out, "<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"3\" fill=\"{}\"/>\n",
                       place_x(x), place_y(y), colour);
    const double y = kTop + 18 + 17 * static_cast<double>(s);
    fmt::format_to(out,
                   "<path d=\"M{0} {1}h22\" stroke=\"{2}\" stroke-width=\"2\"/>"
                   "<text x=\"{3}\" y=\"{4}\" stroke=\"white\" stroke-width=\"4\" "
                   "paint-order=\"stroke\">{5}</text>\n",
                   right - 230, y - 4, colour, right - 202, y, escaped(series.name));
  }
  return svg + "</svg>\n";
}

}  // namespace weft::client
