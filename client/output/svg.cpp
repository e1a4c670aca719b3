#include "client/output/svg.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

namespace weft::client {
namespace {

constexpr double kWidth = kPlotWidth, kHeight = kPlotHeight;
constexpr double kLeft = 80, kRight = 224,  // the names stand there
    kTop = 44, kBottom = 56;
constexpr std::array kColours = {"#1f77b4", "#d62728", "#2ca02c", "#9467bd",
                                 "#ff7f0e", "#17becf", "#8c564b", "#7f7f7f"};

// A range, and places in it at 1, 2 or 5 times a power of ten; of a logarithm: at the powers
// themselves, between them too where they are few.
struct Axis {
  double low = 0, high = 1;
  bool logarithm = false;

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
    if (logarithm) {
      const bool few = high - low < 2.5;
      for (double power = std::floor(low); power <= high; ++power)
        for (const double factor : {1.0, 2.0, 5.0})
          if (const double place = power + std::log10(factor);
              place >= low && place <= high && (few || factor == 1))
            places.push_back(place);
      return places;
    }
    const double by = step();
    for (double k = std::ceil(low / by); k * by <= high; ++k) places.push_back(k * by);
    return places;
  }
  std::string label(double place) const {
    return logarithm ? fmt::format("{:.3g}", std::pow(10, place))
                     : fmt::format("{:.6g}", place + 0.0);  // no -0
  }
};

std::pair<Axis, Axis> axes_of(const Plot& plot) {
  Axis x, y;
  bool first = true;
  for (const Series& series : plot.series) {
    for (const auto& [px, py] : series.points) {
      const bool log = plot.logarithmic;
      x = first ? Axis{px, px, log} : Axis{std::min(x.low, px), std::max(x.high, px), log};
      y = first ? Axis{py, py, log} : Axis{std::min(y.low, py), std::max(y.high, py), log};
      first = false;
    }
  }
  x.widen();
  y.widen();
  if (plot.downwards) {  // a picture of a shape: one measure for both
    const double width = kWidth - kLeft - kRight, height = kHeight - kTop - kBottom;
    const double measure = std::max((x.high - x.low) / width, (y.high - y.low) / height);
    const double more = measure * width - (x.high - x.low);
    x.low -= more / 2;
    x.high += more / 2;
    y.high = y.low + measure * height;
    std::swap(y.low, y.high);
  }
  return {x, y};
}

// The plot with logarithms for points, as far as they have them.
Plot as_drawn(Plot plot) {
  if (!plot.logarithmic) return plot;
  for (Series& series : plot.series) {
    std::erase_if(series.points,
                  [](const auto& point) { return !(point.first > 0 && point.second > 0); });
    for (auto& [x, y] : series.points) {
      x = std::log10(x);
      y = std::log10(y);
    }
  }
  return plot;
}

}  // namespace

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

std::string svg_text(const Plot& given) {
  const Plot plot = as_drawn(given);
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
                   "<text x=\"{0:.2f}\" y=\"{3}\" text-anchor=\"middle\">{4}</text>\n",
                   x, kTop, bottom, bottom + 18, x_axis.label(tick));
  }
  Axis upright = y_axis;
  if (upright.low > upright.high) std::swap(upright.low, upright.high);
  for (const double tick : upright.ticks()) {
    const double y = place_y(tick);
    fmt::format_to(out,
                   "<path d=\"M{1} {0:.2f}H{2}\" stroke=\"#ddd\"/>"
                   "<text x=\"{3}\" y=\"{4:.2f}\" text-anchor=\"end\">{5}</text>\n",
                   y, kLeft, right, kLeft - 6, y + 4, upright.label(tick));
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
                   "<text x=\"{3}\" y=\"{4}\">{5}</text>\n",
                   right + 12, y - 4, colour, right + 40, y, escaped(series.name));
  }
  return svg + "</svg>\n";
}

}  // namespace weft::client
