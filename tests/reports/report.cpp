#include "tests/reports/report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <fstream>
#include <iostream>
#include <map>
#include <stdexcept>
#include <thread>

namespace weft::reports {
namespace {

void write_file(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  file.close();
  if (!file) throw std::runtime_error("cannot write " + path.string());
}

}  // namespace

Page::Page(std::filesystem::path folder, std::vector<std::string> columns)
    : folder_(std::move(folder)) {
  std::filesystem::create_directories(folder_);
  row(columns);
}

void Page::row(const std::vector<std::string>& cells) {
  csv_ += fmt::format("{}\n", fmt::join(cells, ","));
}

void Page::text(const std::string& markdown) { markdown_ += markdown + "\n\n"; }

void Page::table(const std::vector<std::string>& columns,
                 const std::vector<std::vector<std::string>>& rows) {
  markdown_ += fmt::format("| {} |\n|{}\n", fmt::join(columns, " | "),
                           fmt::join(std::vector<std::string>(columns.size(), "---|"), ""));
  for (const auto& cells : rows) markdown_ += fmt::format("| {} |\n", fmt::join(cells, " | "));
  markdown_ += '\n';
}

void Page::plot(const std::string& name, const Plot& plot) {
  write_file(folder_ / (name + ".svg"), svg_text(plot));
  markdown_ += fmt::format("![{}]({}.svg)\n\n", plot.title, name);
}

std::filesystem::path Page::picture(const std::string& name, const std::string& title) {
  markdown_ += fmt::format("![{}]({}.webp)\n\n", title, name);
  return folder_ / (name + ".webp");
}

void Page::write() const {
  write_file(folder_ / (folder_.filename().string() + ".csv"), csv_);
  write_file(folder_ / "README.md", markdown_);
}

std::string machine(const std::string& commit) {
  std::string name = "an unknown processor";
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name")) name = line.substr(line.find(": ") + 2);
  return fmt::format("{}, {} threads; commit {}", name, std::thread::hardware_concurrency(),
                     commit);
}

std::string number(double value) { return fmt::format("{:.4g}", value); }

std::string short_number(double value) {
  return std::isfinite(value) ? fmt::format("{:.2g}", value) : "-";
}

}  // namespace weft::reports

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  const std::map<std::string, decltype(&weft::reports::accuracy)> pages = {
      {"accuracy", weft::reports::accuracy},   {"contact", weft::reports::contact},
      {"garments", weft::reports::garments},   {"mesh", weft::reports::mesh},
      {"stability", weft::reports::stability}, {"rest", weft::reports::rest},
      {"speed", weft::reports::speed},         {"tethers", weft::reports::tethers}};
  if (arguments.size() < 3 || !pages.contains(arguments[0])) {
    std::cerr
        << "usage: weft-report accuracy|contact|garments|mesh|rest|stability|speed|tethers FOLDER "
           "COMMIT [--large]\n";
    return 2;
  }
  const bool large = arguments.size() > 3 && arguments[3] == "--large";
  pages.at(arguments[0])(arguments[1], arguments[2], large);
  std::cout << arguments[1] << "/README.md\n";
}
