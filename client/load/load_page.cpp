#include "client/load/load_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "client/output/svg.h"
#include "client/output/text.h"

namespace weft::client {
namespace {

constexpr const char* kStyle = R"(
body { font: 15px/1.5 system-ui, sans-serif; max-width: 960px; margin: 2em auto; padding: 0 1em; color: #222 }
div { overflow-x: auto }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; white-space: nowrap }
th, td { padding: .3em .8em; text-align: right; border-bottom: 1px solid #ddd }
th:first-child, td:first-child { text-align: left }
svg { width: 100%; min-width: 640px; height: auto; margin-top: 1.5em })";

constexpr std::array kLatenesses{std::pair{"p50", 2.0}, std::pair{"p90", 10.0},
                                 std::pair{"p99", 100.0}, std::pair{"p99_9", 1000.0}};

double milliseconds(const Json& load, const char* quantile) {
  return 1e3 * load.at("frame_s").at(quantile).get<double>();
}

std::string row(const char* cell, const std::vector<std::string>& texts) {
  std::string html = "<tr>";
  for (const std::string& text : texts) html += fmt::format("<{0}>{1}</{0}>", cell, text);
  return html + "</tr>\n";
}

std::string table(const std::vector<NamedLoad>& loads) {
  std::string html = "<div><table>\n" + row("th", {"load", "frames/s", "create p99", "late p50",
                                                   "p90", "p99", "p99.9", "at most", "errors"});
  for (const auto& [name, figures] : loads) {
    std::vector<std::string> texts{name,
                                   fmt::format("{:.0f}", figures.at("frames_per_s").get<double>()),
                                   seconds_text(figures.at("create_s").at("p99").get<double>())};
    const Json& frame = figures.at("frame_s");
    for (const char* quantile : {"p50", "p90", "p99", "p99_9", "max"})
      texts.push_back(frame.at("count") == 0 ? "-"
                                             : seconds_text(frame.at(quantile).get<double>()));
    const Json& errors = figures.at("errors");
    std::int64_t count = errors.is_number() ? errors.get<std::int64_t>() : 0;
    if (errors.is_object())
      for (const Json& each : errors) count += each.get<std::int64_t>();
    texts.push_back(std::to_string(count));
    html += row("td", texts);
  }
  return html + "</table></div>\n";
}

std::string drawn(const Plot& plot) { return "<div>" + svg_text(plot) + "</div>\n"; }

Plot lateness(const std::vector<NamedLoad>& loads) {
  Plot plot{.title = "How late frames came",
            .x_label = "one frame of so many",
            .y_label = "came later than, ms",
            .series = {},
            .points = true,
            .logarithmic = true};
  for (const auto& [name, figures] : loads) {
    const auto count = figures.at("frame_s").at("count").get<double>();
    Series series{name, {}};
    for (const auto& [quantile, one_of] : kLatenesses)
      if (one_of < count) series.points.emplace_back(one_of, milliseconds(figures, quantile));
    series.points.emplace_back(count, milliseconds(figures, "max"));
    plot.series.push_back(std::move(series));
  }
  return plot;
}

Plot over_sessions(const std::string& title, const std::string& y_label,
                   std::vector<Series> series) {
  for (Series& each : series) std::sort(each.points.begin(), each.points.end());
  return {.title = title,
          .x_label = "sessions",
          .y_label = y_label,
          .series = std::move(series),
          .points = true};
}

}  // namespace

std::string load_page(const std::string& asked, const std::vector<NamedLoad>& loads) {
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width\">\n<title>Weft under load</title>\n"
      "<style>{}</style>\n<h1>Weft under load</h1>\n<p>{}</p>\n{}",
      kStyle, escaped(asked), table(loads));
  const bool is_timed = std::all_of(loads.begin(), loads.end(), [](const NamedLoad& load) {
    return load.figures.at("frame_s").at("count") != 0;
  });
  if (is_timed) html += drawn(lateness(loads));

  std::vector<Series> late{{"p50", {}}, {"p99", {}}, {"at most", {}}}, received{{"received", {}}};
  for (const auto& [name, figures] : loads) {
    const auto sessions = figures.at("sessions").get<double>();
    received[0].points.emplace_back(sessions, figures.at("frames_per_s").get<double>());
    if (!is_timed) continue;
    late[0].points.emplace_back(sessions, milliseconds(figures, "p50"));
    late[1].points.emplace_back(sessions, milliseconds(figures, "p99"));
    late[2].points.emplace_back(sessions, milliseconds(figures, "max"));
  }
  const auto& [least, most] =
      std::minmax_element(received[0].points.begin(), received[0].points.end());
  if (least->first < most->first) {
    if (is_timed)
      html += drawn(over_sessions("Lateness of frames", "late by, ms", std::move(late)));
    html += drawn(over_sessions("Frames", "frames a second", std::move(received)));
  }
  return html + "</html>\n";
}

}  // namespace weft::client
