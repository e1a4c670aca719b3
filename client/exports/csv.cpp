#include <fmt/format.h>

#include <iterator>

#include "client/exports/frame_writer.h"
#include "client/exports/output_file.h"

namespace weft::client {
namespace {

class CsvWriter : public FrameWriter {
 public:
  CsvWriter(const std::string& path, std::size_t particles, const std::vector<std::string>& values)
      : file_(path) {
    std::string heading = "t";
    for (std::size_t i = 0; i < particles; ++i)
      fmt::format_to(std::back_inserter(heading), ",x{0},y{0},z{0}", i);
    for (const std::string& name : values)
      for (std::size_t i = 0; i < particles; ++i)
        fmt::format_to(std::back_inserter(heading), ",{}{}", name, i);
    file_.write(heading + '\n');
  }

  void add(const ExportFrame& frame) override {
    const auto& [x, y, z] = frame.points;
    std::string row = fmt::format("{:.12g}", frame.time_s);
    for (std::size_t i = 0; i < x.size(); ++i) {
      fmt::format_to(std::back_inserter(row), ",{:.12f},{:.12f},{:.12f}", x[i], y[i], z[i]);
    }
    for (const ExportValues& each : frame.values)
      for (const double value : each.values)
        fmt::format_to(std::back_inserter(row), ",{:.9g}", value);
    file_.write(row + '\n');
  }

  void finish() override { file_.close(); }

 private:
  OutputFile file_;
};

}  // namespace

std::unique_ptr<FrameWriter> make_csv_writer(const std::string& path, std::size_t particles,
                                             const std::vector<std::string>& values) {
  return std::make_unique<CsvWriter>(path, particles, values);
}

}  // namespace weft::client
