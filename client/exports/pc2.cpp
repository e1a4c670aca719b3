#include <cstring>

#include "client/exports/frame_writer.h"
#include "client/exports/output_file.h"

namespace weft::client {
namespace {

// The file's first 32 bytes; numbers are little-endian.
struct Header {
  char signature[12] = "POINTCACHE2";
  std::int32_t version = 1;
  std::int32_t points = 0;
  float start_frame = 0;
  float sample_rate = 1;
  std::int32_t samples = 0;
};
static_assert(sizeof(Header) == 32);

class Pc2Writer : public FrameWriter {
 public:
  Pc2Writer(const std::string& path, std::size_t particles, std::int64_t first_frame)
      : file_(path) {
    header_.points = static_cast<std::int32_t>(particles);
    header_.start_frame = static_cast<float>(first_frame);
    write_header();
  }

  void add(const ExportFrame& frame) override {
    const auto& [x, y, z] = frame.points;
    std::vector<float> values;
    values.reserve(3 * x.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
      values.insert(values.end(),
                    {static_cast<float>(x[i]), static_cast<float>(y[i]), static_cast<float>(z[i])});
    }
    file_.write(bytes_of(values));
    ++header_.samples;
  }

  // the number of samples is known only now
  void finish() override {
    file_.seek(0);
    write_header();
    file_.close();
  }

 private:
  void write_header() { file_.write({reinterpret_cast<const char*>(&header_), sizeof(header_)}); }

  OutputFile file_;
  Header header_;
};

}  // namespace

std::unique_ptr<FrameWriter> make_pc2_writer(const std::string& path, std::size_t particles,
                                             std::int64_t first_frame) {
  return std::make_unique<Pc2Writer>(path, particles, first_frame);
}

}  // namespace weft::client
