#include <bit>
#include <cstdint>
#include <cstring>

#include "client/exports/frame_writer.h"
#include "client/exports/output_file.h"

namespace weft::client {
namespace {

constexpr std::streamoff kPlaceOfTimes = 8;

void append_big_endian(std::string& bytes, std::uint32_t number) {
  for (int shift = 24; shift >= 0; shift -= 8)
    bytes += static_cast<char>(number >> static_cast<unsigned>(shift) & 255);
}

void append_big_endian(std::string& bytes, double number) {
  append_big_endian(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(number)));
}

// Frames, particles, the times, s, and then every frame; all big-endian.
class MddWriter : public FrameWriter {
 public:
  MddWriter(const std::string& path, std::size_t particles, std::size_t frames) : file_(path) {
    std::string header;
    append_big_endian(header, static_cast<std::uint32_t>(frames));
    append_big_endian(header, static_cast<std::uint32_t>(particles));
    header.append(frames * sizeof(float), '\0');
    file_.write(header);
  }

  void add(const ExportFrame& frame) override {
    const auto& [x, y, z] = frame.points;
    std::string values;
    for (std::size_t i = 0; i < x.size(); ++i) {
      append_big_endian(values, x[i]);
      append_big_endian(values, y[i]);
      append_big_endian(values, z[i]);
    }
    file_.write(values);
    append_big_endian(times_, frame.time_s);
  }

  void finish() override {
    file_.seek(kPlaceOfTimes);
    file_.write(times_);
    file_.close();
  }

 private:
  OutputFile file_;
  std::string times_;
};

}  // namespace

std::unique_ptr<FrameWriter> make_mdd_writer(const std::string& path, std::size_t particles,
                                             std::size_t frames) {
  return std::make_unique<MddWriter>(path, particles, frames);
}

}  // namespace weft::client
